#!/usr/bin/env python3
"""Programs that ask a city say the same as of the whole map, and open only the files that they need."""
import csv
import io
import json
import math
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import small_city  # noqa: E402

BIN = pathlib.Path(os.environ['BKI_MAPPING_BIN'])
CAR = 1  # in the class table semantic_kitti
READ = re.compile(r'read (\d+) of (\d+) tiles?, in (\d+) of (\d+) files?; [0-9.]+ ms\n')


class City(unittest.TestCase):
    SETTINGS = ()

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.index = small_city.make(BIN, cls.folder, settings=cls.SETTINGS)
        cls.city, cls.whole = str(cls.folder / 'city'), str(cls.folder / 'whole.bkm')
        assert len(cls.index['regions']) > 4

    def call(self, program, *arguments, text=None):
        return subprocess.run([str(BIN / program), *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              universal_newlines=True, input=text, timeout=120)

    def succeeds(self, *arguments, text=None):
        result = self.call(*arguments, text=text)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def fails(self, words, *arguments, text=None):
        result = self.call(*arguments, text=text)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn(words, result.stderr)
        self.assertEqual(result.stderr.count('\n'), 1, 'one sentence: ' + result.stderr)

    def voxels(self):
        """Centre and class id of the occupied voxels of the whole map."""
        path = self.folder / 'whole.ply'
        self.succeeds('export_map', self.whole, '--output', path)
        body = path.read_bytes().split(b'end_header\n', 1)[1]
        return [(record[:3], record[3]) for record in struct.iter_unpack('<fff3xH25x', body)]

    def check_points(self):
        """Points of the city are those of the whole map, and the nearest obstacles are those of all occupied voxels."""
        drawn = random.Random(1)
        points = [(drawn.uniform(-80, 110), drawn.uniform(-90, 80), drawn.uniform(-2.5, 4)) for _ in range(300)]
        voxels = self.voxels()
        points += [centre for centre, _ in drawn.sample(voxels, 50)]
        points += [(1e12, 0, 0), (0.0, 0.0, 0.0)]
        path, output = self.folder / 'points.csv', self.folder / 'answers.csv'
        path.write_text('x,y,z\n# a remark\n' + ''.join(f'{x!r},{y!r},{z!r}\n' for x, y, z in points))
        of_city = self.succeeds('query_city', self.city, '--points', path, '--nearest', '25')
        of_map = self.succeeds('query_city', self.whole, '--points', path, '--nearest', '25')
        self.assertEqual(of_city.stdout, of_map.stdout)
        self.succeeds('query_city', self.city, '--points', path, '--nearest', '25', '--output', output)
        self.assertEqual(output.read_text(), of_map.stdout)
        rows = list(csv.DictReader(io.StringIO(of_city.stdout)))
        self.assertEqual(len(rows), len(points))
        self.assertEqual({row['state'] for row in rows[:300]} - {'occluded', 'occupied'}, {'unknown', 'free'})
        self.assertEqual({row['state'] for row in rows[300:350]}, {'occupied'})
        for row in rows[300:350]:
            self.assertEqual(row['nearest_class'], row['class'])
            self.assertLess(float(row['nearest_distance']), 1e-4)
        found = 0
        for point, row in zip(points, rows):
            self.assertAlmostEqual(float(row['x']), point[0], delta=1e-9 * abs(point[0]))
            nearest = min(math.dist(point, centre) for centre, _ in voxels)
            if nearest <= 24.999:
                found += 1
                self.assertAlmostEqual(float(row['nearest_distance']), nearest, delta=1e-4)
                self.assertAlmostEqual(math.dist(point, [float(row[f'nearest_{axis}']) for axis in 'xyz']), nearest, delta=1e-3)
            elif nearest > 25.001:
                self.assertEqual(row['nearest_distance'], '')
        self.assertGreater(found, 100)
        self.assertLess(found, 300)
        named = self.succeeds('query_city', self.city, '--points', path, '--nearest', '25', '--classes', 'car,building')
        classes = {row['nearest_class'] for row in csv.DictReader(io.StringIO(named.stdout))}
        self.assertEqual(classes, {'', 'car', 'building'})
        return rows


class DecidedByNeighbours(City):
    """With rules/together, a voxel's state depends on voxels of other tiles."""
    EDGE = 0.3  # of a voxel [m]
    SETTINGS = ('--config', os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'config', 'presets', 'robot.yaml'))

    def test_points_are_those_of_the_whole_map(self):
        self.check_points()

    def test_an_obstacle_at_the_end_of_the_search_is_decided_with_its_neighbours(self):
        """The nearest obstacle is searched in a box about the points of a tile, so each call has one point of each tile."""
        drawn = random.Random(2)
        cars = [centre for centre, label in self.voxels() if label == CAR]
        near = [tuple(x + self.EDGE * drawn.randint(-1, 1) for x in drawn.choice(cars)) for _ in range(2000)]
        asked = self.ask(near)
        occupied = [point for point, row in zip(near, asked) if row['state'] == 'occupied' and row['class'] == 'car']
        others = [point for point, row in zip(near, asked) if row['state'] == 'free']
        self.assertGreater(min(len(occupied), len(others)), 100)
        calls = {}
        for kind in (occupied, others):
            number = {}
            for point in kind[:300]:
                tile = tuple(math.floor(x / (64 * self.EDGE)) for x in point)
                number[tile] = number.get(tile, 0) + 1
                calls.setdefault((number[tile], kind is occupied), []).append(point)
        for (_, is_occupied), points in calls.items():
            for point, row in zip(points, self.ask(points, '--nearest', '0.01')):
                self.assertEqual(row['nearest_distance'] != '', is_occupied, (point, row))

    def ask(self, points, *arguments):
        text = ''.join(f'{x!r},{y!r},{z!r}\n' for x, y, z in points)
        return list(csv.DictReader(io.StringIO(self.succeeds('query_city', self.city, '--points', '-', *arguments, text=text).stdout)))


