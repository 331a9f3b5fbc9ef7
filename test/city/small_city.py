"""A small city as map_city writes it, without Dask, and the whole map of the same drives."""
import json
import pathlib
import sqlite3
import subprocess

SCANS = 5


def program(folder, name, *arguments):
    subprocess.run([str(pathlib.Path(folder) / name), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def write_city(programs, pieces, city, region_tiles):
    """Writes the regions of some map files, and the index."""
    city = pathlib.Path(city)
    (city / 'regions').mkdir(parents=True)
    columns, ids = set(), []
    for piece in pieces:
        database = sqlite3.connect(str(piece))
        columns |= set(database.execute('SELECT DISTINCT x, y FROM tile WHERE part = 0'))
        ids += [id for (id,) in database.execute('SELECT id FROM drive')]
        database.close()
    index = {'version': 1, 'region_tiles': region_tiles, 'regions': [], 'left_out': {},
             'drives': [{'name': id, 'sequence': id, 'pieces': [{'file': 'pieces/x.bkm', 'id': id, 'first': 0, 'scans': SCANS}]}
                        for id in sorted(ids)]}
    for x, y in sorted({(x // region_tiles, y // region_tiles) for x, y in columns}):
        file, low = f'regions/{x}_{y}-key.bkm', (x * region_tiles, y * region_tiles)
        program(programs, 'merge_maps', *pieces, '--output', city / file, '--tiles',
                ','.join(map(str, (*low, low[0] + region_tiles - 1, low[1] + region_tiles - 1))))
        program(programs, 'inspect_map', city / file, '--json', city / 'found.json')
        found = json.loads((city / 'found.json').read_text())
        index['resolution'] = found['resolution']
        index['regions'].append({'file': file, 'x': x, 'y': y, 'inputs': len(pieces), 'bytes': found['file_bytes'],
                                 **{key: found[key] for key in ('bounds', 'voxels', 'voxels_by_class', 'blocks', 'tiles')}})
    (city / 'found.json').unlink()
    (city / 'index.json').write_text(json.dumps(index, indent=1) + '\n')
    return index


def make(programs, folder, shifts=((0, 0), (35.1, -20.1)), region_tiles=2, settings=()):
    """Writes the city `city` of some drives, moved by x, y [m], and their map `whole.bkm`. `settings` are arguments of map_sequence.
    Returns the index."""
    folder = pathlib.Path(folder)
    maps = []
    for seed, (x, y) in enumerate(shifts, 1):
        drive, mapped, moved = folder / f'd{seed}', folder / f'mapped{seed}.bkm', folder / f'moved{seed}.bkm'
        program(programs, 'simulate_drive', '--output', drive, '--scans', SCANS, '--seed', seed, '--beams', 16,
                '--columns', 400)
        program(programs, 'map_sequence', '--sequence', drive, '--output', mapped, *settings)
        program(programs, 'merge_maps', mapped, '--transform', f'{mapped}={x},{y},0,0', '--output', moved)
        maps.append(moved)
    program(programs, 'merge_maps', *maps, '--output', folder / 'whole.bkm')
    return write_city(programs, maps, folder / 'city', region_tiles)
