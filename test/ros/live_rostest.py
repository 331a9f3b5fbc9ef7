#!/usr/bin/env python3
"""The mapper on a robot where things go wrong: every cloud is accounted for, and clients that listen to updates alone
hold the same map as the mapper."""
import os
import random
import struct
import sys
import unittest

import rospy
import rostest
from bki_mapping.msg import ElevationMap, MappingStatus, OccupancyMap, OccupancyUpdate, VoxelCloudUpdate
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.client import Client
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointField
from std_srvs.srv import Empty, Trigger
from visualization_msgs.msg import Marker, MarkerArray

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, Robot, adds_up, make_cloud, wait_until  # noqa: E402

CAR, ROAD = 10, 40
CAR_COLOR = 0x6496f5  # of config/classes/semantic_kitti.yaml


def random_scan(seed, around=(0.0, 0.0, 0.0)):
    rand = random.Random(seed)
    points = [tuple(c + rand.uniform(-30.0, 30.0) for c in around) for _ in range(60)]
    return points, [rand.choice((CAR, ROAD)) for _ in points]


def voxels_of(blocks):
    return {(b.x, b.y, b.z): (bytes(b.state), bytes(b.label), b.probability) for b in blocks if any(bytes(b.state))}


class MapClient:
    """Rebuilds the map from occupancy_updates alone."""

    def __init__(self):
        self.blocks, self.sequence, self.gaps, self.wholes, self.stamp = None, None, 0, 0, None
        self.listener = Listener('occupancy_updates', OccupancyUpdate)
        self.read = 0

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            if message.whole:
                self.wholes += 1
                self.blocks = {}
            elif self.blocks is None:
                continue  # an update on its way before the whole map
            elif message.sequence != self.sequence + 1:
                self.gaps += 1
            self.sequence, self.stamp = message.sequence, message.header.stamp
            self.blocks.update(voxels_of(message.blocks))
            for gone in message.removed:
                self.blocks.pop((gone.x, gone.y, gone.z), None)


