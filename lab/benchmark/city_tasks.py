#!/usr/bin/env python3
"""What map_city spends beside its programs: on a task of Dask, and on planning the pieces of a drive."""
import argparse
import pathlib
import sys
import tempfile
import time

import psutil

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / 'python'))
from bki_mapping.city import plan, work  # noqa: E402
from bki_mapping.city.build import dask_client  # noqa: E402
from bki_mapping.city.description import City, Drive  # noqa: E402


def core_seconds():
    """Of this process and of those that it has started."""
    process = psutil.Process()
    return sum(sum(each.cpu_times()[:2]) for each in [process, *process.children(recursive=True)])


def nothing(setup, piece):
    return {'file': piece.file}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tasks', type=int, default=5000, metavar='N', help='number of empty tasks')
    parser.add_argument('--scans', type=int, default=20000, metavar='N', help='number of scans that are planned')
    parser.add_argument('--workers', type=int, default=1, metavar='N', help='processes on this machine')
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        drive = Drive('drive', pathlib.Path(folder), 'labels', pathlib.Path(folder) / 'poses.txt')
        for kind, suffix in (('velodyne', 'bin'), ('labels', 'label')):
            (drive.folder / kind).mkdir()
            for scan in range(options.scans):
                (drive.folder / kind / f'{scan:06d}.{suffix}').touch()
        begin = time.perf_counter()
        plan.pieces_of(City((drive,), 'semantic_kitti', '', (), 200, 16), drive)
        elapsed = time.perf_counter() - begin
        print(f'planning: {1e6 * elapsed / options.scans:.1f} us a scan, with what the disk knows of its files in memory')
    setup = work.Setup('/city', '/programs', '/city/.run', (), 'bki_mapping\n' + 4000 * 'p')
    with dask_client(options.workers) as client:
        from distributed import as_completed
        before, begin = core_seconds(), time.perf_counter()
        pieces = [plan.Piece(drive, number, 200, f'pieces/drive/{number}.bkm') for number in range(options.tasks)]
        futures = {client.submit(nothing, setup, piece, pure=False, retries=0): piece for piece in pieces}
        for future in as_completed(futures):
            future.result()
        elapsed, spent = time.perf_counter() - begin, core_seconds() - before
    print(f'Dask: {1e3 * elapsed / options.tasks:.2f} ms and {1e3 * spent / options.tasks:.2f} core-milliseconds a task, with '
          f'{options.workers} workers')


if __name__ == '__main__':
    main()
