#!/usr/bin/env python3
"""Draws a section through a map file: its classes, and the distance to the nearest obstacle, which is anything but ground.

    python3 examples/draw_section.py street.bkm --z -0.8 --output section.png
    python3 examples/draw_section.py street.bkm --line 10 -15 10 15 --output across.png
"""
import argparse

import matplotlib
import numpy as np

import bki_mapping

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402


def section_of(map_, z, line):
    """The section at a height, or upright on a line from x, y to x, y [m], as far as the map reaches."""
    lower, upper = map_.bounds
    if line:
        return map_.vertical_section(line[:2], line[2:], lower[2], upper[2])
    return map_.horizontal_section(z, lower[:2], upper[:2])


def distances_of(map_, section, reach):
    """The distance from each cell to the nearest obstacle [m], counting those up to `reach` [m] from the section."""
    points = section.centres.reshape(-1, 3)
    solid = map_.classes.all_but(c for c in map_.classes if 'ground' in c.flags)
    field = map_.distance_field(points.min(axis=0) - reach, points.max(axis=0) + reach, classes=solid)
    distances, _ = field.at(points)
    return np.minimum(distances, reach).reshape(section.states.shape)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('map', help='map file (.bkm)')
    parser.add_argument('--z', type=float, default=0.0, help='height of a horizontal section, map frame [m]')
    parser.add_argument('--line', type=float, nargs=4, metavar=('X0', 'Y0', 'X1', 'Y1'), help='line of a vertical section instead [m]')
    parser.add_argument('--reach', type=float, default=5.0, help='greatest distance that is drawn [m]')
    parser.add_argument('--output', default='section.png')
    given = parser.parse_args()

    map_ = bki_mapping.load(given.map)
    section = section_of(map_, given.z, given.line)
    distances = distances_of(map_, section, given.reach)
    occupied, free = section.states == bki_mapping.OCCUPIED, section.states == bki_mapping.FREE
    known = free | occupied
    if not known.any():
        raise SystemExit('nothing is known in this section; the map reaches from {} to {} m'.format(*map_.bounds.round(1).tolist()))

    classes = np.full((*occupied.shape, 3), 200, np.uint8)  # unknown
    classes[free] = 255
    classes[occupied] = map_.classes.colors[section.labels[occupied]]

    edge, (rows, columns) = section.resolution, occupied.shape
    left, bottom = (0.0, section.origin[2]) if given.line else section.origin[:2]
    extent = [left, left + edge * columns, bottom, bottom + edge * rows]
    shown = [np.flatnonzero(known.any(axis=axis)) for axis in (0, 1)]  # columns and rows where something is known
    width, height = (np.ptp(each) + 1 for each in shown)
    figure, axes = plt.subplots(*((2, 1) if width > height else (1, 2)), figsize=(10, 1.5 + 16 * min(1, height / width)), sharex=True,
                                sharey=True, constrained_layout=True)
    place = 'from {:g}, {:g} to {:g}, {:g} m'.format(*given.line) if given.line else f'at z = {given.z:g} m'
    axes[0].imshow(classes, origin='lower', extent=extent, interpolation='nearest')
    axes[0].set(title=f'Classes {place}; white is free, grey unknown', facecolor='0.8')
    colored = axes[1].imshow(np.ma.masked_where(~known, distances), origin='lower', extent=extent, interpolation='nearest', vmin=0,
                             vmax=given.reach)
    axes[1].contour(np.where(known, distances, np.nan), levels=[1.0], colors='white', linewidths=1, extent=extent)
    axes[1].set(title='Distance to anything but ground [m]; the line is at 1 m', facecolor='0.8')
    for each in axes:
        each.set(xlabel='along the section [m]' if given.line else 'x [m]', ylabel='z [m]' if given.line else 'y [m]')
        each.label_outer()
    axes[0].set_xlim(left + edge * (shown[0][0] - 2), left + edge * (shown[0][-1] + 3))
    axes[0].set_ylim(bottom + edge * (shown[1][0] - 2), bottom + edge * (shown[1][-1] + 3))
    figure.colorbar(colored, ax=axes, shrink=0.6)
    figure.savefig(given.output, dpi=120)
    wide_enough = np.count_nonzero(free & (distances > 1.0))
    print(f'{given.output}: {np.count_nonzero(occupied)} occupied voxels, {np.count_nonzero(free)} free, {wide_enough} of them more than 1 m '
          'from obstacles')


if __name__ == '__main__':
    main()
