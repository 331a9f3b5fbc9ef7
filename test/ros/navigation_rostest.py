#!/usr/bin/env python3
"""config/navigation gives planners what they need of projected_map. A stand-in takes the place of costmap_2d's StaticLayer."""
import os
import sys
import threading

import rospy
import rostest
from bki_mapping.msg import ElevationMap
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, Listener, MapperTest, random_scan, wait_until  # noqa: E402

SIDEWALK, TERRAIN = 48, 72  # raw labels of SemanticKITTI
FREE, INSCRIBED, LETHAL, NO_INFORMATION = 0, 253, 254, 255  # costs of costmap_2d


class StaticLayer:
    """Does with grids what costmap_2d's for Noetic does: it subscribes to a map, waits for it, and only then to its updates."""
    DEFAULTS = {'map_topic': 'map', 'subscribe_to_updates': False, 'first_map_only': False, 'track_unknown_space': True,
                'unknown_cost_value': -1, 'lethal_cost_threshold': 100, 'trinary_costmap': True, 'use_maximum': False}

    def __init__(self, settings):
        self.settings = {**self.DEFAULTS, **settings}
        self.lock = threading.Lock()
        self.info, self.costs, self.wholes, self.stamp, self.outside = None, None, 0, None, []
        self.subscribers = [rospy.Subscriber(self.settings['map_topic'], OccupancyGrid, self.take_map, queue_size=1)]
        wait_until(lambda: self.wholes, 'the map')

    def follow(self):
        if self.settings['subscribe_to_updates']:
            self.subscribers.append(rospy.Subscriber(self.settings['map_topic'] + '_updates', OccupancyGridUpdate,
                                                     self.take_update, queue_size=10))

    def close(self):
        for subscriber in self.subscribers:
            subscriber.unregister()

    def cost(self, value):
        value %= 256  # it takes cells as unsigned
        threshold = max(0, min(100, self.settings['lethal_cost_threshold']))
        if value == self.settings['unknown_cost_value'] % 256:
            return NO_INFORMATION if self.settings['track_unknown_space'] else FREE
        if value >= threshold:
            return LETHAL
        return FREE if self.settings['trinary_costmap'] else int(value / threshold * LETHAL)

    def take_map(self, grid):
        with self.lock:
            if self.settings['first_map_only'] and self.wholes:
                return
            self.info, self.costs = grid.info, [self.cost(value) for value in grid.data]
            self.wholes += 1
            self.stamp = grid.header.stamp

    def take_update(self, update):
        with self.lock:
            if min(update.x, update.y) < 0 or update.x + update.width > self.info.width or update.y + update.height > self.info.height:
                self.outside.append(update)  # it would write there all the same
                return
            for row in range(update.height):
                begin = (update.y + row) * self.info.width + update.x
                cells = update.data[row * update.width:(row + 1) * update.width]
                self.costs[begin:begin + update.width] = [self.cost(value) for value in cells]
            self.stamp = update.header.stamp

    def known(self):
        """The costs that are known, by the centres of the cells."""
        with self.lock:
            origin, edge, width = self.info.origin.position, self.info.resolution, self.info.width
            return {(origin.x + edge * (i % width + 0.5), origin.y + edge * (i // width + 0.5)): cost
                    for i, cost in enumerate(self.costs) if cost != NO_INFORMATION}

    def at(self, x, y):
        with self.lock:
            origin, edge = self.info.origin.position, self.info.resolution
            return self.costs[int((y - origin.y) // edge) * self.info.width + int((x - origin.x) // edge)]


class Navigation(MapperTest):
    def setUp(self):
        super().setUp()
        self.settings = rospy.get_param('move_base/global_costmap/static_layer')

    def layer(self, **changes):
        layer = StaticLayer({**self.settings, **changes})
        self.addCleanup(layer.close)
        return layer

    def expect_current(self, layer, stamp):
        """The layer has all of the map after a scan: a map that is sent anew changes nothing."""
        wait_until(lambda: layer.stamp == stamp, 'the layer hearing of the last scan')
        known, wholes = layer.known(), layer.wholes
        self.call('publish_map')
        wait_until(lambda: layer.wholes > wholes, 'the whole map')
        self.assertEqual(sorted(known.items() ^ layer.known().items()), [])
        self.assertEqual(set(known.values()), {FREE, LETHAL})
        self.assertEqual(layer.outside, [])

    def test_classes_have_their_costs(self):
        points = [(3.5, 0.5, -1.5), (3.5, 2.5, -1.5), (3.5, 4.5, -1.5), (3.5, 6.5, -1.5), (3.5, 6.5, -0.5)]
        self.integrate(points, [ROAD, SIDEWALK, TERRAIN, ROAD, CAR])
        layer = self.layer()
        self.assertEqual([layer.at(3.5, y) for y in (0.5, 2.5, 4.5, 6.5, -20.5)], [FREE, 76, 152, LETHAL, NO_INFORMATION])
        layer.close()
        plain = self.layer(trinary_costmap=True)
        self.assertEqual([plain.at(3.5, y) for y in (0.5, 2.5, 4.5, 6.5, -20.5)], [FREE, FREE, FREE, LETHAL, NO_INFORMATION])

    def test_what_is_higher_than_the_robot_is_no_obstacle(self):
        points = [(3.5, 0.5, -1.5), (3.5, 0.5, 4.5), (3.5, 4.5, -1.5), (3.5, 4.5, 0.5)]  # 5.5 m and 1.5 m above the road
        self.integrate(points, [ROAD, CAR, ROAD, CAR])
        layer = self.layer()
        self.assertEqual([layer.at(3.5, y) for y in (0.5, 4.5)], [FREE, LETHAL])

    def test_costs_end_below_those_of_the_footprint(self):
        layer = StaticLayer.__new__(StaticLayer)
        layer.settings = {**StaticLayer.DEFAULTS, **self.settings}
        costs = [layer.cost(value) for value in range(100)]
        self.assertEqual(costs, sorted(set(costs)), 'each cost differs from the next')
        self.assertLess(costs[-1], INSCRIBED, 'ground that may be driven is never taken for a collision')
        self.assertEqual((layer.cost(100), layer.cost(-1)), (LETHAL, NO_INFORMATION))

    def test_settings_exist(self):
        for costmap in ('global_costmap', 'local_costmap'):
            settings = rospy.get_param(f'move_base/{costmap}')
            self.assertLessEqual(set(settings['static_layer']), set(StaticLayer.DEFAULTS))
            for name, value in settings['static_layer'].items():
                self.assertIs(type(value), type(StaticLayer.DEFAULTS[name]), name)
            self.assertEqual(settings['static_layer'], self.settings)
            for plugin in settings['plugins']:
                self.assertIn(plugin['name'], settings)

    def test_a_layer_that_subscribes_to_updates_late_misses_nothing(self):
        self.integrate(*random_scan(0))
        layer = self.layer()
        elevation = Listener('elevation_map', ElevationMap)
        self.addCleanup(elevation.close)
        stamp = self.integrate(*random_scan(1))
        elevation.wait_for(lambda m: m.header.stamp == stamp, 'an update, which the layer does not hear')
        layer.follow()
        wait_until(lambda: layer.subscribers[1].get_num_connections(), 'the connection')
        stamp = self.integrate([(3.5, 0.5, -1.5)], [CAR])  # changes few cells
        self.expect_current(layer, stamp)

    def test_a_layer_grows_with_the_map(self):
        self.integrate(*random_scan(0))
        layer = self.layer()
        layer.follow()
        wait_until(lambda: layer.subscribers[1].get_num_connections(), 'the connection')
        width = layer.info.width
        stamp = self.drive(range(1, 30))
        self.expect_current(layer, stamp)
        self.assertGreater(layer.info.width, width)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'navigation', Navigation)
