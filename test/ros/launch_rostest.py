#!/usr/bin/env python3
"""mapping.launch as users start it: with every preset, as node and as nodelet, with simulated time that jumps back."""
import glob
import os
import signal
import subprocess
import sys
import tempfile
import unittest
import xmlrpc.client

import rosgraph
import roslib.packages
import rospy
import rostest
from bki_mapping.msg import OccupancyMap
from rosgraph_msgs.msg import Clock, Log

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import TIMEOUT, Listener, Mapping, wait_until  # noqa: E402


class Launch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('launch_rostest')

    def test_every_preset_maps_and_says_what_it_did(self):
        presets = glob.glob(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'config/presets/*.yaml'))
        self.assertGreaterEqual(len(presets), 8)
        for number, preset in enumerate(sorted(presets)):
            name = os.path.splitext(os.path.basename(preset))[0]
            plain = ['labelled:=false', 'classes:=occupancy'] if 'occupancy_only' in preset else []
            nodelet = 'true' if number % 2 else 'false'
            with Mapping(f'config:={name}', f'nodelet:={nodelet}', *plain) as mapping:
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
        self.assertEqual(settings['config'], 'robot', 'besides, the preset of robots')

    def test_voxels_are_as_large_as_asked_for(self):
        occupancy = Listener('/occupancy', OccupancyMap)
        self.addCleanup(occupancy.close)
        with Mapping('resolution:=0.5', 'config:=paper_none') as mapping:
            mapping.scan()
            self.assertEqual(occupancy.wait_for(lambda m: m.blocks, 'the map').resolution, 0.5)

    def test_a_map_file_is_relative_to_the_folder_of_the_shell(self):
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(2):  # the second continues the file
                with Mapping("map_file:=rob's street.bkm", cwd=folder) as mapping:
                    status = mapping.scan()
                self.assertEqual(status.map_file_fault, '')
                self.assertEqual(os.listdir(folder), ["rob's street.bkm"])
            self.assertGreater(status.blocks, 0)

    def test_a_wrong_setting_ends_the_launch_with_one_sentence(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, 'two.yaml'), 'w') as file:
                file.write('config: robot\nprior: 0.001\n')
            for arguments, words in ((['config:=crowdd'], "neither a file nor one of baseline_even, crowded, occupancy_only, "),
                                     (['config:=none.yaml'], f"parameter file '{folder}/none.yaml' is neither a file nor one of"),
                                     (['config:=two.yaml'], f'parameter file {folder}/two.yaml names another one as config'),
                                     (['classes:=tooy'], "did you mean 'toy'?"),
                                     (['resolution:=ten'], "resolution is 'ten', but must be a number"),
                                     (['map_file:=map.ply'], 'must end in .bkm')):
                for nodelet in 'true', 'false':
                    launch = subprocess.run(['roslaunch', '--wait', 'bki_mapping', 'mapping.launch', f'nodelet:={nodelet}', *arguments],
                                            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT,
                                            check=False)
                    self.assertEqual(sum(words in line for line in launch.stdout.splitlines()), 1, launch.stdout)
                    self.assertNotRegex(launch.stdout, 'Traceback|RLException')

    def test_a_manager_that_is_killed_ends_the_launch(self):
        with Mapping() as mapping:
            uri = rosgraph.Master(rospy.get_name()).lookupNode('/mapping_manager')
            with xmlrpc.client.ServerProxy(uri) as manager:
                os.kill(manager.getPid(rospy.get_name())[2], signal.SIGKILL)
            mapping.launch.wait(TIMEOUT)

    def test_other_nodes_go_on_where_the_mapper_is_not_required(self):
        launch = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', 'mapping.launch', 'required:=false', 'config:=crowdd'],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(launch.communicate)
        self.addCleanup(launch.terminate)
        for line in launch.stdout:
            if 'has died' in line or 'finished cleanly' in line:
                break
        else:
            self.fail('the launch has ended')
        rospy.wait_for_service('/mapping_manager/list', TIMEOUT)
        self.assertIsNone(launch.poll())

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
