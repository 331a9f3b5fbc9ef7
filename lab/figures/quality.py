"""Measures a preset on simulated drives and given sequences, and writes the tables of a document.

A table replaces what the document has between its two marker lines; it says the date and the commit. Simulated drives have
--scans scans, in rooms five times as many, because the robot there is slow. scripts/reproduce --quality calls this.
"""
import argparse
import concurrent.futures
import datetime
import os
import re

from .programs import ROOT, Programs, commit
from .runs import Runs
from .tables import markdown

SCENES = {'street': 1, 'crowd': 1, 'traffic': 1, 'arrivals': 1, 'queue': 1, 'rooms': 5}  # by how much each drive is longer
RESOLUTIONS = (0.1, 0.15, 0.2, 0.3, 0.4, 0.6)
# Drives that are longer than the others, by how much, and their lidars.
LONGER = (('street', 5, 'hdl64'), ('traffic', 10 / 3, 'hdl64'), ('traffic', 10 / 3, 'hdl32'), ('traffic', 10 / 3, 'vlp16'),
          ('arrivals', 10 / 3, 'hdl64'), ('queue', 10 / 3, 'hdl64'))
FEW = ('04', 'traffic', 'crowd', 'street')  # drives on which settings are compared, if they are measured at all
LIDARS = {'hdl64': 64, 'hdl32': 32, 'vlp16': 16}  # and their rows
HEIGHTS = {'street': (0.6, 1.0, 1.7, 2.5), 'crowd': (0.6, 1.0, 1.7, 2.5), 'rooms': (0.35, 0.6, 1.0, 1.7)}
JUDGED = ('stands_after=4', 'stands_after=16', 'living_stands_after=10', 'living_stands_after=40', 'together=0',
          'together=0.3', 'together=1.2')
MEASURED = ('void_outweighs=0', 'void_outweighs=20', 'void_outweighs=60')
FURNITURE = {'tables': 51, 'chairs': 71, 'thin things': 80, 'small things': 81}  # raw labels in rooms
# Rules of evaluate_map --without, and where in docs/method.md they are; some together, and some at 0.1 m.
RULES = (('hits_stay', '3a'), ('hits_first', ''), ('hit_limit', '14'), ('threshold', '14'), ('voids', '14a'), ('passing', '12'),
         ('standing', '12'), ('living', '12'), ('fixed_gain', '12'), ('edge', '12'), ('remaining', '12a'), ('neighbours', '12b'),
         ('vote_limit', '12b'), ('looks', '12c'), ('has_stayed', '12c'), ('hidden', '12c'),
         ('free_sum_limit', '12c'))
PAIRS = ('remaining neighbours', 'neighbours looks', 'neighbours standing', 'neighbours passing', 'voids neighbours',
         'voids looks', 'threshold looks', 'hits_first neighbours', 'hits_first looks')
FINE = ('hits_first', 'passing', 'standing', 'fixed_gain', 'edge', 'neighbours', 'vote_limit', 'looks', 'has_stayed',
        'hidden', 'free_sum_limit', 'neighbours looks')
LASTING = ('living', 'neighbours', 'vote_limit', 'looks', 'has_stayed', 'hidden', 'free_sum_limit')  # on longer drives
LEAST_CHANGE = 0.3  # that a table of rules lists [percentage points]
SHAKEN = ('--pose-noise', '0.05,0.3')


def share(report, *path):
    """A fraction of a report of evaluate_map in percent; '' where nothing is counted."""
    for name in path:
        report = report[name]
    return '' if report is None else f'{100 * report:.1f}'


def emptiness(report):
    """The least fraction of free voxels that are mostly empty, of all distances, in percent; '' if no truth is known."""
    if not report.get('truth'):
        return ''
    of_distances = (each['free_precision'] for each in report['truth']['by_distance'])
    return f'{100 * min(each for each in of_distances if each is not None):.1f}'


