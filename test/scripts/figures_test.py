#!/usr/bin/env python3
"""Each figure of scripts/reproduce is drawn for a small case, and its table has the expected values."""
import csv
import math
import os
import re
import sys
import tempfile
import unittest
import unittest.mock

SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
sys.path.insert(0, os.path.join(SOURCE, 'lab'))

import matplotlib  # noqa: E402
matplotlib.use('Agg')
import matplotlib.image  # noqa: E402

from figures import complexity, frontier, leave_one_out, method, plane, quality, tradeoff  # noqa: E402
from figures.programs import Programs  # noqa: E402
from figures.runs import Runs  # noqa: E402


def ink(path):
    """The fraction of a picture that differs from its corner, which is background."""
    pixels = matplotlib.image.imread(path)[..., :3]
    return float((abs(pixels - pixels[0, 0]).max(axis=-1) > 0.1).mean())


class Figures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.output = cls.folder.name
        cls.programs = Programs(os.environ['BKI_MAPPING_BIN'], os.path.join(cls.output, 'scratch'))
        cls.drive = cls.programs.simulate('drive', scans=4, beams=24, columns=600)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def rows(self, name):
        with open(os.path.join(self.output, name), newline='') as file:
            return list(csv.DictReader(file))

    def expect_pictures(self, text, count):
        pictures = re.findall(r'!\[.*?\]\((.*?)\)', text)
        self.assertEqual(len(set(pictures)), count)
        for picture in pictures:
            self.assertGreater(ink(os.path.join(self.output, picture)), 0.01, picture)

    def test_plane(self):
        self.expect_pictures(plane.draw(self.programs, self.output), 2)

        def crowding(pattern):  # density near the sensor, relative to far from it
            density = [float(row['samples_per_m2']) for row in self.rows('figure1.csv') if row['pattern'] == pattern]
            return density[0] / density[3]
        self.assertLess(crowding('linear, 5 per beam'), 2.5)
        self.assertGreater(crowding('uniform, 5 per beam'), 5)
        free = {row['representation']: int(row['free_voxels']) for row in self.rows('figure2.csv')}
        self.assertGreater(free['lines, uniform'], 1.3 * free['linear, 5 per beam'])

    def test_the_drive_left_out_has_no_say(self):
        def figures(sa, parked, da):
            return {'sa': sa, 'sa_standing': parked, 'da': 0.5, 'da_decidable': da, 'aa': 0.0, 'floor_holes': 0.0}
        good, bad = figures(1.0, 0.95, 0.95), figures(1.0, 0.95, 0.5)
        figures_of = {'a': {'x': bad, 'y': good, 'z': good}, 'b': {'x': good, 'y': figures(1.0, 0.5, 0.9), 'z': good},
                      'c': {'x': figures(1.0, None, 1.0), 'y': figures(0.98, 1.0, 1.0), 'z': figures(1.0, 1.0, None)}}
        rows, best = leave_one_out.left_out(figures_of, 0.99)
        self.assertEqual([(drive, setting) for drive, setting, _ in rows], [('x', 'a'), ('y', 'c'), ('z', 'a')])
        self.assertEqual(best, 'a')
        self.assertIs(rows[0][2], bad)  # on x, the choice of the others is bad, which only leaving out shows
        self.assertIn('| x | a | 100.0 | 95.0 | 0.0 | 50.0 | 0.0 |', leave_one_out.table(rows))

    def test_leave_one_out_measures_each_setting(self):
        gains = leave_one_out.judgements()[:2]
        preset = os.path.join(SOURCE, 'config', 'presets', 'robot.yaml')
        figures_of = leave_one_out.measured(self.programs, {'drive': self.drive, 'again': self.drive}, preset,
                                            [30.0], gains)
        self.assertEqual(list(figures_of), ['rules/void_outweighs=30,' + gain for gain in gains])
        for figures in figures_of.values():
            self.assertEqual(figures['drive'], figures['again'])
            self.assertGreater(figures['drive']['sa'], 0.5)

    def test_the_tables_of_quality(self):
        runs, sequences = Runs(self.programs), {'drive': self.drive}
        rows = quality.measured(runs, sequences, (0.2, 0.4))
        self.assertEqual([row[:2] for row in rows], [['drive', '0.2'], ['drive', '0.4']])
        for row in rows:
            self.assertEqual(len(row), 8)
            self.assertGreater(float(row[2]), 95.0)  # SA
        variants = [('right', {}, (quality.SA, quality.MIOU)), ('wrong', {'more': ['--label-noise', '0.3']}, (quality.MIOU,))]
        header, _, row = quality.by_drive(runs, sequences, variants).splitlines()
        self.assertEqual(header, '| drive | right: SA | mIoU | wrong: mIoU |')
        right, wrong = (float(cell) for cell in row.split('|')[3:5])
        self.assertGreater(right, wrong)
        self.assertIn('`rules/together` 1.2', quality.table_of_settings(runs, {'street': self.drive}))
        rules = ('looks', 'voids looks')
        header, _, looks, both = quality.table_of_rules(runs, sequences, ('drive', 'missing'), rules).splitlines()
        self.assertEqual(header, '| without | drive |')
        self.assertIn('| `looks` (12c) |', looks)
        self.assertRegex(looks, r'PA −[1-9]')
        self.assertIn('| `voids`, `looks` |', both)
        with unittest.mock.patch.object(quality, 'LASTING', ('looks',)):
            header = quality.rules_on_longer_drives(runs, self.programs, 1).splitlines()[0]
        self.assertTrue(header.startswith('| without | street, 64 rows | traffic, 64 rows |'), header)
        with self.assertRaisesRegex(SystemExit, 'known: ' + ', '.join(name for name, _ in quality.RULES) + '\n'):
            runs.report(self.drive, more=('--without', 'nothing'))
        header, _, row = quality.table_of_presence(runs, sequences).splitlines()
        self.assertEqual(row.count('|'), header.count('|'))
        header, _, *rows_of_longer = quality.table_of_longer_drives(runs, self.programs, 1).splitlines()
        self.assertEqual([row.split('|')[3].strip() for row in rows_of_longer], ['5', '3', '3', '3', '3', '3'])
        self.assertEqual({row.count('|') for row in rows_of_longer}, {header.count('|')})
        with unittest.mock.patch.object(self.programs, 'evaluate', side_effect=AssertionError('measured twice')):
            self.assertEqual(quality.measured(runs, sequences, (0.2, 0.4)), rows)

    def test_changes_are_listed_from_a_least_one_on(self):
        self.assertEqual([quality.change(*each) for each in (('99.0', '98.7'), ('98.7', '99.0'), ('98.8', '99.0'), ('', '99.0'))],
                         ['+0.3', '−0.3', '', ''])

    def test_a_table_of_quality_replaces_that_between_its_marks(self):
        begin, end = quality.marks('x')
        others = ''.join(quality.marks('y'))
        self.assertEqual(quality.replaced(f'{others}a\n{begin}old\n{end}b\n', 'x', 'new\n'), f'{others}a\n{begin}new\n{end}b\n')
        for text in ('no marks', end + begin, 2 * (begin + end)):
            with self.assertRaises(SystemExit):
                quality.replaced(text, 'x', 'new\n')

    def test_the_document_has_marks_for_each_table_of_quality(self):
        given = unittest.mock.Mock(scans=1, resolution=(0.3,))
        with open(f'{SOURCE}/docs/quality.md') as file:
            text = file.read()
        for name in quality.tables_of(None, None, given, {}):
            quality.replaced(text, name, '')

    def test_tables_of_quality_are_the_same_measured_side_by_side(self):
        def written(jobs, *more):
            document = os.path.join(self.output, 'tables.md')
            with open(document, 'w') as file:
                file.write(''.join('text\n'.join(quality.marks(name)) for name in ('settings', 'errors', 'calibration')))
            words = ['quality', '--programs', self.programs.folder, '--scratch', self.programs.scratch, '--document', document,
                     '--scans', '1', '--commit', 'abc', '--table', 'settings', '--table', 'errors', '--jobs', str(jobs), *more]
            with unittest.mock.patch.object(sys, 'argv', words):
                quality.main()
            with open(document) as file:
                return file.read()
        one_by_one = written(1)
        self.assertIn('| `rules/void_outweighs` 60 |', one_by_one)
        self.assertEqual(one_by_one.count('commit abc, 1 scans of each simulated drive:'), 2)
        self.assertIn('text\n' + quality.marks('calibration')[1], one_by_one, 'not asked for')
        self.assertEqual(written(2), one_by_one)
        with self.assertRaisesRegex(SystemExit, 'missing.yaml'):
            written(2, '--preset', 'missing')

    def test_tradeoff_and_views(self):
        modes = {name: points[:2] for name, points in tradeoff.MODES.items() if name in ('none', 'linear', 'line, bilinear')}
        with unittest.mock.patch.object(tradeoff, 'MODES', modes):
            self.expect_pictures(tradeoff.draw(self.programs, self.drive, 'small', 'a test', self.output), 2)
        rows = self.rows('figure4_small.csv')
        self.assertEqual([row['mode'] for row in rows], ['none', 'linear', 'linear', 'line, bilinear'])
        self.assertEqual(int(rows[0]['samples_or_beams']), 0)
        self.assertGreater(int(rows[2]['samples_or_beams']), int(rows[1]['samples_or_beams']))
        self.assertGreater(int(rows[0]['car_voxels']), int(rows[3]['car_voxels']))

    def test_frontier(self):
        options = {name: frontier.OPTIONS[name] for name in ('linear, 1', 'line, bilinear, observed')}
        with unittest.mock.patch.object(frontier, 'OPTIONS', options):
            presets = os.path.join(SOURCE, 'config', 'presets')
            self.expect_pictures(frontier.draw(self.programs, self.drive, 'small', 'a test', presets, self.output), 2)
        rows = {row['option']: row for row in self.rows('frontier_small.csv')}
        self.assertEqual(len(rows), len(os.listdir(presets)) + 2)
        self.assertEqual(float(rows['preset paper_none']['sa']), 100.0)
        curves = {(row['preset'], row['of']) for row in self.rows('calibration_small.csv')}
        kinds = ('probability', 'class_probability', 'occupancy')
        self.assertEqual(curves, {(os.path.splitext(p)[0], of) for p in os.listdir(presets) for of in kinds})
        self.assertGreater(float(rows['line, bilinear, observed']['free_recall']), float(rows['linear, 1']['free_recall']))

    def test_method(self):
        method.draw(self.output)
        names = sorted(name for name in os.listdir(self.output) if name.startswith('method_'))
        self.assertEqual(names, sorted(n for n in os.listdir(f'{SOURCE}/docs/images') if n.startswith('method_')))
        self.expect_pictures(''.join(f'![]({name})' for name in names), 3)
        for name in names:  # fonts and versions of matplotlib move some pixels
            shown = ink(f'{SOURCE}/docs/images/{name}')
            self.assertAlmostEqual(ink(os.path.join(self.output, name)), shown, delta=0.2 * shown, msg=name)

    def test_balls_lie_within_their_extent(self):
        for azimuth, elevation in ((0.3, 0.0), (-2.0, 1.2), (1.0, -0.9)):
            outline = method.ball_outline(azimuth, elevation, 0.25)
            half_elevation, half_azimuth = method.ball_extent(elevation, 1.0, math.sin(0.25))
            turned = [math.remainder(math.atan2(y, x) - azimuth, 2 * math.pi) for x, y, _ in outline]
            self.assertAlmostEqual(max(turned), half_azimuth, places=4)
            self.assertAlmostEqual(max(abs(math.asin(z) - elevation) for _, _, z in outline), half_elevation, places=4)
        self.assertIsNone(method.ball_extent(1.4, 1.0, math.sin(0.25))[1])

    def test_complexity(self):
        self.assertAlmostEqual(complexity.exponent([1, 2, 4], [3, 12, 48]), 2.0)
        small = {'MODES': {'linear, 1 sample': {'free_space/mode': 'linear'}, 'uniform, 1 sample': {}},
                 'RESOLUTIONS': (0.4, 0.3), 'COLUMNS': (450, 1800), 'SAMPLES': (1, 2), 'RANGES': (10, 20), 'REPEATS': 1}
        with unittest.mock.patch.multiple(complexity, **small):
            self.expect_pictures(complexity.draw(self.programs, self.output, 2), 1)
        rows = self.rows('complexity.csv')
        self.assertEqual(len(rows), 2 * (2 + 2 + 2) + 4)
        points = [float(row['value']) for row in rows if row['varied'] == 'points']
        self.assertGreater(points[1], 3 * points[0])


if __name__ == '__main__':
    unittest.main()
