"""The tasks that workers do. Each writes to a name of its own and renames, so that it may be done twice, at the same time,
or be killed. Each returns a dictionary: `file` and what is known of it, or `fault`, a sentence, and with `of_worker` whether
the worker is to blame, and not what it worked on."""
import contextlib
import ctypes
import functools
import hashlib
import json
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import subprocess
import tempfile
import time
import uuid
from typing import NamedTuple

from bki_mapping.city import plan
from bki_mapping.city.description import CityError

VERSION = 6  # of the tasks: a worker whose modules have another cannot do them
STOPPED = 130  # status of programs that SIGTERM or SIGINT has ended early
FRAME = 'map'  # of the maps of map_sequence, with which those of bags are added
TRIES = 3  # of a program that a signal ends, as when memory is short
SIGHT = 10.0  # how long a worker may take to see what another machine has written [s]
LIBC, PR_SET_PDEATHSIG = ctypes.CDLL(None), 1
OVER = 'map_city has ended'
WARNING = 'warning: '  # how programs begin the lines of their warnings
MOST_WARNINGS = 10  # that a task returns
# Signals that come from outside of a program, or from a processor that it was not built for.
OF_WORKER = {signal.SIGKILL, signal.SIGTERM, signal.SIGILL, signal.SIGXCPU}


class Setup(NamedTuple):
    """What all tasks of a run have in common."""
    folder: str  # of the city
    programs: str  # folder
    token: str  # a file in the folder of the city, by which workers know that they see it
    settings: tuple  # arguments of map_sequence
    identity: str  # what the programs say of themselves and of the settings


class Ran(NamedTuple):
    """What is known of a program that has done its work."""
    core_seconds: float
    warnings: tuple  # what it has warned of, without a repetition
    printed: str  # on its standard output


class Fault(Exception):
    def __init__(self, text, of_worker=False):
        super().__init__(text)
        self.of_worker = of_worker


def identity_of(programs, settings):
    """The version of the programs, and the parameters and the class table that they would use. Raises Fault."""
    text = ''
    for arguments in (['--version'], ['--print-config', *settings], ['--print-classes', *settings]):
        command = [str(pathlib.Path(programs) / 'map_sequence'), *arguments]
        for _ in range(TRIES):
            try:
                result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
            except OSError as error:
                raise not_started(command[0], error.strerror) from None
            if result.returncode >= 0:
                break
        if -result.returncode in OF_WORKER:
            raise ended(command[0], -result.returncode)
        if result.returncode:
            lines = result.stderr.strip().splitlines()
            if arguments[0] == '--version' or result.returncode in (126, 127):
                raise not_started(command[0], lines[-1] if lines else f'status {result.returncode}')
            raise Fault(lines[-1] if lines else f'{command[0]} ended with status {result.returncode}')
        # Of the table a digest, because the text goes with every task.
        text += (result.stdout if arguments[0] != '--print-classes' else
                 f'class table with digest {hashlib.sha256(result.stdout.encode()).hexdigest()[:16]}\n')
    return text


def not_started(program, why):
    return Fault(f'{program} cannot be started on {socket.gethostname()} ({why}); install the same version of '
                 'bki_mapping there as where map_city runs, or name the folder of its programs with --programs', of_worker=True)


def ended(program, number, log=''):
    return Fault(f'{program} was ended {TRIES} times by signal {number} on {socket.gethostname()}, as when memory is short; '
                 f'give each worker more of it, or start fewer{log}', of_worker=True)


def unseen(folder):
    return Fault(f'{socket.gethostname()} does not see {folder}; mount it there at the same path', of_worker=True)


def prepare(setup: Setup):
    """Checks that this process sees the city and has the same programs. Raises Fault."""
    end = time.monotonic() + SIGHT
    while not os.path.exists(setup.token):
        if time.monotonic() > end:
            raise unseen(setup.folder)
        time.sleep(0.2)
    check_programs(setup)


@functools.lru_cache(maxsize=16)
def check_programs(setup: Setup):
    try:
        found = identity_of(setup.programs, setup.settings)
    except Fault as fault:
        raise Fault(str(fault), of_worker=True) from None
    if found != setup.identity:
        ours, theirs = setup.identity.splitlines(), found.splitlines()
        first = next(((a, b) for a, b in zip(ours, theirs) if a != b), ('', ''))
        raise Fault(f"the programs in {setup.programs} on {socket.gethostname()} are others than where map_city runs "
                    f"('{first[1]}' instead of '{first[0]}'); install the same version of bki_mapping there", of_worker=True)


def task(do):
    """A function of a setup and more: what it raises becomes a result."""
    @functools.wraps(do)
    def done(setup, *arguments):
        begin = time.time()
        try:
            prepare(setup)
            found = do(setup, *arguments)
        except (Fault, CityError) as fault:
            found = {'fault': str(fault), 'of_worker': isinstance(fault, Fault) and fault.of_worker}
        except OSError as error:  # such as a full disk; programs read the drives, so it is not about one of them
            found = {'fault': f'{error} on {socket.gethostname()}', 'of_worker': True}
        return dict(found, seconds=time.time() - begin)
    return done


