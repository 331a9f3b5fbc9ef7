"""Runs the programs of the package and reads their output."""
import json
import os
import subprocess
import tempfile
import threading
import time

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
VOXEL = np.dtype([('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('red', 'u1'), ('green', 'u1'), ('blue', 'u1'),
                  ('label', '<u2'), ('state', 'u1'), ('probability', '<f4'), ('occupancy', '<f4'),
                  ('class_probability', '<f4'), ('variance', '<f4'), ('entropy', '<f4'), ('evidence', '<f4')])
FREE, OCCUPIED = 1, 2  # voxel states in map files


def read_ply(path):
    """Reads the voxels of a map file (docs/files.md) into a structured array."""
    with open(path, 'rb') as file:
        content = file.read()
    end = content.index(b'end_header\n') + len(b'end_header\n')
    voxels = np.frombuffer(content[end:], VOXEL)
    count = next(int(line.split()[2]) for line in content[:end].decode().splitlines() if line.startswith('element'))
    if len(voxels) != count:
        raise ValueError(f'{path} has {len(voxels)} voxels, but says {count}')
    return voxels


class Programs:
    """Runs the programs of one folder; intermediate files go to a scratch folder."""

    def __init__(self, folder, scratch):
        self.folder, self.scratch = folder, scratch
        self._simulating = threading.Lock()
        os.makedirs(scratch, exist_ok=True)

    def run(self, name, *arguments):
        start = time.monotonic()
        result = subprocess.run([os.path.join(self.folder, name), *arguments], capture_output=True, text=True,
                                check=False)
        if result.returncode != 0:
            raise SystemExit(f'{name} {" ".join(arguments)} failed:\n{result.stderr}')
        print(f'    {name} {" ".join(arguments)}: {time.monotonic() - start:.1f} s', flush=True)

    def _with(self, name, option, sequence, settings, more):
        words = [word for key, value in settings.items() for word in ('--set', f'{key}={value}')]
        with tempfile.TemporaryDirectory(dir=self.scratch) as folder:
            path = os.path.join(folder, 'figures.json')
            self.run(name, '--sequence', sequence, option, path, *words, *more)
            with open(path) as file:
                return json.load(file)

    def map(self, sequence, settings, states=None, more=()):
        """Maps a sequence; returns the report of map_sequence and, if states are given, the voxels in these states."""
        more = list(more)
        path = os.path.join(self.scratch, 'map.ply')
        if states:
            more += ['--output', path, '--include', states]
        report = self._with('map_sequence', '--report', sequence, settings, more)
        return report, read_ply(path) if states else None

    def evaluate(self, sequence, settings, more=()):
        """Returns the figures of evaluate_map."""
        return self._with('evaluate_map', '--json', sequence, settings, more)

    def simulate(self, name, **options):
        """Simulates a drive unless it exists; returns its folder."""
        folder = os.path.join(self.scratch, name)
        with self._simulating:
            if not os.path.isdir(folder):
                words = [word for key, value in options.items() for word in ('--' + key.replace('_', '-'), str(value))]
                self.run('simulate_drive', '--output', folder, *words)
        return folder


def commit():
    """Short name of the commit of this tree; with a plus if tracked files have changed since."""
    def git(*arguments):
        return subprocess.run(['git', '-C', ROOT, *arguments], capture_output=True, text=True, check=True).stdout.strip()
    return git('rev-parse', '--short', 'HEAD') + ('+' if git('status', '--porcelain', '--untracked-files=no') else '')


def median_samples(report):
    """Median number of free samples (after down-sampling) or beams of a scan."""
    return float(np.median([scan['free_samples_or_beams'] for scan in report['scans']]))
