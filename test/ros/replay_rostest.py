#!/usr/bin/env python3
"""A simulated drive played by play_sequence, and the same drive replayed from a bag, give the same bytes as
map_sequence, through the launch files that users start, with paths relative to the shell. What cannot be played ends
the launch."""
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import rosbag
import roslib.packages
import rospy
import rostest
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import TIMEOUT, Listener, program, wait_until  # noqa: E402

SCANS = 6
PACKAGE = roslib.packages.get_pkg_dir('bki_mapping')
PRESET = os.path.join(PACKAGE, 'config/presets/robot.yaml')  # default of the launch files


def run(name, *arguments):
    subprocess.run([program(name), *arguments], check=True, timeout=60)


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('replay_rostest')
        cls.folder = tempfile.mkdtemp()
        cls.drive = os.path.join(cls.folder, 'drive')
        run('simulate_drive', '--output', cls.drive, '--scans', str(SCANS), '--beams', '32', '--columns', '900')
        cls.bag = os.path.join(cls.folder, 'my drive.bag')
        run('sequence_to_bag', '--sequence', cls.drive, '--output', cls.bag)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def expected_map(self, *options):
        path = os.path.join(self.folder, 'expected.ply')
        run('map_sequence', '--sequence', self.drive, '--include', 'occupied,free', '--output', path, *options)
        with open(path, 'rb') as file:
            return file.read()

    def map_of_launch(self, *launch):
        """The map after a launch in the drive's folder; HOME is that folder, PWD is not."""
        status = Listener('/mapping/status', MappingStatus)
        server = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', *launch, 'rviz:=false'], cwd=self.folder,
                                  env={**os.environ, 'HOME': self.folder, 'PWD': '/'})
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
            played = self.map_of_launch('semantic_kitti.launch', f'sequence:={self.drive}', 'rate:=0', f'mode:={mode}',
                                        f'nodelet:={nodelet}')
            expected = self.expected_map('--config', PRESET, '--set', f'free_space/mode={mode}')
            self.assertTrue(played == expected, f'the maps of mode {mode} differ')

    def test_bag(self):
        for compression in ('none', 'lz4'):
            bag = os.path.join(self.folder, f'{compression}.bag')
            run('sequence_to_bag', '--sequence', self.drive, '--output', bag, '--compression', compression)
            replayed = self.map_of_launch('replay.launch', f'bag:={bag}', 'rate:=0.5')
            self.assertTrue(replayed == self.expected_map('--config', PRESET), 'the maps differ')

    def test_paths_are_those_of_the_shell(self):
        shutil.copy(os.path.join(PACKAGE, 'config/presets/paper_line.yaml'), os.path.join(self.folder, 'lines.yaml'))
        shutil.copy(os.path.join(PACKAGE, 'config/classes/occupancy.yaml'), os.path.join(self.folder, 'one class.yaml'))
        relative = ('config:=lines.yaml', 'classes:=one class.yaml')
        home = ('config:=~/lines.yaml', 'classes:=~/one class.yaml')
        expected = self.expected_map('--config', os.path.join(self.folder, 'lines.yaml'), '--classes',
                                     os.path.join(self.folder, 'one class.yaml'))
        for launch in (('replay.launch', 'bag:=my drive.bag', 'rate:=0.5', *relative),
                       ('replay.launch', 'bag:=~/my drive.bag', 'rate:=0.5', *home),
                       ('semantic_kitti.launch', 'sequence:=drive', 'rate:=0', *relative),
                       ('semantic_kitti.launch', 'sequence:=~/drive', 'rate:=0', *home),
                       ('demo.launch', 'sequence:=drive/../drive', *relative)):
            self.assertTrue(self.map_of_launch(*launch) == expected, launch)

    def ends(self, words, *launch):
        """What cannot be played ends the launch with one line."""
        server = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', *launch, 'rviz:=false'], cwd=self.folder,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            printed = server.communicate(timeout=TIMEOUT)[0]
        finally:
            server.terminate()
            server.wait(30)
        self.assertEqual(sum(words in line for line in printed.splitlines()), 1, printed)

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_what_cannot_be_played_ends_the_launch(self):
        self.ends(f"bag '{self.path('missing.bag')}' cannot be read (No such file or directory); check bag:=FILE",
                  'replay.launch', 'bag:=missing.bag')
        self.ends(f"bag '{self.drive}' cannot be read (Is a directory); check bag:=FILE", 'replay.launch', 'bag:=drive')
        with open(self.path('text.bag'), 'w') as file:
            file.write('no bag\n')
        self.ends(f"bag '{self.path('text.bag')}' cannot be read (", 'replay.launch', 'bag:=text.bag')
        with open(self.bag, 'rb') as whole, open(self.path('cut.bag'), 'wb') as file:
            file.write(whole.read(100000))
        self.ends(f"bag '{self.path('cut.bag')}' has no index because its recording was interrupted; run: rosbag "
                  'reindex ', 'replay.launch', 'bag:=cut.bag')
        self.ends(f"bag '{self.bag}' has no clouds on /points; it has some on: /velodyne_points; choose with "
                  'cloud_topic:=TOPIC', 'replay.launch', 'bag:=my drive.bag', 'cloud_topic:=/points')
        with rosbag.Bag(self.path('empty.bag'), 'w'):
            pass
        self.ends(f"bag '{self.path('empty.bag')}' has no clouds (sensor_msgs/PointCloud2); record some",
                  'replay.launch', 'bag:=empty.bag')
        self.ends(f"{self.path('none/velodyne')} is not a folder; give the folder of a sequence", 'semantic_kitti.launch',
                  'sequence:=none')
        self.ends(f"{self.path('none/velodyne')} is not a folder; give the folder of a sequence", 'demo.launch',
                  'sequence:=none')
        self.ends(f"{self.path('drive/predictions')} is not a folder; name one with labels", 'semantic_kitti.launch',
                  'sequence:=drive', 'labels:=predictions')

    def test_a_mapper_that_does_not_start_ends_the_launch(self):
        for nodelet in ('true', 'false'):
            self.ends("did you mean 'line'?", 'semantic_kitti.launch', 'sequence:=drive', 'mode:=liner',
                      f'nodelet:={nodelet}')
        self.ends("did you mean 'toy'?", 'replay.launch', 'bag:=my drive.bag', 'classes:=tooy')
        self.ends(f"'{self.path('none.yaml')}' is neither a file nor one of", 'replay.launch', 'bag:=my drive.bag',
                  'classes:=./none.yaml')
        self.ends(f"'{self.path('none.yaml')}' is neither a file nor one of", 'semantic_kitti.launch', 'sequence:=drive',
                  'config:=none.yaml')
        self.ends("did you mean 'robot'?", 'replay.launch', 'bag:=my drive.bag', 'config:=robott')

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
        def limit():  # simulates a full disk
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