class CloudClient:
    """The same from voxel_cloud_updates: points by block."""

    def __init__(self):
        self.points, self.read, self.stamp = None, 0, None
        self.listener = Listener('voxel_cloud_updates', VoxelCloudUpdate)

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            edge = 8 * message.resolution
            if message.whole:
                self.points = {}
            elif self.points is None:
                continue
            for block in message.blocks:
                self.points.pop((block.x, block.y, block.z), None)
            offset = {f.name: f.offset for f in message.cloud.fields}
            for i in range(message.cloud.width):
                at = i * message.cloud.point_step
                xyz = struct.unpack_from('<3f', message.cloud.data, at)
                state, = struct.unpack_from('<B', message.cloud.data, at + offset['state'])
                self.points.setdefault(tuple(int(c // edge) for c in xyz), {})[xyz] = state
            self.stamp = message.header.stamp


class MarkerClient:
    """What rviz would show."""

    def __init__(self):
        self.shown, self.read, self.kept = {}, 0, 0
        self.listener = Listener('occupied_cells_vis_array', MarkerArray)

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            for marker in message.markers:
                if marker.action == Marker.DELETEALL:
                    self.shown = {}
                elif marker.action == Marker.DELETE:
                    self.shown.pop((marker.ns, marker.id), None)
                else:
                    self.shown[(marker.ns, marker.id)] = [(p.x, p.y, p.z) for p in marker.points]

    def cubes(self):
        return sorted((key[0], point) for key, points in self.shown.items() for point in points)


class Live(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('live_rostest')
        cls.robot = Robot('front_cloud')
        cls.merged = Robot('merged_cloud')
        cls.robot.connect()
        cls.merged.connect()
        cls.status = Listener('mapping/status', MappingStatus)
        cls.status.wait_for(lambda m: True, 'a first status')
        rospy.wait_for_service('mapping/reset', 30)

    def call(self, service, kind=Empty):
        return rospy.ServiceProxy(f'mapping/{service}', kind)()

    def setUp(self):
        self.call('reset')

    def deal_with(self, stamp):
        return self.status.wait_for(lambda m: m.header.stamp == stamp, f'dealing with the cloud of {stamp.to_sec()}')

    def integrate(self, points, labels, **options):
        status = self.deal_with(self.robot.scan(points, labels, **options))
        self.assertTrue(status.integrated_last, status)
        return status.header.stamp

    def map_of_server(self, stamp):
        listener = Listener('occupancy', OccupancyMap)
        try:
            return voxels_of(listener.wait_for(lambda m: m.header.stamp == stamp, 'the whole map').blocks)
        finally:
            listener.close()

    def expect_same(self, client, stamp):
        truth = self.map_of_server(stamp)

        def arrived():
            client.update()
            return client.stamp == stamp and client.blocks == truth
        wait_until(arrived, 'the client having the same map')
        return truth

    def drive(self, seeds):
        for seed in seeds:
            stamp = self.integrate(*random_scan(seed), position=(20.0 * seed, 0.0, 0.0))
        return stamp

    def test_clients_of_updates_hold_the_map(self):
        early = MapClient()
        wait_until(lambda: early.update() or early.blocks is not None, 'the whole map for a new client')
        stamp = self.drive(range(4))
        truth = self.expect_same(early, stamp)
        self.assertEqual((early.wholes, early.gaps), (1, 0))
        sent = early.listener.messages[-1]
        self.assertGreater(len(truth), 100)
        self.assertLess(len(sent.blocks), len(truth), 'an update has what changed, not all')
        early.listener.close()  # listeners of one process share a connection: a late client must be alone
        late = MapClient()
        self.addCleanup(late.listener.close)
        stamp = self.drive(range(4, 6))
        self.expect_same(late, stamp)
        self.assertEqual((late.wholes, late.gaps), (1, 0))

        # A message is lost: the client sees a gap, asks for the whole map, and is right again.
        late.read += 1
        stamp = self.drive(range(6, 8))
        wait_until(lambda: late.update() or late.gaps > 0 or late.stamp == stamp, 'further updates')
        self.call('publish_map')
        wait_until(lambda: late.update() or late.wholes == 2, 'a whole map on request')
        self.expect_same(late, stamp)
        self.call('reset')
        wait_until(lambda: late.update() or late.blocks == {}, 'the client forgetting the map')

    def test_clouds_and_markers_follow_the_map(self):
        self.drive(range(2))
        cloud, markers = CloudClient(), MarkerClient()
        for client in (cloud, markers):
            self.addCleanup(client.listener.close)
        stamp = self.drive(range(2, 5))
        truth = self.map_of_server(stamp)
        wait_until(lambda: cloud.update() or cloud.stamp == stamp, 'the last cloud update')
        self.assertEqual({place: len(points) for place, points in cloud.points.items() if points},
                         {place: sum(1 for s in states if s) for place, (states, _, _) in truth.items()})
        names = {1: 'car', 9: 'road'}
        expected = sorted((names[labels[v]], (8 * x + v % 8 + 0.5, 8 * y + v // 8 % 8 + 0.5, 8 * z + v // 64 + 0.5))
                          for (x, y, z), (states, labels, _) in truth.items() for v in range(512) if states[v] == 2)
        self.assertGreater(len(expected), 100)
        wait_until(lambda: markers.update() or markers.cubes() == expected, 'the markers showing the map')
        chunks = {key[1] for key in markers.shown}
        last = markers.listener.messages[-1]
        self.assertLess(len({m.id for m in last.markers}), len(chunks), 'only chunks that changed are sent')
        self.call('reset')
        wait_until(lambda: markers.update() or not markers.shown, 'the markers being deleted')

    def test_grids_from_above_follow_the_map(self):
        self.drive(range(1))
        grid = Listener('projected_map', OccupancyGrid)
        updates = Listener('projected_map_updates', OccupancyGridUpdate)
        elevation = Listener('elevation_map', ElevationMap)
        for listener in (grid, updates, elevation):
            self.addCleanup(listener.close)
        grid.wait_for(lambda m: m.data, 'a whole grid')
        elevation.wait_for(lambda m: m.whole, 'a whole elevation map')
        # A second drive over the same place: the grid need not grow.
        for seed in range(1, 3):
            stamp = self.integrate(*random_scan(seed))
        updates.wait_for(lambda m: m.header.stamp == stamp, 'the update of the last scan')
        self.assertEqual(len(grid.messages), 1)
        width, cells = grid.messages[0].info.width, list(grid.messages[0].data)
        for update in updates.messages:
            self.assertLess(update.width * update.height, len(cells))
            for row in range(update.height):
                begin = (update.y + row) * width + update.x
                cells[begin:begin + update.width] = update.data[row * update.width:(row + 1) * update.width]
        grid.close()
        again = Listener('projected_map', OccupancyGrid)
        self.addCleanup(again.close)
        whole = again.wait_for(lambda m: True, 'the whole grid again')
        self.assertEqual((whole.info.width, whole.info.origin.position.x),
                         (width, grid.messages[0].info.origin.position.x))
        self.assertEqual(list(whole.data), cells)
        self.assertEqual({-1, 0, 100}, set(cells))
        # The road is ground: it does not block, and it has a height.
        self.call('reset')
        stamp = self.integrate([(3.5, 0.5, -1.5), (3.5, 2.5, -1.5), (3.5, 2.5, 1.5)], [ROAD, ROAD, CAR])
        part = elevation.wait_for(lambda m: m.header.stamp == stamp, 'the elevation')
        place = {(x, y): (x - part.x) + part.width * (y - part.y) for x, y in ((3, 0), (3, 2), (0, 5))}
        self.assertEqual(part.ground_height[place[3, 0]], -1.0)
        self.assertEqual((part.ground_height[place[3, 2]], part.clearance[place[3, 2]]), (-1.0, 2.0))
        self.assertEqual(bytes(part.ground_class)[place[3, 0]], 9)
        self.assertNotEqual(part.ground_height[place[0, 5]], part.ground_height[place[0, 5]], 'NaN: not known')

    def test_the_queue_is_bounded_and_counts(self):
        before = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        stamps = [self.robot.next_stamp() for _ in range(8)]
        for stamp in stamps:
            self.robot.clouds.publish(make_cloud([(2.0, 0.0, 0.0)], [CAR], stamp))
        full = self.status.wait_for(lambda m: m.dropped_queue_full == before.dropped_queue_full + 5, 'a full queue')
        self.assertEqual(full.waiting, 3)
        self.assertTrue(adds_up(full), full)
        self.robot.publish_pose(stamps[-2])  # out of order, and late: what waits is found all the same
        for stamp in (stamps[-1], stamps[-3]):
            self.robot.publish_pose(stamp)
        status = self.status.wait_for(lambda m: m.waiting == 0 and m.received == before.received + 8, 'the rest')
        self.assertEqual(status.integrated, before.integrated + 3)
        self.assertTrue(adds_up(status), status)

    def test_pause_and_resume(self):
        before = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        self.assertTrue(self.call('pause', Trigger).success)
        status = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        self.assertEqual((status.dropped_paused, status.paused), (before.dropped_paused + 1, True))
        self.call('resume', Trigger)
        self.integrate([(2.0, 0.0, 0.0)], [CAR])

    def test_diagnostics_tell_how_it_goes(self):
        reports = Listener('/diagnostics', DiagnosticArray)
        self.addCleanup(reports.close)

        def report(level, words):
            def fits(message):
                return any(s.level == level and words in s.message and 'mapping' in s.name for s in message.status)
            return reports.wait_for(fits, f'a report of level {level} with "{words}"')

        self.integrate([(2.0, 0.0, 0.0)], [CAR])
        report(DiagnosticStatus.OK, 'mapping')
        self.deal_with(self.robot.scan([], []))
        bad = report(DiagnosticStatus.ERROR, 'empty')
        values = {v.key: v.value for v in bad.status[0].values}
        self.assertGreaterEqual(int(values['dropped: empty']), 1)
        self.assertIn('latency, 99th percentile [ms]', values)
        report(DiagnosticStatus.WARN, 'no clouds come')

    def test_settings_change_while_mapping(self):
        client = Client('/mapping/reconfigure', timeout=30)
        self.addCleanup(client.close)
        stamp = self.integrate([(4.5, 0.5, 0.5)], [CAR])
        self.assertEqual(self.map_of_server(stamp)[(0, 0, 0)][0][2], OccupancyMap.FREE)
        answer = client.update_configuration({'free_space_mode': 'none', 'sensor_model_max_range': 20.0})
        self.addCleanup(client.update_configuration, {'free_space_mode': 'line', 'sensor_model_max_range': -1.0})
        self.assertEqual((answer.free_space_mode, answer.sensor_model_max_range), ('none', 20.0))
        stamp = self.integrate([(0.5, 5.5, 0.5), (0.5, 25.5, 0.5)], [ROAD, ROAD])
        blocks = self.map_of_server(stamp)
        self.assertEqual(blocks[(0, 0, 0)][0][4], OccupancyMap.OCCUPIED, 'the map is kept')
        self.assertEqual(blocks[(0, 0, 0)][0][8 * 3], OccupancyMap.UNKNOWN, 'nothing is cleared')
        self.assertNotIn((0, 3, 0), blocks, 'hits beyond the range are not mapped')
        answer = client.update_configuration({'resolution': 0.5, 'view_range': 3.0})
        self.assertEqual((answer.resolution, answer.view_range), (1.0, 0.0), 'refused as a whole')

    def test_views_are_limited(self):
        client = Client('/mapping/reconfigure', timeout=30)
        self.addCleanup(client.close)
        self.addCleanup(client.update_configuration, {'view_range': 0.0, 'view_max_z': 1e6})
        self.integrate([(3.5, 0.5, 0.5), (3.5, 0.5, 5.5), (100.5, 0.5, 0.5)], [CAR] * 3)
        markers = MarkerClient()
        self.addCleanup(markers.listener.close)

        def shows(*points):
            wait_until(lambda: markers.update() or [p for _, p in markers.cubes()] == sorted(points), f'{points}')
        shows((3.5, 0.5, 0.5), (3.5, 0.5, 5.5), (100.5, 0.5, 0.5))
        client.update_configuration({'view_range': 20.0})
        shows((3.5, 0.5, 0.5), (3.5, 0.5, 5.5))
        client.update_configuration({'view_max_z': 2.0})
        shows((3.5, 0.5, 0.5))
        self.integrate([(3.5, 0.2, 0.2)], [CAR], position=(110.0, 0.5, 0.5))  # the view moves on, chunk by chunk
        shows((100.5, 0.5, 0.5), (113.5, 0.5, 0.5))

    def test_window_and_memory_are_bounded(self):
        client = Client('/mapping/reconfigure', timeout=30)
        self.addCleanup(client.close)
        self.addCleanup(client.update_configuration, {'window': 0.0, 'memory_limit': 0.0})
        client.update_configuration({'window': 40.0})
        for step in range(6):
            stamp = self.integrate([(3.5, 0.5, 0.5)], [CAR], position=(30.0 * step, 0.0, 0.0))
        blocks = self.map_of_server(stamp)
        self.assertGreater(len(blocks), 0)
        self.assertTrue(all(8 * x + 8 > 150 - 28 for x, _, _ in blocks), blocks.keys())
        before = self.status.find(lambda m: True)
        client.update_configuration({'memory_limit': 0.001})
        status = self.deal_with(self.robot.scan([(3.5, 0.5, 0.5)], [CAR]))
        self.assertEqual(status.dropped_memory, before.dropped_memory + 1)
        self.assertEqual(status.map_bytes, before.map_bytes)

    def test_inputs_have_settings_of_their_own(self):
        # Merged clouds come in the map frame, with colours; beams start at the sensor.
        self.merged.seconds = self.robot.seconds
        stamp = self.merged.next_stamp()
        self.robot.seconds = self.merged.seconds
        self.robot.publish_pose(stamp, position=(5.0, 0.5, 0.5))
        self.merged.clouds.publish(make_cloud([(9.5, 0.5, 0.5)], [CAR_COLOR], stamp, frame='map', label_name='rgb',
                                              label_type=PointField.UINT32))
        status = self.deal_with(stamp)
        self.assertTrue(status.integrated_last, status)
        blocks = self.map_of_server(stamp)
        states, labels, _ = blocks[(1, 0, 0)]
        self.assertEqual((states[1], labels[1]), (OccupancyMap.OCCUPIED, 1))
        self.assertEqual(blocks[(0, 0, 0)][0][7], OccupancyMap.FREE)
        self.assertEqual(blocks[(0, 0, 0)][0][3], OccupancyMap.UNKNOWN, 'nothing is cleared from the map origin')

    def test_time_that_jumps_back_is_noticed_and_the_map_kept(self):
        stamp = self.integrate([(4.5, 0.5, 0.5)], [CAR])
        jumps = self.status.find(lambda m: True).time_jumps
        waiting = self.robot.next_stamp()
        self.robot.clouds.publish(make_cloud([(2.0, 0.0, 0.0)], [CAR], waiting))  # waits for its pose
        self.robot.seconds -= 50
        first = self.robot.scan([(0.5, 3.5, 0.5)], [ROAD])  # one old cloud alone might be a stray
        self.assertEqual(self.status.find(lambda m: True).time_jumps, jumps)
        again = self.robot.scan([(0.5, 5.5, 0.5)], [ROAD])
        status = self.deal_with(again)
        self.assertTrue(status.integrated_last, status)
        self.assertEqual(status.time_jumps, jumps + 1)
        self.assertTrue(self.deal_with(first).integrated_last, 'it waited, and is of the new time')
        self.assertEqual(self.status.find(lambda m: m.header.stamp == waiting).last_drop, 'time jump')
        self.assertTrue(adds_up(status), status)
        self.assertEqual(self.map_of_server(again)[(0, 0, 0)][0][4], OccupancyMap.OCCUPIED)
        self.robot.seconds = int(stamp.to_sec()) + 10


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'live', Live)
