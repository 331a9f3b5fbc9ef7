"""Follows the map of a running mapper: rebuilds it from the topics occupancy_updates and occupancy.

    import bki_mapping.ros
    follower = bki_mapping.ros.OccupancyFollower()
    follower.subscribe('occupancy_updates')
    follower.wait(10.0)
    states = follower.query(points)['state']

Needs NumPy, but not the C++ library; only subscribe() needs ROS (rospy). docs/ros.md describes the topics.
"""
import operator
import threading
from typing import Any, Dict, Iterable, Optional, Tuple, Union

import numpy as np

from bki_mapping.occupancy_message import BLOCK, EDGE, VALUES, Content, OccupancyClass, content_of, decode

__all__ = ['BLOCK', 'OccupancyClass', 'OccupancyFollower', 'decode']

_UNKNOWN, _FREE_LABEL = 0, 255
_STATES = {'free': 1, 'occupied': 2, 'occluded': 3}
_FREE_COLOR, _OCCLUDED_COLOR = (200, 225, 240), (60, 60, 70)  # those of Map.voxels
_VOXEL = np.dtype([(axis, '<f8') for axis in 'xyz'] + [(name, 'u1') for name in ('red', 'green', 'blue')] +
                  [('label', '<u2'), ('state', 'u1')] + [(name, '<f4') for name in VALUES])
_SAID = np.dtype([('state', 'u1'), ('label', 'u1')] + [(name, '<f4') for name in VALUES])


