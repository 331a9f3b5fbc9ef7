#!/usr/bin/env python3
"""Boxes of cities and of map files in Python: what they say equals what the whole map says."""
import concurrent.futures
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import numpy as np

import bki_mapping as bki

sys.path.insert(0, os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'test', 'city'))
import small_city  # noqa: E402

BOX = np.array([[-20, -30, -np.inf], [40, 8.1, np.inf]])


class CityMap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.index = small_city.make(os.environ['BKI_MAPPING_BIN'], cls.folder)
        cls.whole = bki.load(cls.folder / 'whole.bkm')

    def same(self, one, other):
        self.assertTrue(np.array_equal(one.blocks, other.blocks))
        for index in one.blocks:
            a, b = one.block(index), other.block(index)
            self.assertTrue(np.array_equal(a.classes, b.classes) and np.array_equal(a.planes, b.planes), index)

    def test_everything_is_the_whole_map(self):
        self.same(bki.open_city(self.folder / 'city').load(), self.whole)
        self.same(bki.load(self.folder / 'city'), self.whole)

    def test_a_box_of_a_city_and_of_a_file(self):
        voxels = self.whole.voxels('occupied,free,occluded')
        inside = np.ones(len(voxels), bool)
        for axis, name in enumerate('xyz'):
            inside &= (voxels[name] >= BOX[0, axis]) & (voxels[name] <= BOX[1, axis])
        self.assertTrue(0 < inside.sum() < len(voxels))
        city = bki.open_city(self.folder / 'city')
        for part in (city.load(BOX), city.load((BOX[1].tolist(), BOX[0].tolist())),
                     bki.load(self.folder / 'whole.bkm', box=BOX), bki.load(str(self.folder / 'city'), box=BOX)):
            found = part.voxels('occupied,free,occluded')
            for name in ('x', 'y', 'z', 'state', 'label'):
                self.assertTrue(np.array_equal(found[name], voxels[inside][name]), name)
        self.assertTrue(0 < city.tiles_read < 2 * city.tiles)
        self.assertLess(city.files_read, len(city.regions))
        self.assertEqual(len(bki.load(self.folder / 'whole.bkm', box=((900, 0, 0), (901, 1, 1))).blocks), 0)

    def test_points_need_their_tiles_only(self):
        city = bki.open_city(self.folder / 'city')
        points = np.random.default_rng(1).uniform((-60, -60, -2), (80, 60, 3), (2000, 3))
        self.assertTrue(np.array_equal(city.load_at(points).query(points), self.whole.query(points)))
        before = city.tiles_read
        few = points[:1].astype(np.float32)
        self.assertTrue(np.array_equal(city.load_at(few).states(few), self.whole.states(few)))
        self.assertLessEqual(city.tiles_read - before, 1)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:  # calls wait for each other
            maps = list(pool.map(lambda some: city.load_at(some).states(some), np.split(points, 40)))
        self.assertTrue(np.array_equal(np.concatenate(maps), self.whole.states(points)))

    def test_what_a_city_says_of_itself(self):
        city = bki.open_city(str(self.folder / 'city') + '/')
        self.assertEqual(city.path, str(self.folder / 'city'))
        self.assertEqual((city.resolution, city.frame, city.classes.name), (0.3, 'map', 'semantic_kitti'))
        self.assertEqual(city.drives, ['d1/000000-000004', 'd2/000000-000004'])
        self.assertEqual(city.tiles, sum(region['tiles'] for region in self.index['regions']))
        for field in ('x', 'y', 'tiles', 'blocks', 'bytes'):
            self.assertEqual(city.regions[field].tolist(), [region[field] for region in self.index['regions']])
        voxels = self.whole.voxels('occupied,free,occluded')
        corners = [[function(voxels[axis]) + sign * 0.15 for axis in 'xyz'] for function, sign in ((np.min, -1), (np.max, 1))]
        self.assertTrue(np.allclose(city.bounds, corners, atol=1e-4))

    def test_wrong_input_is_refused_in_one_sentence(self):
        city = bki.open_city(self.folder / 'city')
        nan = float('nan')
        for error, words, call in (
                (bki.MapFileError, 'holds no index.json', lambda: bki.open_city(self.folder)),
                (bki.MapFileError, 'cannot be opened', lambda: bki.open_city(self.folder / 'none')),
                (ValueError, 'is a map file, not a city; call load', lambda: bki.open_city(self.folder / 'whole.bkm')),
                (bki.MapFileError, 'the limit is 1 MB; ask for a smaller box', lambda: city.load(memory_limit=1)),
                (bki.MapFileError, 'the limit is 1 MB', lambda: bki.load(self.folder / 'whole.bkm', memory_limit=1)),
                (ValueError, 'a corner of box', lambda: city.load(((0, 0, nan), (1, 1, 1)))),
                (ValueError, 'box must be two corners', lambda: city.load((1, 2, 3))),
                (TypeError, 'box must be two corners', lambda: city.load(7)),
                (TypeError, 'box must be two corners', lambda: bki.load(self.folder / 'city', box='all')),
                (ValueError, 'not a finite number', lambda: city.load_at([[0, 0, nan]])),
                (ValueError, 'points', lambda: city.load_at([0, 0, 0]))):
            with self.assertRaisesRegex(error, words) as raised:
                call()
            self.assertNotIn('\n', str(raised.exception))


if __name__ == '__main__':
    unittest.main()
