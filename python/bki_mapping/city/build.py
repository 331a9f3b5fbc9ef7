"""Gives the tasks of a city to Dask, and follows them. Only names of files and figures pass through Dask."""
import collections
import contextlib
import errno
import fcntl
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile
import time
import uuid
from typing import Dict, List

from bki_mapping.city import plan, report, work
from bki_mapping.city.description import City, CityError

# A worker that is killed takes its task with it through no fault of the task; Dask gives up on a task after this many.
ALLOWED_FAILURES = 1000
SMALLEST_FREE = 16 << 20  # of a disk [bytes]: below it, a task that failed is taken to have failed for want of space
NO_SPACE = re.compile('No space left on device|Disk quota exceeded')
NO_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}  # of file systems that know none
CONVERTED, CONVERTING = re.compile(r'-[0-9a-f]{16}$'), re.compile(r'\..+\.[0-9a-f]{32}(\.|$)')  # bags, by earlier versions
WAIT = 60  # for the first worker of a scheduler [s]


@contextlib.contextmanager
def dask_client(workers=0, scheduler=None):
    """A Dask cluster: the scheduler at an address, or one on this machine with a number of workers."""
    try:
        import dask
        # Workers are copies of a process that has loaded Dask: each would take a second to load it. Read on import.
        dask.config.set({'distributed.worker.multiprocessing-method': 'forkserver'})
        import distributed
    except ImportError:
        raise CityError('map_city needs Dask; install python3-distributed') from None
    with dask.config.set({'distributed.scheduler.allowed-failures': ALLOWED_FAILURES, 'distributed.admin.log-length': 100}):
        with contextlib.ExitStack() as stack:
            if scheduler is None:
                own = tempfile.mkdtemp(prefix='map_city-')
                stack.callback(shutil.rmtree, own, ignore_errors=True)
                cluster = distributed.LocalCluster(local_directory=own, n_workers=workers or os.cpu_count(),
                                                   threads_per_worker=1, processes=True, host='127.0.0.1',
                                                   dashboard_address='127.0.0.1:0', memory_limit=0, silence_logs=50)
                stack.enter_context(cluster)
                scheduler = cluster
            try:
                client = stack.enter_context(distributed.Client(scheduler, timeout=30))
            except (OSError, ValueError) as error:
                raise CityError(f'the Dask scheduler {scheduler} does not answer: {error}') from None
            if not workers_of(client, distributed):
                raise CityError(f'the Dask scheduler {scheduler} has no workers; start some: '
                                f'dask-worker {scheduler} --nthreads 1')
            sentence = unfit_process(client)
            if sentence:
                raise CityError(sentence)
            yield client


def workers_of(client, distributed):
    """Waits for a worker. Returns whether there is one."""
    try:
        client.wait_for_workers(1, timeout=WAIT)
    except (distributed.TimeoutError, TimeoutError):
        return False
    return True


@contextlib.contextmanager
def only_run(folder):
    """Keeps other runs out of the folder of a city. The lock ends with this process, however that ends; the file stays."""
    with open(folder / 'lock', 'a') as file:  # which processes that are started do not inherit
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CityError(f'another map_city works in {folder}; wait until it has ended, or name another folder') from None
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
        yield


