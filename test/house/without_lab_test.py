#!/usr/bin/env python3
"""The product needs nothing of the lab: without it, all else is configured, built and installed."""
import os
import re
import subprocess
import tempfile
import unittest

ROOT, BUILD = os.environ['BKI_MAPPING_SOURCE_DIR'], os.environ['BKI_MAPPING_BUILD']


class WithoutLab(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        with open(os.path.join(BUILD, 'CMakeCache.txt')) as file:
            ros = next(line.split('=')[1].strip() for line in file if line.startswith('BKI_MAPPING_ROS:'))
        subprocess.run(['cmake', '-G', 'Ninja', '-S', ROOT, '-B', cls.folder.name, '-DBKI_MAPPING_LAB=OFF',
                        f'-DBKI_MAPPING_ROS={ros}'], check=True, capture_output=True, text=True, timeout=250)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def words(self, name):
        with open(os.path.join(self.folder.name, name)) as file:
            return set(re.findall(r'[\w./-]+', file.read()))

    def test_nothing_of_the_lab_is_built_or_installed(self):
        lab = re.compile(r'/lab/|evaluat|simulation|simulate_|benchmark_')
        for name in ('build.ninja', 'cmake_install.cmake', 'CTestTestfile.cmake'):
            self.assertEqual({word for word in self.words(name) if lab.search(word)}, set(), name)

    def test_all_else_is_built(self):
        built = self.words('build.ninja')
        rooms = set(os.listdir(os.path.join(ROOT, 'src'))) - {'costmap', 'ros', 'tools'}  # which need ROS, in part
        for room in rooms:
            for folder, _, files in os.walk(os.path.join(ROOT, 'src', room)):
                for name in files:
                    self.assertTrue(not name.endswith('.cpp') or os.path.join(folder, name) in built, name)
        for program in ('clear_map', 'correct_map', 'export_map', 'forget_journal', 'inspect_map', 'map_sequence', 'merge_maps', 'migrate_map', 'query_city'):
            self.assertIn(program, built)


if __name__ == '__main__':
    unittest.main()