def delay(report, name):
    """Median and 95 % quantile of a time [s]."""
    times = report['presence'][name]
    return ', '.join(value if isinstance(value, str) else '-' if value is None else f'{value:.1f}'
                     for value in (times['median'], times['p95']))


SA, PARKED, HOLES, DA, DECIDABLE = (('SA', lambda r: share(r, 'sa')), ('parked', lambda r: share(r, 'sa_standing')),
                                    ('holes', lambda r: share(r, 'floor_holes')), ('DA', lambda r: share(r, 'da')),
                                    ('DA where decidable', lambda r: share(r, 'da_decidable')))
OPEN = ('open holes', lambda r: share(r, 'floor_open_holes'))
ENTERED = ('DA where entered', lambda r: share(r, 'da_entered'))
PA20, PA50 = ((f'PA to {distance} m', lambda r, n=n: share(r, 'presence', 'by_distance', n, 'pa_moving'))
              for n, distance in enumerate((20, 50)))
EMPTY = ('mostly empty', emptiness)
MIOU, INPUT = ('mIoU', lambda r: share(r, 'miou_map_present')), ('input', lambda r: share(r, 'miou_input_present'))
APPEAR, CLEAR = (('appear [s]', lambda r: delay(r, 'appear')), ('clear [s]', lambda r: delay(r, 'clear')))
NAMED = ('named', lambda r: share(r, 'presence', 'by_distance', 1, 'moving_named'))
STAYED = ('stayed', lambda r: share(r, 'presence', 'stayed_present'))


def by_drive(runs, sequences, variants):
    """One row for each drive. variants: for each of them, its name, arguments of Runs.report, and columns."""
    header = ['drive'] + [': '.join(filter(None, (name if n == 0 else '', title)))
                          for name, _, columns in variants for n, (title, _) in enumerate(columns)]
    return markdown(header, [[drive] + [of(runs.report(sequence, **arguments)) for _, arguments, columns in variants
                                        for _, of in columns] for drive, sequence in sequences.items()])


def measured(runs, sequences, resolutions):
    """The rows of the table of resolutions, one for each drive and resolution."""
    columns = (SA, PARKED, HOLES, DA, DECIDABLE, PA50)
    return [[drive, f'{resolution:g}'] + [of(runs.report(sequence, [f'resolution={resolution}'])) for _, of in columns]
            for drive, sequence in sequences.items() for resolution in resolutions]


def table_of_resolutions(runs, sequences, resolutions):
    return markdown(['drive', 'voxel [m]', 'SA', 'parked', 'holes', 'DA', 'DA where decidable', 'PA to 50 m'],
                    measured(runs, sequences, resolutions))


def table_of_sensors(runs, programs, scans):
    """For each scene, height and lidar: SA / parked / holes / DA where decidable / mostly empty."""
    rows = []
    for scene, heights in HEIGHTS.items():
        for height in heights:
            row = [scene, f'{height:g}']
            for lidar in LIDARS:
                count = SCENES[scene] * scans
                drive = programs.simulate(f'{scene}{count}_{lidar}_{height:g}', scene=scene, scans=count, lidar=lidar,
                                          height=height)
                report = runs.report(drive)
                row.append(' / '.join(of(report) or '-' for _, of in (SA, PARKED, HOLES, DECIDABLE, EMPTY)))
            rows.append(row)
    return markdown(['scene', 'height [m]'] + [f'{rows} rows' for rows in LIDARS.values()], rows)


def longer_drives(programs, scans):
    """Scene, rows, number of scans, and folder of each."""
    for scene, times, lidar in LONGER:
        count = round(times * scans)
        yield scene, LIDARS[lidar], count, programs.simulate(f'{scene}{count}_{lidar}', scene=scene, scans=count, lidar=lidar)


