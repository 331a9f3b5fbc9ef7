#!/usr/bin/env python3
"""Draws a path of plan_path over the map: the ground, what stands on it, and the distances that it keeps.

    plan_path street.bkm semantic_kitti 2 -5.3 0 48 8 0 > path.csv
    python3 examples/draw_path.py street.bkm path.csv --output path.png
"""
import argparse

import matplotlib
import numpy as np

import bki_mapping

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402

ROBOT = np.array([[0.6, 0.4], [-0.6, 0.4], [-0.6, -0.4], [0.6, -0.4], [0.6, 0.4]])  # its outline [m]
GROUND = ('road', 'parking', 'sidewalk', 'other-ground', 'terrain')  # of SemanticKITTI
MARGIN = 6.0  # of the picture around the path [m]


def section(map_, xy, z):
    """What is at one height."""
    return map_.query(np.dstack([*xy, np.full_like(xy[0], z)]).reshape(-1, 3)).reshape(xy[0].shape)


def obstacles_in(map_, layer):
    ground = [c.id for c in map_.classes if c.name in GROUND]
    return (layer['state'] == bki_mapping.OCCUPIED) & ~np.isin(layer['label'], ground)


def distances_to(obstacles, edge):
    """From each cell to the nearest obstacle [m], by comparing all of them."""
    found = np.argwhere(obstacles)
    rows, columns = obstacles.shape
    result = np.full(obstacles.shape, np.inf)
    for row in range(rows if len(found) else 0):
        across = (np.arange(columns)[:, None] - found[:, 1]) ** 2
        result[row] = edge * np.sqrt((across + (row - found[:, 0]) ** 2).min(axis=1))
    return result


def draw_robot(axes, path, every):
    for pose in path[::every]:
        turn = np.array([[np.cos(pose['yaw']), -np.sin(pose['yaw'])], [np.sin(pose['yaw']), np.cos(pose['yaw'])]])
        axes.plot(*(ROBOT @ turn.T + [pose['x'], pose['y']]).T, color='black', linewidth=0.6)


def draw_movers(axes, path, movers):
    """What moves, and a line to the robot at that time."""
    for m in movers:
        half = np.array([m['half_length'], m['half_width']])
        axes.add_patch(plt.Rectangle(np.array([m['x'], m['y']]) - half, *(2 * half), fill=False, color='red', linewidth=0.8))
        robot = path[np.abs(path['time'] - m['time']).argmin()]
        axes.plot([robot['x'], m['x']], [robot['y'], m['y']], color='red', linewidth=0.3)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('map', help='map file (.bkm)')
    parser.add_argument('path', help='path, as plan_path writes it')
    parser.add_argument('--movers', help='what moved near the robot, as navigation_test writes it')
    parser.add_argument('--output', default='path.png')
    given = parser.parse_args()

    map_ = bki_mapping.load(given.map)
    path = np.genfromtxt(given.path, delimiter=',', names=True)
    edge = map_.resolution
    spans = [np.arange(np.floor((path[axis].min() - MARGIN) / edge), np.ceil((path[axis].max() + MARGIN) / edge)) for axis in 'xy']
    extent = [edge * limit for span in spans for limit in (span[0], span[-1] + 1)]
    xy = np.meshgrid(*(edge * (span + 0.5) for span in spans))
    floor = section(map_, xy, path['z'].mean() - 0.5 * edge)
    body = section(map_, xy, path['z'].mean() + 2.5 * edge)
    obstacles = obstacles_in(map_, body)

    ground = np.full((*floor.shape, 3), 200.0)
    known = floor['state'] == bki_mapping.OCCUPIED
    ground[known] = 255 - 0.4 * (255 - map_.classes.colors[floor['label'][known]].astype(float))  # pale
    ground[obstacles] = map_.classes.colors[body['label'][obstacles]]
    figure, axes = plt.subplots(2, 1, figsize=(10, 9), sharex=True, sharey=True, constrained_layout=True)
    axes[0].imshow(ground.astype(np.uint8), origin='lower', extent=extent, interpolation='nearest')
    axes[0].plot(path['x'][[0, -1]], path['y'][[0, -1]], '--', color='black', linewidth=0.8)
    axes[0].plot(path['x'], path['y'], color='black', linewidth=1.5)
    draw_robot(axes[0], path, 20)
    if given.movers:
        draw_movers(axes[0], path, np.atleast_1d(np.genfromtxt(given.movers, delimiter=',', names=True)))
    for c in map_.classes:
        if c.id in floor['label'][known] or c.id in body['label'][obstacles]:
            axes[0].scatter([], [], marker='s', color=np.array(c.color) / 255, label=c.name)
    axes[0].legend(loc='upper center', bbox_to_anchor=(0.5, -0.04), ncol=7, frameon=False)
    axes[0].set(ylabel='y [m]', title='Classes of the ground (pale), and of what stands on it; the straight way is dashed')
    shown = axes[1].imshow(distances_to(obstacles, edge), origin='lower', extent=extent, vmin=0, vmax=6, cmap='viridis')
    axes[1].plot(path['x'], path['y'], color='white', linewidth=1.5)
    axes[1].set(xlabel='x [m]', ylabel='y [m]', title='Distance to the nearest obstacle [m]')
    figure.colorbar(shown, ax=axes[1], orientation='horizontal', shrink=0.6)
    figure.savefig(given.output, dpi=90)
    print(f'{given.output}: {0.1 * (len(path) - 1):.1f} m')


if __name__ == '__main__':
    main()