class Builder:
    def __init__(self, city: City, folder, programs, client, say=print, draw=True):
        self.city, self.folder, self.programs, self.client, self.say = city, pathlib.Path(folder), str(programs), client, say
        self.draw = draw
        self.costs: Dict[str, report.Cost] = {}
        self.broken: Dict[str, str] = {}
        self.warnings = report.Warnings(say)
        self.setup = None

    def build(self):
        """Makes the city. Returns its index. Raises CityError if the disk is full, a worker is not fit, or a step fails for
        other reasons than a drive."""
        with only_run(self.folder):
            return self.build_alone()

    def build_alone(self):
        begin = time.time()
        token = self.folder / f'.run.{uuid.uuid4().hex}'
        token.write_text('')
        try:
            self.setup = self.check_programs(str(token))
            index = self.make()
            self.remove_old(index)
        finally:
            token.unlink()
        picture = report.draw(self.folder, index) if self.draw else None
        report.write(self.folder, index, self.costs, time.time() - begin, picture, self.warnings)
        return index

    def check_programs(self, token):
        city = self.city
        settings = ['--classes', city.classes] + (['--config', city.config] if city.config else [])
        settings += [word for setting in city.settings for word in ('--set', setting)]
        try:
            identity = work.identity_of(self.programs, settings)
            return work.Setup(str(self.folder), self.programs, token, tuple(settings), identity)
        except work.Fault as fault:
            raise CityError(str(fault)) from None

    def make(self):
        pieces = self.map_drives(self.count_clouds())
        mapped = {drive.name: drive for drive in self.city.drives if drive.name not in self.broken}
        if not mapped:
            reasons = '; '.join(f'{name}: {why}' for name, why in sorted(self.broken.items()))
            raise CityError('no drive could be mapped: ' + reasons)
        inputs: Dict[plan.Region, List[str]] = {}
        for piece, found in pieces:
            if piece.drive.name in mapped:
                for region in plan.regions_of(map(tuple, found['columns']), self.city.region_tiles):
                    inputs.setdefault(region, []).append(piece.file)
        if not inputs:
            raise CityError('the drives hold no voxel; check that their scans have points within the ranges of the parameters')
        levels = plan.sums_of(inputs, self.city.region_tiles)
        for level in levels:
            self.follow('sum', 'sums', [(each, (work.sum_region, self.setup, self.city.region_tiles, each)) for each in level],
                        must=True)
        last = [each for level in levels for each in level if each.file.startswith('regions/')]
        checked = self.follow('check', 'regions', [(each, (work.check_region, self.setup, self.draw, each)) for each in last],
                              must=True, count_of=lambda found: ('tiles', found['tiles']))
        index = {
            'version': 1, 'region_tiles': self.city.region_tiles, 'resolution': checked[0][1]['resolution'],
            'drives': [self.drive_entry(drive, [piece for piece, _ in pieces if piece.drive.name == name])
                       for name, drive in sorted(mapped.items())],
            'left_out': dict(sorted(self.broken.items())),
            'regions': [dict(found, x=each.region[0], y=each.region[1], inputs=len(inputs[each.region]))
                        for each, found in sorted(checked, key=lambda pair: pair[0].region)],
        }
        for region in index['regions']:
            for name in ('seconds', 'core_seconds', 'made', 'resolution', 'warnings'):
                region.pop(name)
        report.write_whole(self.folder / 'index.json', json.dumps(index, indent=1) + '\n')
        return index

    @staticmethod
    def drive_entry(drive, pieces):
        """What the index says of a drive."""
        source = {'sequence': str(drive.folder), 'poses': str(drive.poses), 'poses_in': drive.poses_in}
        if drive.bag:
            source = {'bag': str(drive.bag.path), 'cloud_topic': drive.bag.cloud_topic, 'frame': drive.bag.frame}
        return {'name': drive.name, **source,
                'pieces': [dict(file=piece.file, id=piece.id, first=piece.first, scans=piece.scans) for piece in pieces]}

    def leave_out(self, drive, why):
        if drive.name not in self.broken:
            self.broken[drive.name] = why
            self.say(f"drive '{drive.name}' is left out: {why}")

    def count_clouds(self):
        """Returns the drives, with the number of clouds of each bag."""
        bags = []
        for drive in self.city.drives:
            if drive.bag and drive.bag.path.exists():
                bags.append((drive, (work.count_clouds, self.setup, drive)))
            elif drive.bag:
                self.leave_out(drive, f'{drive.bag.path} does not exist; give the path of a bag')
        drives = {drive.name: drive for drive in self.city.drives if not drive.bag}
        for drive, found in self.follow('bag', 'bags', bags, drive_of=lambda drive: drive):
            if 'fault' not in found:
                drives[drive.name] = drive._replace(clouds=found['clouds'])
        return [drive for _, drive in sorted(drives.items())]

    def map_drives(self, drives):
        """Returns the pieces that are mapped, with what is known of them."""
        tasks = []
        for drive in drives:
            try:
                pieces = plan.pieces_of(self.city, drive, self.setup.identity)
                tasks += [(piece, (work.map_piece, self.setup, piece)) for piece in pieces]
            except CityError as error:
                self.leave_out(drive, str(error))
        done = self.follow('map', 'pieces', tasks, drive_of=lambda piece: piece.drive)
        pieces = sorted((pair for pair in done if 'fault' not in pair[1]), key=lambda pair: pair[0].id)
        for drive in drives:
            if drive.bag and drive.name not in self.broken:
                self.report_clouds(drive, [found for piece, found in pieces if piece.drive.name == drive.name])
        return pieces

    def report_clouds(self, drive, found):
        """Says how many clouds of a bag could not be mapped, and leaves it out if none could."""
        clouds, dropped = sum(each['clouds'] for each in found), collections.Counter()
        for each in found:
            dropped.update(each['dropped'])
        missing = sum(dropped.values())
        reasons = ', '.join(f'{count} {reason}' for reason, count in sorted(dropped.items()))
        if missing == clouds:
            self.leave_out(drive, f'{drive.bag.path}: no cloud of {drive.bag.cloud_topic} has a transform to '
                           f"'{drive.bag.frame}' ({reasons}); record tf with the clouds, or give another frame")
        elif missing:
            self.say(f"drive '{drive.name}': {missing} of {clouds} clouds are left out: {reasons}")

    def follow(self, stage, what, tasks, must=False, drive_of=None, count_of=None):
        """Lets workers do tasks. Returns each task with its result. must: a fault ends the whole, as one of a worker
        always does. drive_of: the drive of a task, which a fault leaves out. count_of: something else to count in a result."""
        from distributed import as_completed
        if not tasks:
            return []
        progress = report.Progress(what, len(tasks), self.say, [drive_of(each).name for each, _ in tasks] if drive_of else [])
        cost = self.costs.setdefault(stage, report.Cost())
        futures = {self.client.submit(*call, pure=False, retries=0): each for each, call in tasks}
        done = []
        for future in as_completed(futures):
            each = futures[future]
            try:
                found = future.result()
            except Exception as error:  # not of a task, which returns its faults
                if self.client.status != 'running':
                    raise CityError('the Dask scheduler has gone; start it and its workers again, and run the same command '
                                    'with --resume') from None
                self.client.cancel(list(futures))
                raise CityError(unfit_process(self.client) or f'a task failed ({type(error).__name__}: {error}); run the '
                                'same command with --resume') from None
            if 'fault' in found and (must or found['of_worker'] or self.disk_is_full()):
                self.client.cancel(list(futures))
                remedy = ('; the disk is full: free space, and run the same command with --resume' if self.disk_is_full()
                          or NO_SPACE.search(found['fault']) else '; run the same command with --resume once this is mended')
                raise CityError(found['fault'] + remedy)
            done.append((each, found))
            if 'fault' in found:
                self.leave_out(drive_of(each), found['fault'])
            else:
                cost.add(found)
                for sentence in found.get('warnings', ()):
                    self.warnings.add(sentence, each)
            progress.step(failed='fault' in found, drive=drive_of(each).name if drive_of else None,
                          more=count_of(found) if count_of else None)
        return done

    def disk_is_full(self):
        return shutil.disk_usage(self.folder).free < SMALLEST_FREE

    def remove_old(self, index):
        """Removes what earlier cities left, and what killed tasks did, once the new index names all that is needed. Pieces and
        their accounts stay: they make changes of the city cheap."""
        kept = {each['file'] for each in index['regions']}
        for path in (self.folder / 'regions').iterdir():
            if f'regions/{path.name}' not in kept:
                path.unlink()
        pictures = {plan.picture_of(file) for file in kept}
        for path in self.folder.glob('pictures/*'):
            if f'pictures/{path.name}' not in pictures:
                path.unlink()
        shutil.rmtree(self.folder / 'sums', ignore_errors=True)
        own = pathlib.Path(self.setup.token)
        for pattern in ('pieces/*/.*', 'regions/.*.bkm*', '.*.json*', 'pictures/.*', '.run.*', '.report.md.*'):
            for path in self.folder.glob(pattern):
                if path != own:
                    path.unlink()
        remove_converted_bags(self.folder / 'bags')


