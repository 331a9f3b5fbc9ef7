"""Runs the programs of the package and reads what they write."""
import json
import os
import subprocess
import time

import numpy as np

VOXEL = np.dtype([('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('red', 'u1'), ('green', 'u1'), ('blue', 'u1'),
                  ('label', '<u2'), ('state', 'u1'), ('probability', '<f4'), ('variance', '<f4'), ('entropy', '<f4'),
                  ('evidence', '<f4')])
FREE, OCCUPIED = 1, 2  # states of voxels in map files


def read_ply(path):
    """The voxels of a map file (docs/files.md) as a structured array."""
    with open(path, 'rb') as file:
        content = file.read()
    end = content.index(b'end_header\n') + len(b'end_header\n')
    voxels = np.frombuffer(content[end:], VOXEL)
    count = next(int(line.split()[2]) for line in content[:end].decode().splitlines() if line.startswith('element'))
    if len(voxels) != count:
        raise ValueError(f'{path} has {len(voxels)} voxels, but says {count}')
    return voxels


class Programs:
    """Calls the programs in one folder; files in between go to a scratch folder."""

    def __init__(self, folder, scratch):
        self.folder, self.scratch = folder, scratch
        os.makedirs(scratch, exist_ok=True)

    def run(self, name, *arguments):
        start = time.monotonic()
        result = subprocess.run([os.path.join(self.folder, name), *arguments], capture_output=True, text=True,
                                check=False)
        if result.returncode != 0:
            raise SystemExit(f'{name} {" ".join(arguments)} failed:\n{result.stderr}')
        print(f'    {name} {" ".join(arguments)}: {time.monotonic() - start:.1f} s', flush=True)

    def _with(self, name, option, sequence, settings, more):
        path = os.path.join(self.scratch, 'figures.json')
        words = [word for key, value in settings.items() for word in ('--set', f'{key}={value}')]
        self.run(name, '--sequence', sequence, option, path, *words, *more)
        with open(path) as file:
            return json.load(file)

    def map(self, sequence, settings, states=None, more=()):
        """Maps a sequence: the report of map_sequence and, where states are asked for, the voxels in them."""
        more = list(more)
        path = os.path.join(self.scratch, 'map.ply')
        if states:
            more += ['--output', path, '--include', states]
        report = self._with('map_sequence', '--report', sequence, settings, more)
        return report, read_ply(path) if states else None

    def evaluate(self, sequence, settings, more=()):
        """The figures of evaluate_map."""
        return self._with('evaluate_map', '--json', sequence, settings, more)

    def simulate(self, name, **options):
        """A simulated drive; returns its folder, and makes it only once."""
        folder = os.path.join(self.scratch, name)
        if not os.path.isdir(folder):
            words = [word for key, value in options.items() for word in ('--' + key.replace('_', '-'), str(value))]
            self.run('simulate_drive', '--output', folder, *words)
        return folder


def median_samples(report):
    """Free samples (after down-sampling) or beams of a scan, in the median."""
    return float(np.median([scan['free_samples_or_beams'] for scan in report['scans']]))
