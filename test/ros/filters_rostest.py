#!/usr/bin/env python3
"""The nodelets and programs of pcl_ros as the documents show them: the snippets work as they are."""
import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
from bki_mapping.srv import SaveMap
from sensor_msgs.msg import PointCloud2

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, TIMEOUT, Listener, Mapping, make_cloud, wait_until  # noqa: E402


def snippets(document, language):
    with open(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'docs', document)) as file:
        return re.findall(rf'```{language}\n(.*?)```', file.read(), re.DOTALL)


class Filters(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('filters_rostest')

    def start(self, filter_name):
        found = [text for text in snippets('ros.md', 'xml') if filter_name in text]
        self.assertEqual(len(found), 1, filter_name)
        file = tempfile.NamedTemporaryFile('w', suffix='.launch')
        self.addCleanup(file.close)
        file.write(found[0])
        file.flush()
        return Mapping(launch=(file.name,))

    def test_pass_through(self):
        heights = [-4.0, -2.9, 0.0, 4.9, 5.1]
        with self.start('pcl/PassThrough') as mapping:
            status = mapping.scan([(5.0 + i, 3.0, z) for i, z in enumerate(heights)], [CAR, ROAD, CAR, ROAD, CAR])
        self.assertTrue(status.integrated_last, status)
        self.assertEqual((status.points_received, status.points_used), (3, 3))

    def test_voxel_grid(self):
        with self.start('pcl/VoxelGrid') as mapping:
            status = mapping.scan([(5.01, 3.01, -1.99), (5.02, 3.02, -1.98), (8.01, 3.01, 4.01)])
        self.assertTrue(status.integrated_last, status)
        self.assertEqual((status.points_received, status.points_used), (2, 2))

    def test_voxel_grid_averages_labels(self):
        """Tests a statement of the documents; if it fails, they must be changed."""
        grid = subprocess.Popen(['rosrun', 'nodelet', 'nodelet', 'standalone', 'pcl/VoxelGrid', '__name:=grid',
                                 '_leaf_size:=0.5', '_filter_field_name:='])
        output = Listener('/grid/output', PointCloud2)
        clouds = rospy.Publisher('/grid/input', PointCloud2, queue_size=1)
        try:
            wait_until(lambda: clouds.get_num_connections() > 0, 'the filter subscribing')
            clouds.publish(make_cloud([(2.1, 2.1, 2.1), (2.2, 2.1, 2.1), (2.3, 2.1, 2.1)], [10, 40, 40], rospy.Time(1)))
            cloud = output.wait_for(lambda m: True, 'the filtered cloud')
        finally:
            grid.terminate()
            grid.wait(30)
            output.close()
            clouds.unregister()
        self.assertEqual((cloud.width, int.from_bytes(cloud.data[:4], 'little')), (1, 30))

    def test_body_box_command(self):
        commands = [line for text in snippets('ros.md', 'sh') for line in text.splitlines() if 'body_box:=' in line]
        self.assertEqual(len(commands), 1)
        arguments = shlex.split(commands[0])
        self.assertEqual(arguments[:3], ['roslaunch', 'bki_mapping', 'mapping.launch'])
        nodes = subprocess.run([arguments[0], '--nodes', *arguments[1:]], capture_output=True, text=True,
                               timeout=TIMEOUT, check=True).stdout.split()
        self.assertEqual(sorted(nodes), ['/mapping', '/mapping_body_box', '/mapping_manager'])

    def test_a_saved_map_is_published(self):
        commands = [line for text in snippets('files.md', 'sh') for line in text.splitlines()
                    if 'pcd_to_pointcloud' in line]
        self.assertEqual(len(commands), 1)
        with tempfile.TemporaryDirectory() as folder:
            with Mapping() as mapping:
                mapping.scan()
                saved = rospy.ServiceProxy('/mapping/save_map', SaveMap)(os.path.join(folder, 'map.pcd'), 'occupied')
                self.assertTrue(saved.success, saved.message)
            with open(os.path.join(folder, 'map.pcd'), 'rb') as file:
                points = int(re.search(rb'\nPOINTS (\d+)\n', file.read()).group(1))
            clouds = Listener('/cloud_pcd', PointCloud2)
            server = subprocess.Popen(shlex.split(commands[0]), cwd=folder)
            try:
                cloud = clouds.wait_for(lambda m: True, 'the saved map')
            finally:
                server.terminate()
                server.wait(30)
                clouds.close()
        self.assertGreater(points, 10)
        self.assertEqual((cloud.header.frame_id, cloud.width * cloud.height), ('map', points))
        self.assertLessEqual({'x', 'y', 'z', 'rgb', 'label', 'state'}, {field.name for field in cloud.fields})


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'filters', Filters)
