#!/usr/bin/env python3
"""The examples in Python run on a simulated drive, and draw what the map says."""
import contextlib
import io
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from matplotlib import image

import bki_mapping

BIN = os.environ['BKI_MAPPING_BIN']
EXAMPLES = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'examples')
sys.path.insert(0, os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'test', 'city'))
import small_city  # noqa: E402


class Examples(unittest.TestCase):
    def test_map_and_section(self):
        with tempfile.TemporaryDirectory() as folder:
            def run(*command):
                done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                return done.stdout
            run(os.path.join(BIN, 'simulate_drive'), '--scans', '4', '--beams', '24', '--columns', '600', '--output', 'drive')
            said = run(sys.executable, os.path.join(EXAMPLES, 'map_sequence.py'), 'drive', '--output', 'street')
            map_ = bki_mapping.load(os.path.join(folder, 'street.bkm'))
            self.assertIn('4 scans, median', said)
            self.assertIn(f'{len(map_.voxels())} occupied voxels', said)
            draw = (sys.executable, os.path.join(EXAMPLES, 'draw_section.py'), 'street.bkm')
            said = run(*draw, '--z', '-0.8', '--output', 'section.png')
            self.assertIn(self.clearances(map_, -0.8), said)
            run(*draw, '--line', '0', '-15', '0', '15', '--output', 'across.png')
            for name, class_name in (('street.png', 'road'), ('section.png', 'building'), ('across.png', 'road')):
                picture = image.imread(os.path.join(folder, name))[..., :3]
                self.assertGreater(min(picture.shape[:2]), 200)
                drawn = {tuple(color) for color in np.rint(255 * picture.reshape(-1, 3)).astype(int)}
                self.assertIn(map_.classes[class_name].color, drawn, name)
                self.assertEqual((68, 1, 84) in drawn, name != 'street.png', 'the colour of distance 0')
            nothing = subprocess.run([*draw, '--z', '40'], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
            self.assertRegex(nothing.stderr, r'^nothing is known in this section; the map reaches from \[.*\] to \[.*\] m\n$')
            wrong = subprocess.run([sys.executable, os.path.join(EXAMPLES, 'map_sequence.py'), '/no/such'], capture_output=True, text=True,
                                   timeout=60, check=False)
            self.assertNotEqual(wrong.returncode, 0)

    def clearances(self, map_, z):
        """What draw_section prints, from the obstacle that is nearest to each voxel."""
        section = map_.horizontal_section(z, *map_.bounds[:, :2])
        centres, free = section.centres, section.states == bki_mapping.FREE
        solid = map_.classes.all_but([c for c in map_.classes if 'ground' in c.flags])
        far = map_.nearest_obstacles(centres[free], solid)['distance'] > 1.0
        return f'{free.sum()} free, {far.sum()} of them more than 1 m'

    def test_blocks_of_the_documents(self):
        """What docs/start.md and docs/python.md show runs as it stands, block after block."""
        rng = np.random.default_rng(1)
        given = {'origin': (0.0, 0.0, 1.7), 'points': rng.uniform([4, -3, -1], [4.1, 3, 1], (500, 3)).astype(np.float32),
                 'labels': np.full(500, 50, np.uint32), 'stamp': 0, 'pose': np.eye(4)}
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            self.addCleanup(os.chdir, before)
            subprocess.run([os.path.join(BIN, 'simulate_drive'), '--scans', '2', '--beams', '8', '--columns', '200', '--output',
                            'demo_output/drive'], check=True, capture_output=True, timeout=60)
            small_city.program(BIN, 'map_sequence', '--sequence', 'demo_output/drive', '--output', 'drive.bkm')
            small_city.write_city(BIN, ['drive.bkm'], 'city', 2)
            for name in ('a', 'b', 'yesterday'):
                bki_mapping.SemanticMapper(config='robot').save(f'{name}.bkm')
            for document in ('docs/start.md', 'docs/python.md'):
                with open(os.path.join(os.path.dirname(EXAMPLES), document)) as file:
                    blocks = re.findall(r'^```python\n(.*?)^```$', file.read(), re.MULTILINE | re.DOTALL)
                self.assertGreater(len(blocks), 0, document)
                names = dict(given)
                with contextlib.redirect_stdout(io.StringIO()):
                    for block in blocks:
                        exec(compile(block, document, 'exec'), names)
                self.assertGreater(len(names['mapper'].map.voxels()), 10)
            os.chdir(before)


if __name__ == '__main__':
    unittest.main()
