"""Compares OctoMap, the paper's modes and the preset robot on the same scans, in voxels of the same size.

Writes comparison.md with the table, comparison.json with all figures, and two pictures. scripts/compare calls it.
"""
import argparse
import datetime
import json
import os

import matplotlib
matplotlib.use('Agg')

from . import comparison_pictures  # noqa: E402
from .programs import Programs, commit  # noqa: E402
from .tables import markdown  # noqa: E402

# Settings of evaluate_map --octomap. None is OctoMap's best in all columns: some are fast, some keep what stands, some
# show at once what comes. Of 21 that were tried on a real clip, none had a better sqrt(SA DA) than the default.
OCTOMAP = (
    'default',
    'discretize=true',
    'lazy=true,discretize=true,compress_map=false',
    'max_range=40,discretize=true',
    'max_range=20,discretize=true',
    'rays=true',
    'hit=0.8',
    'hit=0.97',
    'hit=0.97,miss=0.3,min=0.3',
)
# Presets with further arguments of evaluate_map.
PRESETS = ('paper_none', 'baseline_even', 'paper_linear', 'paper_line', 'robot')
OURS = {preset: ['--config', preset] for preset in PRESETS}
OURS['robot without labels'] = ['--config', 'robot', '--classes', 'occupancy']
BESIDE = 'robot'  # takes turns with OctoMap, scan by scan
THREADS = (1, 2)
TIMES = (('processor_ms', 'yardstick_processor_ms'), ('median_ms', 'yardstick_ms'))  # by number of threads
HEADER = ['map', 'ms, 1 thread', 'Y, 1 thread', 'Y, 2 threads', 'MB', 'SA', 'holes', 'DA', 'PA to 50 m',
          'free precision', 'free recall', 'ECE']
INTRODUCTION = '''Measured on {date}, commit {commit}: {data}, voxels of {resolution:g} m. Y = {yardstick:.1f} ms.

'''


def percent(value):
    return '' if value is None else f'{100 * value:.1f}'


def row_of(name, figures, times):
    """A row of the table. @param times in Y by number of threads; None where the map has no such threads."""
    truth = figures.get('truth', {})
    error = truth.get('occupancy_calibration_error', figures['occupancy_calibration_error'])
    far = figures['presence']['by_distance'][1]
    shares = (figures['sa'], figures['floor_holes'], figures['da'], far['pa_moving'], truth.get('free_precision'),
              truth.get('free_recall'), error)
    ratios = ['' if times[threads] is None else f'{times[threads]:.1f}' for threads in THREADS]
    return [name, f'{figures["processor_ms"]:.1f}', *ratios, f'{figures["map_bytes"] / 1e6:.1f}', *map(percent, shares)]


def without_empty_columns(header, rows):
    """The table without columns that have no figure, as those of free space where the truth is not known."""
    kept = [n for n in range(len(header)) if any(row[n] for row in rows)]
    return [header[n] for n in kept], [[row[n] for n in kept] for row in rows]


class Comparison:
    """The figures of all maps of one sequence."""

    def __init__(self, programs, sequence, more):
        """Measures. @param more arguments of evaluate_map."""
        self.rows, self.figures, self.errors = [], {}, {}
        ours = {}
        for name, words in OURS.items():
            ours[name] = [self._evaluate(programs, sequence, [*more, *words], name, threads) for threads in THREADS]
        one = ours[BESIDE][0]
        self.yardstick_ms = one['yardstick_processor_ms']
        for number, figures in enumerate(one.pop('octomap', []), 1):
            name = f'OctoMap, {figures["settings"]}'
            self.errors[name] = self._errors_file(programs, f'{BESIDE}_octomap_{number}')
            self._add(name, figures, {1: figures['processor_ms'] / self.yardstick_ms, 2: None})
        for name, runs in ours.items():
            # Of one thread by processor time, which other work on the machine does not lengthen; of two by the clock.
            ratios = [run[time] / run[yardstick] for run, (time, yardstick) in zip(runs, TIMES)]
            self._add(name, runs[0], dict(zip(THREADS, ratios)))

    def _errors_file(self, programs, name):
        return os.path.join(programs.scratch, f'{name}.csv')

    def _evaluate(self, programs, sequence, more, name, threads):
        words = [*more, '--threads', str(threads)]
        if threads == 1:  # the map is the same with two
            self.errors[name] = self._errors_file(programs, name)
            words += ['--errors', os.path.join(programs.scratch, f'{name}.png')]
            if name == BESIDE:
                words += [word for settings in OCTOMAP for word in ('--octomap', settings)]
        return programs.evaluate(sequence, {}, words)

    def _add(self, name, figures, times):
        self.figures[name] = {**figures, 'yardsticks': times}
        self.rows.append(row_of(name, figures, times))


def main(arguments=None):
    parser = argparse.ArgumentParser(prog='figures.comparison', description=__doc__)
    parser.add_argument('--programs', required=True, help='folder with the programs of the package')
    parser.add_argument('--output', required=True, help='output folder')
    parser.add_argument('--sequence', help="sequence in SemanticKITTI's layout; default: a simulated drive")
    parser.add_argument('--scans', type=int, help='number of scans; default: 40 simulated ones, or all of the sequence')
    parser.add_argument('--resolution', type=float, default=0.3, help='edge of the voxels [m]')
    parser.add_argument('--commit', help='commit of the programs; default: that of this tree')
    given = parser.parse_args(arguments)
    output = os.path.abspath(given.output)
    programs = Programs(given.programs, os.path.join(output, 'scratch'))
    more = ['--set', f'resolution={given.resolution:g}']
    if given.sequence:
        sequence, data = given.sequence, 'sequence ' + os.path.basename(os.path.abspath(given.sequence))
        if given.scans:
            more += ['--scans', str(given.scans)]
            data += f', {given.scans} scans'
    else:
        scans = given.scans or 40
        sequence, data = programs.simulate(f'street{scans}', scans=scans), f'a simulated drive of {scans} scans'
    compared = Comparison(programs, sequence, more)
    text = INTRODUCTION.format(date=datetime.date.today(), commit=given.commit or commit(), data=data,
                               resolution=given.resolution, yardstick=compared.yardstick_ms)
    text += markdown(*without_empty_columns(HEADER, compared.rows))
    for name, content in (('comparison.md', text), ('comparison.json', json.dumps(compared.figures, indent=2) + '\n')):
        with open(os.path.join(output, name), 'w') as file:
            file.write(content)
    comparison_pictures.draw_times(compared.figures, output)
    comparison_pictures.draw_left(compared.errors, BESIDE, given.resolution, output)
    print(text, flush=True)


if __name__ == '__main__':
    main()
