#!/usr/bin/env python3
"""Draws a horizontal section of a map file: classes and free space, and the probability that something is there.

    python3 examples/draw_section.py street.bkm --z -0.8 --output section.png
"""
import argparse

import matplotlib
import numpy as np

import bki_mapping

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402


def section(map_, z):
    """The centres of the voxels at one height [m], (rows, columns, 3), as far as the map's blocks reach."""
    edge, blocks = map_.resolution, map_.blocks
    low, high = 8 * edge * blocks.min(axis=0), 8 * edge * (blocks.max(axis=0) + 1)
    x, y = np.meshgrid(*(np.arange(low[axis] + edge / 2, high[axis], edge) for axis in (0, 1)))
    return np.stack([x, y, np.full_like(x, z)], axis=-1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('map', help='map file (.bkm)')
    parser.add_argument('--z', type=float, default=0.0, help='height of the section, map frame [m]')
    parser.add_argument('--output', default='section.png')
    given = parser.parse_args()

    map_ = bki_mapping.load(given.map)
    points = section(map_, given.z)
    said = map_.query(points.reshape(-1, 3)).reshape(points.shape[:2])

    classes = np.full((*said.shape, 3), 200, np.uint8)  # unknown
    classes[said['state'] == bki_mapping.FREE] = 255
    occupied = said['state'] == bki_mapping.OCCUPIED
    classes[occupied] = map_.classes.colors[said['label'][occupied]]
    occupancy = np.where(said['state'] == bki_mapping.UNKNOWN, np.nan, said['occupancy'])

    extent = [points[0, 0, 0], points[0, -1, 0], points[0, 0, 1], points[-1, 0, 1]]
    figure, axes = plt.subplots(1, 2, figsize=(13, 5), sharex=True, sharey=True, constrained_layout=True)
    axes[0].imshow(classes, origin='lower', extent=extent, interpolation='nearest')
    axes[0].set(xlabel='x [m]', ylabel='y [m]', title=f'Classes at z = {given.z:g} m; white is free, grey unknown')
    shown = axes[1].imshow(occupancy, origin='lower', extent=extent, interpolation='nearest', vmin=0, vmax=1)
    axes[1].set(xlabel='x [m]', title='Probability that something is there')
    figure.colorbar(shown, ax=axes[1], shrink=0.8)
    figure.savefig(given.output, dpi=120)
    print(f'{given.output}: {np.count_nonzero(occupied)} occupied voxels, {np.count_nonzero(said["state"] == bki_mapping.FREE)} free')


if __name__ == '__main__':
    main()
