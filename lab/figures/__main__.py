"""Measures and draws all figures; called by scripts/reproduce."""
import argparse
import os

import matplotlib
matplotlib.use('Agg')

from . import complexity, frontier, plane, tradeoff  # noqa: E402
from .programs import Programs  # noqa: E402

INTRODUCTION = '''# The paper's figures, reproduced

The comparisons of Zhong and Peng, "Real-time Semantic 3D Dense Occupancy Mapping with Efficient Free Space Representations",
made with this package. `scripts/reproduce` measured all figures in one run on {cores} cores; times are medians over the
scans.

'''


def main():
    parser = argparse.ArgumentParser(prog='figures', description=__doc__)
    parser.add_argument('--programs', required=True, help='folder with the programs of the package')
    parser.add_argument('--presets', required=True, help='folder with the presets')
    parser.add_argument('--output', required=True, help='output folder')
    parser.add_argument('--scans', type=int, default=60, help='number of scans of the simulated drive')
    parser.add_argument('--sequence', help="additional sequence in SemanticKITTI's layout")
    given = parser.parse_args()
    output = os.path.abspath(given.output)
    programs = Programs(given.programs, os.path.join(output, 'scratch'))
    drive = programs.simulate(f'drive{given.scans}', scans=given.scans)
    cases = [(drive, 'simulated', f'a simulated drive of {given.scans} scans')]
    if given.sequence:
        cases.append((given.sequence, 'sequence', 'the given sequence'))

    parts = [plane.draw(programs, output)]
    for sequence, name, title in cases:
        parts.append(tradeoff.draw(programs, sequence, name, title, output))
        parts.append(frontier.draw(programs, sequence, name, title, given.presets, output))
    parts.append(complexity.draw(programs, output, given.scans))
    with open(os.path.join(output, 'report.md'), 'w') as file:
        file.write(INTRODUCTION.format(cores=os.cpu_count()) + '\n'.join(parts))


if __name__ == '__main__':
    main()
