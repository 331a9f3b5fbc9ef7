#!/usr/bin/env python3
"""mapping.launch as users start it: with every preset, as node and as nodelet, with simulated time that jumps back."""
import glob
import os
import sys
import unittest

import roslib.packages
import rospy
import rostest
from rosgraph_msgs.msg import Clock, Log

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, Mapping, wait_until  # noqa: E402


class Launch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('launch_rostest')

    def test_every_preset_maps_and_says_what_it_did(self):
        presets = glob.glob(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'config/presets/*.yaml'))
        self.assertGreaterEqual(len(presets), 8)
        for number, preset in enumerate(sorted(presets)):
            plain = ['labelled:=false', 'classes:=occupancy'] if 'occupancy_only' in preset else []
            nodelet = 'true' if number % 2 else 'false'
            with Mapping(f'config:={preset}', f'nodelet:={nodelet}', *plain) as mapping:
                status = mapping.scan()
            self.assertTrue(status.integrated_last, f'{preset}: {status}')
            self.assertGreater(status.blocks, 2, preset)
            self.assertEqual(status.labels_not_in_table, 0, preset)
            self.assertIn('Mapped 1 of 1 clouds; dropped none', mapping.printed(), preset)

    def test_navigation_measures_heights_from_the_ground(self):
        with Mapping('navigation:=true') as mapping:
            settings = rospy.get_param('/mapping')
            status = mapping.scan()
        self.assertTrue(status.integrated_last, status)
        self.assertEqual([settings[name] for name in ('occupancy_height', 'occupancy_min_z', 'occupancy_max_z')], ['ground', 0.1, 2.0])
        self.assertEqual(settings['prior'], 0.0001, 'besides, the preset of robots')

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
                before = mapping.scan()  # on a busy machine a transform may arrive too late for its cloud
                self.assertEqual(before.time_jumps, 0)
            mapping.robot.seconds = 50
            clock.publish(Clock(rospy.Time(51)))
            log.wait_for(lambda m: '/clock went back' in m.msg, 'a warning')
            after = mapping.scan()
            self.assertTrue(after.integrated_last, 'transforms of the new time serve')
            self.assertEqual((after.time_jumps, after.integrated), (1, before.integrated + 1))


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'launch', Launch)
