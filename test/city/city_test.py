#!/usr/bin/env python3
"""A city made by map_city equals one run of map_sequence over all its scans, to the bit, whatever happens meanwhile."""
import contextlib
import json
import os
import pathlib
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import distributed  # noqa: F401
    import psutil
except ImportError:
    print('SKIPPED: needs python3-distributed', file=sys.stderr)
    sys.exit(77)

SOURCE = pathlib.Path(os.environ['BKI_MAPPING_SOURCE_DIR'])
BIN = pathlib.Path(os.environ['BKI_MAPPING_BIN'])
sys.path.insert(0, str(SOURCE / 'python'))
from bki_mapping.city.description import CityError, read_city  # noqa: E402
from bki_mapping.city.plan import pieces_of, sums_of  # noqa: E402

DRIVES = {'d1': (0, 0), 'd2': (12, 40), 'd3': (35, -20), 'd4': (-30, 10), 'd5': (5, 5), 'd6': (60, 30)}
SCANS = 5


def program(name, *arguments):
    subprocess.run([str(BIN / name), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def simulate(folder, seed, shift):
    """Writes a drive whose poses are moved into the frame of the city."""
    program('simulate_drive', '--output', folder, '--scans', SCANS, '--seed', seed, '--beams', 16, '--columns', 400)
    poses = [[float(number) for number in line.split()] for line in (folder / 'poses.txt').read_text().splitlines()]
    for pose in poses:
        pose[3] += shift[0]
        pose[7] += shift[1]
    (folder / 'poses.txt').write_text(''.join(' '.join(map(repr, pose)) + '\n' for pose in poses))


def tiles_of(*paths):
    """The content of all tiles of some map files, which must have none in common."""
    tiles = {}
    for path in paths:
        with contextlib.closing(sqlite3.connect(path)) as database:
            for z, y, x, content in database.execute('SELECT z, y, x, content FROM tile WHERE part = 0'):
                assert (z, y, x) not in tiles, (path, z, y, x)
                tiles[z, y, x] = content
    return tiles


class Made(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        for seed, (name, shift) in enumerate(DRIVES.items(), 1):
            simulate(cls.folder / name, seed, shift)
        cls.wholes = {}

    def whole(self, names):
        """The map of some drives by map_sequence, one scan after another. Made once."""
        path = self.folder / ('whole-' + '-'.join(names) + '.bkm')
        if not path.exists():
            resume = ()
            for name in names:
                program('map_sequence', '--sequence', self.folder / name, '--output', path, *resume)
                resume = ('--resume', path)
        return tiles_of(path)

    def describe(self, names, **more):
        path = self.folder / f'{self.id().split(".")[-1]}.yaml'
        text = {'drives': [{'sequence': name} for name in names], 'piece_scans': 2, 'region_tiles': 2, **more}
        path.write_text(json.dumps(text))  # JSON is YAML
        return path

    def start(self, city, *arguments):
        self.output = self.folder / self.id().split('.')[-1]
        return subprocess.Popen([sys.executable, str(SOURCE / 'scripts/map_city'), str(city), '--output', str(self.output),
                                 '--programs', str(BIN), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                universal_newlines=True, env={**os.environ, 'PYTHONPATH': str(SOURCE / 'python')})

    def finish(self, process, status=0):
        text = process.communicate(timeout=240)[0]
        self.assertEqual(process.returncode, status, text)
        return text

    def expect_equal(self, names):
        index = json.loads((self.output / 'index.json').read_text())
        regions = [self.output / region['file'] for region in index['regions']]
        self.assertEqual(sorted(path.name for path in (self.output / 'regions').iterdir()), sorted(path.name for path in regions))
        self.assertGreater(len(regions), 4)
        self.assertEqual(tiles_of(*regions), self.whole(sorted(names)))
        return index

    def test_kills_change_no_bit(self):
        """Two workers are killed while they map, then all of it with the scheduler; it is continued, with another worker killed."""
        names = list(DRIVES)
        city, drawn = self.describe(names[::-1]), random.Random(1)

        def kill_worker(process):
            """Kills a worker that runs one of the programs, with it or without."""
            end = time.monotonic() + 60
            while time.monotonic() < end and process.poll() is None:
                for found in psutil.Process(process.pid).children(recursive=True):
                    with contextlib.suppress(psutil.Error):
                        if found.name() in ('map_sequence', 'merge_maps', 'inspect_map'):
                            worker = found.parent()
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
        self.finish(self.start(city, '--workers', '2', '--resume', '--without', 'd6'))
        index = self.expect_equal(names[:-1])
        same = before & {region['file'] for region in index['regions']}
        self.assertTrue(0 < len(same) < len(before))
        self.finish(self.start(self.describe(names[:-1]), '--workers', '2', '--resume', '--add', str(self.folder / 'd6')))
        self.assertEqual({region['file'] for region in self.expect_equal(names)['regions']}, before)

    def test_a_broken_drive_is_named_and_left_out(self):
        broken = self.folder / 'broken'
        shutil.copytree(self.folder / 'd2', broken)
        with open(broken / 'velodyne/000003.bin', 'ab') as file:
            file.write(b'x')
        city = self.describe(['d1', 'broken', 'd3', 'd1', 'missing'])
        text = self.finish(self.start(city, '--workers', '2'), 1)
        self.assertRegex(text, r"drive 'broken' is left out: map_sequence: .*000003\.bin")
        self.assertRegex(text, r"drive 'missing' is left out: .*missing holds no scans")
        index = self.expect_equal(['d1', 'd3'])
        self.assertEqual(sorted(index['left_out']), ['broken', 'missing'])
        self.assertIn('| broken | map_sequence: ', (self.output / 'report.md').read_text())

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
                ('{drives: [{sequence: d1}], piece_scans: 0}', 'piece_scans in '),
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
            return [piece.file for piece in pieces_of(read, read.drives[0])]
        before = files()
        self.assertEqual(len(before), 3)
        self.assertEqual(files(), before)
        os.utime(self.folder / 'd1/labels/000002.label', (1, 1))
        self.assertEqual([a == b for a, b in zip(files(), before)], [True, False, True])
        before = files()
        with open(table, 'a') as file:
            file.write('# changed\n')
        self.assertFalse(set(files()) & set(before))

    def test_sums_are_trees(self):
        files = [f'piece {n}' for n in range(300)]
        levels = sums_of({(0, 0): files, (1, 0): files[:16]})
        self.assertEqual([len(level) for level in levels], [19 + 1, 2, 1])
        self.assertEqual([each.file.split('/')[0] for each in levels[0]], ['sums'] * 19 + ['regions'])
        self.assertEqual(sorted(name for each in levels[0][:19] for name in each.inputs), sorted(files))
        self.assertEqual(levels[2][0].inputs, tuple(sorted(each.file for each in levels[1])))


if __name__ == '__main__':
    unittest.main()
