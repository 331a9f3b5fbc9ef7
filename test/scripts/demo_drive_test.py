#!/usr/bin/env python3
"""scripts/demo_drive.py simulates a drive once, and leaves alone what is there. ROS is replaced: the programs are found by a
module roslib of this test, and play_sequence only prints its arguments."""
import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'scripts/demo_drive.py')
FIND_NODE = '''
import os
def find_node(package, program):
    path = os.path.join(os.environ['PROGRAMS'], program)
    return [path] if os.path.exists(path) else []
'''


class DemoDrive(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for name in ('roslib', 'programs', 'ros', 'home'):
            (self.root / name).mkdir()
        (self.root / 'roslib/__init__.py').touch()
        (self.root / 'roslib/packages.py').write_text(FIND_NODE)
        self.program('play_sequence', 'echo "$@"')
        self.program('simulate_drive', f'exec {os.environ["BKI_MAPPING_BIN"]}/simulate_drive --beams 4 --columns 40 "$@"')

    def program(self, name, does):
        (self.root / 'programs' / name).write_text(f'#!/bin/sh\n{does}\n')
        (self.root / 'programs' / name).chmod(0o755)

    def start(self, sequence, scans, ros_home=None):
        environment = {**os.environ, 'PYTHONPATH': str(self.root), 'PROGRAMS': str(self.root / 'programs'),
                       'HOME': str(self.root / 'home'), 'ROS_HOME': str(self.root / 'ros') if ros_home is None else ros_home}
        return subprocess.Popen(['/usr/bin/python3', SCRIPT, sequence, str(scans)], env=environment, cwd=self.root,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def drive(self, process):
        """The folder that play_sequence is given."""
        printed, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        self.assertTrue(printed.startswith('--check --sequence '), printed)
        return pathlib.Path(printed.split()[-1])

    def refuses(self, words, *arguments):
        process = self.start(*arguments)
        errors = process.communicate(timeout=60)[1]
        self.assertEqual((process.returncode, errors.count('\n')), (1, 1), errors)
        self.assertIn(words, errors)

    def scans(self, drive):
        return sorted(path.name for path in (drive / 'velodyne').iterdir())

    def test_a_drive_is_simulated_once(self):
        drives = self.root / 'ros/bki_mapping_demo'
        drives.mkdir()
        (drives / 'note').touch()
        first = self.drive(self.start('', 2))
        self.assertEqual((first, self.scans(first)), (drives / '2_scans', ['000000.bin', '000001.bin']))
        written = (first / 'times.txt').stat().st_mtime_ns
        other = self.drive(self.start('', 1))
        self.assertEqual((other, self.scans(other)), (drives / '1_scans', ['000000.bin']))
        self.assertEqual(self.drive(self.start('', 2)), first)
        self.assertEqual((first / 'times.txt').stat().st_mtime_ns, written)
        self.assertEqual(sorted(drives.iterdir()), [other, first, drives / 'note'])

    def test_two_demos_at_the_same_time(self):
        both = [self.start('', 3) for _ in range(2)]
        drives = [self.drive(process) for process in both]
        self.assertEqual(drives[0], drives[1])
        self.assertEqual(len(self.scans(drives[0])), 3)
        self.assertEqual(list(drives[0].parent.iterdir()), drives[:1])

    def test_without_an_absolute_folder_of_ros(self):
        for ros_home in ('', 'ros'):
            self.assertEqual(self.drive(self.start('', 1, ros_home)), self.root / 'home/.ros/bki_mapping_demo/1_scans')
        self.assertEqual(list((self.root / 'ros').iterdir()), [])

    def test_what_is_no_simulated_drive_stays(self):
        drive = self.drive(self.start('', 2))
        for name in ('simulation.yaml', 'times.txt'):
            content = (drive / name).read_text()
            (drive / name).unlink()
            self.refuses(f'{drive} is no simulated drive of 2 scans; move it elsewhere', '', 2)
            self.assertEqual(len(self.scans(drive)), 2)
            (drive / name).write_text(content)
        self.assertEqual(self.drive(self.start('', 2)), drive)

    def test_what_cannot_be_simulated(self):
        self.refuses('--scans', '', 'many')
        (self.root / 'file').touch()
        self.refuses("the demo's drive cannot be written: ", '', 1, str(self.root / 'file'))
        (self.root / 'programs/simulate_drive').unlink()
        self.refuses('simulate_drive, which the demo needs, is not installed', '', 1)
        self.assertEqual(list((self.root / 'ros').rglob('*scans')), [])
        self.assertEqual(self.drive(self.start('mine', 1)), pathlib.Path('mine'))


if __name__ == '__main__':
    unittest.main()
