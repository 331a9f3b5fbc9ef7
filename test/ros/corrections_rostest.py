#!/usr/bin/env python3
"""Corrected poses: the node's map is, to the bit, that of a node whose poses were right from the start."""
import contextlib
import os
import random
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.join(FOLDER, '../../scripts')]
from harness import CAR, ROAD, TIMEOUT, Listener, Robot, program, wait_until  # noqa: E402
from read_map import read_planes  # noqa: E402

SCANS = 20
DRIFT = 0.15625  # to the left [m a scan]; a multiple of 2^-20, to which poses are rounded


def true_place(n):
    return (1.0 * n, 0.0, 0.0)


def drifted_place(n):
    return (1.0 * n, DRIFT * n, 0.0)


def scan_at(n):
    """What the sensor sees of a street from its true place: walls on both sides, and the road."""
    rand = random.Random(n)
    points, labels = [], []
    for _ in range(300):
        x = rand.uniform(-15.0, 15.0)
        where = rand.randrange(3)
        points.append((x, (-6.0, 6.0, rand.uniform(-5.0, 5.0))[where], rand.uniform(-1.0, 3.0) if where < 2 else -1.7))
        labels.append(ROAD if where == 2 else CAR)
    return points, labels


def content(path):
    """The evidence in a map file, plane by plane."""
    return {(block, label): plane.tobytes() for block, label, plane in read_planes(path)}


