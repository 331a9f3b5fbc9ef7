"""Writes the CSV files and tables of the report."""
import csv
import os


def write_csv(folder, name, header, rows):
    path = os.path.join(folder, name)
    with open(path, 'w', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)
    print(f'    {path}', flush=True)


def markdown(header, rows):
    lines = ['| ' + ' | '.join(header) + ' |', '|' + '---|' * len(header)]
    lines += ['| ' + ' | '.join(str(cell) for cell in row) + ' |' for row in rows]
    return '\n'.join(lines) + '\n'


def save(figure, folder, name):
    path = os.path.join(folder, name)
    figure.savefig(path, dpi=110)
    print(f'    {path}', flush=True)
