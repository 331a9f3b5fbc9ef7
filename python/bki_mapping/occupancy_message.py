"""Reads the messages of the topics occupancy_updates and occupancy into NumPy arrays. Needs neither ROS nor the C++ library."""
import collections
import struct
from typing import Any, NamedTuple, Tuple

import numpy as np

__all__ = ['BLOCK', 'OccupancyClass', 'decode']

EDGE = 8  #: of a block [voxels]
VALUES = ('probability', 'occupancy', 'class_probability')

#: A bki_mapping/OccupancyBlock as it lies in messages; voxels by z, y, x.
BLOCK = np.dtype([(axis, '<i4') for axis in 'xyz'] + [(name, 'u1', (EDGE,) * 3) for name in ('state', 'label')] +
                 [(name, '<f4', (EDGE,) * 3) for name in VALUES])


class OccupancyClass(NamedTuple):
    """A class of the mapper's class table."""
    id: int
    name: str
    color: Tuple[int, int, int]
    dynamic: bool


#: What a message says. sequence: None for the topic occupancy. blocks: of dtype BLOCK. removed: indices of blocks, (N, 3).
Content = collections.namedtuple('Content', 'stamp frame sequence whole resolution block_edge classes blocks removed')


def _checked(content: Content) -> Content:
    if content.block_edge != EDGE:
        raise ValueError(f'the message has blocks of {content.block_edge} voxels along an edge, not of {EDGE}; use the package of '
                         'the mapper')
    if not content.resolution > 0:
        raise ValueError('the message has a resolution that is not above 0')
    # The parameter as the user wrote it, which the message rounds to single precision.
    return content._replace(resolution=float(str(np.float32(content.resolution))))


def content_of(message: Any) -> Content:
    """Of a message as ROS makes it, or of anything with the same fields."""
    blocks = np.zeros(len(message.blocks), BLOCK)
    for to, block in zip(blocks, message.blocks):
        to['x'], to['y'], to['z'] = block.x, block.y, block.z
        for name in ('state', 'label', *VALUES):
            values = getattr(block, name)
            values = np.frombuffer(values, np.uint8) if isinstance(values, (bytes, bytearray)) else np.asarray(values)
            if values.size != EDGE**3:
                raise ValueError(f'the message has {values.size} values of {name} for the {EDGE**3} voxels of a block')
            to[name] = values.reshape(to[name].shape)
    is_update = hasattr(message, 'sequence')
    removed = [(block.x, block.y, block.z) for block in message.removed] if is_update else []
    header = message.header
    return _checked(Content(
        header.stamp.secs * 10**9 + header.stamp.nsecs, header.frame_id, message.sequence if is_update else None,
        bool(message.whole) if is_update else True, message.resolution, message.block_edge,
        tuple(OccupancyClass(c.id, c.name, (c.red, c.green, c.blue), bool(c.dynamic)) for c in message.classes),
        blocks, np.array(removed, np.int32).reshape(-1, 3)))


class _Reader:
    """Reads the values of a serialised message one after the other."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def next(self, layout: str) -> tuple:
        values = struct.unpack_from('<' + layout, self._data, self._at)
        self._at += struct.calcsize('<' + layout)
        return values

    def text(self) -> str:
        length, = self.next('I')
        return self.next(f'{length}s')[0].decode(errors='replace')

    def array(self, kind: np.dtype) -> np.ndarray:
        count, = self.next('I')
        values = np.frombuffer(self._data, kind, count, self._at)
        self._at += values.nbytes
        return values


def decode(data: bytes, is_update: bool = True) -> Content:
    """Read a serialised bki_mapping/OccupancyUpdate or, with is_update=False, OccupancyMap. This is many times as fast as ROS's own
    Python code, which makes an object of each number. OccupancyFollower.update takes the result.

    Raises ValueError if the message is cut off or inconsistent.
    """
    read = _Reader(data)
    try:
        _, seconds, nanoseconds = read.next('III')
        frame = read.text()
        sequence, whole = read.next('QB') if is_update else (None, True)
        resolution, block_edge = read.next('fI')
        classes = []
        for _ in range(read.next('I')[0]):
            id_, = read.next('B')
            name = read.text()
            red, green, blue, dynamic = read.next('4B')
            classes.append(OccupancyClass(id_, name, (red, green, blue), bool(dynamic)))
        blocks = read.array(BLOCK)
        removed = read.array(np.dtype(('<i4', 3))) if is_update else np.zeros((0, 3), np.int32)
    except (struct.error, ValueError):
        raise ValueError('the message is cut off, or of another type') from None
    return _checked(Content(seconds * 10**9 + nanoseconds, frame, sequence, bool(whole), resolution, block_edge, tuple(classes),
                             blocks, removed.reshape(-1, 3)))
