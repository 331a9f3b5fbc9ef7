"""What a city is made of: a YAML file with drives and settings."""
import pathlib
from typing import Dict, List, NamedTuple, Tuple

import yaml


class CityError(Exception):
    """One sentence for the user, with the thing and the remedy."""


class Drive(NamedTuple):
    name: str
    folder: pathlib.Path
    labels: str


class City(NamedTuple):
    drives: Tuple[Drive, ...]  # sorted by name
    classes: str
    config: str  # '' or the path of a YAML file of parameters
    settings: Tuple[str, ...]  # NAME=VALUE, sorted
    piece_scans: int  # scans that one task maps
    region_tiles: int  # edge of a region [tiles of 64 voxels]


KEYS = {'drives', 'classes', 'config', 'set', 'piece_scans', 'region_tiles'}
DRIVE_KEYS = {'sequence', 'name', 'labels'}


def read_city(path, add=(), without=()) -> City:
    """Reads a description. Relative paths are relative to its folder.

    add: folders of more sequences. without: names of drives to leave out. Raises CityError."""
    path = pathlib.Path(path)
    try:
        text = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise CityError(f'{path} cannot be read: {" ".join(str(error).split())}') from None
    known(text, KEYS, path)
    entries = text.get('drives')
    if not isinstance(entries, list) or not entries:
        raise CityError(f'{path} lists no drives; give drives: [{{sequence: FOLDER}}, ...]')
    drives: Dict[str, Drive] = {}
    for entry in entries + [{'sequence': str(pathlib.Path(folder).absolute())} for folder in add]:
        drive = read_drive(entry, path)
        if drives.setdefault(drive.name, drive) != drive:
            raise CityError(f"{path} gives two drives the name '{drive.name}'; give one of them another name")
    for name in without:
        if name not in drives:
            raise CityError(f"{path} has no drive '{name}' to leave out; it has {', '.join(sorted(drives))}")
        del drives[name]
    if not drives:
        raise CityError(f'no drive of {path} is left')
    settings = text.get('set', {})
    if not isinstance(settings, dict):
        raise CityError(f'set in {path} is no mapping of parameters to values')
    config = text_of(text, 'config', '', path) if 'config' in text else ''
    classes = text_of(text, 'classes', 'semantic_kitti', path)
    if (path.parent / classes).is_file():
        classes = str((path.parent / classes).absolute())
    return City(tuple(drives[name] for name in sorted(drives)), classes,
                str((path.parent / config).absolute()) if config else '',
                tuple(sorted(f'{key}={scalar(value)}' for key, value in settings.items())),
                count_of(text, 'piece_scans', 200, path), count_of(text, 'region_tiles', 16, path))


def read_drive(entry, path) -> Drive:
    known(entry, DRIVE_KEYS, path)
    if not isinstance(entry.get('sequence'), str):
        raise CityError(f'a drive in {path} has no sequence: FOLDER')
    folder = (path.parent / entry['sequence']).absolute()
    name = text_of(entry, 'name', folder.name, path)
    if not name or name in ('.', '..') or any(c in name for c in '/\0#'):
        raise CityError(f"'{name}' in {path} is no name for a drive, whose files are named after it; leave out / and #")
    return Drive(name, folder, text_of(entry, 'labels', 'labels', path))


def known(mapping, keys, path):
    if not isinstance(mapping, dict):
        raise CityError(f'{path} has {mapping!r} in place of a mapping of {", ".join(sorted(keys))}')
    for key in mapping:
        if key not in keys:
            raise CityError(f"'{key}' in {path} is unknown; known keys: {', '.join(sorted(keys))}")


def text_of(mapping, key, default, path) -> str:
    value = mapping.get(key, default)
    if not isinstance(value, str) or not value:
        raise CityError(f'{key} in {path} is {value!r}; give a text')
    return value


def count_of(mapping, key, default, path) -> int:
    value = mapping.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 1000000:
        raise CityError(f'{key} in {path} is {value!r}; give a whole number from 1 to 1000000')
    return value


def scalar(value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def scans_of(drive: Drive) -> Dict[int, pathlib.Path]:
    """The files of a sequence's scans by their numbers, sorted. Raises CityError."""
    for folder, suffix in (('velodyne', '.bin'), ('pcd', '.pcd')):
        try:
            files = [each for each in (drive.folder / folder).iterdir() if each.suffix == suffix and each.stem.isdigit()]
        except OSError:
            continue
        if files:
            return dict(sorted((int(each.stem), each) for each in files))
    raise CityError(f'{drive.folder} holds no scans; it needs velodyne/*.bin, or pcd/*.pcd')
