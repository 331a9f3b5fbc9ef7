#!/usr/bin/env python3
"""A box is put before a robot that has seen free space for half a minute: the next projected_map has it. Taken away, it is gone
within two seconds."""
import math
import os
import sys

import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, MapperTest, make_cloud, wait_until  # noqa: E402
from navigation_rostest import FREE, LETHAL, StaticLayer  # noqa: E402

WALL, PERIOD, HEIGHT = 50, 0.1, 1.5  # raw label; time between scans [s]; of the sensor above the ground [m]
BOX = 3.1  # distance of the box [m]


def scan(with_box):
    """A sensor that looks along x at a wall 8 m away, and at a box 1.8 m wide and 1.2 m high."""
    points, labels = [], []
    for azimuth in range(-50, 51):
        for elevation in range(-45, 11):
            y, z = math.tan(0.01 * azimuth), math.tan(0.01 * elevation)
            distance, label = 8.0, WALL
            if HEIGHT + distance * z < 0.0:
                distance, label = -HEIGHT / z, ROAD
            if with_box and abs(BOX * y) < 0.9 and -1.4 < BOX * z < -0.2:
                distance, label = BOX, CAR
            points.append((distance, distance * y, distance * z))
            labels.append(label)
    return points, labels


class Bumper(MapperTest):
    def setUp(self):
        super().setUp()
        self.clouds = {with_box: make_cloud(*scan(with_box), rospy.Time()) for with_box in (False, True)}
        self.time = 1000.0

    def see(self, with_box, duration):
        """Publishes scans for some seconds of the robot's time; returns the last one's stamp."""
        for _ in range(round(duration / PERIOD)):
            self.time += PERIOD
            stamp = rospy.Time.from_sec(round(self.time, 3))
            self.robot.publish_pose(stamp)
            self.clouds[with_box].header.stamp = stamp
            self.robot.clouds.publish(self.clouds[with_box])
            self.assertTrue(self.deal_with(stamp).integrated_last)
        return stamp

    def box_in(self, layer):
        """The cells of the box's front that are obstacles, and the others."""
        costs = [layer.at(BOX, 0.3 * n + 0.15) for n in range(-2, 2)]
        return costs.count(LETHAL), costs.count(FREE)

    def test_a_box_is_in_the_next_map_and_gone_within_two_seconds(self):
        self.see(False, 30.0)
        layer = StaticLayer({**rospy.get_param('move_base/global_costmap/static_layer')})
        self.addCleanup(layer.close)
        layer.follow()
        wait_until(lambda: len(layer.subscribers) > 1 and layer.subscribers[1].get_num_connections(), 'the connection')
        self.assertEqual(self.box_in(layer), (0, 4))
        stamp = self.see(True, PERIOD)  # one scan
        wait_until(lambda: layer.stamp == stamp, 'the next publication')
        self.assertEqual(self.box_in(layer), (4, 0))
        self.see(True, 20.0)
        stamp = self.see(False, 2.0)
        wait_until(lambda: layer.stamp == stamp, 'a publication after two seconds')
        self.assertEqual(self.box_in(layer), (0, 4))


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'bumper', Bumper)
