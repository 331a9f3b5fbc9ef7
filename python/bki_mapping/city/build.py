"""Gives the tasks of a city to Dask, and follows them. Only names of files and figures pass through Dask."""
import contextlib
import json
import os
import pathlib
import shutil
import time
from typing import Dict, List

from bki_mapping.city import plan, report, work
from bki_mapping.city.description import City, CityError

# A worker that is killed takes its task with it through no fault of the task; Dask gives up on a task after this many.
ALLOWED_FAILURES = 1000
SMALLEST_FREE = 16 << 20  # of a disk [bytes]: below it, a task that failed is taken to have failed for want of space


@contextlib.contextmanager
def dask_client(workers=0, scheduler=None):
    """A Dask cluster: the scheduler at an address, or one on this machine with a number of workers."""
    try:
        import dask
        import distributed
    except ImportError:
        raise CityError('map_city needs Dask; install python3-distributed') from None
    with dask.config.set({'distributed.scheduler.allowed-failures': ALLOWED_FAILURES, 'distributed.admin.log-length': 100}):
        with contextlib.ExitStack() as stack:
            if scheduler is None:
                cluster = distributed.LocalCluster(n_workers=workers or os.cpu_count(), threads_per_worker=1, processes=True,
                                                   host='127.0.0.1', dashboard_address=None, memory_limit=0, silence_logs=50)
                stack.enter_context(cluster)
                scheduler = cluster
            try:
                client = stack.enter_context(distributed.Client(scheduler, timeout=30))
            except OSError as error:
                raise CityError(f'the Dask scheduler {scheduler} does not answer: {error}') from None
            yield client


class Builder:
    def __init__(self, city: City, folder, programs, client, say=print):
        self.city, self.folder, self.programs, self.client, self.say = city, pathlib.Path(folder), str(programs), client, say
        self.seconds: Dict[str, float] = {}

    def build(self):
        """Makes the city. Returns its index. Raises CityError if the disk is full or a step fails for other reasons than
        a drive."""
        begin = time.time()
        pieces, broken = self.map_drives()
        mapped = {drive.name: drive for drive in self.city.drives if drive.name not in broken}
        if not mapped:
            raise CityError('no drive could be mapped: ' + '; '.join(f'{name}: {why}' for name, why in sorted(broken.items())))
        inputs: Dict[plan.Region, List[str]] = {}
        for piece, found in pieces:
            if piece.drive.name in mapped:
                for region in plan.regions_of(map(tuple, found['columns']), self.city.region_tiles):
                    inputs.setdefault(region, []).append(piece.file)
        levels = plan.sums_of(inputs)
        for level in levels:
            self.follow('sum', 'sums', [(each, (work.sum_region, str(self.folder), self.programs, self.city.region_tiles, each))
                                        for each in level], must=True)
        last = [each for level in levels for each in level if each.file.startswith('regions/')]
        checked = self.follow('check', 'regions', [(each, (work.check_region, str(self.folder), self.programs, each))
                                                   for each in last], must=True)
        index = {
            'version': 1, 'region_tiles': self.city.region_tiles,
            'drives': [{'name': name, 'sequence': str(drive.folder),
                        'pieces': [dict(file=piece.file, id=piece.id, first=piece.first, scans=piece.scans)
                                   for piece, _ in pieces if piece.drive.name == name]} for name, drive in sorted(mapped.items())],
            'left_out': dict(sorted(broken.items())),
            'regions': [dict(found, x=each.region[0], y=each.region[1], inputs=len(inputs[each.region]))
                        for each, found in sorted(checked, key=lambda pair: pair[0].region)],
        }
        for region in index['regions']:
            region.pop('seconds')
        write_whole(self.folder / 'index.json', json.dumps(index, indent=1) + '\n')
        report.write(self.folder, index, self.seconds, time.time() - begin)
        self.remove_old(index)
        return index

    def map_drives(self):
        """Returns the pieces that are mapped, with what is known of them, and the drives that are broken, with the reason."""
        broken: Dict[str, str] = {}
        tasks = []
        for drive in self.city.drives:
            try:
                tasks += [(piece, (work.map_piece, str(self.folder), self.programs, self.city, piece))
                          for piece in plan.pieces_of(self.city, drive)]
            except CityError as error:
                broken[drive.name] = str(error)
        done = self.follow('map', 'pieces', tasks)
        for piece, found in done:
            if 'fault' in found:
                broken.setdefault(piece.drive.name, found['fault'])
        for name, why in sorted(broken.items()):
            self.say(f"drive '{name}' is left out: {why}")
        return sorted((pair for pair in done if 'fault' not in pair[1]), key=lambda pair: pair[0].id), broken

    def follow(self, stage, what, tasks, must=False):
        """Lets workers do tasks. Returns each task with its result. must: a fault ends the whole."""
        from distributed import as_completed
        if not tasks:
            return []
        progress = report.Progress(what, len(tasks), self.say)
        futures = {self.client.submit(*call, pure=False, retries=0): task for task, call in tasks}
        done = []
        for future in as_completed(futures):
            task = futures[future]
            try:
                found = future.result()
            except OSError as error:  # of the worker, such as a full disk
                found = {'fault': str(error)}
            if 'fault' in found and (must or self.disk_is_full()):
                self.client.cancel(list(futures))
                remedy = ('; the disk is full: free space, and run the same command with --resume' if self.disk_is_full()
                          else '; run the same command with --resume once this is mended')
                raise CityError(found['fault'] + remedy)
            self.seconds[stage] = self.seconds.get(stage, 0.0) + found.get('seconds', 0.0)
            done.append((task, found))
            progress.step(failed='fault' in found)
        return done

    def disk_is_full(self):
        return shutil.disk_usage(self.folder).free < SMALLEST_FREE

    def remove_old(self, index):
        """Removes what earlier cities left, and what killed tasks did, once the new index names all that is needed. Pieces stay:
        they make changes of the city cheap."""
        kept = {each['file'] for each in index['regions']}
        for path in (self.folder / 'regions').iterdir():
            if f'regions/{path.name}' not in kept:
                path.unlink()
        shutil.rmtree(self.folder / 'sums', ignore_errors=True)
        for pattern in ('pieces/*/.*.bkm*', 'regions/.*.bkm*', '.*.json*'):
            for path in self.folder.glob(pattern):
                path.unlink()


def write_whole(path, text):
    own = path.with_name(f'.{path.name}.{os.getpid()}')
    own.write_text(text)
    os.replace(own, path)
