"""The pieces and regions of a city, and the files that they are in.

The name of a file follows from everything that its content depends on. So a file that is there is done, whoever made it, and a
change of the city makes just the files that change."""
import hashlib
import json
import os
import pathlib
import sqlite3
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple

from bki_mapping.city.description import City, Drive, scans_of

Region = Tuple[int, int]  # index of a column of tiles, region_tiles wide


class Piece(NamedTuple):
    drive: Drive
    first: int  # number of the first scan
    scans: int
    file: str  # below the folder of the city
    poses: str  # digest of what its key has of the file of poses; '' of a bag

    @property
    def id(self) -> str:
        """The id of the piece in map files, in which drives are told apart."""
        return f'{self.drive.name}#{self.first:06d}+{self.scans}'


class Sum(NamedTuple):
    region: Region
    inputs: Tuple[str, ...]  # sorted
    file: str


def digest(*parts) -> str:
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


def stamps_of(paths: Iterable[pathlib.Path]) -> List:
    """Sizes and times of files: other ones make another piece. The programs say what is wrong with a file that cannot be
    seen."""
    stamps = []
    for path in paths:
        try:
            found = os.stat(path)
        except OSError:
            stamps.append([path.name, None, None])
        else:
            stamps.append([path.name, found.st_size, found.st_mtime_ns])
    return stamps


def matrices_in(path: pathlib.Path) -> Optional[List[str]]:
    """The lines of a file of poses, of which each belongs to one scan; None if it has stamps, or cannot be read."""
    try:
        lines = [line for line in path.read_text().splitlines() if not line.startswith('#')]
    except (OSError, UnicodeDecodeError):
        return None
    return lines if all(len(line.split()) in (0, 12, 16) for line in lines) else None


def poses_in_key(drive: Drive, rows: Optional[List[str]], numbers: Iterable[int]) -> List:
    """What the key of a piece has of the file of poses. rows: matrices_in the file. numbers: of the scans."""
    if rows is None:
        return [str(drive.poses), stamps_of([drive.poses])]
    return [rows[n] if n < len(rows) else '' for n in numbers]


def has_same_poses(piece: Piece) -> bool:
    """Whether the file of poses is, for the scans of a piece of a sequence, still as its key says."""
    numbers = [number for number in scans_of(piece.drive) if number >= piece.first][:piece.scans]
    return digest(poses_in_key(piece.drive, matrices_in(piece.drive.poses), numbers)) == piece.poses


def pieces_of(city: City, drive: Drive, identity: str = '') -> List[Piece]:
    """identity: what the programs say of themselves, because other versions may make other pieces. Raises CityError if the
    drive has no scans."""
    settings = [city.classes, stamps_of([pathlib.Path(city.classes)]),
                stamps_of([pathlib.Path(city.config)]) if city.config else None, city.settings, identity]
    if drive.bag:
        source = [str(drive.bag.path), drive.bag[1:], stamps_of([drive.bag.path])]
        counts = {first: min(city.piece_scans, drive.clouds - first) for first in range(0, drive.clouds, city.piece_scans)}
        return [piece_of(drive, first, count, '', source, settings, count) for first, count in counts.items()]
    files = scans_of(drive)
    numbers = list(files)
    shared = [*filter(None, [drive.poses_in]), stamps_of([drive.folder / 'calib.txt', drive.folder / 'times.txt'])]
    rows = matrices_in(drive.poses)
    pieces = []
    for begin in range(0, len(numbers), city.piece_scans):
        some = numbers[begin:begin + city.piece_scans]
        scans = stamps_of(files[number] for number in some)
        poses = poses_in_key(drive, rows, some)
        labels = stamps_of(drive.folder / drive.labels / f'{files[number].stem}.label' for number in some)
        pieces.append(piece_of(drive, some[0], len(some), digest(poses), str(drive.folder), drive.labels, shared, settings, scans,
                               labels, poses))
    return pieces


def piece_of(drive: Drive, first, scans, poses, *parts) -> Piece:
    """parts: what the content depends on, beside the drive's name."""
    return Piece(drive, first, scans, f'pieces/{drive.name}/{first:06d}-{digest(drive.name, *parts)}.bkm', poses)


def account_of(piece_file: str) -> str:
    """The file that says what became of the clouds of a bag's piece, and where the sensor was."""
    return f'{piece_file[:-len(".bkm")]}.json'


def columns_of(path) -> List[Tuple[int, int]]:
    """The columns x, y of the tiles in a map file."""
    database = sqlite3.connect(pathlib.Path(path).absolute().as_uri() + '?mode=ro', uri=True)
    try:
        return sorted(set(database.execute('SELECT DISTINCT x, y FROM tile WHERE part = 0')))
    finally:
        database.close()


def picture_of(region_file: str) -> str:
    return f'pictures/{pathlib.PurePath(region_file).stem}.png'


def regions_of(columns: Iterable[Tuple[int, int]], edge: int) -> List[Region]:
    return sorted({(x // edge, y // edge) for x, y in columns})


def sums_of(inputs_by_region: Dict[Region, List[str]], edge: int, most: int = 16) -> List[List[Sum]]:
    """The sums of each region as a tree: level by level, of at most `most` files each. The last sum of a region is in
    `regions`, and the others in `sums`. edge: of the regions, without which an index is no place [tiles]."""
    levels: List[List[Sum]] = []
    waiting = {region: sorted(inputs) for region, inputs in inputs_by_region.items()}
    while waiting:
        level, above = [], {}
        for region, inputs in sorted(waiting.items()):
            last = len(inputs) <= most
            made = []
            for begin in range(0, len(inputs), most):
                some = tuple(inputs[begin:begin + most])
                name = f'{region[0]}_{region[1]}-{digest(edge, region, some)}.bkm'
                made.append(Sum(region, some, ('regions/' if last else 'sums/') + name))
            level += made
            if not last:
                above[region] = sorted(each.file for each in made)
        levels.append(level)
        waiting = above
    return levels