def remove_converted_bags(folder):
    """Removes the sequences that earlier versions made of bags, and the folder if nothing else is in it."""
    for path in folder.glob('*'):
        if CONVERTING.match(path.name) or CONVERTED.search(path.name) and (path / 'bag.json').is_file():
            shutil.rmtree(path, ignore_errors=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def unfit_process(client):
    """A sentence about a worker, or the scheduler, that has not the same modules as this process; None if all have. Newer
    versions of Dask unpack tasks in the scheduler, too."""
    version, source = work.VERSION, sys.version_info[:2]

    def probe():  # without names of this package, so that it can run where that is missing
        import socket
        host = socket.gethostname()
        try:
            from bki_mapping.city import work
        except Exception as error:
            return f"on {host} cannot import bki_mapping.city ({error})"
        if getattr(work, 'VERSION', None) != version:
            return f'on {host} has another version of bki_mapping.city ({work.__file__})'
        return None
    try:
        sentences = sorted({'the worker ' + found for found in client.run(probe).values() if found})
        found = client.run_on_scheduler(probe)
    except Exception as error:
        return f'a worker or the scheduler cannot be asked for its modules ({type(error).__name__}: {error}); give all the ' \
               f'same version of Dask and of Python, here {source[0]}.{source[1]}'
    if sentences:
        return sentences[0] + '; install the same bki_mapping there, source its setup.bash, and start the worker again'
    if found:
        return f'the scheduler {found}; install the same bki_mapping there, source its setup.bash, and start the scheduler ' \
               'and its workers again'
    return None
