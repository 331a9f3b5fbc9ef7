"""A scan in a plane, mapped with each representation of free space (after the paper's Figures 1 and 2)."""
import os

import matplotlib.pyplot as plt
import numpy as np

from .programs import FREE, OCCUPIED
from .tables import markdown, save, write_csv

BEAMS = 180
PILLARS = [(4.0, 2.5, 0.8), (-3.0, -2.0, 0.6), (1.0, -4.0, 0.5), (-5.5, 3.5, 0.7)]  # x, y, radius [m]
HALF = (9.0, 6.5)  # half extents of the room [m]
SENSOR = (-1.0, 0.5)
PATTERNS = {
    'hits only': {'free_space/mode': 'none'},
    'even, every metre': {'free_space/mode': 'even', 'free_space/gap': 1.0},
    'uniform, 5 per beam': {'free_space/mode': 'uniform', 'free_space/samples_per_beam': 5},
    'linear, 5 per beam': {'free_space/mode': 'linear', 'free_space/samples_per_beam': 5},
    'whole lines': {'free_space/mode': 'line', 'free_space/weight': 'uniform', 'free_space/extent': 'observed'},
}
WEIGHTS = {f'lines, {weight}': {'free_space/mode': 'line', 'free_space/weight': weight,
                                'free_space/extent': 'observed'} for weight in ('uniform', 'linear', 'bilinear')}
DENSITIES = {**{name: PATTERNS[name] for name in list(PATTERNS)[1:4]}, **WEIGHTS}


def ranges(directions):
    """Distance from the sensor to the nearest wall or pillar along unit vectors."""
    origin = np.array(SENSOR)
    with np.errstate(divide='ignore'):
        walls = np.where(directions > 0, np.array(HALF) - origin, -np.array(HALF) - origin) / directions
    nearest = walls.min(axis=1)
    for x, y, radius in PILLARS:
        to = np.array([x, y]) - origin
        along = directions @ to
        inside = radius ** 2 - (to @ to - along ** 2)
        hit = (inside > 0) & (along > 0)
        nearest = np.where(hit, np.minimum(nearest, along - np.sqrt(np.maximum(inside, 0))), nearest)
    return nearest


def write_scan(folder):
    """Writes one scan of the room as a sequence in SemanticKITTI's layout; returns the hits relative to the sensor."""
    for name in ('velodyne', 'labels'):
        os.makedirs(os.path.join(folder, name), exist_ok=True)
    azimuth = (np.arange(BEAMS) + 0.5) / BEAMS * 2 * np.pi
    directions = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    hits = directions * ranges(directions)[:, None]
    points = np.zeros((BEAMS, 4), '<f4')
    points[:, :2] = hits
    points.tofile(os.path.join(folder, 'velodyne', '000000.bin'))
    np.full(BEAMS, 50, '<u4').tofile(os.path.join(folder, 'labels', '000000.label'))
    identity = '1 0 0 0 0 1 0 0 0 0 1 0\n'
    for name, text in (('poses.txt', identity), ('calib.txt', 'Tr: ' + identity)):
        with open(os.path.join(folder, name), 'w') as file:
            file.write(text)
    return hits


def samples_of(programs, scan, settings):
    """The samples of a mode, as voxels of 5 cm: by the counting kernel, their evidence is the number of samples in them."""
    exact = {'kernel/type': 'counting', 'resolution': 0.05, 'downsample_resolution': 0.0, **settings}
    voxels = programs.map(scan, exact, 'occupied,free')[1]
    return voxels[voxels['state'] == FREE]


def plot_training_data(axes, programs, scan, hits, settings):
    """Draws samples as points and whole beams as lines; returns the voxels of the samples."""
    free = samples_of(programs, scan, settings)
    if settings['free_space/mode'] == 'line':
        for x, y in hits:
            axes.plot((0, x), (0, y), '-', color='tab:blue', linewidth=0.4)
    else:
        axes.plot(free['x'], free['y'], '.', color='tab:blue', markersize=1.2)
    return free


