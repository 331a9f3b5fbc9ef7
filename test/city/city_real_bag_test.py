#!/usr/bin/env python3
"""A real bag, without labels and tf, as a drive of a city."""
import json
import os
import pathlib
import sys
import unittest

from harness import BIN, MadeCity, tiles_of

if 'BKI_MAPPING_TEST_DATA' not in os.environ:
    print('SKIPPED: needs BKI_MAPPING_TEST_DATA', file=sys.stderr)
    sys.exit(77)
if not (BIN / 'map_bag').exists():
    print('SKIPPED: needs map_bag, which is built with ROS', file=sys.stderr)
    sys.exit(77)


class RealBag(MadeCity):
    def test_a_real_bag_without_labels_and_tf(self):
        path = pathlib.Path(os.environ['BKI_MAPPING_TEST_DATA']) / 'bags/luminar_no_label_no_tf.bag'

        def city(**more):
            bag = {'bag': str(path), 'name': 'real', 'cloud_topic': '/luminar_pointcloud', 'labelled': False, **more}
            made = self.describe([])
            made.write_text(json.dumps({'drives': [bag], 'classes': 'occupancy', 'piece_scans': 2}))
            return made
        text = self.finish(self.start(city(), '--workers', '2'), 1)
        self.assertIn("no cloud of /luminar_pointcloud has a transform to 'map' (5 unknown frame)", text)
        # In the frame of its clouds, no tf is needed.
        self.finish(self.start(city(frame='luminar_lidar'), '--workers', '2', '--resume'))
        index = json.loads((self.output / 'index.json').read_text())
        self.assertEqual([piece['scans'] for piece in index['drives'][0]['pieces']], [2, 2, 1])
        self.assertGreater(len(tiles_of(*(self.output / region['file'] for region in index['regions']))), 10)


if __name__ == '__main__':
    unittest.main()
