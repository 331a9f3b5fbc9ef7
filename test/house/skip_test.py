#!/usr/bin/env python3
"""ctest shows a test without its data as skipped, not as passed."""
import json
import os
import re
import subprocess
import unittest

ROOT = os.environ['BKI_MAPPING_SOURCE_DIR']


class Skips(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        listed = subprocess.run(['ctest', '--show-only=json-v1'], cwd=os.environ['BKI_MAPPING_BUILD'],
                                capture_output=True, text=True, timeout=60, check=True)
        cls.tests = {test['name']: test for test in json.loads(listed.stdout)['tests']}

    def outcome(self, name, **data):
        """The result that ctest derives from exit status and output of a test, with only this data."""
        properties = {p['name']: p['value'] for p in self.tests[name]['properties']}
        environment = {key: value for key, value in os.environ.items() if key != 'BKI_MAPPING_TEST_DATA'}
        run = subprocess.run(self.tests[name]['command'], capture_output=True, text=True, timeout=60, check=False,
                             env={**environment, **data})
        output = run.stdout + run.stderr
        if run.returncode == properties.get('SKIP_RETURN_CODE', -1) or \
                any(re.search(words, output) for words in properties.get('SKIP_REGULAR_EXPRESSION', [])):
            return 'skipped'
        return 'passed' if run.returncode == 0 else 'failed'

    def test_without_real_data(self):
        self.assertEqual(self.outcome('real_data_test'), 'skipped')
        self.assertEqual(self.outcome('city_real_bag_test'), 'skipped')
        self.assertEqual(self.outcome('real_data_test', BKI_MAPPING_TEST_DATA='/no/such'), 'failed')
        if 'real_bag_rostest' in self.tests:
            self.assertEqual(self.outcome('real_bag_rostest'), 'skipped')

    def test_without_ros(self):
        self.assertEqual(self.outcome('city_bags_test', BKI_MAPPING_BIN='/no/such'), 'skipped')
        self.assertEqual(self.outcome('city_real_bag_test', BKI_MAPPING_BIN='/no/such', BKI_MAPPING_TEST_DATA='/no/such'), 'skipped')

    def test_without_an_emulator(self):
        self.assertEqual(self.outcome('nehalem_test', PATH='/no/such'), 'skipped')

    def test_without_a_browser(self):
        self.assertEqual(self.outcome('browser_test', PATH='/no/such'), 'skipped')

    def test_what_tests_something_is_not_skipped(self):
        self.assertEqual(self.outcome('grid_geometry_test'), 'passed')

    def test_no_test_skips_a_part_of_itself(self):
        """ctest would hide a skipped case among others of the same program, so each is a separate test, listed here."""
        for folder, _, files in os.walk(os.path.join(ROOT, 'test')):
            for name in files:
                if not name.endswith(('.cpp', '.h', '.py')):
                    continue
                with open(os.path.join(folder, name)) as file:
                    skips = re.search(r'GTEST_SKIP|skipTest|SkipTest|unittest\.skip', file.read())
                if skips and name != os.path.basename(__file__):
                    self.assertIn(name, ('full_disk_test.cpp', 'real_data_test.cpp'))


if __name__ == '__main__':
    unittest.main()
