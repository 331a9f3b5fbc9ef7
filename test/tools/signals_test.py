#!/usr/bin/env python3
"""Signals to programs that map: the first ends them at a good place, the second at once."""
import errno
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import unittest

from programs import BIN, TIMEOUT, ProgramTest, read_bytes, read_json, rows, tiles_of

SCANS = 3000  # the progress of so many is more than a terminal buffers, so that a program waits until its output is read


class Program:
    """A program whose standard error is a terminal, on which it shows its progress."""
    def __init__(self, *command, ignored=()):
        def dispositions():
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.SIG_IGN if number in ignored else signal.SIG_DFL)
        self.terminal, end = pty.openpty()
        self.process = subprocess.Popen([os.path.join(BIN, command[0]), *command[1:]], stdout=subprocess.PIPE, stderr=end,
                                        universal_newlines=True, preexec_fn=dispositions)
        os.close(end)
        self.said = ''

    def read(self):
        """Adds what the program says next. Returns False at the end."""
        if not select.select([self.terminal], [], [], TIMEOUT)[0]:
            raise AssertionError('nothing was said for too long after: ' + self.said)
        try:
            self.said += os.read(self.terminal, 1000).decode()
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return False
        return True

    def wait_for(self, pattern):
        """Returns the match; a program may say a line in several parts."""
        while not re.search(pattern, self.said):
            if not self.read():
                raise AssertionError(f'{pattern} was never said: {self.said}')
        return re.search(pattern, self.said)

    def end(self):
        """Returns the exit status and what the program said at last."""
        while self.read():
            pass
        os.close(self.terminal)
        self.process.communicate(timeout=TIMEOUT)
        return self.process.returncode, self.said.replace('\r', '\n').strip().splitlines()[-1]


