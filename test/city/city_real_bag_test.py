#!/usr/bin/env python3
"""A real bag, without labels and tf, as a drive of a city."""
import os
import pathlib
import sys
import unittest

from harness import MadeCity, program, tiles_of

from bki_mapping.city import bags
from bki_mapping.city.description import Bag, CityError

if 'BKI_MAPPING_TEST_DATA' not in os.environ:
    print('SKIPPED: needs BKI_MAPPING_TEST_DATA', file=sys.stderr)
    sys.exit(77)


class RealBag(MadeCity):
    def test_a_real_bag_without_labels_and_tf(self):
        path = pathlib.Path(os.environ['BKI_MAPPING_TEST_DATA']) / 'bags/luminar_no_label_no_tf.bag'
        bag = Bag(path, '/luminar_pointcloud', 'map', 'label', False)
        with self.assertRaisesRegex(CityError, "no cloud of /luminar_pointcloud has a transform to 'map'"):
            bags.extract(bag, self.folder / 'real1')
        # In the frame of its clouds, no tf is needed.
        self.assertEqual(bags.extract(bag._replace(frame='luminar_lidar'), self.folder / 'real2'), (5, 0))
        program('map_sequence', '--sequence', self.folder / 'real2', '--classes', 'occupancy',
                '--output', self.folder / 'real.bkm')
        self.assertGreater(len(tiles_of(self.folder / 'real.bkm')), 10)


if __name__ == '__main__':
    unittest.main()
