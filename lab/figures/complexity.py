"""Measured complexity of a scan: the exponents e of time ~ x^e, each fitted to all measurements of a row."""
import matplotlib.pyplot as plt
import numpy as np

from .tables import markdown, save, write_csv

MODES = {
    'none': {'free_space/mode': 'none'},
    'uniform, 1 sample': {'free_space/mode': 'uniform'},
    'linear, 1 sample': {'free_space/mode': 'linear'},
    'even, every metre': {'free_space/mode': 'even', 'free_space/gap': 1.0},
    'line, bilinear, mapped': {'free_space/mode': 'line'},
    'line, bilinear, observed': {'free_space/mode': 'line', 'free_space/extent': 'observed'},
}
RESOLUTIONS = (0.4, 0.3, 0.2, 0.15, 0.1)
COLUMNS = (450, 900, 1800, 3600)
SAMPLES = (1, 2, 4, 8, 16)
RANGES = (10, 20, 40, 80)
REPEATS = 3  # runs of each measurement; the fastest one counts


def exponent(xs, times):
    return float(np.polyfit(np.log(xs), np.log(times), 1)[0])


def measure(programs, drives):
    """Rows of varied quantity, mode, value and median time [ms]. `drives` maps the number of columns to a drive."""
    rows = []

    def add(what, mode, value, sequence, settings):
        reports = [programs.map(sequence, settings)[0] for _ in range(REPEATS)]
        points = float(np.median([scan['points'] for scan in reports[0]['scans']]))
        time = min(report['median_ms'] for report in reports)
        rows.append([what, mode, points if what == 'points' else value, time])

    for mode, settings in MODES.items():
        for columns in COLUMNS:
            exact = {'downsample_resolution': 0.0, **settings}  # do not merge points
            add('points', mode, columns, drives[columns], exact)
        for resolution in RESOLUTIONS:
            add('1 / resolution', mode, 1.0 / resolution, drives[1800], {'resolution': resolution, **settings})
        for most in RANGES:
            add('range', mode, most, drives[1800], {'sensor_model/max_range': most, **settings})
    for mode in ('uniform', 'linear'):
        for count in SAMPLES:
            settings = {'free_space/mode': mode, 'free_space/samples_per_beam': count}
            add('samples per beam', f'{mode}, 1 sample', count, drives[1800], settings)
    return rows


def draw(programs, output, scans):
    drives = {columns: programs.simulate(f'columns{columns}', scans=min(scans, 12), columns=columns)
              for columns in COLUMNS}
    rows = measure(programs, drives)
    whats = ['points', 'samples per beam', '1 / resolution', 'range']
    figure, axes = plt.subplots(1, len(whats), figsize=(17, 4))
    table = []
    for mode in MODES:
        line = [mode]
        for ax, what in zip(axes, whats):
            own = [row for row in rows if row[0] == what and row[1] == mode]
            line.append(f'{exponent([r[2] for r in own], [r[3] for r in own]):.2f}' if own else '')
            if own:
                ax.loglog([r[2] for r in own], [r[3] for r in own], 'o-', markersize=4, label=mode)
        table.append(line)
    for ax, what in zip(axes, whats):
        ax.set_xlabel(what)
        ax.grid(True, which='both', alpha=0.3)
    axes[0].set_ylabel(f'time of a scan [ms], median, best of {REPEATS}')
    axes[2].legend(fontsize=7)
    figure.tight_layout()
    save(figure, output, 'complexity.png')
    write_csv(output, 'complexity.csv', ['varied', 'mode', 'value', 'median_ms'], rows)
    return f'''## Complexity

Exponents e of time ~ x^e, fitted to the measurements of [complexity.csv](complexity.csv): points of a scan (64 beams,
{COLUMNS[0]} to {COLUMNS[-1]} columns, without down-sampling), samples per beam ({SAMPLES[0]} to {SAMPLES[-1]}), 1 / resolution
({RESOLUTIONS[0]} to {RESOLUTIONS[-1]} m, kernel of 0.3 m) and range ({RANGES[0]} to {RANGES[-1]} m). A hit reaches the voxels
in a ball with the radius kernel/length, so the exponent of 1 / resolution is at most 3; it is lower because neighbouring
hits and beams reach the same voxels.

![complexity](complexity.png)

{markdown(['mode', *whats], table)}'''
