#!/usr/bin/env python3
"""A node that starts in a city loads what is near the sensor as it moves, never changes the city, and maps on without it."""
import os
import pathlib
import shutil
import sqlite3
import struct
import sys
import tempfile
import unittest

import rospy
import rostest
from bki_mapping.srv import QueryPoints, SaveMap
from geometry_msgs.msg import Point

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.join(FOLDER, '../city')]
import small_city  # noqa: E402
from harness import ROAD, program, wait_until  # noqa: E402
from map_file_rostest import Mapper  # noqa: E402

HIGH = [(0.1, 0.1, 30.0)]  # a hit in a tile above the city
SETTINGS = {'free_space/mode': 'none', 'resolution': 0.3, 'map_load_radius': 15.0}


def tiles_of(path):
    database = sqlite3.connect(str(path))
    try:
        return {(z, y, x): content for z, y, x, content in database.execute('SELECT z, y, x, content FROM tile WHERE part = 0')}
    finally:
        database.close()


class City(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('city_rostest')
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        programs = os.path.dirname(program('map_sequence'))
        small_city.make(programs, cls.folder)
        small_city.program(programs, 'export_map', cls.folder / 'whole.bkm', '--output', cls.folder / 'whole.ply')
        body = (cls.folder / 'whole.ply').read_bytes().split(b'end_header\n', 1)[1]
        cls.occupied = [record[:3] for record in struct.iter_unpack('<fff30x', body)]
        cls.city = cls.folder / 'city'
        cls.before = cls.bytes_of_city()

    @classmethod
    def bytes_of_city(cls):
        return {str(path): path.read_bytes() for path in cls.city.rglob('*') if path.is_file()}

    def near(self, x, y, distance):
        found = [point for point in self.occupied if max(abs(point[0] - x), abs(point[1] - y)) < distance]
        self.assertGreater(len(found), 50)
        return found[::7]

    def known(self, mapper, points):
        """How many of these occupied voxels the node knows to be occupied."""
        answer = mapper.call('query_points', QueryPoints, [Point(*map(float, point)) for point in points])
        self.assertTrue(answer.success, answer.message)
        return sum(state == 2 for state in answer.state)

    def test_1_what_is_near_is_loaded_as_the_sensor_moves(self):
        mapper = Mapper(self, 'visitor', map_file=f'{self.city}/', **SETTINGS)
        here, there = self.near(0.0, 0.0, 12.0), self.near(60.0, -20.0, 12.0)
        mapper.robot.connect()
        stamp = mapper.robot.scan(HIGH, [ROAD])
        mapper.status.wait_for(lambda m: m.header.stamp == stamp and m.integrated_last, 'mapping the cloud')
        wait_until(lambda: self.known(mapper, here) == len(here), 'loading what is near')
        self.assertEqual(self.known(mapper, there), 0)
        stamp = mapper.robot.scan(HIGH, [ROAD], position=(60.0, -20.0, 0.0))
        mapper.status.wait_for(lambda m: m.header.stamp == stamp and m.integrated_last, 'mapping the cloud')
        wait_until(lambda: self.known(mapper, there) == len(there), 'loading what is near')
        for name in ('own.bkm', 'own.ply', 'regions/0_0-key.bkm', 'regions/new.bkm'):
            answer = mapper.call('save_map', SaveMap, str(self.city / name), '')
            self.assertFalse(answer.success)
            self.assertIn('which only map_city may change; save the map elsewhere', answer.message)
        saved = self.folder / 'saved.bkm'
        answer = mapper.call('save_map', SaveMap, str(saved), '')
        self.assertTrue(answer.success, answer.message)
        output = mapper.end()
        self.assertRegex(output, r'Loaded \d+ tiles within 15 m of the sensor from .*/city')
        whole, own = tiles_of(self.folder / 'whole.bkm'), tiles_of(saved)
        shared = set(whole) & set(own)
        self.assertTrue(4 < len(shared) < len(whole))
        self.assertEqual({key: own[key] for key in shared}, {key: whole[key] for key in shared}, 'each tile counts once')
        self.assertEqual(len(set(own) - shared), 2, 'the hits')
        self.assertEqual(self.bytes_of_city(), self.before)

    def test_2_a_window_needs_a_file_of_its_own(self):
        own = self.folder / 'own.bkm'
        mapper = Mapper(self, 'resident', map_file=str(self.city), own_map_file=str(own), window=40.0, **SETTINGS)
        mapper.robot.connect()
        for x, y in ((0.0, 0.0), (60.0, -20.0)):
            points = self.near(x, y, 12.0)
            mapper.robot.scan(HIGH, [ROAD], position=(x, y, 0.0))
            wait_until(lambda: self.known(mapper, points) == len(points), 'loading what is near')
        self.assertIn(f'The map is saved in {own}', mapper.end())
        whole, kept = tiles_of(self.folder / 'whole.bkm'), tiles_of(own)
        shared = set(whole) & set(kept)
        self.assertGreater(len(shared), 4)
        self.assertEqual({key: kept[key] for key in shared}, {key: whole[key] for key in shared})
        self.assertEqual(self.bytes_of_city(), self.before)
        for parameters, what in (({'own_map_file': str(own)}, 'exists already, and may hold tiles of the city'),
                                 ({'window': 40.0}, 'set own_map_file, or window to 0'),
                                 ({'read_only': True}, 'read_only publishes a whole map'),
                                 ({'map_file': str(self.city / 'regions/0_0-key.bkm')}, 'which only map_city may change')):
            refused = Mapper(self, 'refused', **{'map_file': str(self.city), **SETTINGS, **parameters})
            output = refused.node.communicate(timeout=30)[0]
            self.assertEqual(refused.node.returncode, 1, output)
            self.assertIn(what, output)
            refused.status.close()

    def test_3_without_a_sound_city_mapping_goes_on(self):
        broken = self.folder / 'broken'
        shutil.copytree(self.city, broken)
        for path in (broken / 'regions').iterdir():
            if path.name.startswith('0_0-'):
                path.write_text('rubbish')
        (self.folder / 'empty').mkdir()
        for number, (city, what, settings) in enumerate((
                (self.folder / 'empty', 'holds no index.json', {}),
                (broken, 'is not a map of bki_mapping', {}),
                (self.city, 'the resolution of', {'resolution': 0.4}),
                (self.city, 'classes', {'classes': 'nuscenes'}),
                (self.city, "is in frame 'map', and the mapper maps in 'odom'", {'frame_id': 'odom'}))):
            mapper = Mapper(self, f'broken_{number}', map_file=str(city), **{**SETTINGS, **settings})
            if 'frame_id' not in settings:
                mapper.robot.connect()
                mapper.robot.scan(HIGH, [ROAD])
                mapper.status.wait_for(lambda m: m.integrated == 1, 'mapping')
            fault = mapper.status.wait_for(lambda m: m.map_file_fault, 'the fault').map_file_fault
            self.assertIn(what, fault)
            self.assertNotIn('\n', fault)
            mapper.end()


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'city_rostest', City)
