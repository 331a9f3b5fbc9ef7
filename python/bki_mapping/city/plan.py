"""The pieces and regions of a city, and the files that they are in.

The name of a file follows from everything that its content depends on. So a file that is there is done, whoever made it, and a
change of the city makes just the files that change."""
import hashlib
import json
import os
import pathlib
import sqlite3
from typing import Dict, Iterable, List, NamedTuple, Tuple

from bki_mapping.city.description import City, Drive, scans_of

Region = Tuple[int, int]  # index of a column of tiles, region_tiles wide


class Piece(NamedTuple):
    drive: Drive
    first: int  # number of the first scan
    scans: int
    file: str  # below the folder of the city

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


def written_bag(drive: Drive) -> str:
    """Where a bag is written as a sequence, below the folder of the city."""
    return f'bags/{drive.name}-{digest(str(drive.bag.path), *drive.bag[1:], stamps_of([drive.bag.path]))}'


def pieces_of(city: City, drive: Drive, identity: str = '') -> List[Piece]:
    """identity: what the programs say of themselves, because other versions may make other pieces. Raises CityError if the
    drive has no scans."""
    files = scans_of(drive)
    numbers = list(files)
    shared = [str(drive.poses), *filter(None, [drive.poses_in]), stamps_of([drive.poses, drive.folder / 'calib.txt', drive.folder / 'times.txt'])]
    settings = [city.classes, stamps_of([pathlib.Path(city.classes)]),
                stamps_of([pathlib.Path(city.config)]) if city.config else None, city.settings, identity]
    pieces = []
    for begin in range(0, len(numbers), city.piece_scans):
        some = numbers[begin:begin + city.piece_scans]
        scans = stamps_of(files[number] for number in some)
        labels = stamps_of(drive.folder / drive.labels / f'{files[number].stem}.label' for number in some)
        key = digest(drive.name, str(drive.folder), drive.labels, shared, settings, scans, labels)
        pieces.append(Piece(drive, some[0], len(some), f'pieces/{drive.name}/{some[0]:06d}-{key}.bkm'))
    return pieces


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
