#!/usr/bin/env python3
"""Compares queries in Python with the same ones in C++: processor time of one thread, in turns, on the same simulated street.

    source build/devel/setup.bash
    python3 lab/benchmark/compare_python.py --programs build/devel/lib/bki_mapping
"""
import argparse
import json
import os
import subprocess
import tempfile
import time

import numpy as np

import bki_mapping


def frames_of(programs, scans):
    """A simulated drive; the street depends on its length."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([os.path.join(programs, 'simulate_drive'), '--scans', str(scans), '--output', folder], check=True, capture_output=True)
        return list(bki_mapping.Sequence(folder))


class Street:
    """The map and the questions of benchmark_parts."""

    def __init__(self, programs):
        self.mapper = bki_mapping.SemanticMapper('semantic_kitti', threads=1)
        frames = frames_of(programs, 10)
        for frame in frames:
            self.integrate(frame)
        self.before = self.mapper.snapshot()
        self.integrate(frames_of(programs, 11)[10])
        self.after, self.changed = self.mapper.snapshot(), self.mapper.touched_blocks
        random = np.random.default_rng(1)
        middle = frames[5].pose[:3, 3]
        self.points = middle + random.uniform([-40, -20, -2], [40, 20, 2], (200000, 3))
        blocks = np.floor(self.points / (8 * self.before.resolution)).astype(int)
        self.sorted = self.points[np.lexsort(blocks.T)]
        self.origins = middle + random.uniform([-10, -3, -0.5], [10, 3, 0.5], (200000, 3))
        self.directions = random.uniform([-1, -1, -0.2], [1, 1, 0.2], (200000, 3))
        self.poses = np.tile(np.eye(4), (2000, 1, 1))
        yaw = random.uniform(-3.1, 3.1, 2000)
        self.poses[:, 0, 0] = self.poses[:, 1, 1] = np.cos(yaw)
        self.poses[:, 1, 0] = np.sin(yaw)
        self.poses[:, 0, 1] = -self.poses[:, 1, 0]
        self.poses[:, :3, 3] = self.points[:2000]
        self.z, self.low, self.high = middle[2], middle - [50, 50, 5], middle + [50, 50, 5]
        self.field = self.before.distance_field(self.low, self.high)

    def integrate(self, frame):
        self.mapper.integrate(frame.pose, frame.points, frame.labels, stamp=frame.stamp)

    def follow(self):
        self.field.update(self.after, self.changed)
        self.field.update(self.before, self.changed)

    def queries(self):
        """What benchmark_parts calls each question, how it is asked here, and how many answers it has."""
        map_ = self.before
        some = ['state', 'occupancy', 'variance']
        return (('PointStates', lambda: map_.states(self.points), 200000),
                ('PointStatesSorted', lambda: map_.states(self.sorted), 200000),
                ('PointPosteriors', lambda: map_.query(self.points, some), 200000),
                ('PointPosteriorsSorted', lambda: map_.query(self.sorted, some), 200000),
                ('Rays', lambda: map_.cast_rays(self.origins, self.directions, 20.0), 200000),
                ('RaysToUnknown', lambda: map_.cast_rays(self.origins, self.directions, 20.0, stop_at_unknown=True), 200000),
                ('Footprints', lambda: map_.contents_along(self.poses, (2.5, 1.0, 0.75)), 2000),
                ('NearestObstacle', lambda: map_.nearest_obstacles(self.points[:2000]), 2000),
                ('Section', lambda: map_.horizontal_section(self.z, self.low[:2], self.high[:2]), 1),
                ('FrontierSizes', map_.frontiers, 1),
                ('DistanceField', lambda: map_.distance_field(self.low, self.high), 1),
                ('DistanceUpdate', self.follow, 2))


def time_in_cpp(programs, name):
    """Processor time of an answer [s]."""
    threads = '' if name == 'NearestObstacle' else '/threads:1'
    said = subprocess.run([os.path.join(programs, 'benchmark_parts'), f'--benchmark_filter=^{name}{threads}(/real_time)?$',
                           '--benchmark_format=json', '--benchmark_min_time=0.3'], check=True, capture_output=True, text=True).stdout
    result, = json.loads(said)['benchmarks']
    answers = {'NearestObstacle': 2000, 'Footprints': 2000, 'DistanceUpdate': 2}.get(name, 200000 if name.startswith(('Point', 'Rays')) else 1)
    return 1e-3 * result['cpu_time'] / answers


def time_in_python(ask, answers):
    ask()
    count, start = 0, time.process_time()
    while time.process_time() < start + 0.3:
        ask()
        count += 1
    return (time.process_time() - start) / (count * answers)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--programs', required=True, help='folder of simulate_drive and benchmark_parts')
    parser.add_argument('--repeats', type=int, default=5)
    parser.add_argument('--only', help='comma-separated names of benchmarks')
    given = parser.parse_args()

    street = Street(given.programs)
    print(street.before)
    print('C++, Python: microseconds an answer, the least; Python / C++: the median of the ratios of each turn')
    for name, ask, answers in street.queries():
        if given.only and name not in given.only.split(','):
            continue
        turns = [(time_in_cpp(given.programs, name), time_in_python(ask, answers)) for _ in range(given.repeats)]
        cpp, python = np.array(turns).T
        print(f'{name:24} {1e6 * cpp.min():12.3f} {1e6 * python.min():12.3f} {np.median(python / cpp):6.2f}', flush=True)


if __name__ == '__main__':
    main()