def show_room(axes, hits, title):
    axes.plot(hits[:, 0], hits[:, 1], 'k.', markersize=3)
    axes.plot(0, 0, 'r^', markersize=6)
    axes.set_title(title, fontsize=10)
    axes.set_aspect('equal')
    axes.set_xticks([])
    axes.set_yticks([])


def draw_patterns(programs, scan, hits, output):
    """Figure 1: the samples of each pattern, and their density by distance from the sensor."""
    figure, axes = plt.subplots(1, len(PATTERNS), figsize=(18, 3.2))
    rings = np.arange(0.0, 6.0, 1.0)
    rows = []
    for ax, (name, settings) in zip(axes, PATTERNS.items()):
        free = plot_training_data(ax, programs, scan, hits, settings)
        show_room(ax, hits, name)
        if name in ('hits only', 'whole lines'):
            continue
        distance = np.hypot(free['x'], free['y'])
        for ring in rings:
            count = round(float(free['evidence'][(distance >= ring) & (distance < ring + 1)].sum()))
            rows.append([name, ring, ring + 1, count, round(count / (np.pi * (2 * ring + 1)), 2)])
    figure.tight_layout()
    save(figure, output, 'figure1.png')
    header = ['pattern', 'from_m', 'to_m', 'samples', 'samples_per_m2']
    write_csv(output, 'figure1.csv', header, rows)
    table = [[name] + [row[4] for row in rows if row[0] == name] for name in list(PATTERNS)[1:4]]
    return markdown(['pattern'] + [f'{r:.0f} to {r + 1:.0f} m' for r in rings], table)


def draw_densities(programs, scan, hits, output):
    """Figure 2: training data in the upper row, inference in the lower."""
    figure, axes = plt.subplots(2, len(DENSITIES), figsize=(20, 6.4))
    rows = []
    for column, (name, settings) in enumerate(DENSITIES.items()):
        plot_training_data(axes[0][column], programs, scan, hits, settings)
        show_room(axes[0][column], hits, name)
        fine = {'resolution': 0.1, 'kernel/length': 0.3, **settings}
        report, voxels = programs.map(scan, fine, 'occupied,free')
        plane = voxels[np.abs(voxels['z'] - 0.05) < 0.01]  # the layer of voxels that contains the beams
        for state, colors in ((FREE, 'Blues'), (OCCUPIED, 'Reds')):
            part = plane[plane['state'] == state]
            axes[1][column].scatter(part['x'], part['y'], c=np.log10(part['evidence']), s=3, marker='s', linewidths=0,
                                    cmap=colors, vmin=-3, vmax=1)
        show_room(axes[1][column], hits[:0], '')
        rows.append([name, int(report['scans'][0]['free_samples_or_beams']), int((plane['state'] == FREE).sum()),
                     int((plane['state'] == OCCUPIED).sum())])
    axes[0][0].set_ylabel('training data')
    axes[1][0].set_ylabel('inference, by evidence')
    figure.tight_layout()
    save(figure, output, 'figure2.png')
    header = ['representation', 'samples_or_beams', 'free_voxels', 'occupied_voxels']
    write_csv(output, 'figure2.csv', header, rows)
    return markdown(['representation', 'samples or beams', 'free voxels in the plane', 'occupied voxels'], rows)


def draw(programs, output):
    scan = os.path.join(programs.scratch, 'plane')
    hits = write_scan(scan)
    return f'''## Where free space is sampled (after Figure 1)

One scan of {BEAMS} beams in a two-dimensional room. The counting kernel in voxels of 5 cm shows the samples.

![patterns](figure1.png)

Samples per square metre, by distance from the sensor ([figure1.csv](figure1.csv)): `linear` is the most even near the
sensor, as Theorem 1 says; `uniform` and `even` are densest there.

{draw_patterns(programs, scan, hits, output)}
## The resulting maps (after Figure 2)

Upper row: training data. Lower row: the map with the sparse kernel of 0.3 m in voxels of 0.1 m, free in blue and occupied in
red; darker voxels have more evidence, on a logarithmic scale from 0.001 to 10 ([figure2.csv](figure2.csv)).

![densities](figure2.png)

{draw_densities(programs, scan, hits, output)}'''
