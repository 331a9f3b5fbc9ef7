"""The pictures of the comparison: accuracy against time, and what maps show where something has left."""
import collections
import csv

import matplotlib.pyplot as plt
from matplotlib.collections import PatchCollection
from matplotlib.patches import Patch

from .tables import save

COLORS = {'OctoMap': '#c05010', 'robot': '#1060c0'}  # the rest: the paper's modes
PAPER = '#707070'
PANELS = ('OctoMap, default', 'paper_line', 'robot')  # beside the truth
WINDOW = (30.0, 20.0)  # of the second picture [m]
KINDS = {'kept': ('#b8b8b8', 'stands, and occupied'), 'lost': ('#1f5fd0', 'stands, but not occupied'),
         'left': ('#e02020', 'has left, but still occupied')}
HAS_LEFT = ('#b6dfb6', 'has left')


def color_of(name):
    return next((color for start, color in COLORS.items() if name.startswith(start)), PAPER)


def draw_times(figures_of, output):
    """Static kept and moving removed against the time of a scan."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharex=True)
    for axis, key, title in zip(axes, ('da', 'sa'), ('moving removed, DA [%]', 'static kept, SA [%]')):
        for number, (name, figures) in enumerate(figures_of.items(), 1):
            if figures[key] is None:
                continue
            time, share = figures['yardsticks'][1], 100 * figures[key]
            label = f'{number} {name}' if key == 'sa' else None  # a drive may lack points of what moved
            marker = 's' if name.startswith('OctoMap') else 'o'
            axis.scatter(time, share, color=color_of(name), marker=marker, label=label)
            axis.annotate(str(number), (time, share), xytext=(4, 4), textcoords='offset points', fontsize=8)
        axis.set_xscale('log')
        axis.set_xlabel('time of a scan on one thread [Y]')
        axis.set_ylabel(title)
        axis.grid(True, which='both', alpha=0.25)
    figure.legend(loc='lower center', ncol=3, fontsize=7.5, frameon=False)
    figure.tight_layout(rect=(0, 0.17, 1, 1))
    save(figure, output, 'comparison_time.png')
    plt.close(figure)


def read_columns(path):
    """The outcomes in each column of voxels, by the position of the column [m]."""
    columns = collections.defaultdict(set)
    with open(path, newline='') as file:
        for row in csv.DictReader(file):
            columns[float(row['x']), float(row['y'])].add(row['what'])
    return columns


def busiest(positions):
    """The corner of the window that holds most of the positions; searched in steps of half a window."""
    counts = collections.Counter()
    for x, y in positions:
        i, j = x // (WINDOW[0] / 2), y // (WINDOW[1] / 2)
        counts.update((i - a, j - b) for a in (0, 1) for b in (0, 1))
    (i, j), _ = max(counts.items(), key=lambda item: (item[1], item[0])) if counts else ((0, 0), 0)
    return i * WINDOW[0] / 2, j * WINDOW[1] / 2


def draw_columns(axis, columns, kinds, corner, edge):
    """Later kinds are drawn on top."""
    for kind, color in kinds.items():
        shown = [(x, y) for (x, y), outcomes in columns.items() if kind in outcomes and
                 0 <= x - corner[0] < WINDOW[0] and 0 <= y - corner[1] < WINDOW[1]]
        patches = [plt.Rectangle((x - edge / 2, y - edge / 2), edge, edge) for x, y in shown]
        axis.add_collection(PatchCollection(patches, facecolor=color, edgecolor='none', linewidth=0))


def draw_left(errors_of, ours, edge, output):
    """What stands and what has left, and how maps show it, from above. @param edge of the voxels [m]."""
    truth = read_columns(errors_of[ours])
    corner = busiest([at for at, outcomes in truth.items() if outcomes & {'forgotten', 'left'}])
    names = [name for name in PANELS if name in errors_of]
    figure, axes = plt.subplots(2, 2, figsize=(11, 8.2), sharex=True, sharey=True)
    stands = {at: {'stands'} if outcomes & {'kept', 'lost'} else set() for at, outcomes in truth.items()}
    gone = {at: {'gone'} if outcomes & {'forgotten', 'left'} else set() for at, outcomes in truth.items()}
    draw_columns(axes.flat[0], stands, {'stands': KINDS['kept'][0]}, corner, edge)
    draw_columns(axes.flat[0], gone, {'gone': HAS_LEFT[0]}, corner, edge)
    axes.flat[0].set_title('truth, of the voxels with points')
    colors = {kind: color for kind, (color, _) in KINDS.items()}
    for axis, name in zip(axes.flat[1:], names):
        draw_columns(axis, read_columns(errors_of[name]), colors, corner, edge)
        axis.set_title(name)
    for axis in axes.flat:
        axis.set_xlim(corner[0], corner[0] + WINDOW[0])
        axis.set_ylim(corner[1], corner[1] + WINDOW[1])
        axis.set_aspect('equal')
    for axis in axes[1]:
        axis.set_xlabel('x [m]')
    for axis in axes[:, 0]:
        axis.set_ylabel('y [m]')
    legend = [Patch(color=color, label=label) for color, label in (*KINDS.values(), HAS_LEFT)]
    figure.legend(handles=legend, loc='lower center', ncol=4, fontsize=9, frameon=False)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save(figure, output, 'comparison_left.png')
    plt.close(figure)
