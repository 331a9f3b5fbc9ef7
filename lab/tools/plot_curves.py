#!/usr/bin/env python3
"""Draws the curves measured by benchmark_sequence --curves: plot_curves.py DIR."""
import csv
import os
import sys

import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402


def read(folder, name):
    """The rows of a CSV file by mode, as floats."""
    modes = {}
    with open(os.path.join(folder, name), newline='') as file:
        for row in csv.DictReader(file):
            mode = row.pop('mode')
            modes.setdefault(mode, []).append({key: float(value) for key, value in row.items()})
    return modes


def new_axes(title, x_label):
    figure, axes = plt.subplots(figsize=(7, 4.2))
    axes.set_title(title)
    axes.set_xlabel(x_label)
    axes.set_ylabel('time of a scan [ms], two threads')
    axes.grid(True, alpha=0.3)
    return figure, axes


def finish(figure, axes, path):
    axes.set_ylim(bottom=0)
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    print(path)


def running_median(values, width):
    medians = []
    for i in range(len(values)):
        window = sorted(values[max(0, i - width // 2):i + width // 2 + 1])
        medians.append(window[len(window) // 2])
    return medians


def draw_growth(folder):
    figure, axes = new_axes('Time of a scan while the map grows (simulated drive)', 'blocks in the map')
    for mode, rows in read(folder, 'growth.csv').items():
        times = [row['ms'] for row in rows]
        blocks = [row['blocks'] for row in rows]
        line, = axes.plot(blocks, running_median(times, 51), label=f'{mode} (running median of 51)')
        axes.plot(blocks, times, '.', markersize=1, alpha=0.3, color=line.get_color())
    finish(figure, axes, os.path.join(folder, 'growth.png'))


def draw_points(folder):
    figure, axes = new_axes('Time of a scan against its number of points (64 beams, 450 to 3600 columns)',
                            'points in the scan')
    for mode, rows in read(folder, 'points.csv').items():
        axes.plot([row['points'] for row in rows], [row['median_ms'] for row in rows], 'o-', label=mode)
    axes.set_xlim(left=0)
    finish(figure, axes, os.path.join(folder, 'points.png'))


def draw_resolution(folder):
    figure, axes = new_axes('Time of a scan against resolution (0.6 m to 0.1 m, kernel 0.3 m)',
                            '1 / resolution$^2$ [1/m$^2$]')
    for mode, rows in read(folder, 'resolution.csv').items():
        axes.plot([row['resolution'] ** -2 for row in rows], [row['median_ms'] for row in rows], 'o-', label=mode)
    axes.set_xlim(left=0)
    finish(figure, axes, os.path.join(folder, 'resolution.png'))


def main():
    if len(sys.argv) != 2:
        sys.exit('usage: plot_curves.py DIR')
    draw_growth(sys.argv[1])
    draw_points(sys.argv[1])
    draw_resolution(sys.argv[1])


if __name__ == '__main__':
    main()