def table_of_longer_drives(runs, programs, scans):
    columns = (SA, PARKED, HOLES, DA, DECIDABLE, ENTERED, PA50, NAMED, STAYED)
    rows = [[scene, str(beams), str(count)] + [of(runs.report(drive)) or '-' for _, of in columns]
            for scene, beams, count, drive in longer_drives(programs, scans)]
    return markdown(['scene', 'rows', 'scans', *(title for title, _ in columns)], rows)


def table_of_settings(runs, sequences):
    """Parked and DA of each setting, on a few drives."""
    drives = {drive: sequences[drive] for drive in FEW if drive in sequences}
    judge = [word for each in JUDGED for word in ('--judge', 'rules/' + each)]

    def cell(figures):
        return f"{share(figures, 'sa_standing')}, {share(figures, 'da')}"

    def reports_of(sequence):
        report, *measured_ones = runs.with_others(sequence, ['rules/' + each for each in MEASURED], more=judge)
        return [report, *report['judged'], *measured_ones]
    names = ['`robot`'] + [f"`rules/{each.replace('=', '` ')}" for each in JUDGED + MEASURED]
    columns = [[cell(report) for report in reports_of(sequence)] for sequence in drives.values()]
    return markdown(['setting', *drives], [[name, *cells] for name, *cells in zip(names, *columns)])


def change(without, every):
    """By how much a figure is higher or lower without a rule [percentage points]; '' if by less than LEAST_CHANGE, or if one of
    the two is missing."""
    if not (without and every):
        return ''
    more = float(without) - float(every)
    return f'{more:+.1f}'.replace('-', '−') if abs(more) >= LEAST_CHANGE - 1e-9 else ''


def table_of_rules(runs, sequences, drives, rules, settings=()):
    """For each rule that is left out, or several, and each drive: all figures that change."""
    columns = (SA, PARKED, HOLES, DA, ('PA', PA50[1]), STAYED, ('empty', EMPTY[1]))
    measured_on = {drive: sequences[drive] for drive in drives if drive in sequences}
    others = [','.join(f'without={name}' for name in left_out.split()) for left_out in rules]
    rows = []
    for left_out in rules:
        equation = dict(RULES).get(left_out)
        rows.append([', '.join(f'`{name}`' for name in left_out.split()) + (f' ({equation})' if equation else '')])
    for sequence in measured_on.values():
        with_all, *without = runs.with_others(sequence, others, settings)
        for row, report in zip(rows, without):
            changes = ((title, change(of(report), of(with_all))) for title, of in columns)
            row.append(', '.join(f'{title} {value}' for title, value in changes if value))
    return markdown(['without', *measured_on], rows)


def rules_on_longer_drives(runs, programs, scans):
    drives = {f'{scene}, {beams} rows': drive for scene, beams, _, drive in longer_drives(programs, scans)}
    return table_of_rules(runs, drives, drives, LASTING)


def table_without_labels(runs, sequences):
    """If no point has a label, and the height of the sensor is set; in rooms with several settings."""
    columns = (SA, DA, DECIDABLE, PA50)
    cases = [(drive, '', 1.73, []) for drive in sequences if drive != 'rooms'] + [
        ('rooms', '', 0.35, []), ('rooms', ', 0.1 m', 0.35, ['resolution=0.1']),
        ('rooms', ', 0.1 m, `rules/void_outweighs` 1', 0.35, ['resolution=0.1', 'rules/void_outweighs=1'])]
    rows = []
    for drive, name, height, settings in cases:
        report = runs.report(sequences[drive], [f'sensor_model/height={height}', *settings], classes='occupancy')
        kept = {each['label']: share(each, 'sa') for each in report['sa_by_label']} if drive == 'rooms' else {}
        rows.append([drive + name] + [of(report) for _, of in columns] + [kept.get(label, '') for label in FURNITURE.values()])
    return markdown(['drive', *(title for title, _ in columns), *FURNITURE], rows)


