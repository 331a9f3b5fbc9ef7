#!/usr/bin/env python3
"""Files after SIGKILL and the next start, and the answer of a mapper without write permission."""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap
from dynamic_reconfigure.client import Client

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, TIMEOUT, Listener, Robot, program  # noqa: E402

POINTS = [(0.3 * i - 30.0, 8.0 + 0.01 * i, 0.1 * (i % 20) - 1.0) for i in range(2000)]
BYTES_A_VERTEX = 3 * 4 + 3 + 2 + 1 + 6 * 4  # size of a vertex in .ply files


def complete(path):
    """Whether the number of vertices in a .ply file agrees with its header."""
    with open(path, 'rb') as file:
        content = file.read()
    header, _, vertices = content.partition(b'end_header\n')
    count = int(next(line for line in header.split(b'\n') if line.startswith(b'element vertex')).split()[2])
    return len(vertices) == count * BYTES_A_VERTEX


class Mapper:
    """A nodelet manager with the mapper, and a robot."""

    def __init__(self, test, name, command_before=()):
        self.name = name
        self.status = Listener(f'/{name}/status', MappingStatus)
        self.robot = Robot('/cloud_in')
        nodelet = program('nodelet', 'nodelet')
        self.manager = subprocess.Popen([*command_before, nodelet, 'manager', f'__name:={name}_manager'])
        self.loader = subprocess.Popen([nodelet, 'load', 'bki_mapping/MappingNodelet', f'{name}_manager',
                                        f'__name:={name}'])
        for process in (self.manager, self.loader):
            test.addCleanup(process.kill)
        self.robot.connect()
        rospy.wait_for_service(f'/{name}/save_map', TIMEOUT)

    def map(self):
        stamp = self.robot.scan(POINTS, [CAR] * len(POINTS))
        status = self.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')
        if not status.integrated_last:
            raise AssertionError(status)

    def save(self, path):
        return rospy.ServiceProxy(f'/{self.name}/save_map', SaveMap)(path, 'occupied,free')

    def end(self, number):
        self.manager.send_signal(number)
        self.manager.wait(TIMEOUT)
        self.loader.send_signal(signal.SIGINT)
        self.loader.wait(TIMEOUT)
        self.status.close()
        self.robot.clouds.unregister()
        self.robot.poses.unregister()


class Killed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('killed_rostest')

    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_next_start_works(self):
        path = os.path.join(self.folder, 'map.ply')
        rospy.set_param('/killed_mapping/free_space/mode', 'none')
        first = Mapper(self, 'killed_mapping')
        first.map()
        client = Client('/killed_mapping/reconfigure', timeout=TIMEOUT)
        self.assertEqual(client.update_configuration({'free_space_mode': 'linear'})['free_space_mode'], 'linear')
        client.close()
        saved = threading.Event()

        def save_for_ever():
            try:
                while True:
                    first.save(path)
                    saved.set()
            except (rospy.ServiceException, rospy.ROSException):
                pass

        saver = threading.Thread(target=save_for_ever)
        saver.start()
        self.assertTrue(saved.wait(TIMEOUT))
        first.end(signal.SIGKILL)
        saver.join(TIMEOUT)
        self.assertTrue(complete(path), 'a file is there whole or not at all')

        second = Mapper(self, 'killed_mapping')
        second.map()
        client = Client('/killed_mapping/reconfigure', timeout=TIMEOUT)
        self.assertEqual(client.get_configuration(TIMEOUT)['free_space_mode'], 'none', 'as the parameters say')
        client.close()
        answer = second.save(path)
        self.assertTrue(answer.success, answer.message)
        self.assertTrue(complete(path))
        self.assertEqual(os.listdir(self.folder), ['map.ply'], 'what the killed one left is gone')
        second.end(signal.SIGINT)

    def test_a_folder_that_may_not_be_written(self):
        os.chmod(self.folder, 0o555)
        self.addCleanup(os.chmod, self.folder, 0o755)
        # Root could write everywhere, so the program gives up that capability.
        limits = ['setpriv', '--bounding-set', '-dac_override,-dac_read_search'] if os.geteuid() == 0 else []
        mapper = Mapper(self, 'limited_mapping', limits)
        mapper.map()
        for name in ('map.ply', 'map.pcd'):
            path = os.path.join(self.folder, name)
            answer = mapper.save(path)
            self.assertFalse(answer.success, answer.message)
            self.assertIn(path, answer.message)
            self.assertIn('Permission denied', answer.message)
        self.assertEqual(os.listdir(self.folder), [])
        mapper.map()
        mapper.end(signal.SIGINT)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'killed', Killed)
