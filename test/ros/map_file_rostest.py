#!/usr/bin/env python3
"""Maps that outlive the mapper: map_file with a window, ~save_map and ~load_map, read_only, SIGKILL, and what is refused."""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus, OccupancyMap
from bki_mapping.srv import BoundingBoxQuery, BoundingBoxQueryRequest, LoadMap, SaveMap
from geometry_msgs.msg import Point
from std_srvs.srv import Empty, Trigger

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.join(FOLDER, '../../scripts')]
from harness import CAR, ROAD, TIMEOUT, Listener, Robot, program, publishers_of, wait_until  # noqa: E402
from read_map import read_planes  # noqa: E402

POINTS = [(0.4 * (i % 40) - 8.0, 0.35 * (i // 40) - 8.0, 0.02 * (i % 7) - 1.0) for i in range(1200)]
LABELS = [CAR if i % 5 == 0 else ROAD for i in range(1200)]
PLACES = [*range(0, 180, 6), *range(180, -12, -6)]  # out and back, along x [m]
WINDOW = 50.0


def content(path):
    """The evidence in a map file, plane by plane."""
    return {(block, label): plane.tobytes() for block, label, plane in read_planes(path)}


class Mapper:
    """A mapping node with parameters, and a robot."""

    def __init__(self, test, name, **parameters):
        self.name = name
        if rospy.has_param(f'/{name}'):
            rospy.delete_param(f'/{name}')
        for parameter, value in {'free_space/mode': 'line', 'resolution': 0.4, **parameters}.items():
            rospy.set_param(f'/{name}/{parameter}', value)
        self.status = Listener(f'/{name}/status', MappingStatus)
        test.addCleanup(self.status.close)
        self.robot = Robot(f'/{name}_cloud')
        self.node = subprocess.Popen([program('mapping_node'), f'__name:={name}', f'cloud_in:=/{name}_cloud'],
                                     stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        test.addCleanup(self.node.kill)

    def map(self, places):
        self.robot.connect()
        for place in places:
            stamp = self.robot.scan(POINTS, LABELS, position=(float(place), 0.0, 0.0))
            status = self.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')
            if not status.integrated_last:
                raise AssertionError(status)

    def call(self, service, kind, *arguments):
        rospy.wait_for_service(f'/{self.name}/{service}', TIMEOUT)
        return rospy.ServiceProxy(f'/{self.name}/{service}', kind)(*arguments)

    def end(self, number=signal.SIGINT):
        self.node.send_signal(number)
        output = self.node.communicate(timeout=TIMEOUT)[0]
        wait_until(lambda: not publishers_of(f'/{self.name}/status') or number == signal.SIGKILL, 'the end')
        self.status.close()
        self.robot.clouds.unregister()
        return output


class MapFile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('map_file_rostest')
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.whole = os.path.join(cls.folder, 'whole.bkm')
        cls.first_half = os.path.join(cls.folder, 'first_half.bkm')

    def path(self, name):
        return os.path.join(self.folder, name)

    def saved(self, mapper, path):
        answer = mapper.call('save_map', SaveMap, path, '')
        self.assertTrue(answer.success, answer.message)
        return content(path)

    def test_1_a_plain_mapper_saves(self):
        mapper = Mapper(self, 'plain')
        half = len(PLACES) // 2
        mapper.map(PLACES[:half])
        self.saved(mapper, self.first_half)
        mapper.map(PLACES[half:])
        self.saved(mapper, self.whole)
        mapper.end()
        self.assertGreater(len(content(self.whole)), 300)

    def test_2_a_window_and_new_starts_change_no_bit(self):
        path = self.path('kept.bkm')
        parts = [PLACES[:20], PLACES[20:45], PLACES[45:]]
        for number, places in enumerate(parts):
            mapper = Mapper(self, f'kept_{number}', map_file=path, window=WINDOW, save_period=0.5)
            mapper.map(places)
            if number == 1:  # a copy of all, though only a part is in memory
                copy = self.saved(mapper, self.path('copy.bkm'))
                self.assertGreater(len(copy), 1.3 * mapper.status.messages[-1].blocks)
            output = mapper.end()
            self.assertIn(f'The map is saved in {path}', output)
        self.assertEqual(content(path), content(self.whole))

    def test_3_what_is_saved_survives_a_kill(self):
        path = self.path('killed.bkm')
        mapper = Mapper(self, 'killed', map_file=path, window=WINDOW, save_period=0.2)
        half = len(PLACES) // 2
        mapper.map(PLACES[:half])
        mapped = rospy.Time.from_sec(time.time())

        def is_saved():
            mapper.call('resume', Trigger)  # which publishes the status
            return mapper.status.messages[-1].map_saved >= mapped
        wait_until(is_saved, 'the save')
        mapper.end(signal.SIGKILL)
        again = Mapper(self, 'killed', map_file=path, window=WINDOW)
        again.map(PLACES[half:])
        again.end()
        self.assertEqual(content(path), content(self.whole))

    def test_4_load_replaces_or_adds(self):
        mapper = Mapper(self, 'loading')
        mapper.map([500])
        answer = mapper.call('load_map', LoadMap, self.first_half, False, False)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(self.saved(mapper, self.path('loaded.bkm')), content(self.first_half))
        answer = mapper.call('load_map', LoadMap, self.first_half, True, False)
        self.assertFalse(answer.success)
        self.assertIn('which would count twice', answer.message)
        mapper.map(PLACES[len(PLACES) // 2:])
        self.assertEqual(self.saved(mapper, self.path('loaded.bkm')), content(self.whole))
        for path, what in ((self.path('none.bkm'), 'none.bkm'), ('relative.bkm', 'absolute'), (self.folder, 'regular file')):
            answer = mapper.call('load_map', LoadMap, path, False, False)
            self.assertFalse(answer.success)
            self.assertIn(what, answer.message)
        with open(self.whole, 'rb') as file, open(self.path('cut.bkm'), 'wb') as cut:
            cut.write(file.read()[:20000])
        answer = mapper.call('load_map', LoadMap, self.path('cut.bkm'), False, False)
        self.assertFalse(answer.success)
        self.assertIn('cut.bkm is damaged', answer.message)
        self.assertEqual(self.saved(mapper, self.path('loaded.bkm')), content(self.whole), 'the good map stays')
        mapper.end()

    def test_5_a_read_only_map_is_published(self):
        mapper = Mapper(self, 'reader', map_file=self.whole, read_only=True)
        occupancy = Listener('/occupancy', OccupancyMap)
        status = mapper.status.wait_for(lambda m: m.read_only, 'the status')
        self.assertGreater(status.blocks, 100)
        occupancy.wait_for(lambda m: len(m.blocks) > 100, 'the map')
        occupancy.close()
        self.assertEqual(mapper.robot.clouds.get_num_connections(), 0)
        with self.assertRaises(rospy.ServiceException):
            mapper.call('reset', Empty)
        answer = mapper.call('load_map', LoadMap, self.first_half, True, False)
        self.assertFalse(answer.success)
        self.assertIn('read only', answer.message)
        before = open(self.whole, 'rb').read()
        mapper.end()
        self.assertEqual(open(self.whole, 'rb').read(), before)

    def test_6_what_does_not_fit_is_refused_at_the_start(self):
        shutil.copy(self.whole, self.path('used.bkm'))
        user = Mapper(self, 'user', map_file=self.path('used.bkm'))
        user.status.wait_for(lambda m: m.blocks > 0, 'the map that is loaded')
        for parameters, what in (({'map_file': self.path('used.bkm')}, 'is open in another place'),
                                 ({'map_file': self.whole, 'resolution': 0.3}, 'the resolution of'),
                                 ({'map_file': self.whole, 'frame_id': 'odom'}, "is in frame 'map'"),
                                 ({'map_file': 'map.bkm'}, 'must be an absolute path'),
                                 ({'map_file': self.path('map.ply')}, 'must end in .bkm'),
                                 ({'map_file': self.path('no/map.bkm')}, 'map.bkm'),
                                 ({'read_only': True}, 'set map_file')):
            refused = Mapper(self, 'refused', **parameters)
            output = refused.node.communicate(timeout=TIMEOUT)[0]
            self.assertEqual(refused.node.returncode, 1, output)
            self.assertIn(what, output)
            refused.status.close()
        user.end()

    def test_7_boxes_are_cleared_in_memory_and_in_the_file(self):
        path = self.path('cleared.bkm')
        shutil.copy(self.whole, path)
        mapper = Mapper(self, 'clearing', map_file=path, window=WINDOW)
        mapper.map([180])
        box = BoundingBoxQueryRequest(min=Point(-5.0, -4.0, -9.0), max=Point(1000.0, 4.0, 9.0))
        swapped = BoundingBoxQueryRequest(min=Point(box.max.x, box.min.y, box.max.z), max=Point(box.min.x, box.max.y, box.min.z))
        mapper.call('clear_bbx', BoundingBoxQuery, swapped)
        with self.assertRaisesRegex(rospy.ServiceException, 'a corner of the box is not a number; correct it'):
            mapper.call('clear_bbx', BoundingBoxQuery, BoundingBoxQueryRequest(min=Point(float('nan'), 0, 0), max=box.max))
        mapper.end()
        edge = 0.4

        def inside(block, axis, index):
            return getattr(box.min, 'xyz'[axis]) <= edge * (8 * block[axis] + index + 0.5) <= \
                getattr(box.max, 'xyz'[axis])
        left, cleared = 0, 0
        for block, _, plane in read_planes(path):
            for z in range(8):
                for y in range(8):
                    for x in range(8):
                        if all(inside(block, axis, i) for axis, i in enumerate((x, y, z))):
                            self.assertEqual(plane[z, y, x], 0.0)
                            cleared += 1
                        else:
                            left += plane[z, y, x] != 0.0
        self.assertGreater(cleared, 1000)
        self.assertGreater(left, 1000)
        self.assertEqual(BoundingBoxQuery._md5sum, '93aa3d73b866f04880927745f4aab303', 'that of octomap_msgs')

    def test_8_a_reset_clears_the_file(self):
        path = self.path('reset.bkm')
        shutil.copy(self.whole, path)
        mapper = Mapper(self, 'resetting', map_file=path, window=WINDOW)
        mapper.map(PLACES[:2])
        mapper.call('reset', Empty)
        mapper.map(PLACES[:len(PLACES) // 2])
        mapper.end()
        self.assertEqual(content(path), content(self.first_half))


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'map_file_rostest', MapFile)
