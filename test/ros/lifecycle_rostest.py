#!/usr/bin/env python3
"""Loading and unloading under traffic, and refusal of wrong parameters; the manager must survive both."""
import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import rosnode
import rospy
import rostest
from bki_mapping.msg import MappingStatus
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, Robot, program, publishers_of, wait_until  # noqa: E402


def load(name, **parameters):
    """Starts `nodelet load`, which unloads the nodelet when it is interrupted."""
    for parameter, value in parameters.items():
        rospy.set_param(f'/{name}/{parameter}', value)
    return subprocess.Popen([program('nodelet', 'nodelet'), 'load', 'bki_mapping/MappingNodelet', 'manager',
                             f'__name:={name}'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def stop(process):
    process.send_signal(signal.SIGINT)
    return process.communicate(timeout=30)[0]


class Lifecycle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('lifecycle_rostest')

    def test_unload_under_traffic(self):
        robot = Robot('/cloud_in')
        stopped = threading.Event()
        points = [(0.02 * i, 0.3 * (i % 40) - 6.0, 0.1 * (i % 17)) for i in range(4000)]

        def drive():
            while not stopped.is_set():
                robot.scan(points, [10] * len(points))
                stopped.wait(0.01)

        traffic = threading.Thread(target=drive)
        traffic.start()
        try:
            for turn in range(6):
                status = Listener(f'/mapping_{turn}/status', MappingStatus)
                nodelet = load(f'mapping_{turn}')
                status.wait_for(lambda m: m.integrated > 0, f'mapping in turn {turn}')
                stop(nodelet)
                wait_until(lambda: not publishers_of(f'/mapping_{turn}/status'), 'unloading')
        finally:
            stopped.set()
            traffic.join()

    def test_wrong_parameters_are_refused_by_name(self):
        refused = load('misspelt', resolutoin=0.1, threads=-3)
        output = refused.communicate(timeout=30)[0]
        self.assertNotEqual(refused.returncode, 0, output)
        status = Listener('/after/status', MappingStatus)  # the manager is alive and loads the next nodelet
        good = load('after')
        status.wait_for(lambda m: True, 'a status after the refusal')
        stop(good)

    def test_a_node_that_is_ended_says_its_counts(self):
        robot = Robot('/ended_cloud')
        for number in (signal.SIGINT, signal.SIGTERM):
            status = Listener('/ended/status', MappingStatus)
            node = subprocess.Popen([program('mapping_node'), '__name:=ended', 'cloud_in:=/ended_cloud'],
                                    stdout=subprocess.PIPE, text=True)
            try:
                status.wait_for(lambda m: m.received == 0, 'the node being up')
                robot.connect()
                stamp = robot.scan([(2.0, 0.0, 0.0)], [10])
                status.wait_for(lambda m: m.header.stamp == stamp, 'a scan in the map')
            finally:
                node.send_signal(number)
                output = node.communicate(timeout=30)[0]
            self.assertEqual(node.returncode, 0, output)
            self.assertIn('/ended: Mapped 1 of 1 clouds; dropped none; used 1 of 1 points', output)
            status.close()

    def test_the_counts_are_logged_when_the_manager_shuts_down(self):
        # SIGTERM would end the nodelet binary at once, because it handles only SIGINT.
        for number in (signal.SIGINT, None):
            manager = subprocess.Popen([program('nodelet', 'nodelet'), 'manager', '__name:=own_manager'],
                                       stdout=subprocess.PIPE, text=True)
            status = Listener('/managed/status', MappingStatus)
            nodelet = subprocess.Popen([program('nodelet', 'nodelet'), 'load', 'bki_mapping/MappingNodelet',
                                        'own_manager', '__name:=managed'], stdout=subprocess.DEVNULL)
            try:
                status.wait_for(lambda m: True, 'the nodelet being loaded')
                if number:
                    manager.send_signal(number)
                else:
                    rosnode.kill_nodes(['/own_manager'])  # like the command rosnode kill
                output = manager.communicate(timeout=30)[0]
            finally:
                for process in (nodelet, manager):
                    process.kill()
                    process.wait()
            self.assertIn('/managed: Mapped 0 of 0 clouds', output)
            status.close()

    def test_a_player_that_is_ended_says_how_far_it_came(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([program('simulate_drive'), '--output', folder + '/drive', '--scans', '3', '--beams', '8',
                            '--columns', '90'], check=True, timeout=60, stdout=subprocess.DEVNULL)
            for number in (signal.SIGINT, signal.SIGTERM):
                clouds, poses = Listener('/played', PointCloud2), Listener('/tf', TFMessage)
                player = subprocess.Popen([program('play_sequence'), '--sequence', folder + '/drive', '--rate', '0.001',
                                           'cloud_in:=/played'], stdout=subprocess.PIPE, text=True)
                try:
                    clouds.wait_for(lambda m: True, 'the first scan')  # the next is 100 s away
                finally:
                    player.send_signal(number)
                    output = player.communicate(timeout=30)[0]
                self.assertEqual((player.returncode, output), (0, 'played 1 of 3 scans\n'))
                clouds.close()
                poses.close()

    def test_the_node_says_what_is_wrong(self):
        rospy.set_param('/wrong/resolutoin', 0.1)
        rospy.set_param('/wrong/free_space/mode', 'liner')
        node = subprocess.run([program('mapping_node'), '__name:=wrong'], capture_output=True, text=True,
                              timeout=30, check=False)
        self.assertEqual(node.returncode, 1)
        self.assertIn("'resolutoin' is unknown; did you mean 'resolution'?", node.stdout + node.stderr)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'lifecycle', Lifecycle)
