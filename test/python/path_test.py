#!/usr/bin/env python3
"""A drive is simulated, mapped, planned and drawn, as docs/navigation.md shows."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from matplotlib import image

import bki_mapping

BIN, SOURCE = os.environ['BKI_MAPPING_BIN'], os.environ['BKI_MAPPING_SOURCE_DIR']


class Path(unittest.TestCase):
    def test_commands_of_the_document(self):
        with open(os.path.join(SOURCE, 'docs/navigation.md')) as file:
            block = next(b for b in re.findall(r'^```sh\n(.*?)^```$', file.read(), re.MULTILINE | re.DOTALL) if 'plan_path' in b)
        with tempfile.TemporaryDirectory() as folder:
            for command in block.strip().splitlines():
                command = re.sub(r'build(-examples|/devel/lib/bki_mapping)/', BIN + '/', command)
                command = command.replace('examples/', f'{SOURCE}/examples/').replace('config/', f'{SOURCE}/config/')
                command = re.sub(r'^python3 ', f'{sys.executable} ', command).replace('--scans 60', '--scans 60 --columns 900')
                done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, timeout=200, check=False)
                self.assertEqual(done.returncode, 0, f'{command}: {done.stderr}')
            path = np.genfromtxt(os.path.join(folder, 'path.csv'), delimiter=',', names=True)
            self.assertGreater(len(path), 450)
            self.assertIn(f'{0.1 * (len(path) - 1):.1f} m', done.stdout)
            picture = np.rint(255 * image.imread(os.path.join(folder, 'path.png'))[..., :3]).astype(int)
            drawn = {tuple(color) for color in picture.reshape(-1, 3)}
            classes = bki_mapping.load(os.path.join(folder, 'street.bkm')).classes
            for name in ('car', 'building', 'trunk'):
                self.assertIn(classes[name].color, drawn, name)
            for color in ((0, 0, 0), (255, 255, 255)):  # the path, in both pictures
                self.assertIn(color, drawn)


if __name__ == '__main__':
    unittest.main()