def dies_with(parent):
    """What a child does first, so that it does not outlive its parent, a process with this number."""
    def prepare_child():
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
    return prepare_child


def wait_for(process, setup):
    """Waits for a program, and kills it once the run of map_city is over. Returns its status, of signals negative, and its
    processor time [s]."""
    pause = 0.001
    while True:
        number, status, usage = os.wait4(process.pid, os.WNOHANG)
        if number:
            process.returncode = -os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
            return process.returncode, usage.ru_utime + usage.ru_stime
        if is_over(setup):
            os.kill(process.pid, signal.SIGKILL)
        time.sleep(pause)
        pause = min(1.2 * pause, 0.2)


def is_over(setup):
    """Whether map_city has ended, or was told to: then nothing may be written any more."""
    try:
        os.stat(setup.token)
    except FileNotFoundError:
        return True
    except OSError:  # the disk of another machine does not answer for a moment
        pass
    return False


def run(setup, name, arguments, log):
    """Runs a program of this package. Its output is added to a log of its own. Returns Ran. Raises Fault."""
    path = pathlib.Path(setup.folder) / 'log' / log
    path.parent.mkdir(parents=True, exist_ok=True)
    command = [str(pathlib.Path(setup.programs) / name), *map(str, arguments)]
    spent = 0.0
    for _ in range(TRIES):
        if is_over(setup):
            raise Fault(OVER, of_worker=True)
        begin = time.time()
        with open(path, 'a') as file, tempfile.TemporaryFile() as errors:
            file.write(f'$ {" ".join(command)}\n')
            file.flush()
            printed = file.tell()
            try:
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=file, stderr=errors,
                                           preexec_fn=dies_with(os.getpid()))
            except OSError as error:
                raise not_started(command[0], error.strerror) from None
            status, seconds = wait_for(process, setup)
            if status == STOPPED:
                status = -signal.SIGTERM
            errors.seek(0)
            text = errors.read().decode(errors='replace')
            with open(path, errors='replace') as written:
                written.seek(printed)
                output = written.read()
            spent += seconds
            file.seek(0, os.SEEK_END)
            file.write(f'{text}status {status}, {time.time() - begin:.1f} s\n')
        if status >= 0:
            break
    if status == 0:
        warnings = dict.fromkeys(line[len(WARNING):] for line in text.splitlines() if line.startswith(WARNING))
        return Ran(spent, tuple(warnings)[:MOST_WARNINGS], output)
    lines = [line for line in text.strip().splitlines() if line]
    if status in (126, 127):
        raise not_started(command[0], lines[-1] if lines else f'status {status}')
    if -status in OF_WORKER:
        raise ended(name, -status, f' ({path})')
    raise Fault(lines[-1] if lines else f'{name} ended with status {status}; see {path}')


def produce(setup, file, make):
    """Lets `make` write a file under a name of its own, and renames it. Returns what make returns; None if it was there."""
    target = pathlib.Path(setup.folder) / file
    if target.exists():
        return None
    target.parent.mkdir(parents=True, exist_ok=True)
    own = target.with_name(f'.{target.stem}.{uuid.uuid4().hex}{target.suffix}')
    try:
        made = make(own)
        if is_over(setup):
            raise Fault(OVER, of_worker=True)
        try:
            os.replace(own, target)
        except OSError:  # a folder: another worker has written it meanwhile
            if not target.is_dir():
                raise
        return made
    finally:
        if own.is_dir():
            shutil.rmtree(own)
        elif own.exists():
            own.unlink()


def result_of(setup, file, ran, **more):
    """ran: what is known of the program; None if the file was there."""
    return {'file': file, 'bytes': (pathlib.Path(setup.folder) / file).stat().st_size, 'made': ran is not None,
            'core_seconds': ran.core_seconds if ran else 0.0, 'warnings': ran.warnings if ran else (), **more}


@task
def count_clouds(setup, drive):
    """Asks a bag how many clouds it has on its topic."""
    if not drive.bag.path.exists():
        raise unseen(drive.bag.path)  # map_city has seen it
    ran = run(setup, 'map_bag', [drive.bag.path, '--print-topics'], f'{drive.name}-topics.log')
    topics = dict(line.rsplit(' ', 1) for line in ran.printed.splitlines())
    for name in (drive.bag.cloud_topic, '/' + drive.bag.cloud_topic):
        if name in topics:
            return {'file': str(drive.bag.path), 'bytes': 0, 'made': False, 'core_seconds': ran.core_seconds,
                    'clouds': int(topics[name])}
    raise Fault(f'{drive.bag.path} has no clouds at {drive.bag.cloud_topic}; it has clouds at: '
                + (', '.join(topics) or 'no topic'))


