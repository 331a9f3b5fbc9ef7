#!/usr/bin/env python3
"""Loading and unloading under traffic, and refusal of wrong parameters, in a manager that must stay alive."""
import os
import signal
import subprocess
import sys
import threading
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, Robot, program, wait_until  # noqa: E402


def load(name, **parameters):
    """Starts `nodelet load`, which unloads again when it is interrupted."""
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
                wait_until(lambda: status.subscriber.get_num_connections() == 0, 'unloading')
        finally:
            stopped.set()
            traffic.join()

    def test_wrong_parameters_are_refused_by_name(self):
        refused = load('misspelt', resolutoin=0.1, threads=-3)
        output = refused.communicate(timeout=30)[0]
        self.assertNotEqual(refused.returncode, 0, output)
        status = Listener('/after/status', MappingStatus)  # the manager is alive and takes the next one
        good = load('after')
        status.wait_for(lambda m: True, 'a status after the refusal')
        stop(good)

    def test_the_node_says_what_is_wrong(self):
        rospy.set_param('/wrong/resolutoin', 0.1)
        rospy.set_param('/wrong/free_space/mode', 'liner')
        node = subprocess.run([program('mapping_node'), '__name:=wrong'], capture_output=True, text=True,
                              timeout=30, check=False)
        self.assertEqual(node.returncode, 1)
        self.assertIn("'resolutoin' is unknown; did you mean 'resolution'?", node.stdout + node.stderr)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'lifecycle', Lifecycle)