class Signals(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drive, cls.long = cls.path('drive'), cls.path('long')
        cls.succeeds('simulate_drive', '--output', cls.drive, '--scans', '2', '--beams', '16', '--columns', '200')
        for kind, ending in (('velodyne', 'bin'), ('labels', 'label')):
            os.makedirs(os.path.join(cls.long, kind))
            for n in range(SCANS):
                os.link(os.path.join(cls.drive, kind, f'{n % 2:06d}.{ending}'), os.path.join(cls.long, kind, f'{n:06d}.{ending}'))
        shutil.copy(os.path.join(cls.drive, 'calib.txt'), cls.long)
        with open(os.path.join(cls.long, 'poses.txt'), 'w') as file:
            file.writelines(f'1 0 0 {0.01 * n} 0 1 0 0 0 0 1 0\n' for n in range(SCANS))

    def test_mapping_ends_after_the_scan_at_hand(self):
        out, report, points, part = (self.path(name) for name in ('out.bkm', 'report.json', 'points.pcd', 'part.bkm'))
        for number in (signal.SIGINT, signal.SIGTERM):
            program = Program('map_sequence', '--sequence', self.long, '--output', out, '--report', report, '--points', points)
            program.wait_for(f'2/{SCANS} ')
            program.process.send_signal(number)
            status, last = program.end()
            self.assertEqual(status, 130)
            said = re.fullmatch(rf'map_sequence: stopped after scan (\d+), (\d+) of {SCANS} scans; '
                                rf'to map the rest, say --first (\d+) --resume {re.escape(out)}', last)
            self.assertTrue(said, last)
            scan, count, following = map(int, said.groups())
            self.assertEqual((scan + 1, following), (count, count))
            self.assertGreaterEqual(count, 2)
            self.assertIn('another signal ends the program at once', program.said)
            self.assertEqual(rows(out, 'SELECT id, scans FROM drive'), [(f'long/000000-{scan:06d}', count)])
            self.assertEqual(len(read_json(report)['scans']), count)
            self.assertRegex(read_bytes(points)[:400], rb'\nPOINTS 0*[1-9]')
            self.succeeds('map_sequence', '--sequence', self.long, '--scans', str(count), '--output', part)
            self.assertEqual(tiles_of(out), tiles_of(part), 'the map is that of the scans so far')
        self.succeeds('map_sequence', '--sequence', self.long, '--first', str(following), '--scans', '2', '--resume', out, '--output', out)
        self.assertEqual(sum(scans for _, scans in rows(out, 'SELECT id, scans FROM drive')), count + 2)

    def test_a_part_of_a_named_drive_has_its_own_name(self):
        out = self.path('named.bkm')
        for drive in ('monday', f'monday/000000-{SCANS - 1:06d}'):
            program = Program('map_sequence', '--sequence', self.long, '--output', out, '--drive', drive)
            program.wait_for(f'2/{SCANS} ')
            program.process.send_signal(signal.SIGINT)
            status, last = program.end()
            self.assertEqual(status, 130)
            said = re.search(r'stopped after scan (\d+), .* say --first (\d+) --resume \S+ --drive (\S+)$', last)
            self.assertTrue(said, last)
            self.assertEqual(said.group(3), f'monday/{int(said.group(2)):06d}-{SCANS - 1:06d}')
            self.assertEqual(rows(out, 'SELECT id FROM drive'), [(f'monday/000000-{said.group(1)}',)])

    def test_evaluation_ends_after_the_scan_at_hand(self):
        figures, whole = self.path('figures.json'), self.path('whole.json')
        program = Program('evaluate_map', '--sequence', self.long, '--json', figures)
        program.wait_for(f'8/{SCANS} ')
        program.process.send_signal(signal.SIGINT)
        status, last = program.end()
        self.assertEqual(status, 130)
        said = re.fullmatch(rf'evaluate_map: stopped after scan (\d+); all figures are of the first (\d+) of {SCANS} scans', last)
        self.assertTrue(said, last)
        self.succeeds('evaluate_map', '--sequence', self.long, '--scans', said.group(2), '--json', whole)
        stopped, complete = read_json(figures), read_json(whole)
        for each in (stopped, complete):
            for time in ('median_ms', 'processor_ms', 'yardstick_ms', 'yardstick_processor_ms'):
                each.pop(time)
        self.assertEqual(stopped, complete)

    def test_a_merge_ends_and_leaves_the_file_as_it_was(self):
        maps = [self.path(f'{n}.bkm') for n in range(2)]
        fine = self.path('fine')
        self.succeeds('simulate_drive', '--output', fine, '--scans', '2', '--beams', '32', '--columns', '600')
        for n, path in enumerate(maps):
            self.succeeds('map_sequence', '--sequence', fine, '--first', str(n), '--scans', '1', '--set', 'free_space/mode=none',
                          '--set', 'resolution=0.015', '--set', 'kernel/length=0.015', '--output', path)
        output = self.path('merged.bkm')
        with open(output, 'w') as file:
            file.write('good')
        before = sorted(os.listdir(self.folder))
        program = Program('merge_maps', *maps, '--output', output)
        all_tiles = int(program.wait_for(r' 1/(\d+) ').group(1))
        self.assertGreater(all_tiles * 50, 1 << 16, 'more progress than a terminal buffers')
        program.process.send_signal(signal.SIGINT)
        status, last = program.end()
        self.assertEqual(status, 130)
        self.assertRegex(last, rf'merge_maps: stopped after \d+ of {all_tiles} tiles; {re.escape(output)} is as it was')
        self.assertEqual(read_bytes(output), b'good')
        self.assertEqual(sorted(os.listdir(self.folder)), before)

    def waiting(self, *more):
        """A run that waits for its calibration; and the file to write it to."""
        calibration = os.path.join(self.drive, 'calib.txt')
        kept = self.path('calib.txt')
        os.rename(calibration, kept)
        self.addCleanup(os.rename, kept, calibration)
        os.mkfifo(calibration)
        program = Program('map_sequence', '--sequence', self.drive, '--poses-in', 'camera', *more)
        return program, open(calibration, 'w')  # which waits until the program reads it

    def test_the_second_signal_ends_at_once(self):
        output = self.path('good.bkm')
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', output)
        before = tiles_of(output)
        for first, second in ((signal.SIGINT, signal.SIGINT), (signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT)):
            with self.subTest(first=first, second=second):
                program, calibration = self.waiting('--output', output)
                program.process.send_signal(first)
                program.wait_for('another signal ends the program at once')
                self.assertIsNone(program.process.poll())
                program.process.send_signal(second)
                self.assertEqual(program.end()[0], -second)
                calibration.close()
                self.doCleanups()
        self.assertEqual(tiles_of(output), before)

    def test_without_a_scan_nothing_is_written(self):
        output = self.path('nothing.bkm')
        program, calibration = self.waiting('--output', output)
        program.process.send_signal(signal.SIGTERM)
        program.wait_for('another signal')
        with calibration:
            calibration.write('Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n')
        self.assertEqual(program.end(), (130, 'map_sequence: stopped before the first scan; nothing was written'))
        self.assertFalse(os.path.exists(output))

    def test_ignored_signals_stay_ignored(self):
        program = Program('map_sequence', '--sequence', self.long, ignored={signal.SIGINT})
        program.wait_for(f'2/{SCANS} ')
        program.process.send_signal(signal.SIGINT)  # were it noted, the next one would end the program at once
        program.process.send_signal(signal.SIGTERM)
        self.assertEqual(program.end()[0], 130)


if __name__ == '__main__':
    unittest.main()
