#!/usr/bin/env python3
"""mapping.launch with namespaces: mappers with different settings, two in one manager, do not interfere."""
import os
import sys
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus, OccupancyMap
from std_srvs.srv import Empty
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import TIMEOUT, Listener, Robot, wait_until  # noqa: E402


def count(message, state):
    return sum(bytes(block.state).count(state) for block in message.blocks)


class TwoMappers(unittest.TestCase):
    def test_each_has_its_own_map(self):
        rospy.init_node('two_mappers_rostest')
        robot = Robot('/cloud_in')
        spaces = {'coarse': '/coarse', 'fine': '/fine', 'beside': ''}
        status = {name: Listener(f'{space}/mapping/status', MappingStatus) for name, space in spaces.items()}
        for listener in status.values():
            listener.wait_for(lambda m: True, 'a first status')
        for topic in (robot.clouds, robot.poses):  # subscribers: the process of the nodelets, and the node
            wait_until(lambda: topic.get_num_connections() == 2, 'all mappers subscribing')
        stamp = robot.scan([(4.2, 0.1, 0.1), (4.1, 0.9, 0.1)], [10, 40])
        for name, listener in status.items():
            listener.wait_for(lambda m: m.header.stamp == stamp and m.integrated_last, f'{name} mapping the cloud')
        for name, kind in (('mapping_manager', 'load_nodelet'), ('mapping', 'save_map')):
            rospy.wait_for_service(f'/coarse/{name}/{kind}', TIMEOUT)
        with self.assertRaises(rospy.ROSException):
            rospy.wait_for_service('/fine/mapping_manager/load_nodelet', 0.1)
        occupancy = {name: Listener(f'{space}/occupancy', OccupancyMap) for name, space in spaces.items()}
        maps = {name: occupancy[name].wait_for(lambda m: m.blocks, f'the map of {name}') for name in status}
        self.assertEqual(maps['coarse'].resolution, 1.0)
        self.assertEqual(maps['fine'].resolution, 0.25)
        self.assertAlmostEqual(maps['beside'].resolution, 0.3)
        self.assertEqual(count(maps['coarse'], OccupancyMap.OCCUPIED), 1)
        self.assertEqual(count(maps['fine'], OccupancyMap.OCCUPIED), 2)
        self.assertEqual(count(maps['coarse'], OccupancyMap.FREE), 0)
        self.assertGreater(count(maps['fine'], OccupancyMap.FREE), 10)
        self.assertEqual((len(maps['coarse'].classes), len(maps['fine'].classes)), (20, 1))

        # The coarse map is coloured by class, the fine one by height: z = 0.125 m is 1/160 of 20 m, almost blue.
        colors = {name: Listener(f'{spaces[name]}/occupied_cells_vis_array', MarkerArray).wait_for(
            lambda m: any(marker.colors for marker in m.markers), f'markers of {name}') for name in ('coarse', 'fine')}
        car = next(marker for marker in colors['coarse'].markers if marker.ns == 'car')
        self.assertAlmostEqual(car.colors[0].b, 245 / 255, places=5)
        lowest = next(marker for marker in colors['fine'].markers if marker.colors).colors[0]
        self.assertEqual((lowest.r, lowest.g), (0.0, 0.0))
        self.assertAlmostEqual(lowest.b, 0.525, places=2)

        rospy.ServiceProxy('/coarse/mapping/reset', Empty)()
        occupancy['coarse'].wait_for(lambda m: not m.blocks, 'the coarse map being empty')
        for name in ('fine', 'beside'):
            occupancy[name].close()
            kept = Listener(f'{spaces[name]}/occupancy', OccupancyMap).wait_for(lambda m: True, f'the map of {name}')
            self.assertEqual(count(kept, OccupancyMap.OCCUPIED), count(maps[name], OccupancyMap.OCCUPIED))


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'two_mappers', TwoMappers)
