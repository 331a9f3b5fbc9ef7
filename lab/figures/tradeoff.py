"""Time, free samples and car voxels of every mode, with varied numbers of samples per beam (after the paper's Figure 4),
and the maps of every mode from above (after its Figure 5)."""
import matplotlib.pyplot as plt
import numpy as np

from .programs import OCCUPIED, median_samples
from .tables import markdown, save, write_csv

SAMPLES = (1, 2, 3, 5, 8)
GAPS = (4.0, 2.0, 1.0, 0.5)


def line(weight):
    return {'free_space/mode': 'line', 'free_space/weight': weight}


MODES = {  # one curve per mode: for each of its points, the varied value and the settings
    'none': [('', {'free_space/mode': 'none'})],
    'uniform': [(n, {'free_space/mode': 'uniform', 'free_space/samples_per_beam': n}) for n in SAMPLES],
    'linear': [(n, {'free_space/mode': 'linear', 'free_space/samples_per_beam': n}) for n in SAMPLES],
    'even': [(f'{gap} m', {'free_space/mode': 'even', 'free_space/gap': gap}) for gap in GAPS],
    'line, uniform': [('', line('uniform'))],
    'line, linear': [('', line('linear'))],
    'line, bilinear': [('', line('bilinear'))],
}
VIEW = 20.0  # half the extent along y of a map seen from above [m]
MARKERS = dict(zip(MODES, 'osD^vPX'))


def draw_tradeoff(programs, sequence, name, title, output):
    """Draws Figure 4; returns its table."""
    rows = []
    for mode, points in MODES.items():
        for varied, settings in points:
            report, _ = programs.map(sequence, settings)
            rows.append([mode, varied, round(report['median_ms'], 2), int(median_samples(report)),
                         report['voxels_by_class']['car'], report['voxels']['occupied'], report['voxels']['free']])
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.4))
    for mode in MODES:
        own = [row for row in rows if row[0] == mode]
        for ax, column in zip(axes, (4, 3)):
            ax.plot([row[2] for row in own], [row[column] for row in own], MARKERS[mode] + '-', label=mode)
            for row in own:
                if row[1]:
                    ax.annotate(row[1], (row[2], row[column]), fontsize=7, textcoords='offset points', xytext=(3, 3))
    for ax, what in zip(axes, ('car voxels in the final map', 'free samples or beams per scan')):
        ax.set_xlabel('time of a scan [ms], median')
        ax.set_ylabel(what)
        ax.grid(True, alpha=0.3)
    axes[1].set_yscale('symlog', linthresh=1000)
    axes[0].legend(fontsize=8)
    figure.suptitle(title)
    figure.tight_layout()
    save(figure, output, f'figure4_{name}.png')
    header = ['mode', 'samples_a_beam_or_gap', 'median_ms', 'samples_or_beams', 'car_voxels', 'occupied_voxels',
              'free_voxels']
    write_csv(output, f'figure4_{name}.csv', header, rows)
    return markdown([h.replace('_', ' ') for h in header], rows)


def draw_views(programs, sequence, name, title, output):
    """Draws Figure 5: maps from above, the highest occupied voxel of each column on top."""
    figure, axes = plt.subplots(len(MODES), 1, figsize=(11, 3.4 * len(MODES)), sharex=True, sharey=True)
    for ax, (mode, points) in zip(axes, MODES.items()):
        varied, settings = points[0]
        report, voxels = programs.map(sequence, settings, 'occupied')
        shown = np.sort(voxels[voxels['state'] == OCCUPIED], order='z')
        colors = np.stack([shown['red'], shown['green'], shown['blue']], axis=1) / 255.0
        ax.scatter(shown['x'], shown['y'], c=colors, s=2.0, marker='s', linewidths=0)
        middle = float(np.median(shown['y']))
        ax.set_ylim(middle - VIEW, middle + VIEW)
        ax.set_facecolor('black')
        ax.set_aspect('equal')
        ax.set_ylabel('y [m]')
        what = f' ({varied})' if varied else ''
        ax.set_title(f"{mode}{what}: {report['median_ms']:.0f} ms per scan, {report['voxels']['occupied']} occupied, "
                        f"{report['voxels_by_class']['car']} car voxels", fontsize=9)
    axes[-1].set_xlabel('x [m]')
    figure.suptitle(title)
    figure.tight_layout(rect=(0, 0, 1, 0.985))
    save(figure, output, f'figure5_{name}.png')


def draw(programs, sequence, name, title, output):
    table = draw_tradeoff(programs, sequence, name, title, output)
    draw_views(programs, sequence, name, title, output)
    return f'''## Time, samples and car voxels: {title} (after Figure 4)

![trade-off](figure4_{name}.png)

Numbers next to points are samples per beam (`uniform`, `linear`) or the gap (`even`). Fewer car voxels do not mean a better
map: the frontier below shows what is lost with them. [figure4_{name}.csv](figure4_{name}.csv):

{table}
## The maps from above: {title} (after Figure 5)

![maps](figure5_{name}.png)
'''
