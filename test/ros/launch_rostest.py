#!/usr/bin/env python3
"""mapping.launch as users start it: with every preset, as node and as nodelet, with simulated time that jumps back."""
import glob
import math
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
from bki_mapping.srv import QueryPoints
from geometry_msgs.msg import Point
from rosgraph_msgs.msg import Clock, Log

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import TIMEOUT, Listener, Mapping, wait_until  # noqa: E402


def view_of_a_walker(y):
    """What a lidar 1.7 m above the floor sees of a wall 8 m ahead, and of a person 5 m ahead who is y m to the left: all points,
    and those of the person above the voxels that may hold the floor as well."""
    points, person = [], []
    for row in range(-40, 15):
        for column in range(-60, 61):
            elevation, azimuth = math.radians(0.6 * row), math.radians(0.6 * column)
            x, side, z = math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)
            length = min(8.0 / x, 1.7 / -z if z < 0.0 else math.inf)
            flat = math.hypot(x, side)  # the person is an upright cylinder
            along = (5.0 * x + y * side) / flat
            inside = 0.25 ** 2 - (25.0 + y ** 2 - along ** 2)
            hit = (along - math.sqrt(inside)) / flat if inside > 0.0 else math.inf
            of_person = hit < length and hit * z < 0.1
            length = hit if of_person else length
            points.append((length * x, length * side, length * z))
            if of_person and length * z > -1.3:
                person.append(points[-1])
    return points, person


def query_points(node, points):
    return rospy.ServiceProxy(node + '/query_points', QueryPoints)([Point(*point) for point in points])


class Launch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('launch_rostest')

    def test_every_preset_maps_and_says_what_it_did(self):
        presets = glob.glob(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'config/presets/*.yaml'))
        self.assertGreaterEqual(len(presets), 5)
        for number, preset in enumerate(sorted(presets)):
            name = os.path.splitext(os.path.basename(preset))[0]
            nodelet = 'true' if number % 2 else 'false'
            with Mapping(f'config:={name}', f'nodelet:={nodelet}') as mapping:
                status = mapping.scan()
            self.assertTrue(status.integrated_last, f'{preset}: {status}')
            self.assertGreater(status.blocks, 2, preset)
            self.assertEqual(status.labels_not_in_table, 0, preset)
            self.assertIn('Mapped 1 of 1 clouds; dropped none', mapping.printed(), preset)

    def test_without_labels_a_walker_leaves_nothing(self):
        with Mapping('labelled:=false', 'classes:=occupancy') as mapping:
            self.assertEqual(rospy.get_param('/mapping/config'), 'robot')
            walked = []
            for scan in range(30):
                points, person = view_of_a_walker(y=0.15 * scan - 2.2)
                self.assertTrue(mapping.scan(points).integrated_last)
                if scan < 15:
                    walked += person
            self.assertGreater(len(walked), 1000)
            states = query_points('/mapping', walked).state
            self.assertEqual(sum(state == 2 for state in states), 0, 'ghosts')
            wall = [point for point in points if abs(point[0] - 8.0) < 0.01]
            self.assertGreater(sum(state == 2 for state in query_points('/mapping', wall).state), 0.98 * len(wall))
        printed = mapping.printed()
        self.assertIn("Settings: config robot, for class table 'occupancy', in which no class can move", printed)
        self.assertIn("class table 'occupancy' flags no class as ground", printed)

    def test_clouds_without_labels_need_a_table_of_one_class(self):
        with Mapping('labelled:=false') as mapping:
            self.assertEqual(rospy.get_param('/mapping/config'), 'robot')
        self.assertIn("are taken without labels (label_field is empty), so all points get label 0 of class table 'semantic_kitti'; set "
                      'classes to occupancy', mapping.printed())

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
            for arguments, words in ((['config:=robott'], "neither a file nor one of baseline_even, paper_line, "),
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
