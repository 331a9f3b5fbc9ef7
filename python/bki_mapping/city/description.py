"""What a city is made of: a YAML file with drives and settings."""
import os
import pathlib
from typing import Dict, NamedTuple, Optional, Tuple

import yaml


class CityError(Exception):
    """One sentence for the user, with the thing and the remedy."""


class Bag(NamedTuple):
    path: pathlib.Path
    cloud_topic: str
    frame: str  # of the city, in tf
    label_field: str
    labelled: bool


class Drive(NamedTuple):
    name: str
    folder: pathlib.Path  # of the sequence; of a bag, its path
    labels: str
    poses: pathlib.Path  # in the frame of the city
    bag: Optional[Bag] = None
    poses_in: str = ''  # the sensor that the poses are of, one of SENSORS; '': as map_sequence finds it
    clouds: int = 0  # of a bag, how many it has on its topic, once it has been asked


class City(NamedTuple):
    drives: Tuple[Drive, ...]  # sorted by name
    classes: str
    config: str  # '', the name of a preset, or the path of a YAML file of parameters
    settings: Tuple[str, ...]  # NAME=VALUE, sorted
    piece_scans: int  # scans that one task maps
    region_tiles: int  # edge of a region [tiles of 64 voxels]


KEYS = {'drives', 'classes', 'config', 'set', 'piece_scans', 'region_tiles'}
SEQUENCE_KEYS = {'sequence', 'name', 'labels', 'poses', 'poses_in'}
SENSORS = ('camera', 'lidar')
BAG_KEYS = {'bag', 'name', 'cloud_topic', 'frame', 'label_field', 'labelled'}


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
    if 'threads' in settings:
        raise CityError(f'set in {path} has threads, but each task uses one core; leave it out, and use more workers')
    config = text_of(text, 'config', '', path) if 'config' in text else ''
    classes = text_of(text, 'classes', 'semantic_kitti', path)
    return City(tuple(drives[name] for name in sorted(drives)), named_file(path.parent, classes),
                named_file(path.parent, config) if config else '',
                tuple(sorted(f'{key}={scalar(value)}' for key, value in settings.items())),
                count_of(text, 'piece_scans', 200, path), count_of(text, 'region_tiles', 16, path))


def named_file(folder, text):
    """The absolute path of a file in a folder; or, where there is none, the text: a name that the programs know or refuse."""
    path = (folder / text).absolute()
    return str(path) if path.is_file() or path.suffix or '/' in text else text


def read_drive(entry, path) -> Drive:
    is_bag = isinstance(entry, dict) and 'bag' in entry
    known(entry, BAG_KEYS if is_bag else SEQUENCE_KEYS, path)
    source = entry.get('bag' if is_bag else 'sequence')
    if not isinstance(source, str) or not source:
        raise CityError(f'a drive in {path} has no sequence: FOLDER, and no bag: FILE')
    source = pathlib.Path(os.path.normpath((path.parent / source).absolute()))
    name = text_of(entry, 'name', source.stem if is_bag else source.name, path)
    if name.startswith('.') or any(c in name for c in '/\0#'):
        raise CityError(f"'{name}' in {path} is no name for a drive, whose files are named after it; leave out / and #, and "
                        'begin with another character than a dot')
    if not is_bag:
        poses = path.parent / text_of(entry, 'poses', '-', path) if 'poses' in entry else source / 'poses.txt'
        poses_in = entry.get('poses_in', '')
        if poses_in and poses_in not in SENSORS:
            raise CityError(f"poses_in in {path} is {poses_in!r}; give {' or '.join(SENSORS)}")
        return Drive(name, source, text_of(entry, 'labels', 'labels', path), poses.absolute(), poses_in=poses_in)
    if 'cloud_topic' not in entry:
        raise CityError(f'{source} in {path} has no cloud_topic; give that of its labelled clouds')
    labelled = entry.get('labelled', True)
    if not isinstance(labelled, bool):
        raise CityError(f'labelled in {path} is {labelled!r}; give true or false')
    bag = Bag(source, text_of(entry, 'cloud_topic', '', path), text_of(entry, 'frame', 'map', path),
              text_of(entry, 'label_field', 'label', path), labelled)
    return Drive(name, source, 'labels', source, bag)


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
            files = [each for each in (drive.folder / folder).iterdir()
                     if each.suffix == suffix and each.stem.isascii() and each.stem.isdigit()]
        except OSError:
            continue
        if files:
            return dict(sorted((int(each.stem), each) for each in files))
    raise CityError(f'{drive.folder} holds no scans; it needs velodyne/*.bin, or pcd/*.pcd')