class OccupancyFollower:
    """The map of a mapper, rebuilt from its messages.

    A message of occupancy_updates with `whole` replaces the map; in any other one, `sequence` must be one more than in the
    last. If not, updates were missed: the map stays as it was, and `in_sync` is False, until a whole map comes. A message of
    the topic occupancy, which has no number, replaces the map while it is not in sync.

    Threads may share a follower. Hold `lock` to ask several questions of the same map.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._changed = threading.Condition(self.lock)
        self._in_sync, self._missed = False, 0
        self._sequence: Optional[int] = None
        self._stamp, self._frame = 0, ''
        self._resolution: Optional[float] = None
        self._classes: Tuple[OccupancyClass, ...] = ()
        self._store = np.zeros(0, BLOCK)  # blocks, and room for more
        self._rows: Dict[Tuple[int, int, int], int] = {}  # where the block with an index is
        self._finder: Any = None
        self._subscription: Optional[_Subscription] = None

    # The state of the map.

    @property
    def in_sync(self) -> bool:
        """Whether the map holds all updates up to the last message."""
        return self._in_sync

    @property
    def sequence(self) -> Optional[int]:
        """The number of the last update in the map; None if the map is from the topic occupancy, or there is no map."""
        return self._sequence

    @property
    def missed(self) -> int:
        """How many times updates were missed."""
        return self._missed

    @property
    def stamp(self) -> int:
        """Time of the last scan in the map [ns]."""
        return self._stamp

    @property
    def frame(self) -> str:
        """Name of the map frame."""
        return self._frame

    @property
    def resolution(self) -> Optional[float]:
        """Edge of a voxel [m]; None before the first map."""
        return self._resolution

    @property
    def classes(self) -> Tuple[OccupancyClass, ...]:
        """The class table."""
        return self._classes

    # Messages.

    def update(self, message: Any) -> bool:
        """Take a message: a bki_mapping/OccupancyUpdate or OccupancyMap, in order.

        Returns whether the map changed. Raises ValueError if the message is inconsistent; the map is then unchanged.
        """
        content = message if isinstance(message, Content) else content_of(message)
        with self.lock:
            if content.whole:
                if content.sequence is None and self._in_sync:
                    return False  # may be older than the last update
                self._replace(content)
            elif self._in_sync and self._sequence is not None and content.sequence == self._sequence + 1:
                self._change(content)
            else:
                if self._in_sync and content.sequence != self._sequence:
                    self._in_sync = False
                    self._missed += 1
                    self._changed.notify_all()
                return False
            self._sequence, self._stamp = content.sequence, content.stamp
            self._changed.notify_all()
            return True

    def _replace(self, content: Content) -> None:
        rows = {key: row for row, key in enumerate(_keys_of(content.blocks))}
        if len(rows) < len(content.blocks):
            raise ValueError('the message has a block twice')
        self._in_sync = content.sequence is not None
        self._frame, self._resolution, self._classes = content.frame, content.resolution, content.classes
        self._store, self._rows, self._finder = np.array(content.blocks), rows, None

    def _change(self, content: Content) -> None:
        keys = _keys_of(content.blocks)
        count = len(self._rows)
        for key in keys:
            self._rows.setdefault(key, len(self._rows))
        if len(self._rows) > count:
            self._finder = None
        if len(self._rows) > len(self._store):
            store = np.zeros(len(self._rows) + len(self._rows) // 2, BLOCK)
            store[:count] = self._store[:count]
            self._store = store
        self._store[[self._rows[key] for key in keys]] = content.blocks
        for key in map(tuple, content.removed.tolist()):
            self._remove(key)

    def _remove(self, key: Tuple[int, int, int]) -> None:
        row = self._rows.pop(key, None)
        if row is None:
            return
        last = len(self._rows)  # its block takes the free row
        if row != last:
            self._store[row] = self._store[last]
            self._rows[_keys_of(self._store[row:row + 1])[0]] = row
        self._finder = None

    # Topics.

    def subscribe(self, topic: str = 'occupancy_updates', publish_map: Optional[str] = None, patience: float = 1.0) -> None:
        """Follow a topic. Call rospy.init_node before.

        topic: occupancy_updates, or occupancy for whole maps only.
        publish_map: name of the mapper's service, such as 'mapping/publish_map', which is called if updates were missed; all
        subscribers then receive the whole map. None: subscribes again instead, which works only if nothing else in this process
        subscribes to the topic, because ROS would share the connection.
        patience: time until the whole map is requested again [s]. It doubles with each request, because another request delays a
        map that is on its way.

        Raises ValueError for a topic of another type.
        """
        self.unsubscribe()
        self._subscription = _Subscription(self, topic, publish_map, patience)

    def unsubscribe(self) -> None:
        """Stop following the topic; the map stays."""
        if self._subscription:
            self._subscription.close()
        self._subscription = None

    def wait(self, timeout: float, sequence: Optional[int] = None) -> bool:
        """Wait until the map is in sync or, with the topic occupancy, has been received.

        timeout: [s].
        sequence: also wait for the update with this number.

        Returns whether that happened in time.
        """
        def ready():
            comes_whole = self._resolution is not None and self._sequence is None
            return (self._in_sync or comes_whole) and (sequence is None or (self._sequence is not None and self._sequence >= sequence))
        with self.lock:
            return self._changed.wait_for(ready, timeout)

    # Queries.

    @property
    def blocks(self) -> np.ndarray:
        """The indices of all blocks, sorted by z, y, x: (N, 3), int32."""
        with self.lock:
            return self._indices()[self._order()]

    def block(self, index: Iterable[int]) -> Optional[np.void]:
        """A copy of the block with an index, of dtype BLOCK: state, label, probability, occupancy and class_probability are
        (8, 8, 8), by z, y, x. None if the map has no such block."""
        try:
            x, y, z = map(operator.index, index)
        except (TypeError, ValueError):
            raise ValueError('index must be three integers') from None
        with self.lock:
            row = self._rows.get((x, y, z))
            return None if row is None else self._store[row].copy()

    def query(self, points: Any) -> np.ndarray:
        """Look up the voxels that contain points.

        points: map frame [m], (N, 3).

        Returns (N,), structured: state, label, probability, occupancy and class_probability, as in bki_mapping/OccupancyBlock.
        Where the map has no block, state is 0 (unknown), label 255, and all others NaN. Raises ValueError for a point that is not
        finite or masked, or if there is no map yet.
        """
        if np.ma.is_masked(points):
            raise ValueError('points has masked values, which would count like the others; leave their rows out')
        points = np.asarray(points, float)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f'points must be an array of numbers of shape (N, 3), not of shape {points.shape}')
        finite = np.isfinite(points).all(axis=1)
        if not finite.all():
            raise ValueError(f'point {np.argmin(finite)} of {len(points)} has a coordinate that is not finite; remove such points')
        said = np.full(len(points), np.array((_UNKNOWN, _FREE_LABEL, np.nan, np.nan, np.nan), _SAID))
        with self.lock:
            if self._resolution is None:
                raise ValueError('there is no map yet; wait for one')
            voxels = np.floor(points / self._resolution)
            voxels[np.abs(voxels).max(axis=1) > 2**30] = 2**30  # beyond the grid
            voxels = voxels.astype(np.int64)
            rows = self._find(voxels // EDGE)
            known = rows >= 0
            place = (rows[known], *(voxels[known] % EDGE).T[::-1])
            for name in ('state', 'label', *VALUES):
                said[name][known] = self._store[name][place]
        return said

    def voxels(self, states: Union[str, Iterable[str]] = 'occupied') -> np.ndarray:
        """The voxels in the given states ('occupied', 'free', 'occluded'; a list, or joined by commas).

        Returns them structured, like bki_mapping.Map.voxels, with the centre x, y, z [m], the colour red, green, blue, and label,
        state, probability, occupancy and class_probability. Sorted by block. Raises ValueError for an unknown state.
        """
        words = states.split(',') if isinstance(states, str) else list(states)
        for word in words:
            if word not in _STATES:
                raise ValueError(f"voxel state '{word}' is unknown; known states: occupied, free, occluded")
        colors = np.full((256, 3), _OCCLUDED_COLOR, np.uint8)
        with self.lock:
            for each in self._classes:
                colors[each.id] = each.color
            order = self._order()
            rows, *place = np.nonzero(np.isin(self._store['state'][order], [_STATES[word] for word in words]))
            rows = order[rows]
            voxels = np.empty(len(rows), _VOXEL)
            for axis, within in zip('xyz', place[::-1]):
                voxels[axis] = (EDGE * self._store[axis][rows].astype(float) + within + 0.5) * (self._resolution or 0.0)
            for name in ('label', 'state', *VALUES):
                voxels[name] = self._store[name][(rows, *place)]
        for channel, name in enumerate(('red', 'green', 'blue')):
            voxels[name] = np.where(voxels['state'] == _STATES['free'], _FREE_COLOR[channel], colors[voxels['label'], channel])
        return voxels

    def _indices(self) -> np.ndarray:
        return np.stack([self._store[axis][:len(self._rows)] for axis in 'xyz'], axis=1)

    def _order(self) -> np.ndarray:
        return np.lexsort(self._indices().T)

    def _find(self, indices: np.ndarray) -> np.ndarray:
        """The row of each block in the store, or -1."""
        if len(self._rows) == 0:
            return np.full(len(indices), -1)
        if self._finder is None:
            own = self._indices().astype(np.int64)
            axes = [np.unique(own[:, axis]) for axis in range(3)]
            numbers = _number(axes, own)[0]
            order = np.argsort(numbers)
            self._finder = axes, numbers[order], order
        axes, numbers, order = self._finder
        wanted, may_exist = _number(axes, indices)
        at = np.minimum(np.searchsorted(numbers, wanted), len(numbers) - 1)
        return np.where(may_exist & (numbers[at] == wanted), order[at], -1)


class _Subscription:
    """Feeds a follower from a topic, and asks for the whole map when updates were missed."""

    def __init__(self, follower: OccupancyFollower, topic: str, publish_map: Optional[str], patience: float) -> None:
        import rospy  # ROS is needed only here
        from bki_mapping.msg import OccupancyMap, OccupancyUpdate
        kinds = {kind._type: kind for kind in (OccupancyUpdate, OccupancyMap)}
        published = dict(rospy.get_published_topics()).get(rospy.resolve_name(topic))
        expected = OccupancyMap._type if topic.rstrip('/').endswith('occupancy') else OccupancyUpdate._type
        if (published or expected) not in kinds:
            raise ValueError(f"topic '{topic}' is of type {published}; follow occupancy_updates or occupancy of a mapper")
        self._ros, self._follower, self._topic, self._service = rospy, follower, topic, publish_map
        self._kind = _raw(kinds[published or expected])
        self._patience, self._closed = patience, False
        self._subscriber = self._connect()
        if self._kind._type == OccupancyUpdate._type:
            threading.Thread(target=self._recover, daemon=True).start()

    def _connect(self) -> Any:
        return self._ros.Subscriber(self._topic, self._kind, lambda message: self._follower.update(message.content), queue_size=1000)

    def _recover(self) -> None:
        """Requests the whole map as long as it is needed. A thread of its own, because callbacks must not wait."""
        follower, patience = self._follower, self._patience
        while True:
            with follower.lock:  # a new subscriber, and one that has asked, gets the map in a moment
                if follower._changed.wait_for(lambda: self._closed or follower._in_sync, patience):
                    patience = self._patience
                    follower._changed.wait_for(lambda: self._closed or not follower._in_sync)
                if self._closed:
                    return
            try:
                if self._subscriber.get_num_connections() > 0:
                    self._request()
                    patience *= 2.0
            except (AttributeError, self._ros.ROSException):  # unsubscribed, or shut down, meanwhile
                if not (self._closed or self._ros.is_shutdown()):
                    raise

    def _request(self) -> None:
        if self._service is None:
            self._subscriber.unregister()
            self._subscriber = self._connect()
            if self._closed:
                self._subscriber.unregister()
            return
        from std_srvs.srv import Empty
        try:
            self._ros.ServiceProxy(self._service, Empty)()
        except self._ros.ServiceException as fault:
            self._ros.logwarn_throttle(10.0, f'{self._topic}: updates were missed, and the whole map cannot be requested: {fault}')

    def close(self) -> None:
        with self._follower.lock:
            self._closed = True
            self._follower._changed.notify_all()
        self._subscriber.unregister()


def _raw(kind: Any) -> Any:
    """A type that is, for ROS, the given type of message, but keeps only its content."""
    is_update = 'sequence' in kind.__slots__

    class Raw(kind):
        def deserialize(self, data):
            self.content = decode(data, is_update)
            return self
    return Raw


def _keys_of(blocks: np.ndarray) -> list:
    return list(zip(*(blocks[axis].tolist() for axis in 'xyz')))


def _number(axes: list, indices: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """A number for each index, from its positions among the coordinates that occur along each axis; and whether all occur."""
    numbers, occur = np.zeros(len(indices), np.int64), np.ones(len(indices), bool)
    for axis, known in enumerate(axes):
        at = np.minimum(np.searchsorted(known, indices[:, axis]), len(known) - 1)
        occur &= known[at] == indices[:, axis]
        numbers = numbers * len(known) + at
    return numbers, occur
