#!/usr/bin/env python3
"""Bags as drives of a city."""
import json
import math
import pathlib
import sys
import time
import unittest

from harness import SCANS, MadeCity

import numpy
from bki_mapping.city import bags
from bki_mapping.city.description import Bag, CityError

try:
    import rosbag
    import rospy
    import tf2_ros  # noqa: F401
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_msgs.msg import TFMessage
except ImportError as error:
    print(f'SKIPPED: needs ROS: {error}', file=sys.stderr)
    sys.exit(77)


class Bags(MadeCity):
    def write_bag(self, path, name, label=7):
        """Writes a sequence as a bag: the sensor on a vehicle, whose pose changes linearly between transforms 0.5 s apart."""
        poses = numpy.loadtxt(self.folder / name / 'poses.txt').reshape(-1, 3, 4)

        def transform(parent, child, stamp, translation, yaw=0.0):
            made = TransformStamped()
            made.header.frame_id, made.child_frame_id, made.header.stamp = parent, child, rospy.Time.from_sec(stamp)
            made.transform.translation.x, made.transform.translation.y, made.transform.translation.z = translation
            made.transform.rotation.z, made.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            return made

        with rosbag.Bag(str(path), 'w', compression='lz4') as bag:
            bag.write('/tf_static', TFMessage([transform('base', 'lidar', 0.0, (0.0, 0.0, 1.5))]), rospy.Time(99))
            for number, pose in enumerate(poses):
                stamp = 100.0 + number
                points = numpy.fromfile(self.folder / name / f'velodyne/{number:06d}.bin', '<f4').reshape(-1, 4)
                labels = numpy.fromfile(self.folder / name / f'labels/{number:06d}.label', '<u4')
                rows = numpy.zeros(len(points), numpy.dtype({
                    'names': ['x', 'y', 'z', 'intensity', 'label'], 'formats': ['<f4', '<f4', '<f4', '<f4', '<u2'],
                    'offsets': [0, 4, 8, 16, 24], 'itemsize': 26}))
                for column, field in enumerate(('x', 'y', 'z', 'intensity')):
                    rows[field] = points[:, column]
                rows['label'] = labels
                cloud = PointCloud2(height=1, width=len(points), point_step=26, row_step=26 * len(points), data=rows.tobytes())
                cloud.fields = [PointField(field, offset, kind, 1) for field, offset, kind in (
                    ('x', 0, label), ('y', 4, 7), ('z', 8, 7), ('intensity', 16, 7), ('label', 24, 4))]
                cloud.header.frame_id, cloud.header.stamp = 'lidar', rospy.Time.from_sec(stamp)
                at = pose[:, 3] - [0, 0, 1.5]
                yaw = math.atan2(pose[1, 0], pose[0, 0])
                for shift in (-0.25, 0.25):  # the cloud is between the two
                    if number < len(poses) - 1:  # and the last one is later than all transforms
                        bag.write('/tf', TFMessage([transform('city', 'base', stamp + shift, at + [shift, 0, 0], yaw)]),
                                  rospy.Time.from_sec(stamp))
                bag.write('/points', cloud, rospy.Time.from_sec(stamp))
        return poses

    def test_bags_are_drives(self):
        path = self.folder / 'monday.bag'
        poses = self.write_bag(path, 'd2')
        city = self.describe([])
        city.write_text(json.dumps({'piece_scans': 2, 'region_tiles': 2, 'drives': [
            {'sequence': 'd1'}, {'bag': 'monday.bag', 'cloud_topic': '/points', 'frame': 'city'}]}))
        text = self.finish(self.start(city, '--workers', '2'))
        self.assertIn(f"drive 'monday': 1 of {SCANS} clouds have no transform to 'city' and are left out", text)
        index = json.loads((self.output / 'index.json').read_text())
        drive = index['drives'][1]
        self.assertEqual((drive['name'], drive['bag']), ('monday', str(path)))
        written = pathlib.Path(drive['sequence'])
        for number in range(SCANS - 1):
            for each in (f'velodyne/{number:06d}.bin', f'labels/{number:06d}.label'):
                self.assertEqual((written / each).read_bytes(), (self.folder / 'd2' / each).read_bytes(), each)
        found = numpy.loadtxt(written / 'poses.txt').reshape(-1, 3, 4)
        numpy.testing.assert_allclose(found, poses[:SCANS - 1], atol=1e-9)
        self.assertEqual((written / 'times.txt').read_text(), ''.join(f'{n}.000000000\n' for n in range(SCANS - 1)))
        # The city is that of the sequence d1 and of the written one.
        (self.folder / 'written').symlink_to(written)
        self.expect_equal(['d1', 'written'])
        # Nothing is written or mapped again.
        self.finish(self.start(city, '--workers', '2', '--resume'))
        self.assertIn('| write bags as sequences | 1 | 0 | ', (self.output / 'report.md').read_text())
        self.assertIn('| 0 | 0.0 |', (self.output / 'report.md').read_text())

    def test_labels_are_read_as_the_node_reads_them(self):
        none = 2**32 - 1
        for dtype, values, expected in (
                ('<u4', [10, 10 | 300 << 16, none], [10, 10 | 300 << 16, none]), ('>i4', [10, -1, -2**31 | 10], [10, none, 2**31 | 10]),
                ('i1', [-1, 40], [none, 40]),
                ('<f4', [39.9, 40.5, -0.4, -0.5, -1, math.nan, math.inf], [40, 41, 0, none, none, none, none]),
                # As in Labels.OfSinglePrecisionAreUnknownWhereThatSkipsNumbers.
                ('<f4', [2.0**24, 2.0**24 + 4, 3.0 * 2**30, -2.0**24, -2.0**24 - 4], [2**24, none, none, 0xff000000, none]),
                ('<f8', [0.49999999999999994, 2.0**24 + 4, -2.0**24 - 4], [0, 2**24 + 4, 0xfefffffc]),
                ('<f8', [10 + 300 * 65536.0, 2.0**32, -2.0**31 - 1, math.nan], [10 | 300 << 16, none, none, none])):
            self.assertEqual(bags.labels_of(numpy.array(values, dtype)).tolist(), expected, dtype)

    def test_wrong_bags_are_left_out_with_a_sentence(self):
        path = self.folder / 'wrong.bag'
        self.write_bag(path, 'd2', label=9)

        def refused(sentence, bag=Bag(path, '/points', 'city', 'label', True)):
            with self.assertRaisesRegex(CityError, sentence):
                bags.extract(bag, self.folder / f'out{time.monotonic_ns()}')
        refused("the field 'x' of /points is no number")
        self.write_bag(path, 'd2')
        good = Bag(path, '/points', 'city', 'label', True)
        refused('wrong.bag has no clouds at /cloud; it has clouds at: /points', good._replace(cloud_topic='/cloud'))
        refused("no cloud of /points has a transform to 'earth' .*; record tf", good._replace(frame='earth'))
        refused("have no field 'class', but intensity, label, x, y, z; give label_field, or labelled: false",
                good._replace(label_field='class'))
        bags.extract(good._replace(label_field='class', labelled=False), self.folder / 'unlabelled')
        self.assertEqual(set((self.folder / 'unlabelled/labels/000000.label').read_bytes()), {0})
        content = path.read_bytes()
        for length in (0, 5, 5000, len(content) // 2):
            path.write_bytes(content[:length])
            refused('wrong.bag (cannot be read|has no index)')
        path.write_bytes(b'#ROSBAG V2.0\n' + bytes(range(256)) * 50)
        refused('wrong.bag (cannot be read|has no index)')
        city = self.describe([])
        city.write_text(json.dumps({'piece_scans': 2, 'region_tiles': 2, 'drives': [
            {'sequence': 'd1'}, *({'bag': name, 'cloud_topic': '/points'} for name in ('wrong.bag', 'missing.bag'))]}))
        text = self.finish(self.start(city, '--workers', '2'), 1)
        self.assertRegex(text, "drive 'wrong' is left out: .*wrong.bag (cannot be read|has no index)")
        self.assertRegex(text, "drive 'missing' is left out: .*missing.bag does not exist")
        self.expect_equal(['d1'])


if __name__ == '__main__':
    unittest.main()
