#!/usr/bin/env python3
"""Right poses of real drives are not warned of."""
import glob
import os
import subprocess
import sys
import unittest

BIN = os.environ['BKI_MAPPING_BIN']
DATA = os.environ.get('BKI_MAPPING_TEST_DATA')
if not DATA:
    print('SKIPPED: needs BKI_MAPPING_TEST_DATA', file=sys.stderr)
    sys.exit(77)


class RealSequences(unittest.TestCase):
    def test_right_poses_give_no_warning(self):
        drives = glob.glob(os.path.join(DATA, 'semantickitti', 'sequences', '*')) + glob.glob(os.path.join(DATA, 'vlp32', '*'))
        self.assertTrue(drives)
        for drive in sorted(drives):
            run = subprocess.run([os.path.join(BIN, 'map_sequence'), '--sequence', drive, '--set', 'free_space/mode=none'],
                                 capture_output=True, text=True, timeout=120, check=True)
            self.assertNotIn('poses', run.stderr, drive)


if __name__ == '__main__':
    unittest.main()
