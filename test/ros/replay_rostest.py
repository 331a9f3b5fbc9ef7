#!/usr/bin/env python3
"""A simulated drive played by play_sequence, and the same drive replayed from a bag, give the map of map_sequence to
the byte: through the launch files that users start."""
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, program, wait_until  # noqa: E402

SCANS = 6


def run(name, *arguments):
    subprocess.run([program(name), *arguments], check=True, timeout=60)


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('replay_rostest')
        cls.folder = tempfile.mkdtemp()
        cls.drive = os.path.join(cls.folder, 'drive')
        run('simulate_drive', '--output', cls.drive, '--scans', str(SCANS), '--beams', '32', '--columns', '900')

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def expected_map(self, mode):
        path = os.path.join(self.folder, f'expected_{mode}.ply')
        run('map_sequence', '--sequence', self.drive, '--set', f'free_space/mode={mode}', '--include',
            'occupied,free', '--output', path)
        with open(path, 'rb') as file:
            return file.read()

    def map_of_launch(self, mode, *launch):
        status = Listener('/mapping/status', MappingStatus)
        server = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', *launch, f'mode:={mode}', 'rviz:=false'])
        try:
            status.wait_for(lambda m: m.integrated == SCANS, f'mapping {SCANS} scans with {launch[0]}')
            path = os.path.join(self.folder, 'map.ply')
            answer = rospy.ServiceProxy('/mapping/save_map', SaveMap)(path, 'occupied,free')
            self.assertTrue(answer.success, answer.message)
        finally:
            server.terminate()
            server.wait(30)
            wait_until(lambda: status.subscriber.get_num_connections() == 0, 'the launch ending')
        with open(path, 'rb') as file:
            return file.read()

    def test_play_sequence(self):
        for mode, nodelet in (('line', 'true'), ('linear', 'false')):
            played = self.map_of_launch(mode, 'semantic_kitti.launch', f'sequence:={self.drive}', 'rate:=0',
                                        f'nodelet:={nodelet}')
            self.assertTrue(played == self.expected_map(mode), f'the maps of mode {mode} differ')

    def test_bag(self):
        for compression in ('none', 'lz4'):
            bag = os.path.join(self.folder, f'{compression}.bag')
            run('sequence_to_bag', '--sequence', self.drive, '--output', bag, '--compression', compression)
            replayed = self.map_of_launch('line', 'replay.launch', f'bag:={bag}', 'rate:=0.5')
            self.assertTrue(replayed == self.expected_map('line'), 'the maps differ')

    def test_rate_0_waits_for_the_mapper_and_not_for_just_any_listener(self):
        clouds, poses = Listener('/velodyne_points', PointCloud2), Listener('/tf', TFMessage)
        status = Listener('/mapping/status', MappingStatus)
        player = subprocess.Popen([program('play_sequence'), '--sequence', self.drive, '--rate', '0',
                                   'cloud_in:=/velodyne_points'])
        try:
            for listener in (clouds, poses):
                wait_until(lambda: listener.subscriber.get_num_connections() > 0, 'the player starting')
            mapper = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', 'mapping.launch'])
            try:
                status.wait_for(lambda m: m.integrated == SCANS, f'mapping {SCANS} scans')
            finally:
                mapper.terminate()
                mapper.wait(30)
        finally:
            player.terminate()
            player.wait(30)
            for listener in (clouds, poses, status):
                wait_until(lambda: listener.subscriber.get_num_connections() == 0, 'all programs ending')
                listener.close()
        self.assertEqual(len(clouds.messages), SCANS)

    def test_programs_refuse_what_they_do_not_know(self):
        for name in ('play_sequence', 'sequence_to_bag'):
            result = subprocess.run([program(name), '--seqence', 'x'], capture_output=True, text=True, timeout=30,
                                    check=False)
            self.assertEqual(result.returncode, 1)
            self.assertIn("did you mean '--sequence'?", result.stderr)
        for arguments, words in ((('play_sequence', '--rate', '-1'), '--rate is -1, but must be at least 0'),
                                 (('play_sequence', '--rate', 'nan'), '--rate is nan, but must be at least 0'),
                                 (('play_sequence', '--scans', '0'), '--scans is 0, but must be at least 1'),
                                 (('sequence_to_bag', '--first', '-1', '--output', os.path.join(self.folder, 'x')),
                                  '--first is -1, but must be at least 0')):
            result = subprocess.run([program(arguments[0]), '--sequence', self.drive, *arguments[1:]], timeout=30,
                                    capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 1)
            self.assertIn(words, result.stderr)

    def test_a_full_disk_is_said_in_one_sentence(self):
        def limit():  # as if the disk were full
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))
        folder = os.path.join(self.folder, 'full')
        os.mkdir(folder)
        bag = os.path.join(folder, 'drive.bag')
        result = subprocess.run([program('sequence_to_bag'), '--sequence', self.drive, '--output', bag],
                                capture_output=True, text=True, timeout=60, check=False, preexec_fn=limit,
                                restore_signals=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn(bag + ' cannot be written', result.stderr)
        self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
        self.assertEqual(os.listdir(folder), [])


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'replay', Replay)
