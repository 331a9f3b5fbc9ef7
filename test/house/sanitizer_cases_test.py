#!/usr/bin/env python3
"""The cases that scripts/test chooses for the sanitizers exist, and their tests heed the choice."""
import fnmatch
import os
import re
import unittest

ROOT = os.environ['BKI_MAPPING_SOURCE_DIR']


def text_of(name):
    with open(os.path.join(ROOT, name)) as file:
        return file.read()


def cases_of():
    """For each NAME_test.cpp, its cases Suite.Case, and Name/ for the names of its suites with parameters."""
    cases = {}
    for folder, _, files in os.walk(os.path.join(ROOT, 'test')):
        for name in files:
            if name.endswith('_test.cpp'):
                text = text_of(os.path.join(folder, name))
                found = ['.'.join(each) for each in re.findall(r'^ *TEST(?:_F|_P)?\((\w+), (\w+)\)', text, re.MULTILINE)]
                # A suite with parameters has names of its own.
                found += [each + '/' for each in re.findall(r'^ *INSTANTIATE_TEST_SUITE_P\(\s*(\w+)', text, re.MULTILINE)]
                cases[name[:-len('.cpp')]] = found
    return cases


def joined():
    """The tests that may be one program with others. That gets a filter of its own, before which GTEST_FILTER counts nothing."""
    calls = re.findall(r'^ *bki_mapping_unit_tests\(\w+ ([^)]*)\)', text_of('cmake/tests.cmake'), re.MULTILINE)
    names = (re.sub(r'\bLINK\b.*', '', call, flags=re.DOTALL).split() for call in calls)
    return {name + '_test' for each in names if len(each) > 1 for name in each}


class Cases(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.script, cls.cases, cls.joined = text_of('scripts/test'), cases_of(), joined()

    def expect_heeded(self, pattern, tests):
        """A pattern is for cases of one of the tests, which is a program of its own."""
        has = {test for test in tests for case in self.cases[test] if fnmatch.fnmatch(case, pattern)}
        self.assertTrue(has, f'{pattern} is a case of none of {sorted(tests)}')
        self.assertFalse(has & self.joined, f'{pattern}: give its test a call of bki_mapping_unit_tests in cmake/tests.cmake')

    def test_left_out(self):
        (left_out, names), = re.findall(r"GTEST_FILTER=-(\S+) \\\n *run_ctest \S+tsan\S+ -R '\^\(([\w|]+)\)_test\$'", self.script)
        for case in left_out.split(':'):
            self.expect_heeded(case, [name + '_test' for name in names.split('|')])
        left_out, = re.findall(r'GTEST_FILTER=-(\S+) \\\n *run_ctest \S+asan', self.script)
        lists = ' '.join(re.findall(r'^(?:core|file|store)_tests=\(([^)]+)\)', self.script, re.MULTILINE))
        for case in left_out.split(':'):
            self.expect_heeded(case, set(lists.split()) & self.cases.keys())

    def test_chosen(self):
        runs = re.findall(r"bki_mapping/(\w+_test)\" --gtest_filter='([^']+)'", self.script)
        self.assertGreater(len(runs), 0)
        for test, patterns in runs:
            for pattern in patterns.split(':'):
                self.expect_heeded(re.sub(r'^(\w+/)\*/\d+$', r'\1', pattern), [test])

    def test_that_it_would_see_what_is_wrong(self):
        for wrong in ('MapCorrector.NoSuchCase', 'NoSuchName/'):
            with self.assertRaises(AssertionError):
                self.expect_heeded(wrong, ['map_corrector_test', 'points_test'])
        case, *_ = self.cases['points_test']
        with self.assertRaises(AssertionError):
            self.expect_heeded(case, ['points_test'])


if __name__ == '__main__':
    unittest.main()
