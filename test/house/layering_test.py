#!/usr/bin/env python3
"""Rooms include only rooms that their library links; the core depends neither on ROS nor on PCL."""
import os
import re
import unittest

ROOT = os.environ['BKI_MAPPING_SOURCE_DIR']
CMAKE = ('core.cmake', 'tools.cmake', 'ros.cmake', 'costmap.cmake', 'simulation.cmake', 'lab.cmake', 'python_module.cmake')


def links():
    """For each room, the rooms that its library links, directly or not: the layering, as CMake has it."""
    text = ''
    for name in CMAKE:
        with open(os.path.join(ROOT, 'cmake', name)) as file:
            text += re.sub(r'#.*', '', file.read())
    direct = {}
    for room, arguments in re.findall(r'bki_mapping_(?:core_)?room\((\w+)\s([^)]*)\)', text):
        direct[room] = set(re.findall(r'bki_mapping_(\w+)', arguments.partition('LINK')[2]))
    # Programs link rooms beside that of their options.
    direct['tools'] |= {'export', 'ros'}
    direct['lab/tools'] = direct['lab/benchmark'] = {'evaluation', 'tools'}
    # Nothing links the Python module, which is no room of the library.
    bound = re.search(r'target_link_libraries\(bki_mapping_python PRIVATE ([^)]*)\)', text)[1]
    direct['python'] = set(re.findall(r'bki_mapping_(\w+)', bound))

    def reach(room):
        return direct[room].union(*(reach(each) for each in direct[room]))
    return {room: reach(room) | {room} for room in direct}


# What else a room may include, beside the standard library and Eigen.
LIBRARIES = {
    'simd': ('immintrin.h',),
    'beams/beam_rtree.cpp': ('boost/geometry', 'boost/iterator/'),
    'mapping/semantic_mapper.cpp': ('malloc.h',),
    'journal': ('zlib.h',),
    'store': ('sqlite3.h', 'zlib.h'),
    'settings': ('yaml-cpp/',),
    'sequence': ('pcl/',),
    'city': ('nlohmann/',),
    'export': ('nlohmann/', 'octomap/', 'png.h', 'yaml-cpp/', 'zlib.h'),
    'evaluation': ('nlohmann/', 'octomap/', 'pcl/'),
    'python': ('pybind11/',),
    'simulation': ('yaml-cpp/',),
    'ros': ('diagnostic_updater/', 'dynamic_reconfigure/', 'ros/', 'nodelet/', 'pluginlib/', 'tf2_ros/', 'bki_mapping/'),
    'costmap/semantic_layer.cpp': ('costmap_2d/', 'dynamic_reconfigure/', 'pluginlib/', 'ros/', 'tf2/', 'tf2_ros/'),
    'tools': ('boost/program_options', 'nlohmann/', 'ros/', 'rosbag/', 'bki_mapping/'),
    'lab/tools/yardstick.cpp': ('pcl/',),
    'lab/benchmark': ('benchmark/', 'ros/', 'bki_mapping/', 'topic_tools/'),
}
MESSAGES = re.compile(r'\w+_msgs/|std_srvs/')
POSIX = ('dlfcn.h', 'fcntl.h', 'sys/', 'unistd.h')


def sources():
    for top in ('include/bki_mapping', 'src'):
        for folder, _, files in os.walk(os.path.join(ROOT, top)):
            for name in files:
                path = os.path.join(folder, name)
                yield os.path.relpath(path, os.path.join(ROOT, top)), path
    for folder, _, files in os.walk(os.path.join(ROOT, 'lab')):
        for name in files:
            path = os.path.join(folder, name)
            relative = os.path.relpath(path, ROOT)
            if name.endswith(('.h', '.cpp')):  # `tools` is a room of src, too
                yield relative if relative.startswith(('lab/benchmark', 'lab/tools')) else os.path.relpath(path, f'{ROOT}/lab'), path
    for name in os.listdir(os.path.join(ROOT, 'python')):
        if name.endswith(('.h', '.cpp')):
            yield os.path.join('python', name), os.path.join(ROOT, 'python', name)


class Layering(unittest.TestCase):
    def test_includes(self):
        count, may_use = 0, links()
        for relative, path in sources():
            room = os.path.dirname(relative) if relative.startswith('lab/') else relative.split(os.sep)[0]
            self.assertIn(room, may_use, f'{path} is in no room')
            with open(path) as file:
                text = file.read()
            for own in re.findall(r'#include "(?:bki_mapping/)?(\w+)/', text):
                count += 1
                self.assertIn(own, may_use[room], f'{path} includes {own}, which its library does not link')
            allowed = LIBRARIES.get(room, ()) + LIBRARIES.get(relative, ())
            for other in re.findall(r'#include <([^>]+)>', text):
                if '/' not in other and not other.endswith('.h') or other.startswith('Eigen/'):
                    continue
                if room in ('costmap', 'lab/benchmark', 'ros', 'tools') and MESSAGES.match(other):
                    continue
                self.assertTrue(other.startswith(allowed + POSIX), f'{path} includes <{other}>')
        self.assertGreater(count, 50)

    def test_threads_start_in_one_place(self):
        for relative, path in sources():
            with open(path) as file:
                starts = re.search(r'std::thread\b(?!::)|std::async\b|#pragma omp', file.read())
            if starts:
                self.assertIn(relative, ('journal/map_corrector.h', 'journal/map_corrector.cpp', 'lab/benchmark/benchmark_publishing.cpp', 'parallel/thread_pool.h', 'parallel/thread_pool.cpp', 'ros/city_tiles.cpp', 'ros/mapping_server.h', 'ros/mapping_server.cpp',
                                     'ros/publisher_set.h', 'ros/publisher_set.cpp', 'store/tile_store.h',
                                     'store/tile_store.cpp'))

    def test_only_the_vocabulary_knows_instruction_sets(self):
        instructions = re.compile(r'\b_mm\d*_\w+|\b__m(64|128|256|512)|__SSE|__AVX|__ARM|__aarch64|__builtin_cpu_supports')
        found = set()
        for relative, path in sources():
            with open(path) as file:
                if instructions.search(file.read()):
                    found.add(relative.split(os.sep)[0])
        self.assertEqual(found, {'simd'})


if __name__ == '__main__':
    unittest.main()
