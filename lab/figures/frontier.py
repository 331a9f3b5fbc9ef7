"""Accuracy of every mode, option and preset against its time."""
import os

import matplotlib.pyplot as plt

from .tables import markdown, save, write_csv


def line(extent='mapped', weight='bilinear'):
    return {'free_space/mode': 'line', 'free_space/extent': extent, 'free_space/weight': weight}


# Steps from plain lines to the preset `robot`.
STEPS = {
    '+ rules, without voids, time and neighbours': {
        'rules/enabled': 'true', 'rules/void_outweighs': 0, 'rules/latest': 'false', 'rules/together': 0},
    '+ rules/void_outweighs 30': {'rules/void_outweighs': 30},
    '+ rules/together 0.8': {'rules/together': 0.8},
    '+ rules/latest': {'rules/latest': 'true'},
}


def cumulative(settings, steps):
    options = {}
    for name, step in steps.items():
        settings = {**settings, **step}
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


def draw_calibration(figures_of, name, output):
    """Draws reliability diagrams of p, of the class probability and, on simulated drives, of occupancy; returns the
    section."""
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.4))
    rows = []
    for preset, figures in figures_of.items():
        truth = figures.get('truth', {})
        curves = (('probability', figures['probability_reliability']),
                  ('class_probability', figures['class_probability_reliability']),
                  ('occupancy', truth.get('occupancy_reliability', [])))
        for ax, (what, bins) in zip(axes, curves):
            seen = [b for b in bins if b['count'] > 0]
            ax.plot([b['probability'] for b in seen], [b['right'] for b in seen], 'o-', markersize=4, label=preset)
            rows += [[preset, what, b['count'], b['probability'], b['right']] for b in seen]
    for ax, what in zip(axes, ('probability, at points', 'class_probability, at points', 'occupancy, of voxels')):
        ax.plot((0, 1), (0, 1), 'k:')
        ax.set_xlabel(what)
        ax.set_ylabel('fraction that is correct')
        ax.grid(True, alpha=0.3)
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    save(figure, output, f'calibration_{name}.png')
    write_csv(output, f'calibration_{name}.csv', ['preset', 'of', 'count', 'probability', 'right'], rows)

    def percent(value):
        return '' if value is None else f'{100 * value:.1f}'
    table = [[preset, percent(f['probability_calibration_error']), percent(f['class_probability_calibration_error']),
              percent(f.get('truth', {}).get('occupancy_calibration_error')), percent(f['sparsification_error'])]
             for preset, f in figures_of.items()]
    return f'''Reliability: how often a prediction of a given probability is correct ([calibration_{name}.csv](calibration_{name}.csv)).

![calibration](calibration_{name}.png)

{markdown(['preset', 'ECE of probability [%]', 'ECE of class_probability [%]', 'ECE of occupancy [%]', 'AUSE [%]'], table)}'''


def draw_frontier(rows, name, title, output):
    """Draws AA against time, on a scale that is logarithmic in the distance from 100 %."""
    figure, axes = plt.subplots(figsize=(12, 5.6))
    for number, row in enumerate(rows, 1):
        preset = row[0].startswith('preset')
        lacking = max(100.0 - float(row[6]), 0.1)  # a logarithmic axis has no place for 0
        axes.plot(float(row[1]), lacking, 's' if preset else 'o', color='tab:red' if preset else 'tab:blue',
                  label=f'{number}  {row[0]}')
        axes.annotate(number, (float(row[1]), lacking), fontsize=8, textcoords='offset points', xytext=(4, 3))
    axes.legend(fontsize=8, loc='center left', bbox_to_anchor=(1.01, 0.5), markerscale=0.7, frameon=False)
    axes.set_yscale('log')
    ticks = (0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)
    axes.minorticks_off()
    axes.set_yticks(ticks)
    axes.set_yticklabels([f'{100 - tick}' for tick in ticks])
    axes.set_ylim(105, 0.09)
    axes.set_xlabel('time of a scan [ms], median')
    axes.set_ylabel('AA = sqrt(SA DA) [%]')
    axes.set_title(title)
    axes.grid(True, alpha=0.3)
    axes.set_xlim(left=0, right=1.1 * max(float(row[1]) for row in rows))
    figure.tight_layout()
    save(figure, output, f'frontier_{name}.png')


def draw(programs, sequence, name, title, presets, output):
    rows = [row_of(option, programs.evaluate(sequence, settings)) for option, settings in OPTIONS.items()]
    figures_of = {}
    for file in sorted(os.listdir(presets)):
        preset = file[:-len('.yaml')]
        figures_of[preset] = programs.evaluate(sequence, {}, ['--config', os.path.join(presets, file)])
        rows.append(row_of('preset ' + preset, figures_of[preset]))
    calibration = draw_calibration(figures_of, name, output)
    draw_frontier(rows, name, title, output)
    header = ['option', 'median_ms', *PERCENT, 'car_voxels', *OF_TRUTH, 'ghost_voxels']
    write_csv(output, f'frontier_{name}.csv', header, rows)
    return f'''## The frontier: {title}

Accuracy of every mode, option and preset against time. Figures are fractions in %, defined in docs/files.md; each `+` adds
an option to the row above. [frontier_{name}.csv](frontier_{name}.csv):

![frontier](frontier_{name}.png)

{markdown([h.replace('_', ' ') for h in header], rows)}
{calibration}'''
