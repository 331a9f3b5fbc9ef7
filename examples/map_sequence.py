#!/usr/bin/env python3
"""Maps a sequence in SemanticKITTI's layout, keeps the map, and draws it from above.

    python3 examples/map_sequence.py FOLDER --output street
"""
import argparse

import matplotlib
import numpy as np

import bki_mapping

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402


def top_view(map_):
    """The colour of the highest occupied voxel of each column, and the extent [m] of the picture."""
    voxels = map_.voxels('occupied')
    voxels = voxels[np.argsort(voxels['z'])]  # so that the highest is written last
    edge = map_.resolution
    x, y = (np.floor(voxels[axis] / edge).astype(int) for axis in 'xy')
    image = np.full((np.ptp(y) + 1, np.ptp(x) + 1, 3), 255, np.uint8)
    image[y - y.min(), x - x.min()] = np.stack([voxels['red'], voxels['green'], voxels['blue']], axis=1)
    return image, [edge * x.min(), edge * (x.max() + 1), edge * y.min(), edge * (y.max() + 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder', help='folder with velodyne/, labels/, poses.txt and calib.txt')
    parser.add_argument('--classes', default='semantic_kitti', help='class table: a name or a file')
    parser.add_argument('--config', default='robot', help='preset: a name or a file')
    parser.add_argument('--output', default='map', help='writes OUTPUT.bkm and OUTPUT.png')
    given = parser.parse_args()

    mapper = bki_mapping.SemanticMapper(given.classes, config=given.config)
    times = []
    for frame in bki_mapping.Sequence(given.folder):
        stats = mapper.integrate(frame.pose, frame.points, frame.labels, stamp=frame.stamp)
        times.append(stats.total_ms)
    map_ = mapper.map
    print(f'{len(times)} scans, median {np.median(times):.1f} ms; {len(map_.voxels())} occupied voxels')
    map_.save(f'{given.output}.bkm')

    image, extent = top_view(map_)
    figure, axes = plt.subplots(figsize=(9, 6))
    axes.imshow(image, origin='lower', extent=extent, interpolation='nearest')
    names = {c.id: c for c in map_.classes}
    for label in np.unique(map_.voxels()['label']):
        axes.scatter([], [], marker='s', color=np.array(names[label].color) / 255, label=names[label].name)
    axes.legend(loc='center left', bbox_to_anchor=(1, 0.5), frameon=False)
    axes.set(xlabel='x [m]', ylabel='y [m]', title='The highest occupied voxel of each column')
    figure.savefig(f'{given.output}.png', dpi=120, bbox_inches='tight')


if __name__ == '__main__':
    main()
