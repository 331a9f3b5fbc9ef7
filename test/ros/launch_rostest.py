#!/usr/bin/env python3
"""mapping.launch as users start it: with every preset, as node and nodelet, with simulated time that goes back."""
import glob
import os
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
from bki_mapping.msg import MappingStatus
from rosgraph_msgs.msg import Clock, Log

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, Listener, Robot, wait_until  # noqa: E402

POINTS = [(0.2 * i - 10.0, 8.0, 0.1 * (i % 20) - 1.0) for i in range(100)]


class Mapping:
    """A running mapping.launch with a robot beside it."""

    def __init__(self, *arguments):
        self.output = tempfile.TemporaryFile('w+')
        self.status = Listener('/mapping/status', MappingStatus)
        self.robot = Robot('/velodyne_points')
        self.launch = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', 'mapping.launch', *arguments],
                                       stdout=self.output, stderr=subprocess.STDOUT)
        self.robot.connect()

    def __enter__(self):
        return self

    def scan(self):
        stamp = self.robot.scan(POINTS, [CAR] * len(POINTS))
        return self.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')

    def __exit__(self, *_):
        self.launch.terminate()
        self.launch.wait(30)
        wait_until(lambda: self.status.subscriber.get_num_connections() == 0, 'the launch ending')
        self.status.close()
        self.robot.clouds.unregister()
        self.robot.poses.unregister()

    def printed(self):
        self.output.seek(0)
        return self.output.read()


class Launch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('launch_rostest')

    def test_every_preset_maps_and_says_what_it_did(self):
        presets = glob.glob(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'config/presets/*.yaml'))
        self.assertGreaterEqual(len(presets), 7)
        for number, preset in enumerate(sorted(presets)):
            plain = ['labelled:=false', 'classes:=occupancy'] if 'occupancy_only' in preset else []
            nodelet = 'true' if number % 2 else 'false'
            with Mapping(f'config:={preset}', f'nodelet:={nodelet}', *plain) as mapping:
                status = mapping.scan()
            self.assertTrue(status.integrated_last, f'{preset}: {status}')
            self.assertGreater(status.blocks, 2, preset)
            self.assertEqual(status.labels_not_in_table, 0, preset)
            self.assertIn('Mapped 1 of 1 clouds; dropped none', mapping.printed(), preset)

    def test_a_clock_that_goes_back_is_a_time_jump(self):
        rospy.set_param('/use_sim_time', True)
        self.addCleanup(rospy.set_param, '/use_sim_time', False)
        clock = rospy.Publisher('/clock', Clock, queue_size=10)
        log = Listener('/rosout', Log)
        for topic in (clock, log.subscriber):
            self.addCleanup(topic.unregister)
        with Mapping() as mapping:
            wait_until(lambda: clock.get_num_connections() > 0, 'the mapper listening to /clock')
            for seconds in (101, 102):
                clock.publish(Clock(rospy.Time(seconds)))
                before = mapping.scan()  # on a busy machine a transform may come too late for its cloud
                self.assertEqual(before.time_jumps, 0)
            mapping.robot.seconds = 50
            clock.publish(Clock(rospy.Time(51)))
            log.wait_for(lambda m: '/clock went back' in m.msg, 'a warning')
            after = mapping.scan()
            self.assertTrue(after.integrated_last, 'transforms of the new time serve')
            self.assertEqual((after.time_jumps, after.integrated), (1, before.integrated + 1))


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'launch', Launch)
