"""Every mode and option: what it keeps and forgets, against its time."""
import os

import matplotlib.pyplot as plt

from .tables import markdown, save, write_csv


def line(extent='mapped', weight='bilinear'):
    return {'free_space/mode': 'line', 'free_space/extent': extent, 'free_space/weight': weight}


# What turns plain lines into the preset `robot`, one after the other.
STEPS = {
    '+ hits before misses': {'free_space/hits_before_misses': 'true'},
    '+ free_gain/static 0.1': {'free_gain/static': 0.1},
    '+ evidence before misses': {'free_space/evidence_before_misses': 'true'},
    '+ scan_limit 0.2, 0.1': {'scan_limit/hits': 0.2, 'scan_limit/free': 0.1, 'kernel/scale': 100},
    '+ free_gain/dynamic 8': {'free_gain/dynamic': 8},
    '+ free_gain/persistence 0.5': {'free_gain/persistence': 0.5},
}


def cumulative(settings, steps):
    options = {}
    for name, step in steps.items():
        settings = settings | step
        options[name] = settings
    return options


OPTIONS = {
    'linear, 1': {'free_space/mode': 'linear'},
    'linear, 5': {'free_space/mode': 'linear', 'free_space/samples_per_beam': 5},
    'uniform, 1': {'free_space/mode': 'uniform'},
    'uniform, 5': {'free_space/mode': 'uniform', 'free_space/samples_per_beam': 5},
    'line, uniform': line(weight='uniform'),
    'line, linear': line(weight='linear'),
    'line, bilinear': line(),
    'line, bilinear, observed': line('observed'),
    **cumulative(line('observed'), STEPS),
}
PERCENT = ('sa', 'sa_standing', 'floor_holes', 'da', 'aa', 'miou_map')
OF_TRUTH = ('free_precision', 'free_recall', 'occupied_precision', 'occupied_recall', 'voxel_miou')


def row_of(name, figures):
    def percent(value):
        return '' if value is None else round(100.0 * value, 1)
    truth = figures.get('truth', {})
    return [name, round(figures['median_ms'], 1)] + [percent(figures[key]) for key in PERCENT] + \
        [figures['voxels_by_class'].get('car', '')] + [percent(truth.get(key)) for key in OF_TRUTH] + \
        [truth.get('ghost_voxels', '')]


def draw(programs, sequence, name, title, presets, output):
    rows = [row_of(option, programs.evaluate(sequence, settings)) for option, settings in OPTIONS.items()]
    for preset in sorted(os.listdir(presets)):
        more = ['--config', os.path.join(presets, preset)]
        rows.append(row_of('preset ' + preset[:-len('.yaml')], programs.evaluate(sequence, {}, more)))
    figure, axes = plt.subplots(figsize=(12, 5.6))
    for number, row in enumerate(rows, 1):
        preset = row[0].startswith('preset')
        axes.plot(row[1], row[6], 's' if preset else 'o', color='tab:red' if preset else 'tab:blue',
                  label=f'{number}  {row[0]}')
        axes.annotate(number, (row[1], row[6]), fontsize=8, textcoords='offset points', xytext=(4, 3))
    axes.legend(fontsize=8, loc='center left', bbox_to_anchor=(1.01, 0.5), markerscale=0.7, frameon=False)
    axes.set_xlabel('time of a scan [ms], median')
    axes.set_ylabel('AA = sqrt(SA DA) [%]')
    axes.set_title(title)
    axes.grid(True, alpha=0.3)
    axes.set_xlim(left=0, right=1.1 * max(row[1] for row in rows))
    figure.tight_layout()
    save(figure, output, f'frontier_{name}.png')
    header = ['option', 'median_ms', *PERCENT, 'car_voxels', *OF_TRUTH, 'ghost_voxels']
    write_csv(output, f'frontier_{name}.csv', header, rows)
    return f'''## The frontier: {title}

Every mode, option and preset: accuracy against time. Figures are shares in % as docs/files.md defines them; each `+` adds
to the row above it. [frontier_{name}.csv](frontier_{name}.csv):

![frontier](frontier_{name}.png)

{markdown([h.replace('_', ' ') for h in header], rows)}'''
