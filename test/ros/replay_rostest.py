#!/usr/bin/env python3
"""A simulated drive played by play_sequence, and the same drive replayed from a bag, give the same bytes as
map_sequence and map_bag, through the launch files that users start, with paths relative to the shell. What cannot be
played ends the launch."""
import contextlib
import math
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import numpy
import rosbag
import roslib.packages
import rospy
import rostest
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField
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

    def map_of_launch(self, *launch, scans=SCANS, name='map.ply'):
        """The file of the map after a launch in the drive's folder; HOME is that folder, PWD is not."""
        status = Listener('/mapping/status', MappingStatus)
        server = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', *launch, 'rviz:=false'], cwd=self.folder,
                                  env={**os.environ, 'HOME': self.folder, 'PWD': '/'})
        try:
            status.wait_for(lambda m: m.integrated == scans, f'mapping {scans} scans with {launch[0]}')
            path = os.path.join(self.folder, name)
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
            read = self.path('read.ply')
            run('map_bag', bag, '--cloud-topic', '/velodyne_points', '--config', PRESET, '--include', 'occupied,free',
                '--output', read)
            with open(read, 'rb') as file:
                self.assertTrue(file.read() == replayed, 'the map of map_bag differs')

    def write_spinning_bag(self):
        """A bag of a lidar on a vehicle in a curve: each point has a time, some are not finite, transforms come late and in
        between, and the first cloud is older than all of them."""
        path = self.path('spinning.bag')

        def pose(stamp, parent, child, x=0.0, y=0.0, z=0.0, yaw=0.0):
            made = TransformStamped()
            made.header.frame_id, made.child_frame_id, made.header.stamp = parent, child, rospy.Time.from_sec(stamp)
            made.transform.translation.x, made.transform.translation.y, made.transform.translation.z = x, y, z
            made.transform.rotation.z, made.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            return TFMessage([made])
        messages = [('/tf_static', pose(0.0, 'base', 'velodyne', 0.3, 0.1, 1.7, 0.2), 1000.0)]
        for n in range(50):
            stamp = 1000.07 + 0.019 * n
            messages.append(('/tf', pose(stamp, 'city', 'base', 3.0 * 0.019 * n, 0.001 * n * n, 0.0, 0.01 * n), stamp + 0.06))
        with rosbag.Bag(self.bag) as bag:
            clouds = [cloud for _, cloud, _ in bag.read_messages(['/velodyne_points'])]
        for n, cloud in enumerate(clouds):
            stamp = 1000.0 + 0.1 * n
            rows = numpy.frombuffer(cloud.data, 'u1').reshape(-1, cloud.point_step)
            times = numpy.linspace(0.0, 0.09, len(rows), dtype='<f4')
            rows = numpy.concatenate([rows, times.view('u1').reshape(-1, 4)], 1)
            rows[n::97, :4] = numpy.array([numpy.nan], '<f4').view('u1')
            cloud.fields.append(PointField('t', cloud.point_step, PointField.FLOAT32, 1))
            cloud.point_step += 4
            cloud.row_step, cloud.data = cloud.width * cloud.point_step, rows.tobytes()
            cloud.header.stamp = rospy.Time.from_sec(stamp)
            messages.append(('/points', cloud, stamp + 0.1))
        with rosbag.Bag(path, 'w') as bag:
            for topic, message, stamp in sorted(messages, key=lambda each: each[2]):
                bag.write(topic, message, rospy.Time.from_sec(stamp))
        return path

    def test_map_bag_makes_the_map_of_the_node(self):
        def tiles(path):
            with contextlib.closing(sqlite3.connect(path)) as database:
                return sorted(database.execute('SELECT z, y, x, content FROM tile WHERE part = 0'))
        bag = self.write_spinning_bag()
        for extra in ('', 'time_field: t\n'):
            config = self.path('spinning.yaml')
            with open(PRESET) as preset, open(config, 'w') as file:
                file.write(preset.read() + extra)
            self.map_of_launch('replay.launch', f'bag:={bag}', 'rate:=0.5', 'cloud_topic:=/points', 'frame_id:=city',
                               f'config:={config}', scans=SCANS - 1, name='of_node.bkm')
            ours = self.path('of_bag.bkm')
            result = subprocess.run([program('map_bag'), bag, '--cloud-topic', '/points', '--frame', 'city', '--config', config,
                                     '--output', ours], check=True, timeout=60, capture_output=True, text=True)
            self.assertIn(f'Mapped {SCANS - 1} of {SCANS} clouds; dropped: 1 too old; used', result.stdout)
            self.assertGreater(len(tiles(ours)), 5)
            self.assertEqual('time_field' in extra, 'Times of points of /points are read' in result.stderr)
            self.assertTrue(tiles(ours) == tiles(self.path('of_node.bkm')), f'the maps differ with {extra or "no times"}')

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
