#!/usr/bin/env python3
"""A city made by map_city equals one run of map_sequence over all its scans, to the bit, whatever happens meanwhile."""
import contextlib
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

from harness import BIN, DRIVES, SOURCE, MadeCity, program, tiles_of

import numpy as np
import psutil
from bki_mapping.city import report, work
from bki_mapping.city.description import Bag, CityError, Drive, read_city
from bki_mapping.city.plan import has_same_poses, pieces_of, sums_of


class Made(MadeCity):
    def test_kills_change_no_bit(self):
        """Two workers are killed while they map, then all of it with the scheduler; it is continued, with another one
        killed."""
        names = list(DRIVES)
        city, drawn = self.describe(names[::-1]), random.Random(1)

        def kill_worker(process):
            """Kills a worker that runs one of the programs, with it or without."""
            end = time.monotonic() + 60
            while time.monotonic() < end and process.poll() is None:
                children = psutil.Process(process.pid).children(recursive=True)
                for found in children:
                    with contextlib.suppress(psutil.Error):
                        worker = found.parent()
                        if found.name() in ('map_sequence', 'merge_maps', 'inspect_map') and worker in children:
                            if drawn.random() < 0.5:
                                found.kill()
                            worker.kill()
                            return
                time.sleep(0.01)
            self.fail('no worker was seen at work')

        process = self.start(city, '--workers', '2')
        for _ in range(2):
            kill_worker(process)
            time.sleep(0.5)
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGKILL)
        for child in children:
            with contextlib.suppress(psutil.Error):
                child.kill()
        process.communicate()
        self.assertFalse((self.output / 'index.json').exists())
        process = self.start(city, '--workers', '2')
        self.assertIn('is not empty; continue or change the city there with --resume', self.finish(process, 1))
        process = self.start(city, '--workers', '1', '--resume')
        kill_worker(process)
        self.finish(process)
        index = self.expect_equal(names)
        self.assertEqual([drive['name'] for drive in index['drives']], names)
        self.assertEqual([path for path in self.output.rglob('.*')], [])

        # A drive that comes and goes changes only the regions that it touches.
        before = {region['file'] for region in index['regions']}
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume', '--without', 'd6'))
        index = self.expect_equal(names[:-1])
        same = before & {region['file'] for region in index['regions']}
        self.assertTrue(0 < len(same) < len(before))
        self.finish(self.start(self.describe(names[:-1]), '--workers', '2', '--no-picture', '--resume', '--add',
                               str(self.folder / 'd6')))
        self.assertEqual({region['file'] for region in self.expect_equal(names)['regions']}, before)

    def test_corrected_poses_change_what_they_touch(self):
        """Only the pieces whose poses are new are mapped again; the city is then that of a first run with these poses."""
        corrected = self.folder / 'corrected.txt'
        rows = (self.folder / 'd1/poses.txt').read_text().splitlines()
        last = [float(word) for word in rows[-1].split()]
        corrected.write_text('\n'.join([*rows[:-1], ' '.join(map(str, [*last[:3], last[3] + 1.0, *last[4:]]))]) + '\n')
        drives = [{'sequence': 'd1', 'poses': 'corrected.txt'}, {'sequence': 'd2'}, {'sequence': 'd3'}]

        def pieces():
            return {str(path.relative_to(self.output)) for path in self.output.glob('pieces/*/*.bkm')}

        self.finish(self.start(self.describe(['d1', 'd2', 'd3']), '--workers', '2', '--no-picture'))
        before = pieces()
        index = self.expect_equal(['d1', 'd2', 'd3'])
        self.finish(self.start(self.describe([], drives=drives), '--workers', '2', '--no-picture', '--resume'))
        new = pieces() - before
        self.assertEqual([path.split('/')[1] for path in new], ['d1'])
        changed = json.loads((self.output / 'index.json').read_text())
        self.assertTrue({region['file'] for region in index['regions']} & {region['file'] for region in changed['regions']})
        shutil.rmtree(self.output)
        self.finish(self.start(self.describe([], drives=drives), '--workers', '2', '--no-picture'))
        self.assertEqual(json.loads((self.output / 'index.json').read_text())['regions'], changed['regions'])
        # Stamped poses belong to scans by their times: nothing is known of single pieces.
        drive = Drive('d1', self.folder / 'd1', 'labels', corrected)
        whole = [piece.file for piece in pieces_of(read_city(self.describe(['d1'])), drive)]
        corrected.write_text('0 0 0 0 0 0 0 1\n')
        self.assertFalse({*whole} & {piece.file for piece in pieces_of(read_city(self.describe(['d1'])), drive)})

    def test_poses_that_are_replaced_while_pieces_are_mapped(self):
        """No piece is kept under the key of other poses: the city of either poses is right afterwards."""
        drive, moved = self.folder / 'replaced', self.folder / 'moved.txt'
        shutil.copytree(self.folder / 'd1', drive)
        first = (drive / 'poses.txt').read_text()
        rows = [[float(word) for word in line.split()] for line in first.splitlines()]
        moved.write_text(''.join(' '.join(map(str, [*row[:3], row[3] + 1.0, *row[4:]])) + '\n' for row in rows))
        programs = self.folder / 'replacing'
        programs.mkdir()
        for name in ('merge_maps', 'inspect_map'):
            (programs / name).symlink_to(BIN / name)
        (programs / 'map_sequence').write_text(f'#!/bin/sh\n{BIN}/map_sequence "$@" || exit\n'
                                               f'case "$*" in *--drive*replaced*) cp {moved} {drive}/poses.txt;; esac\n')
        (programs / 'map_sequence').chmod(0o755)
        city = self.describe(['replaced', 'd2'])
        pieces_before = pieces_of(read_city(city), read_city(city).drives[1])
        self.assertTrue(all(map(has_same_poses, pieces_before)))
        text = self.finish(self.start(city, '--workers', '1', '--no-picture', programs=programs), 1)
        self.assertIn(f"drive 'replaced' is left out: {drive}/poses.txt was changed after map_city had read it; "
                      'run the same command with --resume', text)
        self.assertFalse(any(map(has_same_poses, pieces_before)))
        self.expect_equal(['d2'], least=2)
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal(['replaced', 'd2'])
        (drive / 'poses.txt').write_text(first)
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal(['d1', 'd2'])
        # Stamped poses count by the time of their file.
        (drive / 'poses.txt').write_text('0 0 0 0 0 0 0 1\n')
        piece = pieces_of(read_city(city), read_city(city).drives[1])[0]
        self.assertTrue(has_same_poses(piece))
        os.utime(drive / 'poses.txt', (1, 1))
        self.assertFalse(has_same_poses(piece))

    def test_a_broken_drive_is_named_and_left_out(self):
        broken = self.folder / 'broken'
        shutil.copytree(self.folder / 'd2', broken)
        with open(broken / 'velodyne/000003.bin', 'ab') as file:
            file.write(b'x')
        city = self.describe(['d1', 'broken', 'd3', 'd1', 'missing'])
        text = self.finish(self.start(city, '--workers', '2', '--no-picture'), 1)
        self.assertRegex(text, r"drive 'broken' is left out: map_sequence: .*000003\.bin")
        self.assertRegex(text, r"drive 'missing' is left out: .*missing holds no scans")
        index = self.expect_equal(['d1', 'd3'])
        self.assertEqual(sorted(index['left_out']), ['broken', 'missing'])
        self.assertIn('| broken | map_sequence: ', (self.output / 'report.md').read_text())

    def test_a_worker_that_is_not_fit_is_named_and_no_drive_is_blamed(self):
        """A program that cannot run, or is ended from outside, ends the run with one sentence, also after the start."""
        city, host = self.describe(['d1', 'd2']), socket.gethostname()
        programs = self.folder / 'programs'
        programs.mkdir()
        for name in ('map_sequence', 'merge_maps', 'inspect_map'):
            (programs / name).symlink_to(BIN / name)

        def fails(sentence):
            text = self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume', programs=programs), 1)
            self.assertRegex(text, rf'map_city: .*{sentence}')
            self.assertIn('--resume once this is mended', text)
            self.assertNotIn('is left out', text)
            self.assertFalse((self.output / 'index.json').exists())

        def replace(name, script):
            (programs / name).unlink()
            (programs / name).write_text('#!/bin/sh\n' + script)
            (programs / name).chmod(0o755)

        at_start = f'case "$1" in --version|--print-*) exec {BIN}/map_sequence "$@";; esac\n'
        replace('map_sequence', at_start + 'echo "$0: error while loading shared libraries: libyaml-cpp.so" >&2; exit 127\n')
        fails(rf'map_sequence cannot be started on {host} .*libyaml-cpp.*; install the same version of bki_mapping there')
        replace('map_sequence', at_start + 'kill -9 $$\n')
        fails(rf'map_sequence was ended 3 times by signal 9 on {host}')
        (programs / 'map_sequence').unlink()
        (programs / 'map_sequence').symlink_to(BIN / 'map_sequence')
        replace('merge_maps', '')
        (programs / 'merge_maps').chmod(0o644)
        fails(rf'merge_maps cannot be started on {host} \(Permission denied\)')
        (programs / 'merge_maps').unlink()
        (programs / 'merge_maps').symlink_to(BIN / 'merge_maps')
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume', programs=programs))
        self.expect_equal(['d1', 'd2'])

    def test_warnings_are_said_once_each(self):
        """What programs warn of in each piece reaches the user, whatever its figures."""
        drive = self.folder / 'camera'
        shutil.copytree(self.folder / 'd1', drive)
        (drive / 'calib.txt').write_text('Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n')  # poses.txt stays that of the lidar
        for path in drive.glob('labels/*'):
            path.write_bytes(np.full(path.stat().st_size // 4, 7, '<u4').tobytes())
        text = self.finish(self.start(self.describe(['camera', 'd2']), '--workers', '2', '--no-picture'))
        label = r"warning: drive 'camera' from scan \d: 100 ?% of the points .* class table 'semantic_kitti' does not list.*: 7 \("
        self.assertEqual(len(re.findall(label, text)), 1, text)
        self.assertEqual(text.count('the poses seem to be those of the lidar'), 1, text)
        self.assertEqual(text.count('warning: '), 2, text)
        found = (self.output / 'report.md').read_text()
        self.assertRegex(found, r"\| drive 'camera' from scan \d \| 3 \| 100 ?% of the points")
        self.assertNotIn('warnings', (self.output / 'index.json').read_text())

    def test_settings_of_drives_reach_the_programs(self):
        """poses_in and labels: none make the maps that map_sequence makes with the same options."""
        drive = self.folder / 'lidar'
        shutil.copytree(self.folder / 'd1', drive)
        (drive / 'calib.txt').write_text('Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n')
        shutil.rmtree(drive / 'labels')
        city = self.describe([], classes='occupancy', drives=[{'sequence': 'lidar', 'poses_in': 'lidar', 'labels': 'none'}])
        text = self.finish(self.start(city, '--workers', '2', '--no-picture'))
        self.assertNotIn('warning', text)
        index = json.loads((self.output / 'index.json').read_text())
        self.assertEqual(index['drives'][0]['poses_in'], 'lidar')
        program('map_sequence', '--sequence', drive, '--poses', drive / 'poses.txt', '--poses-in', 'lidar', '--labels', 'none',
                '--classes', 'occupancy', '--output', self.folder / 'whole-lidar.bkm')
        self.expect_equal(['lidar'])
        for key, value, sentence in (('poses_in', 'radar', 'poses_in in .* is \'radar\'; give camera or lidar'),
                                     ('labels', 3, 'labels in .* is 3; give a text')):
            city.write_text(json.dumps({'drives': [{'sequence': 'lidar', key: value}]}))
            with self.assertRaisesRegex(CityError, sentence):
                read_city(city)

    def test_a_program_that_is_interrupted_is_asked_again_and_then_of_the_worker(self):
        """Status 130 says that a signal has ended a program early: the drive is not broken, and its part is not used."""
        programs = self.folder / 'interrupted'
        programs.mkdir()
        for name in ('merge_maps', 'inspect_map'):
            (programs / name).symlink_to(BIN / name)
        script = programs / 'map_sequence'
        at_start = f'#!/bin/sh\ncase "$1" in --version|--print-*) exec {BIN}/map_sequence "$@";; esac\n'
        script.write_text(at_start + f'[ -e "$0.once" ] || {{ : >"$0.once"; {BIN}/map_sequence "$@" & sleep 0.1; '
                          f'kill -INT $!; wait $!; exit 130; }}\nexec {BIN}/map_sequence "$@"\n')
        script.chmod(0o755)
        city = self.describe(['d1', 'd2'])
        self.finish(self.start(city, '--workers', '1', '--no-picture', programs=programs))
        self.expect_equal(['d1', 'd2'])
        script.write_text(at_start + 'exit 130\n')
        shutil.rmtree(self.output / 'pieces/d2')
        text = self.finish(self.start(city, '--workers', '1', '--no-picture', '--resume', programs=programs), 1)
        self.assertRegex(text, 'map_city: map_sequence was ended 3 times by signal 15 on ')
        self.assertNotIn('is left out', text)

    def interrupted(self, process):
        """Waits until a program maps, and interrupts map_city as a terminal does: all of its processes. Returns them."""
        children, names, end = [], [], time.monotonic() + 60
        while 'map_sequence' not in names:
            self.assertLess(time.monotonic(), end)
            with contextlib.suppress(psutil.Error):  # some end meanwhile
                children = psutil.Process(process.pid).children(recursive=True)
                names = [child.name() for child in children]
        os.killpg(process.pid, signal.SIGINT)
        return children

    def test_nothing_is_written_after_an_interruption(self):
        programs = self.folder / 'slow'
        programs.mkdir()
        script = programs / 'map_sequence'
        script.write_text(f'#!/bin/bash\ncase "$1" in --version|--print-*) exec {BIN}/map_sequence "$@";; esac\n'
                          f'trap "" INT\nsleep 3\ntouch "$0.late"\n')  # deaf, and so alive when its worker ends
        script.chmod(0o755)
        process = self.start(self.describe(['d1', 'd2']), '--workers', '2', '--no-picture', programs=programs,
                             start_new_session=True)
        children = self.interrupted(process)
        self.assertIn('map_city: stopped; continue with --resume', self.finish(process, 130))
        gone, alive = psutil.wait_procs(children, timeout=2)
        self.assertEqual(alive, [])
        self.assertFalse(script.with_name('map_sequence.late').exists())
        self.finish(self.start(self.describe(['d1', 'd2']), '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal(['d1', 'd2'])

    def test_a_worker_of_an_ended_run_kills_its_program(self):
        """As where map_city is interrupted, and its workers are those of a cluster, which goes on."""
        token = self.folder / 'ended'
        token.write_text('')
        programs = self.folder / 'endless'
        programs.mkdir()
        (programs / 'map_sequence').write_text('#!/bin/sh\nexec sleep 60\n')
        (programs / 'map_sequence').chmod(0o755)
        setup = work.Setup(str(self.folder), str(programs), str(token), (), '')
        timer = threading.Timer(0.5, token.unlink)
        timer.start()
        begin = time.monotonic()
        with self.assertRaisesRegex(work.Fault, 'map_city has ended'):
            work.run(setup, 'map_sequence', [], 'ended.log')
        self.assertLess(time.monotonic() - begin, 20)
        timer.join()

    def test_other_programs_and_unseen_folders_are_of_the_worker(self):
        token = self.folder / 'token'
        token.write_text('')
        setup = work.Setup(str(self.folder), str(BIN), str(token), (), work.identity_of(BIN, ()))
        work.prepare(setup)
        with self.assertRaisesRegex(work.Fault, rf'are others than where map_city runs .*on {socket.gethostname()}|'
                                    rf"on {socket.gethostname()} are others .*'bki_mapping 9.9.9'") as raised:
            work.prepare(setup._replace(identity='bki_mapping 9.9.9\n' + setup.identity.split('\n', 1)[1]))
        self.assertTrue(raised.exception.of_worker)
        with self.assertRaisesRegex(work.Fault, 'cannot be started on') as raised:
            work.prepare(setup._replace(programs=str(self.folder)))
        self.assertTrue(raised.exception.of_worker)
        bag = self.folder / 'unseen.bag'
        found = work.count_clouds(setup, Drive('unseen', bag, 'labels', bag, Bag(bag, '/points', 'map', 'label', True)))
        self.assertIn(f'{socket.gethostname()} does not see {bag}; mount it', found['fault'])
        self.assertTrue(found['of_worker'])
        self.addCleanup(setattr, work, 'SIGHT', work.SIGHT)
        work.SIGHT = 0.3
        with self.assertRaisesRegex(work.Fault, f'{socket.gethostname()} does not see {self.folder}; mount it') as raised:
            work.prepare(setup._replace(token=str(self.folder / 'other')))
        self.assertTrue(raised.exception.of_worker)

    def test_a_scheduler_of_its_own(self):
        """A scheduler that somebody else has started, with a worker, first where this package is missing."""

        def dask(name, *arguments, **environment):
            process = subprocess.Popen([sys.executable, '-m', f'distributed.cli.dask_{name}', '--no-dashboard',
                                        *map(str, arguments)],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=str(self.folder),
                                       env={**os.environ, **environment})
            self.addCleanup(process.wait)
            self.addCleanup(process.terminate)
            return process

        def start_scheduler(name, **environment):
            place = self.folder / name
            process = dask('scheduler', '--host', '127.0.0.1', '--port', 0, '--scheduler-file', place, **environment)
            end = time.monotonic() + 60
            while not (place.exists() and place.stat().st_size) and time.monotonic() < end:
                time.sleep(0.05)
            return process, json.loads(place.read_text())['address']

        has_it = {'PYTHONPATH': str(SOURCE / 'python')}
        options = ('--nthreads', 1, '--local-directory', self.folder)
        city = self.describe(['d1', 'd2'])
        host = socket.gethostname()
        lacking, address = start_scheduler('lacking.json', PYTHONPATH='')
        dask('worker', address, *options, **has_it)
        text = self.finish(self.start(city, '--scheduler', address), 1)
        self.assertRegex(text, rf'map_city: the scheduler on {host} cannot import bki_mapping.city .*; install')
        lacking.terminate()

        scheduler, address = start_scheduler('scheduler.json', **has_it)
        unfit = dask('worker', address, *options, PYTHONPATH='')
        text = self.finish(self.start(city, '--scheduler', address), 1)
        self.assertRegex(text, rf'map_city: the worker on {host} cannot import bki_mapping.city .*; install')
        unfit.terminate()
        unfit.wait()
        dask('worker', address, *options, **has_it)
        self.finish(self.start(city, '--scheduler', address, '--no-picture', '--resume'))
        self.expect_equal(['d1', 'd2'])
        # The scheduler is killed while the worker maps.
        city = self.describe(DRIVES)
        process = self.start(city, '--scheduler', address, '--no-picture', '--resume')
        end = time.monotonic() + 60
        while not list(self.output.glob('pieces/d[3456]/*')) and time.monotonic() < end:
            time.sleep(0.01)
        scheduler.kill()
        self.assertIn('map_city: the Dask scheduler has gone; start it', self.finish(process, 1))
        self.assertLess(len(list(self.output.glob('pieces/*/*.bkm'))), 18)
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal(DRIVES)

    def test_a_picture_and_the_costs_are_reported(self):
        text = self.finish(self.start(self.describe(['d1', 'd2', 'd3']), '--workers', '2'))
        self.assertRegex(text, r'pieces: 9 of 9, 3 of 3 drives, [0-9.]+ a second')
        self.assertRegex(text, r'regions: \d+ of \d+, \d+ tiles, ')
        found = (self.output / 'report.md').read_text()
        self.assertRegex(found, r'\| map pieces \| 9 \| 9 \| [0-9.]+ \| [0-9.]+ \| [0-9.]+ \|')
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.assertIn('install python3-matplotlib', found)
        else:
            self.assertIn('(city.png)', found)
            self.assertEqual((self.output / 'city.png').read_bytes()[:4], b'\x89PNG')
        # The ways are where the sensor was.
        index = json.loads((self.output / 'index.json').read_text())
        poses = [[float(word) for word in line.split()] for line in (self.folder / 'd1/poses.txt').read_text().splitlines()]
        self.assertEqual([list(at) for at in report.way_of(index['drives'][0], self.output)], [[p[3], p[7], p[11]] for p in poses])
        again = self.finish(self.start(self.describe(['d1', 'd2', 'd3']), '--workers', '2', '--resume', '--no-picture'))
        self.assertIn('9 of 9', again)
        self.assertIn('| map pieces | 9 | 0 | 0.0 |', (self.output / 'report.md').read_text())
        self.assertNotIn('city.png', (self.output / 'report.md').read_text())

    def test_regions_of_another_size_are_other_files(self):
        for region_tiles in (2, 4, 2):
            city = self.describe(['d1'], piece_scans=100, region_tiles=region_tiles)  # all regions are made of one piece
            self.finish(self.start(city, '--workers', '2', '--resume', '--no-picture'))
            self.expect_equal(['d1'], least=2)

    def test_a_damaged_piece_is_mapped_anew(self):
        city = self.describe(['d1', 'd2'])
        self.finish(self.start(city, '--workers', '2', '--no-picture'))
        pieces = sorted(self.output.glob('pieces/*/*.bkm'))
        good = [tiles_of(piece) for piece in pieces[:2]]
        pieces[0].write_bytes(b'no database' * 1000)
        pieces[1].write_bytes(b'')
        self.finish(self.start(city, '--workers', '2', '--resume', '--no-picture'))
        self.assertIn('| map pieces | 6 | 2 | ', (self.output / 'report.md').read_text())
        self.assertTrue([tiles_of(piece) for piece in pieces[:2]] == good)
        self.expect_equal(['d1', 'd2'])

    def test_drives_without_points_make_no_city(self):
        shutil.copytree(self.folder / 'd1', self.folder / 'void')
        for path in (*self.folder.glob('void/velodyne/*'), *self.folder.glob('void/labels/*')):
            path.write_bytes(b'')
        text = self.finish(self.start(self.describe(['void']), '--workers', '1'), 1)
        self.assertIn('map_city: the drives hold no voxel; check', text)
        self.assertFalse((self.output / 'index.json').exists())

    def test_one_run_at_a_time(self):
        city = self.describe(['d1', 'd2'])
        first = self.start(city, '--workers', '1', '--no-picture')
        end = time.monotonic() + 60
        while not list(self.output.glob('.run.*')) and time.monotonic() < end:
            time.sleep(0.01)
        # With its workers, or these may have done all before the second run has looked.
        self.addCleanup(first.stdout.close)
        first.send_signal(signal.SIGSTOP)
        suspended = []

        def kill_suspended():
            for child in suspended:
                with contextlib.suppress(psutil.NoSuchProcess):
                    child.kill()

        self.addCleanup(kill_suspended)
        parent = psutil.Process(first.pid)
        for child in parent.children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):  # a program that a worker ran has ended meanwhile
                child.suspend()
                suspended.append(child)
                if child.cmdline() == parent.cmdline():  # a copy that is about to execute a program holds the lock, too
                    child.resume()
        self.assertTrue(suspended)
        text = self.finish(self.start(city, '--workers', '1', '--resume', '--no-picture'), 1)
        self.assertRegex(text, f'map_city: another map_city works in {self.output}; wait until it has ended')
        # The workers outlive a killed map_city, and do not hold its lock.
        first.kill()
        first.wait()
        self.finish(self.start(city, '--workers', '2', '--resume', '--no-picture'))
        self.expect_equal(['d1', 'd2'])

    def test_a_program_that_is_killed_once_is_asked_again(self):
        programs = self.folder / 'killed_once'
        programs.mkdir()
        script = programs / 'map_sequence'
        script.write_text(f'#!/bin/sh\n[ -e "$0.killed" ] || {{ : >"$0.killed"; kill -9 $$; }}\nexec {BIN}/map_sequence "$@"\n')
        script.chmod(0o755)
        self.assertEqual(work.identity_of(programs, ()), work.identity_of(BIN, ()))
        script.write_text('#!/bin/sh\nkill -9 $$\n')
        with self.assertRaisesRegex(work.Fault, 'was ended 3 times by signal 9') as raised:
            work.identity_of(programs, ())
        self.assertTrue(raised.exception.of_worker)

    def test_files_are_beside_the_description_and_names_are_of_the_package(self):
        path = self.folder / 'named.yaml'
        (self.folder / 'mine').write_text('prior: 0.001\n')
        for given, read in (('robot', 'robot'), ('mine', str(self.folder / 'mine')), ('none.yaml', str(self.folder / 'none.yaml')),
                            ('sub/none', str(self.folder / 'sub/none')), ('/no/such.yaml', '/no/such.yaml')):
            path.write_text(f'{{drives: [{{sequence: d1}}], classes: {given}, config: {given}}}')
            city = read_city(path)
            self.assertEqual((city.classes, city.config), (read, read))
        for config, status in (('robt', 1), ('robot', 0)):
            text = self.finish(self.start(self.describe(['d1'], config=config), '--workers', '1', '--no-picture', '--resume'), status)
            self.assertEqual("did you mean 'robot'?" in text, status == 1, text)

    def test_wrong_descriptions_are_refused(self):
        path = self.folder / 'wrong.yaml'
        for text, sentence in (
                ('drives: [', 'cannot be read: '),
                ('[]', 'in place of a mapping'),
                ('drives: []', 'lists no drives'),
                ('drive: [{sequence: d1}]', "'drive' in "),
                ('drives: [{folder: d1}]', "'folder' in "),
                ('drives: [{name: d1}]', 'has no sequence: FOLDER'),
                ('drives: [{sequence: d1, name: a/b}]', 'is no name for a drive'),
                ('drives: [{sequence: d1}, {sequence: x/d1}]', "gives two drives the name 'd1'"),
                ('drives: [{sequence: d1, poses: 3}]', 'poses in '),
                ('drives: [{bag: d1.bag}]', 'd1.bag in '),
                ('drives: [{bag: d1.bag, labels: x}]', "'labels' in "),
                ('drives: [{bag: d1.bag, cloud_topic: /c, labelled: 3}]', 'labelled in '),
                ('{drives: [{sequence: d1}], piece_scans: 0}', 'piece_scans in '),
                ('drives: [{sequence: d1, name: .a}]', 'begin with another character than a dot'),
                ('{drives: [{sequence: d1}], set: {threads: 4}}', 'has threads, but each task uses one core'),
                ('{drives: [{sequence: d1}], set: 3}', 'is no mapping of parameters'),
                ('{drives: [{sequence: d1}], classes: 3}', 'classes in '),
                ('{drives: [{sequence: d1}], config: 3}', 'config in ')):
            path.write_text(text)
            with self.assertRaises(CityError, msg=text) as raised:
                read_city(path)
            self.assertIn(sentence, str(raised.exception))
        path.write_text('drives: [{sequence: d1}]')
        with self.assertRaisesRegex(CityError, "has no drive 'x' to leave out; it has d1"):
            read_city(path, without=['x'])

    def test_pieces_change_with_what_they_are_made_of(self):
        table = self.folder / 'table.yaml'
        shutil.copy(SOURCE / 'config/classes/semantic_kitti.yaml', table)
        city = self.describe(['d1'], classes='table.yaml')

        def files():
            read = read_city(city)
            return [piece.file for piece in pieces_of(read, read.drives[0], identity)]
        identity = 'bki_mapping 1'
        before = files()
        self.assertEqual(len(before), 3)
        self.assertEqual(files(), before)
        os.utime(self.folder / 'd1/labels/000002.label', (1, 1))
        self.assertEqual([a == b for a, b in zip(files(), before)], [True, False, True])
        before = files()
        with open(table, 'a') as file:
            file.write('# changed\n')
        self.assertFalse(set(files()) & set(before))
        before, identity = files(), 'bki_mapping 2'
        self.assertFalse(set(files()) & set(before))

    def test_presets_and_tables_that_are_named_count_with_what_is_in_them(self):
        """Where the package is installed, its programs read those beside them: a change there makes other pieces."""
        prefix = self.folder / 'prefix'
        shutil.copytree(SOURCE / 'config', prefix / 'share/bki_mapping/config')
        (prefix / 'bin').mkdir()
        (prefix / 'lib').mkdir()
        shutil.copy(BIN / 'map_sequence', prefix / 'bin')
        for line in subprocess.run(['ldd', str(BIN / 'map_sequence')], check=True, stdout=subprocess.PIPE,
                                   universal_newlines=True).stdout.splitlines():
            if 'libbki_mapping_' in line:
                shutil.copy(line.split('=>')[1].split('(')[0].strip(), prefix / 'lib')
        (prefix / 'bin/map_sequence').rename(prefix / 'bin/program')
        (prefix / 'bin/map_sequence').write_text(f'#!/bin/sh\nLD_LIBRARY_PATH={prefix}/lib exec {prefix}/bin/program "$@"\n')
        (prefix / 'bin/map_sequence').chmod(0o755)
        settings = ('--classes', 'semantic_kitti', '--config', 'robot')
        before = work.identity_of(prefix / 'bin', settings)
        self.assertEqual(work.identity_of(prefix / 'bin', settings), before)
        seen = {before}
        for name, old, new in (('presets/robot.yaml', 'rules: ', '# rules: '),
                               ('classes/semantic_kitti.yaml', 'car', 'vehicle')):
            path = prefix / 'share/bki_mapping/config' / name
            self.assertIn(old, path.read_text())
            path.write_text(path.read_text().replace(old, new, 1))
            seen.add(work.identity_of(prefix / 'bin', settings))
        self.assertEqual(len(seen), 3)

    def test_sums_are_trees(self):
        files = [f'piece {n}' for n in range(300)]
        levels = sums_of({(0, 0): files, (1, 0): files[:16]}, 2)
        self.assertEqual([len(level) for level in levels], [19 + 1, 2, 1])
        self.assertEqual([each.file.split('/')[0] for each in levels[0]], ['sums'] * 19 + ['regions'])
        self.assertEqual(sorted(name for each in levels[0][:19] for name in each.inputs), sorted(files))
        self.assertEqual(levels[2][0].inputs, tuple(sorted(each.file for each in levels[1])))
        other = sums_of({(0, 0): files, (1, 0): files[:16]}, 4)
        self.assertFalse({each.file for level in levels for each in level} & {each.file for level in other for each in level})


if __name__ == '__main__':
    unittest.main()