def table_of_presence(runs, sequences):
    """What comes and goes; of each pair of figures, the second is OctoMap's."""
    columns = (PA20, PA50, NAMED, APPEAR, CLEAR, STAYED, SA, PARKED, HOLES, DA)
    rows = []
    for drive, sequence in sequences.items():
        report = runs.report(sequence, more=['--octomap', 'default'])
        pairs = ((of(report), of(report['octomap'][0])) for _, of in columns)
        cells = [' / '.join(pair) if any(pair) else '-' for pair in pairs]
        cells[columns.index(NAMED)] = NAMED[1](report) or '-'  # an OctoMap has no classes
        rows.append([drive] + cells)
    return markdown(['drive', *(title for title, _ in columns)], rows)


def tables_of(runs, programs, given, sequences):
    """For each name of a table, what measures it."""
    robot = (SA, PARKED, HOLES, DA)
    noise = ['--label-noise', '0.3']
    of_class, of_occupancy = (('', lambda r, kind=kind: share(r, kind + '_calibration_error'))
                              for kind in ('class_probability', 'occupancy'))

    def some(*drives):
        return {drive: sequences[drive] for drive in drives if drive in sequences}

    def kinds():
        return by_drive(runs, some('04', '05', 'street'), [
            (kind, {'more': [*noise, '--label-errors', kind]}, (INPUT, ('`robot`', MIOU[1])))
            for kind in ('even', 'network', 'objects')])

    def shaken():
        columns = (SA, PARKED, HOLES, OPEN, DA)
        fine, few = ('--pose-noise', '0.02,0.1'), some('04', '05', 'traffic')
        return by_drive(runs, few, [
            ('5 cm, `resolution` 0.1', {'settings': ['resolution=0.1'], 'more': SHAKEN}, columns),
            ('5 cm, `resolution` 0.6', {'settings': ['resolution=0.6'], 'more': SHAKEN}, columns),
            ('2 cm, `resolution` 0.3', {'more': fine}, columns),
            ('2 cm, `resolution` 0.1', {'settings': ['resolution=0.1'], 'more': fine}, columns)])

    def calibration():
        variants = [(f'{kind}, `{preset}`{wrong}', {'preset': preset, 'more': more}, (of,))
                    for kind, of in (('class', of_class), ('occupancy', of_occupancy))
                    for preset in ('paper_none', 'paper_line', 'robot') for wrong, more in (('', []), (', wrong', noise))]
        return by_drive(runs, {d: s for d, s in sequences.items() if d not in SCENES or d == 'street'}, variants)

    return {
        'quality': lambda: table_of_resolutions(runs, sequences, given.resolution),
        'paper': lambda: by_drive(runs, sequences, [('', {'preset': 'paper_line'}, (*robot, DECIDABLE, PA50))]),
        'longer': lambda: table_of_longer_drives(runs, programs, given.scans),
        'sensors': lambda: table_of_sensors(runs, programs, given.scans),
        'rules': lambda: table_of_rules(runs, sequences, ('04', '05', '07', 'street', 'crowd', 'traffic', 'arrivals', 'rooms'),
                                        [name for name, _ in RULES] + list(PAIRS)),
        'rules, 0.1 m': lambda: table_of_rules(runs, sequences, ('04', '05', '07', 'crowd', 'rooms'), FINE, ['resolution=0.1']),
        'rules, longer drives': lambda: rules_on_longer_drives(runs, programs, given.scans),
        'settings': lambda: table_of_settings(runs, sequences),
        'no labels': lambda: table_without_labels(runs, sequences),
        'presence': lambda: table_of_presence(runs, {d: s for d, s in sequences.items() if d not in ('street', 'rooms')}),
        'labels': lambda: by_drive(runs, sequences, [('right', {}, (*robot, MIOU)),
                                                     ('0.3 wrong', {'more': noise}, (*robot, MIOU, INPUT))]),
        'errors': kinds,
        'poses': lambda: by_drive(runs, sequences, [('true', {}, robot),
                                                    ('independent', {'more': SHAKEN}, (SA, PARKED, HOLES, OPEN, DA, PA50)),
                                                    ('accumulating', {'more': ('--pose-drift', '0.01,0.05')}, robot)]),
        'shaken': shaken,
        'calibration': calibration,
    }