class CityReading(City):
    def test_points_are_those_of_the_whole_map(self):
        rows = self.check_points()
        one = self.succeeds('query_city', self.city, '--points', '-', text='0 0 0\n')
        self.assertEqual(one.stdout.splitlines()[1].split(',')[3], rows[-1]['state'])

    def test_only_the_files_that_are_needed_are_opened(self):
        copy = self.folder / 'rubbish'
        shutil.copytree(self.city, copy)
        kept = next(region for region in self.index['regions'] if (region['x'], region['y']) == (0, 0))
        for region in self.index['regions']:
            if region is not kept:
                (copy / region['file']).write_text('rubbish')
        result = self.succeeds('query_city', copy, '--point', '5 2 -1.5', '--cost')
        self.assertEqual(result.stdout, self.succeeds('query_city', self.whole, '--point', '5,2,-1.5').stdout)
        tiles = sum(region['tiles'] for region in self.index['regions'])
        self.assertEqual([int(n) for n in READ.fullmatch(result.stderr).groups()], [1, tiles, 1, len(self.index['regions'])])
        box = '1 1 -3 30 30 3'
        of_city, of_map = self.folder / 'city.ply', self.folder / 'map.ply'
        self.succeeds('export_map', copy, '--output', of_city, '--box', box)
        self.succeeds('export_map', self.whole, '--output', of_map, '--box', box)
        self.assertEqual(of_city.read_bytes(), of_map.read_bytes())
        self.fails('is not a map of bki_mapping', 'export_map', copy, '--output', of_city, '--box', '-1 1 -3 30 30 3')
        self.assertEqual(of_city.read_bytes(), of_map.read_bytes(), 'a good file is not replaced by a bad one')
        self.fails('is not a map of bki_mapping', 'query_city', copy, '--point', '-5 2 -1.5')

    def test_exports_are_those_of_the_whole_map(self):
        three = self.folder / 'three.js'
        three.write_text('var THREE = {};\n')
        for box in ((), ('--box', '-20 -30 -inf 40 8.1 inf')):
            for name in ('map.ply', 'map.pcd', 'map.ot', 'map.bt', 'map.yaml', 'map.glb', 'map.html'):
                made = []
                for source in (self.city + '/', self.whole):
                    output = self.folder / name
                    more = ('--three-js', three) if name == 'map.html' else ()
                    self.succeeds('export_map', source, '--output', output, *box, *more)
                    made.append(output.read_bytes() + (output.with_suffix('.pgm').read_bytes() if name == 'map.yaml' else b''))
                made[0] = made[0].replace(b'"name":"city"', b'"name":"whole"').replace(b'<title>city', b'<title>whole')
                self.assertGreater(len(made[0]), 100)
                if name != 'map.html':
                    self.assertEqual(made[0], made[1], (name, box))
                else:
                    header = [json.loads(re.search(rb'id="map">(.*?)</script>', page)[1]) for page in made]
                    self.assertEqual(header[0]['voxels'], header[1]['voxels'])
        self.fails('MB of memory, and the limit is 1 MB; ask for a smaller box, or raise the limit', 'export_map', self.city,
                   '--output', self.folder / 'map.ply', '--memory-limit', '1')

    def test_boxes_are_counted_and_drawn(self):
        box, png = '-20 -30 -inf 40 8.1 inf', self.folder / 'box.png'
        counted = self.succeeds('query_city', self.city, '--box', box, '--top', png)
        self.assertEqual(counted.stdout, self.succeeds('query_city', self.whole, '--box', box, '--top', png).stdout)
        self.assertEqual(png.read_bytes()[:8], b'\x89PNG\r\n\x1a\n')
        inside = [label for (x, y, _), label in self.voxels() if -20 <= x <= 40 and -30 <= y <= 8.1]
        self.assertIn(f'\noccupied: {len(inside)} voxels, ', counted.stdout)
        layer = self.succeeds('query_city', self.city, '--box', box, '--section', '-1.55')
        inside = [label for (x, y, z), label in self.voxels() if -20 <= x <= 40 and -30 <= y <= 8.1 and -1.8 < z < -1.5]
        self.assertGreater(len(inside), 10)
        self.assertIn(f'\noccupied: {len(inside)} voxels, ', layer.stdout)

    def test_a_city_is_described(self):
        self.assertEqual(self.succeeds('query_city', self.city).stderr, '', 'the cost is told on demand')
        result = self.succeeds('query_city', self.city, '--cost')
        self.assertRegex(result.stdout, rf'city: \d+ tiles in {len(self.index["regions"])} files, [0-9.]+ MB\n'
                                        'frame map, resolution 0.3 m, ')
        self.assertTrue(result.stdout.endswith('drives:\n  d1/000000-000004\n  d2/000000-000004\n'), result.stdout)
        self.assertEqual(READ.fullmatch(result.stderr)[1], '0')
        self.assertIn('tiles in 1 file, ', self.succeeds('query_city', self.whole).stdout)

    def test_wrong_questions_are_refused(self):
        for words, arguments in (
                ('name one map file', ()),
                ('holds no index.json, which map_city writes last', (self.folder,)),
                ('cannot be opened', (self.folder / 'nothing',)),
                ('--point 1 2 is not three finite numbers', (self.city, '--point', '1 2')),
                ('--point 1 2 nan is not three finite numbers', (self.city, '--point', '1 2 nan')),
                ('nothing.csv cannot be read', (self.city, '--points', self.folder / 'nothing.csv')),
                ('standard input, line 2: not three finite numbers', (self.city, '--points', '-')),
                ('--nearest needs --point or --points', (self.city, '--nearest', '5')),
                ('--nearest is -5, but must be at least 0', (self.city, '--point', '0 0 0', '--nearest', '-5')),
                ('--classes needs --nearest', (self.city, '--point', '0 0 0', '--classes', 'car')),
                ("'spaceship'", (self.city, '--point', '0 0 0', '--nearest', '5', '--classes', 'spaceship')),
                ('--section needs --box', (self.city, '--section', '0')),
                ('--top x.jpg must end in .png', (self.city, '--box', '0 0 0 1 1 1', '--top', 'x.jpg')),
                ('ask one at a time', (self.city, '--box', '0 0 0 1 1 1', '--point', '0 0 0')),
                ('--box has 2 numbers', (self.city, '--box', '1 2')),
                ('the limit is 1 MB', (self.city, '--box', '-inf -inf -inf inf inf inf', '--memory-limit', '1'))):
            self.fails(words, 'query_city', *arguments, text='1,2,3\n1,2\n')


if __name__ == '__main__':
    unittest.main()