@task
def map_piece(setup, piece):
    drive = piece.drive
    path = pathlib.Path(setup.folder) / piece.file
    account = path.parent / pathlib.PurePath(plan.account_of(piece.file)).name
    while True:
        if drive.bag and path.exists() and not account.exists():  # which were written in the other order
            path.unlink()
        try:
            ran = produce(setup, piece.file, lambda own: (map_bag if drive.bag else map_sequence)(setup, piece, own))
        except (Fault, CityError) as fault:
            if not drive.folder.exists():
                raise unseen(drive.folder) from None
            raise fault
        try:
            known = json.loads(account.read_text()) if drive.bag else {}
            known.pop('way', None)
            return result_of(setup, piece.file, ran, columns=plan.columns_of(path), **known)
        except (sqlite3.DatabaseError, ValueError) as error:  # of the piece, or of its account
            if ran is not None:  # it is new, so the disk is to blame
                damaged = account if isinstance(error, ValueError) else path
                raise Fault(f'{damaged} is damaged on {socket.gethostname()} ({error}); remove it', of_worker=True) from None
            with contextlib.suppress(FileNotFoundError):  # another worker may have removed it
                path.unlink()


def of_piece(setup, piece, own):
    """Arguments that both programs take."""
    return ['--first', piece.first, '--scans', piece.scans, '--drive', piece.id, '--threads', 1, *setup.settings,
            '--output', own]


def log_of_piece(piece):
    return f'{piece.drive.name}-{piece.first:06d}.log'


def map_sequence(setup, piece, own):
    drive = piece.drive
    arguments = ['--sequence', drive.folder, '--labels', drive.labels]
    if (drive.folder / 'velodyne').is_dir():
        arguments += ['--poses', drive.poses]
        if drive.poses_in:
            arguments += ['--poses-in', drive.poses_in]
    ran = run(setup, 'map_sequence', arguments + of_piece(setup, piece, own), log_of_piece(piece))
    if not plan.has_same_poses(piece):
        raise Fault(f'{drive.poses} was changed after map_city had read it; run the same command with --resume')
    return ran


def map_bag(setup, piece, own):
    """Also writes the account of the piece."""
    bag = piece.drive.bag
    report, trajectory, written = (own.with_suffix(end) for end in ('.report.json', '.trajectory.txt', '.json'))
    arguments = [bag.path, '--cloud-topic', bag.cloud_topic, '--frame', bag.frame, '--frame-in-file', FRAME, '--set',
                 f'label_field={bag.label_field if bag.labelled else ""}', '--allow-empty', '--report', report,
                 '--trajectory', trajectory]
    try:
        ran = run(setup, 'map_bag', arguments + of_piece(setup, piece, own), log_of_piece(piece))
        clouds = json.loads(report.read_text())['clouds']
        way = [[float(word) for word in line.split()[1:4]] for line in trajectory.read_text().splitlines()]
        with open(written, 'w') as file:
            file.write(json.dumps({'clouds': clouds['read'], 'dropped': clouds.get('dropped', {}), 'way': way}) + '\n')
            file.flush()
            os.fsync(file.fileno())  # the piece counts on it, also after a loss of power
        if is_over(setup):
            raise Fault(OVER, of_worker=True)
        os.replace(written, own.parent / pathlib.PurePath(plan.account_of(piece.file)).name)
        return ran
    finally:
        for file in (report, trajectory, written):
            with contextlib.suppress(FileNotFoundError):
                file.unlink()


@task
def sum_region(setup, region_tiles, each):
    x, y = (region_tiles * index for index in each.region)
    columns = f'{x},{y},{x + region_tiles - 1},{y + region_tiles - 1}'
    inputs = [pathlib.Path(setup.folder) / file for file in each.inputs]
    ran = produce(setup, each.file, lambda own: run(setup, 'merge_maps', [*inputs, '--tiles', columns, '--output', own],
                                                    log_of(each)))
    return result_of(setup, each.file, ran)


@task
def check_region(setup, picture, each):
    """Reads every byte of a region's file, and returns its figures. picture: whether to draw it, too."""
    own = pathlib.Path(setup.folder) / f'.{uuid.uuid4().hex}.json'
    arguments = [pathlib.Path(setup.folder) / each.file, '--json', own]
    drawn = pathlib.Path(setup.folder) / plan.picture_of(each.file)
    if picture and not drawn.exists():
        drawn.parent.mkdir(exist_ok=True)
        arguments += ['--top', drawn]
    try:
        ran = run(setup, 'inspect_map', arguments, log_of(each))
        found = json.loads(own.read_text())
    finally:
        if own.exists():
            own.unlink()
    figures = {name: found[name] for name in ('bounds', 'voxels', 'voxels_by_class', 'blocks', 'tiles', 'resolution')}
    return result_of(setup, each.file, ran, **figures)


def log_of(each):
    return f'region-{each.region[0]}_{each.region[1]}.log'
