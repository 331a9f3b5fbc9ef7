"""The tasks that workers do. Each writes to a name of its own and renames, so that it may be done twice, at the same time, or be
killed. Each returns a dictionary: `file` and what is known of it, or `fault`, the sentence of the program that failed."""
import json
import os
import pathlib
import subprocess
import time
import uuid

from bki_mapping.city import plan


TRIES = 3  # of a program that a signal ends, as when memory is short


def run(city_folder, programs, name, arguments, log):
    """Runs a program of this package. Returns its fault, or None. Its output is added to a log of its own."""
    path = pathlib.Path(city_folder) / 'log' / log
    path.parent.mkdir(parents=True, exist_ok=True)
    command = [str(pathlib.Path(programs) / name), *map(str, arguments)]
    for _ in range(TRIES):
        begin = time.time()
        try:
            result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
                                    errors='replace')
        except OSError as error:
            return f'{command[0]} cannot be started: {error.strerror}'
        with open(path, 'a') as file:
            file.write(f'$ {" ".join(command)}\n{result.stdout}{result.stderr}status {result.returncode}, '
                       f'{time.time() - begin:.1f} s\n')
        if result.returncode >= 0:
            break
    if result.returncode == 0:
        return None
    lines = [line for line in result.stderr.strip().splitlines() if line]
    return lines[-1] if lines else f'{name} ended with status {result.returncode}; see {path}'


def produce(city_folder, file, make):
    """Lets `make` write a file under a name of its own, and renames it. make returns a fault or None."""
    target = pathlib.Path(city_folder) / file
    if target.exists():
        return None
    target.parent.mkdir(parents=True, exist_ok=True)
    own = target.with_name(f'.{target.stem}.{uuid.uuid4().hex}{target.suffix}')
    try:
        fault = make(own)
        if fault is None:
            os.replace(own, target)
        return fault
    finally:
        if own.exists():
            own.unlink()


def map_piece(city_folder, programs, city, piece):
    begin = time.time()
    drive = piece.drive
    arguments = ['--sequence', drive.folder, '--labels', drive.labels, '--first', piece.first, '--scans', piece.scans,
                 '--drive', piece.id, '--classes', city.classes, '--threads', 1]
    if city.config:
        arguments += ['--config', city.config]
    for setting in city.settings:
        arguments += ['--set', setting]
    fault = produce(city_folder, piece.file, lambda own: run(
        city_folder, programs, 'map_sequence', arguments + ['--output', own], f'{drive.name}-{piece.first:06d}.log'))
    if fault:
        return {'fault': fault}
    path = pathlib.Path(city_folder) / piece.file
    return {'file': piece.file, 'columns': plan.columns_of(path), 'bytes': path.stat().st_size, 'seconds': time.time() - begin}


def sum_region(city_folder, programs, region_tiles, task):
    begin = time.time()
    x, y = (region_tiles * index for index in task.region)
    columns = f'{x},{y},{x + region_tiles - 1},{y + region_tiles - 1}'
    inputs = [pathlib.Path(city_folder) / each for each in task.inputs]
    log = f'region-{task.region[0]}_{task.region[1]}.log'
    fault = produce(city_folder, task.file, lambda own: run(
        city_folder, programs, 'merge_maps', [*inputs, '--tiles', columns, '--output', own], log))
    if fault:
        return {'fault': fault}
    size = (pathlib.Path(city_folder) / task.file).stat().st_size
    return {'file': task.file, 'bytes': size, 'seconds': time.time() - begin}


def check_region(city_folder, programs, task):
    """Reads every byte of a region's file, and returns its figures."""
    begin = time.time()
    own = pathlib.Path(city_folder) / f'.{uuid.uuid4().hex}.json'
    try:
        fault = run(city_folder, programs, 'inspect_map', [pathlib.Path(city_folder) / task.file, '--json', own],
                    f'region-{task.region[0]}_{task.region[1]}.log')
        if fault:
            return {'fault': fault}
        found = json.loads(own.read_text())
    finally:
        if own.exists():
            own.unlink()
    return {'file': task.file, 'bounds': found['bounds'], 'voxels': found['voxels'], 'voxels_by_class': found['voxels_by_class'],
            'blocks': found['blocks'], 'tiles': found['tiles'], 'bytes': found['file_bytes'], 'seconds': time.time() - begin}
