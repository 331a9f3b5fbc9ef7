#!/usr/bin/env python3
"""scripts/compare on a tiny drive: every map has its row, and OctoMap has the settings of its row."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
sys.path.insert(0, os.path.join(SOURCE, 'lab'))

import matplotlib  # noqa: E402
matplotlib.use('Agg')
import matplotlib.image  # noqa: E402

from figures import comparison, comparison_pictures  # noqa: E402
from figures.programs import Programs  # noqa: E402

SETTINGS = ['default', 'max_range=10', 'hit=0.9,discretize=true']
OURS = ['paper_none', 'paper_line', 'robot', 'robot without labels']


def colors(path):
    """The colours of a picture, as hexadecimal numbers."""
    pixels = (255 * matplotlib.image.imread(path)[..., :3] + 0.5).astype(int)
    return {f'#{r:02x}{g:02x}{b:02x}' for r, g, b in pixels.reshape(-1, 3)}


class Comparison(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.output = cls.folder.name
        programs = Programs(os.environ['BKI_MAPPING_BIN'], cls.output)
        drive = programs.simulate('drive', scans=8, beams=24, columns=600, scene='crowd')
        ours = {name: comparison.OURS[name] for name in OURS}
        with unittest.mock.patch.multiple(comparison, OURS=ours, OCTOMAP=SETTINGS):
            comparison.main(['--programs', os.environ['BKI_MAPPING_BIN'], '--output', cls.output, '--sequence', drive,
                             '--scans', '6', '--resolution', '0.4', '--commit', 'abc'])
        with open(os.path.join(cls.output, 'comparison.json')) as file:
            cls.figures = json.load(file)
        with open(os.path.join(cls.output, 'comparison.md')) as file:
            cls.table = file.read()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_every_map_has_a_row_of_sensible_figures(self):
        rows = [line.strip('| ').split(' | ') for line in self.table.splitlines() if line.startswith('| ')]
        self.assertEqual(rows[0], comparison.HEADER)
        names = [f'OctoMap, {each}' for each in SETTINGS] + OURS
        self.assertEqual([row[0] for row in rows[1:]], names)
        self.assertEqual(list(self.figures), names)
        for row in rows[1:]:
            self.assertEqual(len(row), len(comparison.HEADER), row)
            for name, cell in zip(comparison.HEADER[5:], row[5:]):
                if (row[0], name) in (('paper_none', 'free precision'), ('robot without labels', 'holes')):
                    self.assertEqual(cell, '', 'nothing is free without free space, nor a floor without labels')
                    continue
                self.assertTrue(0.0 <= float(cell) <= 100.0, (row[0], name, cell))
            self.assertGreater(float(row[1]), 0.0)
            self.assertGreater(float(row[2]), 0.0)
            self.assertEqual(row[3] == '', row[0].startswith('OctoMap'), 'only OctoMap has one thread')
        self.assertIn('commit abc: sequence drive, 6 scans, voxels of 0.4 m. Y = ', self.table)

    def test_octomap_has_the_settings_of_its_row(self):
        default, near, certain = (self.figures[f'OctoMap, {each}'] for each in SETTINGS)
        self.assertLess(near['map_bytes'], 0.7 * default['map_bytes'])
        self.assertLess(near['sa'], default['sa'])
        self.assertGreater(certain['sa'], default['sa'])
        self.assertEqual(default['static_points'], self.figures['robot']['static_points'])
        self.assertEqual(default['moving_points'], self.figures['robot']['moving_points'])

    def test_maps_that_differ_look_different(self):
        self.assertEqual(self.figures['paper_none']['sa'], 1.0)
        self.assertEqual(self.figures['paper_none']['truth']['free_recall'], 0.0)
        self.assertGreater(self.figures['robot']['sa'], self.figures['OctoMap, default']['sa'])
        self.assertNotEqual(self.figures['robot']['da'], self.figures['robot without labels']['da'])
        seen = colors(os.path.join(self.output, 'comparison_left.png'))
        for color, meaning in (*comparison_pictures.KINDS.values(), comparison_pictures.HAS_LEFT):
            self.assertIn(color, seen, meaning)
        seen = colors(os.path.join(self.output, 'comparison_time.png'))
        for color in (*comparison_pictures.COLORS.values(), comparison_pictures.PAPER):
            self.assertIn(color, seen)

    def test_columns_without_figures_are_left_out(self):
        self.assertEqual(comparison.without_empty_columns(['a', 'b', 'c'], [['x', '', ''], ['y', '', '0']]),
                         (['a', 'c'], [['x', ''], ['y', '0']]))

    def test_the_window_is_where_most_has_left(self):
        width, height = comparison_pictures.WINDOW
        crowd = [(101.0 + 0.1 * n, -51.0) for n in range(9)]
        left, bottom = comparison_pictures.busiest([(0.0, 0.0), *crowd])
        for x, y in crowd:
            self.assertTrue(left <= x < left + width and bottom <= y < bottom + height)
        self.assertEqual(comparison_pictures.busiest([]), (0.0, 0.0))

    def test_the_script_says_what_it_does_not_know(self):
        run = subprocess.run([os.path.join(SOURCE, 'scripts', 'compare'), '--resolutions', '0.1'], capture_output=True,
                             text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn("option '--resolutions' is unknown; known options: --sequence DIR", run.stderr)


if __name__ == '__main__':
    unittest.main()