def places_of_scans(path):
    """Where the scans in the journal of a map file are, and the names of their sensors."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        rows = database.execute('SELECT pose, sensor FROM scan ORDER BY number').fetchall()
    return [struct.unpack('<12d', pose)[3::4] for pose, _ in rows], {sensor for _, sensor in rows}


class Mapper:
    """A mapping node with parameters, and a robot."""

    def __init__(self, test, name, **parameters):
        self.name = name
        defaults = {'config': 'robot', 'resolution': 0.4, 'journal': True, 'correction/tolerance': 0.0,
                    'tf_timeout': 10.0}
        for parameter, value in {**defaults, **parameters}.items():
            rospy.set_param(f'/{name}/{parameter}', value)
        self.status = Listener(f'/{name}/status', MappingStatus)
        self.path = rospy.Publisher(f'/{name}_path', Path, queue_size=10)
        self.robot = Robot(f'/{name}_cloud', frame=f'{name}_sensor')
        # Transforms of its own, so that connect() waits for this mapper and not for another one.
        self.robot.poses = rospy.Publisher(f'/{name}_tf', TFMessage, queue_size=100)
        self.folder = tempfile.mkdtemp()
        self.node = subprocess.Popen([program('mapping_node'), f'__name:={name}', f'cloud_in:=/{name}_cloud',
                                      f'corrected_path:=/{name}_path', f'/tf:=/{name}_tf'],
                                     start_new_session=True)  # where the scheduler groups sessions, as roslaunch does
        test.addCleanup(self.end)
        self.robot.connect()

    def end(self):
        self.node.kill()
        self.node.wait(TIMEOUT)
        self.status.close()
        shutil.rmtree(self.folder)

    def map(self, scans, place):
        for n in scans:
            self.robot.seconds = 100 + n
            points, labels = scan_at(n)
            stamp = self.robot.scan(points, labels, position=place(n))
            status = self.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')
            if not status.integrated_last:
                raise AssertionError(status)

    def correct(self, scans, place, frame='map'):
        wait_until(lambda: self.path.get_num_connections() > 0, 'the mapper subscribing to paths')
        path = Path()
        path.header.frame_id = frame
        for n in scans:
            pose = PoseStamped()
            pose.header.stamp = rospy.Time(101 + n)
            pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = place(n)
            pose.pose.orientation.w = 1.0
            path.poses.append(pose)
        self.path.publish(path)

    def wait_for(self, condition, what):
        """Asks for statuses, which come once a scan and now and then, until one fulfils the condition."""
        return self.status.wait_for(condition, what)

    def content(self):
        path = os.path.join(self.folder, 'map.bkm')
        rospy.wait_for_service(f'/{self.name}/save_map', TIMEOUT)
        answer = rospy.ServiceProxy(f'/{self.name}/save_map', SaveMap)(path, '')
        if not answer.success:
            raise AssertionError(answer.message)
        return content(path)


class Corrections(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('corrections_rostest')

    def test_the_map_is_that_of_the_corrected_poses(self):
        right = Mapper(self, 'right')
        right.map(range(SCANS), true_place)
        wrong = Mapper(self, 'wrong')
        wrong.map(range(SCANS), drifted_place)
        self.assertNotEqual(wrong.content(), right.content())
        # Every fifth pose: the drift is even, so that scans between them move to where they belong, too.
        wrong.correct([*range(0, SCANS, 5), SCANS - 1], true_place)
        status = wrong.wait_for(lambda m: m.corrections == 1 and m.correction_done, 'the correction')
        self.assertEqual(status.journal_scans, SCANS)
        self.assertGreater(status.journal_bytes, 1000)
        self.assertEqual(status.correction_moved, SCANS - 1, 'the first scan is right')
        self.assertEqual((status.correction_to_go, status.correction_failed), (0, 0))
        self.assertAlmostEqual(status.correction_largest_move, DRIFT * (SCANS - 1), places=4)
        self.assertEqual(wrong.content(), right.content())

    def test_scans_that_come_during_and_after_a_correction_are_in_the_map_as_well(self):
        right = Mapper(self, 'right_later')
        right.map(range(SCANS), true_place)
        wrong = Mapper(self, 'wrong_later')
        wrong.map(range(SCANS // 2), drifted_place)
        wrong.correct(range(SCANS // 2), true_place)
        wrong.wait_for(lambda m: m.corrections == 1, 'using the path')
        wrong.map(range(SCANS // 2, SCANS), true_place)
        wrong.wait_for(lambda m: m.integrated == SCANS and m.corrections == 1 and m.correction_done, 'the correction')
        self.assertEqual(wrong.content(), right.content())

    def test_a_file_with_a_window_follows_as_well(self):
        right = Mapper(self, 'right_kept')
        right.map(range(SCANS), true_place)
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        wrong = Mapper(self, 'wrong_kept', window=25.0, map_file=os.path.join(folder, 'kept.bkm'))
        wrong.map(range(SCANS), drifted_place)
        wrong.correct(range(SCANS), true_place)
        wrong.wait_for(lambda m: m.corrections == 1 and m.correction_done, 'the correction')
        wanted = right.content()
        self.assertEqual(wrong.content(), wanted)
        # The file holds the scans at the poses of the path, and so does the copy.
        wrong.node.send_signal(signal.SIGINT)
        self.assertEqual(wrong.node.wait(TIMEOUT), 0)
        for path in (os.path.join(folder, 'kept.bkm'), os.path.join(wrong.folder, 'map.bkm')):
            self.assertEqual(content(path), wanted)
            places, sensors = places_of_scans(path)
            self.assertEqual(places, [true_place(n) for n in range(SCANS)])
            self.assertEqual(sensors, {'wrong_kept_sensor'})

    def test_a_file_whose_node_is_killed_holds_whole_scans(self):
        """Killed while scans move, after a save: each scan is at the pose of its row."""
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        path = os.path.join(folder, 'killed.bkm')
        killed = Mapper(self, 'killed_kept', window=25.0, map_file=path, save_period=0.05)
        killed.map(range(SCANS), drifted_place)
        killed.correct(range(SCANS), true_place)
        killed.wait_for(lambda m: m.corrections == 1, 'using the path')
        killed.node.kill()
        killed.node.wait(TIMEOUT)
        places, _ = places_of_scans(path)
        again = Mapper(self, 'again')
        for n, place in enumerate(places):
            again.map([n], lambda _, place=place: place)
        self.assertEqual(content(path), again.content())

    def test_scans_that_are_forgotten_stay(self):
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        path = os.path.join(folder, 'forgotten.bkm')
        mapper = Mapper(self, 'forgetful', map_file=path, save_period=0.05)
        mapper.map(range(5), drifted_place)
        answer = rospy.ServiceProxy('/forgetful/forget_journal', Trigger)()
        self.assertEqual((answer.success, answer.message), (True, '5 scans forgotten, which stay where they are'))
        before = mapper.content()
        mapper.map(range(5, 8), true_place)
        mapper.correct(range(8), lambda n: (1.0 * n, 1.0, 0.0))
        mapper.wait_for(lambda m: m.corrections == 1 and m.correction_done and m.correction_moved == 3, 'moving the others')
        after = mapper.content()
        self.assertTrue(all(key in after for key in before))
        mapper.node.send_signal(signal.SIGINT)
        self.assertEqual(mapper.node.wait(TIMEOUT), 0)
        self.assertEqual(places_of_scans(path)[0], [(1.0 * n, 1.0, 0.0) for n in range(5, 8)])
        self.assertEqual(content(path), after)

    def test_paths_of_no_use_change_nothing_and_are_said(self):
        mapper = Mapper(self, 'refusing')
        mapper.map(range(3), true_place)
        before = mapper.content()
        mapper.correct(range(3), drifted_place, frame='odom')
        status = mapper.wait_for(lambda m: m.corrections_refused == 1, 'refusing the frame')
        self.assertIn("its frame 'odom' is not the map frame 'map'", status.last_correction_refusal)
        mapper.correct(range(100, 103), true_place)
        status = mapper.wait_for(lambda m: m.corrections_refused == 2, 'refusing poses of other times')
        self.assertIn('no pose lies among the scans that are kept', status.last_correction_refusal)
        mapper.correct(range(3), lambda n: (float('nan'), 0.0, 0.0))
        status = mapper.wait_for(lambda m: m.corrections_refused == 3, 'refusing the pose')
        self.assertIn('is not finite', status.last_correction_refusal)
        self.assertEqual(status.corrections, 0)
        self.assertEqual(mapper.content(), before)
        rospy.ServiceProxy('/refusing/reset', Empty)()
        mapper.wait_for(lambda m: m.journal_scans == 0 and m.integrated == 3, 'forgetting the scans')

    def test_a_jump_of_tf_moves_no_scan_that_is_right(self):
        mapper = Mapper(self, 'jumping')
        right = Mapper(self, 'right_from_start')
        right.map(range(SCANS), true_place)
        mapper.map(range(SCANS // 2), lambda n: (1.0 * n, 3.0, 0.0))
        mapper.map(range(SCANS // 2, SCANS), true_place)  # tf has jumped by 3 m
        mapper.wait_for(lambda m: m.tf_jumps == 1, 'noticing the jump')
        mapper.correct(range(0, SCANS // 2, 3), true_place)
        mapper.wait_for(lambda m: m.corrections == 1 and m.correction_done, 'the correction')
        self.assertEqual(mapper.content(), right.content())

    def test_a_window_without_a_file_is_refused(self):
        for parameter, value in {'journal': True, 'window': 20.0}.items():
            rospy.set_param(f'/windowed/{parameter}', value)
        node = subprocess.run([program('mapping_node'), '__name:=windowed'], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT)
        self.assertNotEqual(node.returncode, 0)
        self.assertIn('set map_file, which keeps it, or window to 0', node.stdout)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'corrections', Corrections)
