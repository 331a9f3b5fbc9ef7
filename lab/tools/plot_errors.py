#!/usr/bin/env python3
"""Draws the errors measured by evaluate_map --errors, from above: plot_errors.py FILE.csv FILE.png."""
import csv
import sys

import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

# Correct voxels first and the worst errors last, because later ones are drawn on top.
KINDS = {
    'kept': ('#d0d0d0', 'static, kept'),
    'forgotten': ('#a8dba8', 'moved, cleared'),
    'wrong class': ('#f0b000', 'occupied, but of another class'),
    'lost': ('#1f5fd0', 'static, but not occupied (hole)'),
    'left': ('#e05020', 'moved, but still occupied'),
    'ghost': ('#c000c0', 'ghost: nothing movable near for 0.5 s'),
}


def read(path):
    points = {kind: [] for kind in KINDS}
    with open(path, newline='') as file:
        for row in csv.DictReader(file):
            points[row['what']].append((float(row['x']), float(row['y'])))
    return points


def main():
    if len(sys.argv) != 3:
        sys.exit('usage: plot_errors.py FILE.csv FILE.png')
    points = read(sys.argv[1])
    every = [p for of_kind in points.values() for p in of_kind]
    if not every:
        sys.exit(f'{sys.argv[1]} has no voxels')
    size = [max(p[axis] for p in every) - min(p[axis] for p in every) + 1.0 for axis in (0, 1)]
    width = 12.0
    height = min(max(width * size[1] / size[0], 2.0), 12.0)
    figure, axes = plt.subplots(figsize=(width, height + 1.2))
    dot = (72.0 * 0.92 * width * 0.3 / size[0]) ** 2  # about the size of a voxel of 0.3 m
    patches = []
    for kind, (color, name) in KINDS.items():
        if points[kind]:
            xs, ys = zip(*points[kind])
            axes.scatter(xs, ys, s=max(dot, 0.5) * (1.0 if kind == 'kept' else 2.0), c=color, marker='s', linewidths=0)
            patches.append(Patch(color=color, label=f'{name}: {len(xs)} voxels'))
    axes.set_aspect('equal')
    axes.set_xlabel('x [m]')
    axes.set_ylabel('y [m]')
    figure.legend(handles=patches, loc='lower center', ncol=3, fontsize=8, frameon=False)
    figure.tight_layout(rect=(0, 0.6 / (height + 1.2), 1, 1))
    figure.savefig(sys.argv[2], dpi=110)
    print(sys.argv[2])


if __name__ == '__main__':
    main()
