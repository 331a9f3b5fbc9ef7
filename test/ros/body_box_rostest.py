#!/usr/bin/env python3
"""body_box of mapping.launch: points in the box neither occupy nor clear, and the others reach the mapper unchanged."""
import os
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client

import rosgraph
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointField
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, TIMEOUT, Mapping, make_cloud, random_scan, voxels_of, wait_until, whole_map  # noqa: E402

FOLDER = os.path.dirname(os.path.abspath(__file__))
PARAMETERS = f'config:={FOLDER}/mapping_params.yaml'
LOW, HIGH = (-2.0, -1.0, -1.5), (3.0, 1.5, 1.0)
BOX = ' '.join(str(value) for value in LOW + HIGH)


def inside(point):
    return all(low <= value <= high for low, value, high in zip(LOW, point, HIGH))


def scan_with_body():
    """Points and labels; those in the box are scattered among the others."""
    far, labels = random_scan(7, points=120, reach=12.0)
    far = [p for p in far if not inside(p)]
    body = [p for p in random_scan(8, points=400, reach=3.0)[0] if inside(p)][:len(far)]
    points = [p for pair in zip(far, body) for p in pair] + far[len(body):]
    return points, [labels[i % len(labels)] for i in range(len(points))]


def outside(points, labels):
    kept = [(p, label) for p, label in zip(points, labels) if not inside(p)]
    return [p for p, _ in kept], [label for _, label in kept]


def map_of(stamp):
    return voxels_of(whole_map(stamp).blocks)


def map_after(points, labels, *arguments):
    """The map of a single scan through mapping.launch, and the status after the scan."""
    with Mapping(PARAMETERS, *arguments) as mapping:
        status = mapping.scan(points, labels)
        return map_of(status.header.stamp), status


class BodyBox(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('body_box_rostest')
        cls.points, cls.labels = scan_with_body()
        cls.expected, status = map_after(*outside(cls.points, cls.labels))
        cls.kept = len(outside(cls.points, cls.labels)[0])
        assert status.points_received == cls.kept and 0.4 < cls.kept / len(cls.points) < 0.8

    def assert_without_body(self, voxels, status):
        self.assertTrue(status.integrated_last, status)
        self.assertEqual((status.points_received, status.points_used), (self.kept, self.kept))
        self.assertEqual((status.points_unknown_label, status.points_not_finite), (0, 0))
        self.assertEqual(voxels, self.expected)

    def test_without_the_box_the_body_is_mapped(self):
        self.assertNotEqual(map_after(self.points, self.labels)[0], self.expected)

    def test_points_in_the_box_neither_occupy_nor_clear(self):
        for nodelet in ('true', 'false'):
            self.assert_without_body(*map_after(self.points, self.labels, f'body_box:={BOX}', f'nodelet:={nodelet}'))
        labels = {label for _, labels, _ in self.expected.values() for label in labels}
        self.assertGreater(len(labels), 2, 'both classes, and that of free space')

    def test_organised_clouds_and_points_that_are_nan(self):
        points = self.points + [(float('nan'),) * 3] * (2 + len(self.points) % 2)
        labels = self.labels + [CAR] * (len(points) - len(self.points))
        with Mapping(PARAMETERS, f'body_box:={BOX}') as mapping:
            stamp = mapping.robot.next_stamp()
            cloud = make_cloud(points, labels, stamp, label_type=PointField.UINT16, padding=3)
            cloud.height, cloud.width = 2, len(points) // 2
            cloud.row_step = cloud.width * cloud.point_step
            mapping.robot.publish_pose(stamp)
            mapping.robot.clouds.publish(cloud)
            status = mapping.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')
            self.assert_without_body(map_of(stamp), status)

    def test_clouds_are_handed_on_as_pointers(self):
        with Mapping(PARAMETERS, f'body_box:={BOX}') as mapping:
            mapping.scan(self.points, self.labels)
            node = xmlrpc.client.ServerProxy(rosgraph.Master('/body_box_rostest').lookupNode('/mapping_manager'))
            code, _, connections = node.getBusInfo('/body_box_rostest')
        self.assertEqual(code, 1)
        transports = {c[3] for c in connections if c[4] == '/mapping_body_box/output'}
        self.assertEqual(transports, {'INTRAPROCESS'})

    def test_a_box_in_a_frame_of_its_own(self):
        """The frame of the cloud is rotated by 90 degrees and shifted relative to that of the box."""
        static = TransformStamped()
        static.header.frame_id, static.child_frame_id = 'sensor', 'base'
        t, q = static.transform.translation, static.transform.rotation
        t.y, t.z, q.z, q.w = 1.0, -0.5, -0.5 ** 0.5, 0.5 ** 0.5
        tf_static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        self.addCleanup(tf_static.unregister)
        tf_static.publish(TFMessage([static]))

        def in_sensor(points):
            return [(y, 1.0 - x, z - 0.5) for x, y, z in points]

        kept, labels = outside(self.points, self.labels)
        expected = map_after(in_sensor(kept), labels)[0]
        with Mapping(PARAMETERS, f'body_box:={BOX}', 'body_frame:=base') as mapping:
            # CropBox drops clouds until it has the transform. It empties a cloud that is entirely inside of the box.
            def has_transform():
                mapping.robot.scan([(0.0, 1.0, -0.5)], [CAR])
                time.sleep(0.1)
                return mapping.status.find(lambda m: m.dropped_empty > 0)

            wait_until(has_transform, 'a cloud passing the box')
            received = mapping.status.find(lambda m: True).points_received
            status = mapping.scan(in_sensor(self.points), self.labels)
            self.assertTrue(status.integrated_last, status)
            self.assertEqual(status.points_received - received, self.kept)
            self.assertEqual(map_of(status.header.stamp), expected)

    def test_what_is_no_box_is_refused_in_one_sentence(self):
        inputs = tempfile.NamedTemporaryFile('w', suffix='.yaml')
        inputs.write('inputs:\n  front: {topic: /front/points}\n')
        inputs.flush()
        for box, words in (('1 2 3', "body_box is '1 2 3', but must be six numbers in metres, 'x0 y0 z0 x1 y1 z1'"),
                           ('5', "body_box is '5', but must be six numbers"),
                           ('-1,-1,-1,1,1,1', 'but must be six numbers'),
                           ('-1 -1 -1 1 1 one', 'but must be six numbers'),
                           ('0 0 0 1 1 nan', "but must lie within 1000 m of its frame's origin"),
                           ('0 0 0 1 1 1001', "but must lie within 1000 m of its frame's origin"),
                           ('1 -1 -1 -1 1 1', 'but its x0 must be less than its x1'),
                           ('0 0 1 1 1 1', 'but its z0 must be less than its z1'),
                           (BOX, f"body_box filters cloud_topic, but '{inputs.name}' names inputs")):
            config = f'config:={inputs.name}' if box == BOX else PARAMETERS
            launch = subprocess.run(['roslaunch', '--wait', 'bki_mapping', 'mapping.launch', f'body_box:={box}', config],
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT,
                                    check=False)
            self.assertNotEqual(launch.returncode, 0, box)
            self.assertEqual(sum(words in line for line in launch.stdout.splitlines()), 1, launch.stdout)
            self.assertNotIn('started with pid', launch.stdout)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'body_box', BodyBox)
