#!/usr/bin/env python3
"""A drive of 200 scans at 10 Hz, simulated or along a real trajectory, whose poses are corrected on the way: the node's map is, to
the bit, that of the corrected poses."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import rospy
import rostest

FOLDER = pathlib.Path(__file__).resolve().parent
SOURCE = FOLDER.parent.parent
sys.path.insert(0, str(FOLDER))
from harness import program  # noqa: E402

SCANS = 200
FIRST_LOOP = 1300  # of kitti_00
RADIUS = 30.0  # of the way [m]; it closes after 188 scans
DRIFT = 3e-4  # of the odometry to the left [rad/m]


def write(path, poses):
    np.savetxt(path, poses[:, :3].reshape(-1, 12))


def pose(x, y, yaw):
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:2, 3] = x, y
    return T


class LiveCorrections(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('live_corrections_rostest')

    def prove(self, truth, odometry, corrected, calib):
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run(
                [sys.executable, str(SOURCE / 'scripts/prove_corrections'), '--truth', truth, '--odometry', odometry,
                 '--corrected', corrected, '--calib', calib, '--scans', str(SCANS), '--updates', '2', '--beams', '16', '--columns',
                 '360', '--live', '10', '--only-live', '--folder', folder, '--programs', str(pathlib.Path(program('mapping_node')).parent)],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=180)
        print(result.stdout)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn(f'{SCANS} of {SCANS} clouds mapped', result.stdout)
        self.assertRegex(result.stdout, r'correction at scan 199: [1-9]\d* scans to move')
        self.assertRegex(result.stdout, r'\n0 of [1-9]\d* tiles differ')

    def test_corrections(self):
        if rospy.get_param('~real', False):
            data = pathlib.Path(os.environ['BKI_MAPPING_TEST_DATA'])
            with tempfile.TemporaryDirectory() as folder:  # where the first loop closes
                files = [pathlib.Path(folder) / name for name in ('truth', 'odometry', 'loop_closed')]
                for file in files:
                    rows = (data / f'trajectories/kitti_00_{file.name}.txt').read_text().splitlines()
                    file.write_text('\n'.join(rows[FIRST_LOOP:FIRST_LOOP + SCANS]) + '\n')
                return self.prove(*files, data / 'semantickitti/sequences/00/calib.txt')
        way = np.arange(SCANS, dtype=float)
        truth = np.array([pose(RADIUS * np.sin(s / RADIUS), RADIUS * (1 - np.cos(s / RADIUS)), s / RADIUS) for s in way])
        odometry = [truth[0]]
        for step in np.linalg.inv(truth[:-1]) @ truth[1:] @ pose(0, 0, DRIFT):
            odometry.append(odometry[-1] @ step)
        with tempfile.TemporaryDirectory() as folder:
            files = [pathlib.Path(folder) / name for name in ('truth', 'odometry', 'calib')]
            write(files[0], truth)
            write(files[1], np.array(odometry))
            files[2].write_text('Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n')
            self.prove(files[0], files[1], files[0], files[2])


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'live_corrections', LiveCorrections)
