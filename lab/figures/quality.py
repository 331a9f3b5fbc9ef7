"""Measures a preset on simulated drives and given sequences, with voxels of several sizes, and writes the table into a document.

The table replaces what the document has between two marker lines; it says the date, the commit, and how many scans each
simulated drive has. scripts/reproduce --quality calls it.
"""
import argparse
import datetime
import os

from .programs import ROOT, Programs, commit
from .tables import markdown

# By how much each drive is longer than --scans: the robot in rooms is slow.
SCENES = {'street': 1, 'crowd': 1, 'traffic': 1, 'arrivals': 1, 'rooms': 5}
RESOLUTIONS = (0.1, 0.2, 0.3, 0.6)
BEGIN, END = '<!-- quality: written by scripts/reproduce --quality -->\n', '<!-- end of quality -->\n'
HEADER = ['drive', 'voxel [m]', 'SA', 'parked', 'holes', 'DA', 'DA where decidable', 'PA to 50 m']
INTRODUCTION = '''Measured on {date}, commit {commit}, preset `{preset}`, {scans} scans of each simulated drive, in rooms {rooms};
all figures in %. A cell without a figure: the drive has no such points.

'''


def figures_of(report):
    """The figures of a row [fraction], of a report of evaluate_map; None where there are no such points."""
    far = report['presence']['by_distance'][1]
    return [report[name] for name in ('sa', 'sa_standing', 'floor_holes', 'da', 'da_decidable')] + [far['pa_moving']]


def row_of(drive, resolution, report):
    return [drive, f'{resolution:g}'] + ['' if value is None else f'{100 * value:.1f}' for value in figures_of(report)]


def replaced(text, table):
    """The text of the document with another table between the markers."""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise SystemExit(f'the document must have the lines {BEGIN.strip()} and {END.strip()}, once and in this order')
    return text[:text.index(BEGIN)] + BEGIN + table + text[text.index(END):]


def measured(programs, sequences, resolutions, more=()):
    """The rows of the table, one for each drive and resolution."""
    return [row_of(name, resolution, programs.evaluate(sequence, {'resolution': resolution}, more))
            for name, sequence in sequences.items() for resolution in resolutions]


def main():
    parser = argparse.ArgumentParser(prog='figures.quality', description=__doc__)
    parser.add_argument('--programs', default=f'{ROOT}/build/devel/lib/bki_mapping',
                        help='folder with the programs of the package')
    parser.add_argument('--scratch', required=True, help='folder for simulated drives')
    parser.add_argument('--document', default=f'{ROOT}/docs/quality.md', help='document with the marker lines')
    parser.add_argument('--presets', default=f'{ROOT}/config/presets', help='folder with the presets')
    parser.add_argument('--preset', default='robot', help='the preset to measure')
    parser.add_argument('--classes', default=f'{ROOT}/config/classes/semantic_kitti.yaml', help='class table')
    parser.add_argument('--scans', type=int, default=60,
                        help='number of scans of each simulated drive; in rooms, five times as many')
    parser.add_argument('--resolution', type=float, nargs='+', default=RESOLUTIONS, help='edges of voxels [m]')
    parser.add_argument('--threads', type=int, default=0, help='threads of the mapper; 0: all cores')
    parser.add_argument('--commit', help='commit of the programs; default: that of this tree')
    parser.add_argument('--sequence', action='append', default=[],
                        help="further sequence in SemanticKITTI's layout; repeatable")
    given = parser.parse_args()
    programs = Programs(given.programs, os.path.abspath(given.scratch))
    with open(given.document) as file:
        text = file.read()
    replaced(text, '')  # fails before the measurement, not after it
    sequences = {os.path.basename(os.path.abspath(path)): path for path in given.sequence}
    for scene, times in SCENES.items():
        scans = times * given.scans
        sequences[scene] = programs.simulate(f'{scene}{scans}', scene=scene, scans=scans)
    more = ['--config', os.path.join(given.presets, given.preset + '.yaml'), '--classes', given.classes,
            '--threads', str(given.threads)]
    rows = measured(programs, sequences, given.resolution, more)
    introduction = INTRODUCTION.format(date=datetime.date.today(), commit=given.commit or commit(), preset=given.preset,
                                       scans=given.scans, rooms=SCENES['rooms'] * given.scans)
    with open(given.document) as file:
        text = file.read()
    with open(given.document, 'w') as file:
        file.write(replaced(text, '\n' + introduction + markdown(HEADER, rows) + '\n'))
    print(f'    {given.document}', flush=True)


if __name__ == '__main__':
    main()
