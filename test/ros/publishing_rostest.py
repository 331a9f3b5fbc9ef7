#!/usr/bin/env python3
"""The cost of topics depends on the changes, and clients that follow updates have the same map as the mapper."""
import os
import sys
import xmlrpc.client

import rosgraph
import rospy
import rostest
from bki_mapping.msg import ElevationMap
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from rosgraph_msgs.msg import Log

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, Listener, MapperTest, random_scan, wait_until  # noqa: E402
from map_clients import CloudClient, MapClient, MarkerClient  # noqa: E402


class Publishing(MapperTest):
    def test_clients_of_updates_hold_the_map(self):
        early = MapClient()
        wait_until(lambda: early.update() or early.blocks is not None, 'the whole map for a new client')
        stamp = self.drive(range(4))
        truth = self.expect_same(early, stamp)
        self.assertEqual((early.wholes, early.gaps), (1, 0))
        sent = early.listener.messages[-1]
        self.assertGreater(len(truth), 100)
        self.assertLess(len(sent.blocks), len(truth), 'an update has what changed, not all')
        early.listener.close()  # listeners in one process share a connection, a late client must be the only one
        late = MapClient()
        self.addCleanup(late.listener.close)
        stamp = self.drive(range(4, 6))
        self.expect_same(late, stamp)
        self.assertEqual((late.wholes, late.gaps), (1, 0))

        # After a lost message the client detects the gap, requests the whole map, and is correct again.
        late.read += 1
        self.drive(range(6, 7))
        wait_until(lambda: len(late.listener.messages) >= late.read, 'the update that is lost')
        stamp = self.drive(range(7, 8))
        wait_until(lambda: late.update() or late.gaps > 0, 'further updates')
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
        regions = {key[1] for key in markers.shown}
        known = len(markers.listener.messages)  # the last of them may be the whole map, if the client was slow to connect
        self.drive(range(5, 6))
        wait_until(lambda: len(markers.listener.messages) > known, 'the markers of another scan')
        last = markers.listener.messages[-1]
        self.assertLess(len({m.id for m in last.markers}), len(regions), 'only regions that changed are sent')
        self.call('reset')
        wait_until(lambda: markers.update() or not markers.shown, 'the markers being deleted')

    def test_grids_from_above_follow_the_map(self):
        self.drive(range(1))
        grid, elevation = Listener('projected_map', OccupancyGrid), Listener('elevation_map', ElevationMap)
        grid.wait_for(lambda m: m.data, 'a whole grid')
        updates = Listener('projected_map_updates', OccupancyGridUpdate)
        for listener in (grid, updates, elevation):
            self.addCleanup(listener.close)
        wait_until(lambda: len(grid.messages) == 2, 'another grid because of the subscriber of updates')
        elevation.wait_for(lambda m: m.whole, 'a whole elevation map')
        # A second drive at the same place: the grid does not grow.
        for seed in range(1, 3):
            stamp = self.integrate(*random_scan(seed))
        updates.wait_for(lambda m: m.header.stamp == stamp, 'the update of the last scan')
        self.assertEqual(len(grid.messages), 2)
        width, cells = grid.messages[1].info.width, list(grid.messages[1].data)
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
                         (width, grid.messages[1].info.origin.position.x))
        self.assertEqual(list(whole.data), cells)
        self.assertEqual({-1, 0, 100}, set(cells))
        # The road is ground: it is no obstacle, and has a height.
        self.call('reset')
        stamp = self.integrate([(3.5, 0.5, -1.5), (3.5, 2.5, -1.5), (3.5, 2.5, 1.5)], [ROAD, ROAD, CAR])
        part = elevation.wait_for(lambda m: m.header.stamp == stamp, 'the elevation')
        place = {(x, y): (x - part.x) + part.width * (y - part.y) for x, y in ((3, 0), (3, 2), (0, 5))}
        self.assertEqual(part.ground_height[place[3, 0]], -1.0)
        self.assertEqual((part.ground_height[place[3, 2]], part.clearance[place[3, 2]]), (-1.0, 2.0))
        self.assertEqual(bytes(part.ground_class)[place[3, 0]], 9)
        self.assertNotEqual(part.ground_height[place[0, 5]], part.ground_height[place[0, 5]], 'NaN: not known')

    def test_views_are_limited(self):
        self.integrate([(3.5, 0.5, 0.5), (3.5, 0.5, 5.5), (100.5, 0.5, 0.5)], [CAR] * 3)
        markers = MarkerClient()
        self.addCleanup(markers.listener.close)

        def shows(*points):
            wait_until(lambda: markers.update() or [p for _, p in markers.cubes()] == sorted(points), f'{points}')
        shows((3.5, 0.5, 0.5), (3.5, 0.5, 5.5), (100.5, 0.5, 0.5))
        self.reconfigure(view_range=20.0)
        shows((3.5, 0.5, 0.5), (3.5, 0.5, 5.5))
        self.reconfigure(view_max_z=2.0)
        shows((3.5, 0.5, 0.5))
        self.integrate([(3.5, 0.2, 0.2)], [CAR], position=(110.0, 0.5, 0.5))  # the view moves on
        shows((100.5, 0.5, 0.5), (113.5, 0.5, 0.5))

    def test_on_a_long_drive_topics_stay_within_the_window(self):
        self.reconfigure(window=40.0)
        reach = 0.5 * (40.0 + 8.0)  # maximum distance of the centres of kept blocks, and of poses, from the sensor
        markers, path, grid = MarkerClient(), Listener('trajectory', Path), Listener('projected_map', OccupancyGrid)
        for listener in (markers.listener, path, grid):
            self.addCleanup(listener.close)
            wait_until(listener.subscriber.get_num_connections, 'the connection')
        for seed in range(80):
            position = (20.0 * seed, 0.0, 0.0)
            stamp = self.integrate(*random_scan(seed), position=position)
            if seed % 5 == 4:  # a node that publishes late would have more regions at once
                markers.listener.wait_for(lambda m, s=stamp: any(marker.header.stamp == s for marker in m.markers), 'markers')
        truth = self.map_of_server(stamp)
        expected = sorted((8 * x + v % 8 + 0.5, 8 * y + v // 8 % 8 + 0.5, 8 * z + v // 64 + 0.5)
                          for (x, y, z), (states, _, _) in truth.items() for v in range(512) if states[v] == 2)
        self.assertGreater(len(expected), 20)
        wait_until(lambda: markers.update() or sorted(p for _, p in markers.cubes()) == expected, 'the same markers')
        numbers = {m.id for array in markers.listener.messages for m in array.markers}
        self.assertLess(max(numbers), 32, 'numbers of regions that are gone are used again')
        last = path.wait_for(lambda m: m.header.stamp == stamp, 'the last trajectory')
        self.assertEqual([p.pose.position.x for p in last.poses], [position[0] - 20.0, position[0]])
        whole = grid.find(lambda m: True)
        self.assertLessEqual(whole.info.width, 2 * reach + 2 * 128 + 16, 'of the window and the margins')

    def test_a_window_below_a_block_keeps_the_block_of_the_sensor(self):
        self.reconfigure(window=0.1)
        for x in (0.0, 3.9, 8.0, 1004.0):  # includes the face between two blocks
            stamp = self.integrate([(2.5, 0.5, 0.5), (20.5, 0.5, 0.5)], [CAR] * 2, position=(x, 0.5, 0.5))
            block = (int(x // 8), 0, 0)
            self.assertIn(block, self.map_of_server(stamp))
            self.assertTrue(all(abs(b[0] - block[0]) <= 1 for b in self.map_of_server(stamp)))

    def test_nothing_is_built_while_nobody_listens(self):
        def connections():
            code, _, infos = node.getBusInfo('/publishing_rostest')
            self.assertEqual(code, 1)
            return [info for info in infos if info[2] == 'o' and info[4].endswith('occupancy_updates')]

        manager = rospy.resolve_name('manager')
        node = xmlrpc.client.ServerProxy(rosgraph.Master('/publishing_rostest').lookupNode(manager))
        sequences = []
        for seeds in (range(3), range(3, 9)):
            client = MapClient()
            wait_until(lambda: client.update() or client.wholes == 1, 'the whole map for a new client')
            self.assertEqual(len(connections()), 1)
            sequences.append(client.sequence)
            client.listener.close()
            wait_until(lambda: not connections(), 'the mapper noticing that nobody listens')
            stamp = self.drive(seeds)
        client = MapClient()
        self.addCleanup(client.listener.close)
        self.expect_same(client, stamp)
        self.assertEqual(sequences + [client.sequence], 3 * [client.sequence], 'an update was made for nobody')

    def test_a_pose_that_is_far_off(self):
        """If the map spans more columns than fit into memory, the 2D maps pause, and only these."""
        grid, ground = Listener('projected_map', OccupancyGrid), Listener('elevation_map', ElevationMap)
        self.addCleanup(grid.close)
        self.addCleanup(ground.close)
        stamp = self.integrate(*random_scan(1))
        for listener in (grid, ground):
            listener.wait_for(lambda m: m.header.stamp == stamp, 'the map from above')
        self.integrate(*random_scan(2), position=(1e6, 1e6, 0.0))
        log = Listener('/rosout', Log)
        self.addCleanup(log.close)
        for topic in ('/projected_map', '/elevation_map'):
            def said(sentence=topic + ' is not published: the map spans '):
                self.call('publish_map')
                return log.find(lambda m: m.msg.startswith(sentence))
            wait_until(said, f'saying why there is no {topic}')
        self.call('reset')
        stamp = self.integrate(*random_scan(3))
        for listener in (grid, ground):
            listener.wait_for(lambda m: m.header.stamp == stamp, 'the map from above')


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'publishing', Publishing)
