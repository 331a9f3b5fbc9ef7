#!/usr/bin/env python3
"""Poses in UTM coordinates: every topic and answer says where its voxels are as exactly as the map."""
import math
import os
import struct
import sys
import tempfile

import rospy
import rostest
from bki_mapping.msg import OccupancyMap, VoxelCloudUpdate
from bki_mapping.srv import QueryPoints, SaveMap
from geometry_msgs.msg import Point
from nav_msgs.msg import OccupancyGrid, Path
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, MapperTest, publishers_of, random_scan, wait_until  # noqa: E402

EDGE = 0.1
PLACE = (500000.0, 4000000.0, 30.0)
FRAME, ORIGIN = 'map_at_500000_4000000_0', (500000.0, 4000000.0, 0.0)


def as_float(value):
    return struct.unpack('<f', struct.pack('<f', value))[0]


class LargeCoordinates(MapperTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.log = Listener('/rosout', Log)
        wait_until(lambda: cls.log.subscriber.get_num_connections() >= len(publishers_of('/rosout')), 'hearing the log')

    def listen(self, topic, kind):
        listener = Listener(topic, kind)
        self.addCleanup(listener.close)
        return listener

    def drive_far(self, seed=1):
        return self.integrate(*random_scan(seed), position=PLACE)

    def voxel_at(self, place):
        """The index of the voxel with this centre; the place must be that of a centre within a tenth of a voxel."""
        index = tuple(math.floor(p / EDGE) for p in place)
        for axis in range(3):
            self.assertLess(abs(place[axis] - (index[axis] + 0.5) * EDGE), 0.1 * EDGE, place)
        return index

    def voxels(self, stamp, states=(1, 2, 3)):
        """The voxels of the map in some states, from the indices of blocks."""
        blocks = self.listen('occupancy', OccupancyMap).wait_for(lambda m: m.header.stamp == stamp, 'the map').blocks
        found = {(8 * b.x + v % 8, 8 * b.y + v // 8 % 8, 8 * b.z + v // 64)
                 for b in blocks for v, state in enumerate(bytes(b.state)) if state in states}
        self.assertGreater(len(found), 50)
        return found

    def origin_of(self, frame):
        """Where tf says that a frame is."""
        def find():
            return next((t for m in reversed(static.messages) for t in m.transforms if t.child_frame_id == frame), None)
        static = self.listen('/tf_static', TFMessage)
        transform = wait_until(find, f'tf knowing {frame}')
        self.assertEqual((transform.header.frame_id, transform.transform.rotation.w), ('map', 1.0))
        return tuple(getattr(transform.transform.translation, axis) for axis in 'xyz')

    def expect_cloud(self, cloud, voxels):
        self.assertEqual(cloud.header.frame_id, FRAME)
        origin = self.origin_of(FRAME)
        self.assertEqual(origin, ORIGIN)
        self.assertEqual(cloud.width, len(voxels))
        places = [struct.unpack_from('<3f', cloud.data, n * cloud.point_step) for n in range(cloud.width)]
        self.assertEqual({self.voxel_at([p + o for p, o in zip(place, origin)]) for place in places}, voxels)

    def test_clouds_are_in_a_frame_near_them(self):
        stamp = self.drive_far()
        cloud = self.listen('voxel_cloud', PointCloud2).wait_for(lambda m: m.header.stamp == stamp, 'the cloud')
        voxels = self.voxels(stamp)
        self.expect_cloud(cloud, voxels)
        self.log.wait_for(lambda m: f"clouds of them are sent in '{FRAME}'" in m.msg, 'saying so, also without a scan')
        updates = self.listen('voxel_cloud_updates', VoxelCloudUpdate)
        whole = updates.wait_for(lambda m: m.whole and m.header.stamp == stamp, 'the whole cloud')
        self.assertEqual(whole.header.frame_id, 'map')
        self.expect_cloud(whole.cloud, voxels)

    def test_clouds_near_the_origin_are_in_the_map_frame(self):
        clouds = self.listen('voxel_cloud', PointCloud2)
        for position, frame in (((0.0, 0.0, 0.0), 'map'), (PLACE, FRAME), ((0.0, 0.0, 0.0), 'map')):
            self.call('reset')
            stamp = self.integrate(*random_scan(2), position=position)
            cloud = clouds.wait_for(lambda m, s=stamp: m.header.stamp == s and m.width, 'the cloud')
            self.assertEqual(cloud.header.frame_id, frame)

    def test_markers_have_their_place_in_their_pose(self):
        stamp = self.drive_far()
        arrays = self.listen('occupied_cells_vis_array', MarkerArray)
        array = arrays.wait_for(lambda m: any(k.header.stamp == stamp and k.points for k in m.markers), 'markers')
        found = set()
        for marker in (m for m in array.markers if m.action == Marker.ADD):
            self.assertEqual(marker.header.frame_id, 'map')
            pose = [getattr(marker.pose.position, axis) for axis in 'xyz']
            self.assertEqual(pose, [as_float(p) for p in pose], 'rviz keeps it as floats')
            for point in marker.points:
                found.add(self.voxel_at([as_float(getattr(point, axis)) + p for axis, p in zip('xyz', pose)]))
        self.assertEqual(found, self.voxels(stamp, states=(2,)))

    def test_other_topics_and_answers_are_doubles(self):
        stamp = self.drive_far()
        path = self.listen('trajectory', Path).wait_for(lambda m: m.header.stamp == stamp, 'the trajectory')
        position = path.poses[-1].pose.position
        self.assertEqual((position.x, position.y, position.z), PLACE)
        grid = self.listen('projected_map', OccupancyGrid).wait_for(lambda m: m.header.stamp == stamp, 'the grid')
        for place, near in ((grid.info.origin.position.x, PLACE[0]), (grid.info.origin.position.y, PLACE[1])):
            self.assertLess(abs(place - near), 100.0)
            self.assertLess(abs(place / (8 * EDGE) - round(place / (8 * EDGE))), 1e-3, 'a corner of a block')
        occupied = sorted(self.voxels(stamp, states=(2,)))
        query = rospy.ServiceProxy('mapping/query_points', QueryPoints)
        answer = query(points=[Point(*((i + 0.5) * EDGE for i in voxel)) for voxel in occupied])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(set(bytes(answer.state)), {2})

    def test_saved_files_are_exact(self):
        stamp = self.drive_far()
        occupied = self.voxels(stamp, states=(2,))
        save = rospy.ServiceProxy('mapping/save_map', SaveMap)
        with tempfile.TemporaryDirectory() as folder:
            for name in ('map.ply', 'map.pcd'):
                self.assertTrue(save(os.path.join(folder, name), 'occupied').success)
            with open(os.path.join(folder, 'map.ply'), 'rb') as file:
                header, body = file.read().split(b'end_header\n', 1)
            with open(os.path.join(folder, 'map.pcd'), 'rb') as file:
                pcd = file.read().split(b'DATA binary\n', 1)
        self.assertIn(b'property double x', header)
        self.assertEqual({self.voxel_at(r[:3]) for r in struct.iter_unpack('<3d3BHB6f', body)}, occupied)
        viewpoint = next(line for line in pcd[0].decode().splitlines() if line.startswith('VIEWPOINT')).split()[1:]
        origin = [float(word) for word in viewpoint[:3]]
        self.assertEqual((tuple(origin), viewpoint[3:]), (ORIGIN, ['1', '0', '0', '0']))
        places = [r[:3] for r in struct.iter_unpack('<3fIHB6f', pcd[1])]
        self.assertEqual({self.voxel_at([p + o for p, o in zip(place, origin)]) for place in places}, occupied)

    def test_the_remedy_is_said_once(self):
        words = 'rosrun tf2_ros static_transform_publisher 500000 4000000 0 0 0 0 map local_map'
        self.drive_far()
        said = self.log.wait_for(lambda m: words in m.msg, 'the remedy')
        self.assertEqual(said.level, Log.WARN)
        self.assertIn('floats are 0.25 m apart', said.msg)
        self.assertIn('frame_id', said.msg)
        self.drive_far(3)
        self.integrate(*random_scan(4), position=(PLACE[0] + 20.0, *PLACE[1:]))
        self.assertEqual(sum('static_transform_publisher' in m.msg for m in self.log.messages), 1)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'large_coordinates', LargeCoordinates)
