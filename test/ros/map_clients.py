"""Clients that rebuild the map only from topics, as users do."""
import struct

from bki_mapping.msg import OccupancyUpdate, VoxelCloudUpdate
from harness import Listener, voxels_of
from visualization_msgs.msg import Marker, MarkerArray


class MapClient:
    """Rebuilds the map from occupancy_updates."""

    def __init__(self):
        self.blocks, self.sequence, self.gaps, self.wholes, self.stamp = None, None, 0, 0, None
        self.listener = Listener('occupancy_updates', OccupancyUpdate)
        self.read = 0

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            if message.whole:
                self.wholes += 1
                self.blocks = {}
            elif self.blocks is None:
                continue  # an update that was sent before the whole map
            elif message.sequence != self.sequence + 1:
                self.gaps += 1
            self.sequence, self.stamp = message.sequence, message.header.stamp
            self.blocks.update(voxels_of(message.blocks))
            for gone in message.removed:
                self.blocks.pop((gone.x, gone.y, gone.z), None)


class CloudClient:
    """Rebuilds the map from voxel_cloud_updates: points by block."""

    def __init__(self):
        self.points, self.read, self.stamp = None, 0, None
        self.listener = Listener('voxel_cloud_updates', VoxelCloudUpdate)

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            edge = 8 * message.resolution
            if message.whole:
                self.points = {}
            elif self.points is None:
                continue
            for block in message.blocks:
                self.points.pop((block.x, block.y, block.z), None)
            offset = {f.name: f.offset for f in message.cloud.fields}
            for i in range(message.cloud.width):
                at = i * message.cloud.point_step
                xyz = struct.unpack_from('<3f', message.cloud.data, at)
                state, = struct.unpack_from('<B', message.cloud.data, at + offset['state'])
                self.points.setdefault(tuple(int(c // edge) for c in xyz), {})[xyz] = state
            self.stamp = message.header.stamp


class MarkerClient:
    """The markers that rviz would show."""

    def __init__(self):
        self.shown, self.read, self.kept = {}, 0, 0
        self.listener = Listener('occupied_cells_vis_array', MarkerArray)

    def update(self):
        while self.read < len(self.listener.messages):
            message = self.listener.messages[self.read]
            self.read += 1
            for marker in message.markers:
                if marker.action == Marker.DELETEALL:
                    self.shown = {}
                elif marker.action == Marker.DELETE:
                    self.shown.pop((marker.ns, marker.id), None)
                else:
                    self.shown[(marker.ns, marker.id)] = [(p.x, p.y, p.z) for p in marker.points]

    def cubes(self):
        return sorted((key[0], point) for key, points in self.shown.items() for point in points)
