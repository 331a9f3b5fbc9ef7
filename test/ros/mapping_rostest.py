#!/usr/bin/env python3
"""The mapping server from outside: clouds and tf in; markers, clouds, grids, messages and files out. The same test
runs against the node and the nodelet, with 1 m voxels, the counting kernel and uniform beam lines, so that expected
values can be computed by hand."""
import os
import struct
import sys
import tempfile
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus, OccupancyMap
from bki_mapping.srv import SaveMap
from nav_msgs.msg import OccupancyGrid, Path
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2, PointField
from std_srvs.srv import Empty
from visualization_msgs.msg import Marker, MarkerArray

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, Robot, adds_up, make_cloud, publishers_of, wait_until  # noqa: E402

CAR, ROAD = 10, 40  # raw labels; classes 1 and 9
HITS = [(4.2, 0.3, 0.4), (4.6, 0.2, 0.1), (0.5, 3.5, -1.5)]  # two in voxel (4, 0, 0), one in (0, 3, -2)


def cubes(array, namespace):
    return [(p.x, p.y, p.z) for marker in array.markers if marker.ns == namespace for p in marker.points]


class MappingTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('mapping_rostest')
        cls.robot = Robot()
        cls.robot.connect()
        cls.status = Listener('mapping/status', MappingStatus)
        cls.status.wait_for(lambda m: True, 'a first status')
        rospy.wait_for_service('mapping/reset', 30)
        cls.reset_map = rospy.ServiceProxy('mapping/reset', Empty)
        cls.save_map = rospy.ServiceProxy('mapping/save_map', SaveMap)

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.reset_map()

    def deal_with(self, stamp):
        return self.status.wait_for(lambda m: m.header.stamp == stamp, f'dealing with the cloud of {stamp.to_sec()}')

    def integrate(self, points, labels, **options):
        status = self.deal_with(self.robot.scan(points, labels, **options))
        self.assertTrue(status.integrated_last)
        return status

    def listen(self, topic, kind):
        """A listener that is closed at the end of the test."""
        listener = Listener(topic, kind)
        self.addCleanup(listener.close)
        return listener

    def latest(self, topic, kind, stamp):
        return self.listen(topic, kind).wait_for(lambda m: m.header.stamp == stamp, f'a map on {topic}')

    def saved_vertices(self, include='occupied'):
        """The voxels of a PLY file: {(x, y, z): (label, state)}."""
        path = os.path.join(self.folder.name, 'map.ply')
        answer = self.save_map(path, include)
        self.assertTrue(answer.success, answer.message)
        with open(path, 'rb') as file:
            body = file.read().split(b'end_header\n', 1)[1]
        records = struct.iter_unpack('<3f3BHB6f', body)
        return {r[:3]: (r[6], r[7]) for r in records}

    def test_markers_show_the_hits_in_the_colours_of_their_classes(self):
        self.integrate(HITS, [CAR, CAR, ROAD])
        array = self.listen('occupied_cells_vis_array', MarkerArray).wait_for(lambda m: cubes(m, 'car'), 'markers')
        self.assertEqual(cubes(array, 'car'), [(4.5, 0.5, 0.5)])
        self.assertEqual(cubes(array, 'road'), [(0.5, 3.5, -1.5)])
        car = next(m for m in array.markers if m.ns == 'car')
        self.assertEqual(car.header.frame_id, 'map')
        self.assertEqual((car.type, car.scale.x, car.pose.orientation.w), (Marker.CUBE_LIST, 1.0, 1.0))
        self.assertAlmostEqual(car.colors[0].b, 245 / 255, places=5)
        self.assertEqual({m.ns for m in array.markers if m.points}, {'car', 'road'})
        free = self.listen('free_cells_vis_array', MarkerArray).wait_for(lambda m: cubes(m, 'free'), 'free markers')
        self.assertIn((2.5, 0.5, 0.5), cubes(free, 'free'))

    def test_poses_are_looked_up_at_the_clouds_stamp(self):
        self.integrate([(4.5, 0.5, 0.5)], [CAR], position=(10.0, 20.0, 3.0), yaw_quarter_turns=1)
        self.assertEqual(list(self.saved_vertices()), [(9.5, 24.5, 3.5)])
        path = self.listen('trajectory', Path).wait_for(lambda m: m.poses, 'a trajectory')
        self.assertEqual(path.poses[-1].pose.position.y, 20.0)

    def test_occupancy_and_voxel_cloud_agree_with_the_file(self):
        stamp = self.integrate(HITS, [CAR, CAR, ROAD]).header.stamp
        vertices = self.saved_vertices('occupied,free')
        self.assertEqual(vertices[(4.5, 0.5, 0.5)], (1, 2))
        self.assertEqual(vertices[(2.5, 0.5, 0.5)], (255, 1))
        message = self.latest('occupancy', OccupancyMap, stamp)
        self.assertEqual((message.header.frame_id, message.resolution, message.block_edge), ('map', 1.0, 8))
        self.assertEqual(next(c.name for c in message.classes if c.id == 9), 'road')
        seen = {}
        for block in message.blocks:
            states, labels = bytes(block.state), bytes(block.label)
            for v in range(512):
                if states[v]:
                    centre = (8 * block.x + v % 8 + 0.5, 8 * block.y + v // 8 % 8 + 0.5, 8 * block.z + v // 64 + 0.5)
                    seen[centre] = (labels[v], states[v])
        self.assertEqual(seen, vertices)
        # Evidence: 2 for the car, 1 for free of the beam that ends beyond the voxel's centre; prior 21 * 0.001.
        block = next(b for b in message.blocks if (b.x, b.y, b.z) == (0, 0, 0))
        self.assertAlmostEqual(block.probability[4], (2 + 0.001) / (3 + 21 * 0.001), places=5)
        self.assertAlmostEqual(block.occupancy[4], 2.0017 / (1.1 * 2.0017 + 6 * 0.001 + 0.05), places=5)
        self.assertAlmostEqual(block.class_probability[4], 1.0, places=5)

        cloud = self.latest('voxel_cloud', PointCloud2, stamp)
        self.assertEqual(cloud.header.frame_id, 'map')
        names = [f.name for f in cloud.fields]
        self.assertEqual(names, ['x', 'y', 'z', 'rgb', 'label', 'state', 'probability', 'occupancy', 'class_probability',
                                 'variance', 'entropy', 'evidence'])
        offset = {f.name: f.offset for f in cloud.fields}
        points = {}
        for i in range(cloud.width):
            at = i * cloud.point_step
            xyz = struct.unpack_from('<3f', cloud.data, at)
            label, = struct.unpack_from('<H', cloud.data, at + offset['label'])
            state, = struct.unpack_from('<B', cloud.data, at + offset['state'])
            points[xyz] = (label, state)
        self.assertEqual(points, vertices)

    def test_projected_map_is_cut_at_its_heights(self):
        # occupancy_min_z is -1: the hit at z = -1.5 is below it, so that its cell is unknown.
        stamp = self.integrate(HITS + [(0.5, -3.5, -1.5)], [CAR, CAR, CAR, ROAD]).header.stamp
        grid = self.latest('projected_map', OccupancyGrid, stamp)
        self.assertEqual((grid.header.frame_id, grid.info.resolution), ('map', 1.0))
        cell = {}
        for i, value in enumerate(grid.data):
            x = grid.info.origin.position.x + i % grid.info.width + 0.5
            y = grid.info.origin.position.y + i // grid.info.width + 0.5
            cell[(x, y)] = value
        self.assertEqual(cell[(4.5, 0.5)], 100)
        self.assertEqual(cell[(2.5, 0.5)], 0)
        self.assertEqual(cell[(0.5, 3.5)], -1)
        self.assertEqual(cell[(0.5, -3.5)], 0, 'a road is ground')
        self.assertEqual(cell[(7.5, 7.5)], -1)

    def test_labels_of_every_datatype_give_the_same_map(self):
        expected = None
        for label_type in (PointField.UINT8, PointField.INT16, PointField.UINT16, PointField.INT32, PointField.UINT32,
                           PointField.FLOAT32, PointField.FLOAT64):
            for options in ({}, {'padding': 3}, {'big_endian': True}):
                self.reset_map()
                self.integrate(HITS, [CAR, CAR, ROAD], label_type=label_type, **options)
                vertices = self.saved_vertices('occupied,free')
                expected = expected or vertices
                self.assertEqual(vertices, expected, f'datatype {label_type}, {options}')

    def test_bad_clouds_are_dropped_counted_and_change_nothing(self):
        before = self.integrate(HITS, [CAR, CAR, ROAD])
        vertices = self.saved_vertices('occupied,free')
        stamp = self.robot.scan(HITS, [CAR] * 3, label_name='class')
        self.assertEqual(self.deal_with(stamp).dropped_bad_cloud, before.dropped_bad_cloud + 1)
        stamp = self.robot.next_stamp()
        self.robot.publish_pose(stamp)
        short = make_cloud(HITS, [CAR] * 3, stamp)
        short.data = short.data[:-1]
        self.robot.clouds.publish(short)
        self.assertEqual(self.deal_with(stamp).dropped_bad_cloud, before.dropped_bad_cloud + 2)
        self.assertEqual(self.deal_with(self.robot.scan([], [])).dropped_empty, before.dropped_empty + 1)
        stamp = self.robot.next_stamp()  # a cloud without its pose
        self.robot.clouds.publish(make_cloud(HITS, [CAR] * 3, stamp))
        status = self.deal_with(stamp)
        self.assertEqual(status.dropped_transform_late, before.dropped_transform_late + 1)
        self.assertEqual(status.last_drop_reason, 'transform late')
        self.assertIn('raise tf_timeout', status.last_drop)
        stamp = self.robot.next_stamp()
        self.robot.clouds.publish(make_cloud(HITS, [CAR] * 3, stamp, frame='nowhere'))
        status = self.deal_with(stamp)
        self.assertEqual(status.dropped_unknown_frame, before.dropped_unknown_frame + 1)
        self.assertTrue(adds_up(status), status)
        self.assertEqual(self.saved_vertices('occupied,free'), vertices)

    def test_one_leading_slash_is_no_other_frame(self):
        expected = None
        for frame in ('sensor', '/sensor'):
            self.reset_map()
            status = self.integrate(HITS, [CAR, CAR, ROAD], frame=frame)
            self.assertEqual(status.header.frame_id, 'sensor')
            expected = expected or self.saved_vertices('occupied,free')
            self.assertEqual(self.saved_vertices('occupied,free'), expected)

    def test_a_cloud_of_another_clock_or_in_millimetres_is_dropped_with_the_reason(self):
        before = self.integrate(HITS, [CAR, CAR, ROAD])
        stamp = rospy.Time(self.robot.seconds + 37)  # TAI
        self.robot.clouds.publish(make_cloud(HITS, [CAR] * 3, stamp))
        status = self.deal_with(stamp)
        self.assertEqual(status.dropped_transform_late, before.dropped_transform_late + 1)
        self.assertIn('37 s ahead', status.last_drop)
        self.assertIn('TAI', status.last_drop)
        self.robot.seconds += 40  # no later cloud has that stamp
        status = self.deal_with(self.robot.scan([(4200.0, 300.0, 400.0), (9000.0, 0.0, 0.0)], [CAR] * 2))
        self.assertFalse(status.integrated_last)
        self.assertEqual(status.dropped_bad_cloud, before.dropped_bad_cloud + 1)
        self.assertIn('millimetres', status.last_drop)

    def test_jumps_of_tf_are_counted(self):
        for _ in range(3):  # after any jump of an earlier test
            before = self.integrate(HITS, [CAR, CAR, ROAD])
        for x in (0.0, 0.0, 0.0, 30.0, 30.0, 30.0):
            status = self.integrate(HITS, [CAR, CAR, ROAD], position=(x, 0.0, 0.0))
        self.assertEqual(status.tf_jumps, before.tf_jumps + 1)
        for x in (20.0, 10.0, 0.0):  # a motion
            status = self.integrate(HITS, [CAR, CAR, ROAD], position=(x, 0.0, 0.0))
        self.assertEqual(status.tf_jumps, before.tf_jumps + 1)

    def test_bad_points_are_left_out_and_counted(self):
        before = self.integrate(HITS, [CAR, CAR, ROAD])
        vertices = self.saved_vertices()
        bad = [(float('nan'), 0.0, 0.0), (0.0, float('inf'), 0.0), (0.0, 0.0, 0.0), (2.0, 2.0, 2.0)]
        status = self.integrate(bad, [CAR, CAR, CAR, 12345])
        new = {name: getattr(status, name) - getattr(before, name) for name in status.__slots__
               if name.startswith('points_')}
        expected = dict.fromkeys(new, 0)
        expected.update(points_received=4, points_not_finite=2, points_at_sensor=1, points_unknown_label=1)
        self.assertEqual(new, expected)
        self.assertEqual(status.labels_not_in_table, before.labels_not_in_table + 1)
        self.assertIn(12345, status.unknown_labels)
        self.assertEqual(self.saved_vertices(), vertices)

    def test_labels_may_have_an_instance_in_their_upper_bits(self):
        before = self.integrate(HITS, [CAR, CAR, ROAD])
        vertices = self.saved_vertices()
        for label_type in (PointField.UINT32, PointField.INT32, PointField.FLOAT64):
            status = self.integrate(HITS, [CAR | 1 << 16, CAR | 300 << 16, ROAD | 7 << 16], label_type=label_type)
            self.assertEqual((status.points_unknown_label, status.labels_not_in_table), (before.points_unknown_label, before.labels_not_in_table))
        self.assertEqual(self.saved_vertices(), vertices)

    def test_unknown_labels_are_warned_of_once_with_the_remedy(self):
        log = Listener('/rosout', Log)
        self.addCleanup(log.close)
        wait_until(lambda: log.subscriber.get_num_connections() >= len(publishers_of('/rosout')), 'all nodes writing to the log')
        for _ in range(3):
            status = self.integrate(HITS, [-1, -1, ROAD], label_type=PointField.INT8)
            self.assertIn(-1, status.unknown_labels)
        self.integrate(HITS, [float('nan'), float('nan'), ROAD], label_type=PointField.FLOAT32)
        status = self.integrate(HITS, [float('nan'), float('nan'), ROAD], label_type=PointField.FLOAT32)
        self.assertGreaterEqual(status.labels_missing, 4)
        log.wait_for(lambda m: 'none at all (2 points)' in m.msg, 'a warning of points without a label')
        for words in ('does not list, and are left out of the map: -1 (2 points); list -1 under raw', 'none at all (2 points)'):
            found = [m.msg for m in log.messages if words in m.msg]
            self.assertEqual(len(found), 1, found)
            self.assertIn('67 % of the points of a scan', found[0])

    def test_a_late_transform_is_waited_for(self):
        stamp = self.robot.next_stamp()
        self.robot.clouds.publish(make_cloud(HITS, [CAR, CAR, ROAD], stamp))
        rospy.rostime.wallsleep(0.2)  # tf_timeout is 1 s: the transform arrives late, but in time
        self.assertIsNone(self.status.find(lambda m: m.header.stamp == stamp), 'nothing is decided yet')
        self.robot.publish_pose(stamp)
        self.assertTrue(self.deal_with(stamp).integrated_last)

    def test_reset_empties_the_map_and_says_so(self):
        self.integrate(HITS, [CAR, CAR, ROAD])
        markers = self.listen('occupied_cells_vis_array', MarkerArray)
        markers.wait_for(lambda m: cubes(m, 'car'), 'markers')
        self.reset_map()
        wait_until(lambda: not cubes(markers.messages[-1], 'car'), 'markers being deleted')
        self.assertEqual(self.saved_vertices('occupied,free'), {})

    def test_save_map_refuses_other_places(self):
        for path in ('map.ply', '/no/such/folder/map.ply', f'{self.folder.name}/map.txt', ''):
            answer = self.save_map(path, '')
            self.assertFalse(answer.success, path)
            self.assertIn(os.path.basename(path), answer.message)
        self.assertFalse(self.save_map(f'{self.folder.name}/map.ply', 'everything').success)

    def test_nothing_is_published_to_nobody_and_all_to_who_comes_late(self):
        self.integrate(HITS, [CAR, CAR, ROAD])
        for _ in range(2):  # the second cloud is as late as the first
            late = Listener('occupied_cells_vis_array', MarkerArray)
            late.wait_for(lambda m: cubes(m, 'car'), 'the map for a late listener')
            late.close()


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'mapping_rostest', MappingTest)
