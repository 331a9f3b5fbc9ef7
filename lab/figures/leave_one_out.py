"""Tunes on all drives but one, and judges on the one left out.

For each drive, chooses the setting whose worst drive among the others is best, and prints what it does on that drive. The
figure of a drive is sqrt(parked DA), which takes parked cars as seriously as ghosts; where SA is below --least-sa, it is 0.
DA is that of decidable points (da_decidable), so that no drive decides all choices through points that no map can decide.
"""
import argparse
import itertools
import math
import os

from .programs import Programs
from .tables import markdown

SETTINGS = {'stands_after': (4, 6, 8, 12), 'living_stands_after': (12, 20), 'together': (0.3, 0.6, 0.8)}
SIMULATED = {'street': {'scans': 300}, 'traffic': {'scene': 'traffic', 'scans': 200},
             'traffic32': {'scene': 'traffic', 'lidar': 'hdl32', 'scans': 200},
             'traffic16': {'scene': 'traffic', 'lidar': 'vlp16', 'scans': 200},
             'crowd': {'scene': 'crowd', 'scans': 200}}


def judgements(rules=None):
    """All settings of rules/ to compare, as --judge of evaluate_map takes them."""
    rules = rules or SETTINGS
    return [','.join(f'rules/{name}={value:g}' for name, value in zip(rules, values))
            for values in itertools.product(*rules.values())]


def figure_of(figures, least_sa):
    """What a setting is worth on a drive; 1 at best. Where nothing that can move is known to stand still, it takes SA."""
    if figures['sa'] < least_sa:
        return 0.0
    parked = figures['sa'] if figures['sa_standing'] is None else figures['sa_standing']
    return math.sqrt(parked * (1.0 if figures['da_decidable'] is None else figures['da_decidable']))


def chosen(figures_of, drives, least_sa):
    """The setting whose worst drive is best; of equals, the first. figures_of[setting][drive] are figures."""
    return max(figures_of, key=lambda setting: min(figure_of(figures_of[setting][drive], least_sa) for drive in drives))


def left_out(figures_of, least_sa):
    """For each drive, what was chosen on the others, and its figures there; and what is chosen on all."""
    drives = list(next(iter(figures_of.values())))
    rows = []
    for drive in drives:
        setting = chosen(figures_of, [other for other in drives if other != drive], least_sa)
        rows.append((drive, setting, figures_of[setting][drive]))
    return rows, chosen(figures_of, drives, least_sa)


def table(rows):
    def percent(value):
        return '' if value is None else f'{100 * value:.1f}'
    return markdown(['left out', 'setting', 'SA', 'parked', 'holes', 'DA', 'AA'],
                    [[drive, setting] + [percent(figures[name]) for name in ('sa', 'sa_standing', 'floor_holes', 'da', 'aa')]
                     for drive, setting, figures in rows])


def measured(programs, sequences, preset, voids, rules=None, more=()):
    """figures_of, with one pass over each sequence for each value of rules/void_outweighs, which changes evidence."""
    judged = [word for each in rules or judgements() for word in ('--judge', each)]
    figures_of = {}
    for void in voids:
        for name, sequence in sequences.items():
            figures = programs.evaluate(sequence, {'rules/void_outweighs': void}, ['--config', preset, *more, *judged])
            for each in figures['judged']:
                figures_of.setdefault(f'rules/void_outweighs={void:g},' + each['settings'], {})[name] = each
    return figures_of


def main():
    parser = argparse.ArgumentParser(prog='figures.leave_one_out', description=__doc__)
    parser.add_argument('--programs', default='build/devel/lib/bki_mapping', help='folder with the programs of the package')
    parser.add_argument('--presets', default='config/presets', help='folder with the presets')
    parser.add_argument('--scratch', required=True, help='folder for simulated drives')
    parser.add_argument('--preset', default='robot', help='the preset to start from')
    parser.add_argument('--classes', help='class table, as for evaluate_map')
    parser.add_argument('--rule', action='append', nargs='+', default=[], metavar=('NAME', 'VALUE'),
                        help='values of rules/NAME to compare, instead of the usual ones; repeatable')
    parser.add_argument('--least-sa', type=float, default=0.994, help='SA below which a setting is not chosen')
    parser.add_argument('--void', type=float, nargs='+', default=[30.0], help='values of rules/void_outweighs to compare')
    parser.add_argument('--sequence', action='append', default=[],
                        help="further sequence in SemanticKITTI's layout; repeatable")
    given = parser.parse_args()
    programs = Programs(given.programs, os.path.abspath(given.scratch))
    sequences = {name: programs.simulate(name, **options) for name, options in SIMULATED.items()}
    sequences.update({os.path.basename(os.path.abspath(path)): path for path in given.sequence})
    rules = {name: [float(value) for value in values] for name, *values in given.rule}
    preset = os.path.join(given.presets, given.preset + '.yaml')
    more = ['--classes', given.classes] if given.classes else []
    rows, best = left_out(measured(programs, sequences, preset, given.void, judgements(rules), more), given.least_sa)
    print(table(rows) + f'\nchosen on all: {best}')


if __name__ == '__main__':
    main()
