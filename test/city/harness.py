"""Small cities for tests: drives, map_city as a user calls it, and the map by map_sequence that a city must equal."""
import contextlib
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

try:
    import distributed  # noqa: F401
    import numpy  # noqa: F401
    import psutil  # noqa: F401
except ImportError:
    print('SKIPPED: needs python3-distributed', file=sys.stderr)
    sys.exit(77)

SOURCE = pathlib.Path(os.environ['BKI_MAPPING_SOURCE_DIR'])
BIN = pathlib.Path(os.environ['BKI_MAPPING_BIN'])
sys.path.insert(0, str(SOURCE / 'python'))
DRIVES = [f'd{n}' for n in range(1, 7)]
SCANS = 5
CITY = ('--blocks', 2, '--block-edge', 70, '--scans', SCANS, '--rate', 1, '--beams', 32, '--columns', 900)


def program(name, *arguments):
    subprocess.run([str(BIN / name), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def tiles_of(*paths):
    """The content of all tiles of some map files, which must have none in common."""
    tiles = {}
    for path in paths:
        with contextlib.closing(sqlite3.connect(path)) as database:
            for z, y, x, content in database.execute('SELECT z, y, x, content FROM tile WHERE part = 0'):
                assert (z, y, x) not in tiles, (path, z, y, x)
                tiles[z, y, x] = content
    return tiles


class MadeCity(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        program('simulate_city', '--output', cls.folder / 'made', '--drives', len(DRIVES), *CITY)
        for number, name in enumerate(DRIVES):
            (cls.folder / f'made/drive_{number:04d}').rename(cls.folder / name)
        cls.wholes = {}

    def whole(self, names):
        """The map of some drives by map_sequence, one scan after another. Made once."""
        path = self.folder / ('whole-' + '-'.join(names) + '.bkm')
        if not path.exists():
            resume = ()
            for name in names:
                program('map_sequence', '--sequence', self.folder / name, '--poses', self.folder / name / 'poses.txt',
                        '--output', path, *resume)
                resume = ('--resume', path)
        return tiles_of(path)

    def describe(self, names, **more):
        path = self.folder / f'{self.id().split(".")[-1]}.yaml'
        text = {'drives': [{'sequence': name} for name in names], 'piece_scans': 2, 'region_tiles': 3, **more}
        path.write_text(json.dumps(text))  # JSON is YAML
        return path

    def start(self, city, *arguments, programs=BIN, **more):
        self.output = self.folder / self.id().split('.')[-1]
        return subprocess.Popen([sys.executable, str(SOURCE / 'scripts/map_city'), str(city), '--output', str(self.output),
                                 '--programs', str(programs), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                universal_newlines=True, env={**os.environ, 'PYTHONPATH': str(SOURCE / 'python')}, **more)

    def finish(self, process, status=0):
        text = process.communicate(timeout=240)[0]
        self.assertEqual(process.returncode, status, text)
        return text

    def expect_equal(self, names, least=5, whole=None):
        """whole: the tiles that the regions must have; default: those of the map of some drives."""
        index = json.loads((self.output / 'index.json').read_text())
        regions = [self.output / region['file'] for region in index['regions']]
        self.assertEqual(sorted((self.output / 'regions').iterdir()), sorted(regions))
        self.assertGreaterEqual(len(regions), least)
        found, whole = tiles_of(*regions), whole or self.whole(sorted(names))
        self.assertEqual(len(set(found) ^ set(whole)), 0, 'tiles in one of the two only')
        self.assertEqual([index for index in whole if found[index] != whole[index]], [], 'tiles that differ')
        return index