def marks(name):
    """The lines before and after a table in the document."""
    return f'<!-- {name}: written by scripts/reproduce --quality -->\n', f'<!-- end of {name} -->\n'


def replaced(text, name, table):
    """The text of the document with another table between its marks."""
    begin, end = marks(name)
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise SystemExit(f'the document must have the lines {begin.strip()} and {end.strip()}, once and in this order')
    return text[:text.index(begin)] + begin + table + text[text.index(end):]


def main():
    parser = argparse.ArgumentParser(prog='figures.quality', description=__doc__)
    parser.add_argument('--programs', default=f'{ROOT}/build/devel/lib/bki_mapping',
                        help='folder with the programs of the package')
    parser.add_argument('--scratch', required=True, help='folder for simulated drives')
    parser.add_argument('--document', default=f'{ROOT}/docs/quality.md', help='document with the marker lines')
    parser.add_argument('--table', action='append', default=[], metavar='NAME', help='table to write; repeatable; default: all')
    parser.add_argument('--presets', default=f'{ROOT}/config/presets', help='folder with the presets')
    parser.add_argument('--preset', default='robot', help='the preset to measure')
    parser.add_argument('--classes', default=f'{ROOT}/config/classes/semantic_kitti.yaml', help='class table')
    parser.add_argument('--scans', type=int, default=60,
                        help='number of scans of each simulated drive; in rooms, five times as many')
    parser.add_argument('--resolution', type=float, nargs='+', default=RESOLUTIONS,
                        help='edges of voxels in the table named quality [m]')
    parser.add_argument('--jobs', type=int, default=os.cpu_count(),
                        help='number of tables to measure at the same time; default: that of all cores')
    parser.add_argument('--threads', type=int, default=1, help='threads of each mapper; 0: all cores')
    parser.add_argument('--commit', help='commit of the programs; default: that of this tree')
    parser.add_argument('--sequence', action='append', default=[],
                        help="further sequence in SemanticKITTI's layout; repeatable")
    given = parser.parse_args()
    programs = Programs(given.programs, os.path.abspath(given.scratch))
    runs = Runs(programs, given.presets, given.preset, given.classes, given.threads)
    sequences = {os.path.basename(os.path.abspath(path)): path for path in given.sequence}
    tables = tables_of(runs, programs, given, sequences)
    names = given.table or list(tables)
    if not set(names) <= set(tables):
        raise SystemExit(f'--table must be one of {", ".join(tables)}')
    with open(given.document) as file:
        text = file.read()
    for name in names:
        replaced(text, name, '')  # fails before the measurement, not after it
    for scene, times in SCENES.items():
        sequences[scene] = programs.simulate(f'{scene}{times * given.scans}', scene=scene, scans=times * given.scans)
    source = f'Measured on {datetime.date.today()}, commit {given.commit or commit()}'

    def write(name, rows):
        scans = '' if 'longer' in name else f', {given.scans} scans of each simulated drive'
        if scans and re.search(r'\| rooms\b', rows):
            scans += f", in rooms {SCENES['rooms'] * given.scans}"
        table = f'\n{source}{scans}:\n\n{rows}\n'
        with open(given.document) as file:
            text = file.read()
        with open(given.document, 'w') as file:
            file.write(replaced(text, name, table))
        print(f'    {given.document}: {name}', flush=True)

    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        # Those of rules take longest.
        measuring = {pool.submit(tables[name]): name for name in sorted(names, key=lambda name: 'rules' not in name)}
        try:
            for done in concurrent.futures.as_completed(measuring):
                write(measuring[done], done.result())
        finally:
            runs.stop()


if __name__ == '__main__':
    main()
