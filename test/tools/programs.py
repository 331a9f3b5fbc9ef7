"""Programs as a user calls them, for their tests."""
import contextlib
import json
import os
import shutil
import sqlite3
import subprocess
import tempfile
import unittest

BIN = os.environ['BKI_MAPPING_BIN']
TIMEOUT = 300  # s


def call(program, *arguments, env=None):
    return subprocess.run([os.path.join(BIN, program), *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT,
                          env=env)


def read_json(path):
    with open(path) as file:
        return json.load(file)


def read_bytes(path):
    with open(path, 'rb') as file:
        return file.read()


def rows(path, query):
    """The rows of a map file that a query selects."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        return sorted(database.execute(query))


def tiles_of(path):
    """The tiles of a map file, packed."""
    return {(z, y, x): content for z, y, x, content in rows(path, 'SELECT z, y, x, content FROM tile WHERE part = 0')}


class ProgramTest(unittest.TestCase):
    """Its tests have a folder in common."""
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def succeeds(program, *arguments, env=None):
        result = call(program, *arguments, env=env)
        assert result.returncode == 0, result.stderr
        return result

    def fails(self, words, program, *arguments, env=None):
        """In one sentence with these words."""
        result = call(program, *arguments, env=env)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn(words, result.stderr)
        self.assertEqual(result.stderr.count('\n'), 1, 'one sentence: ' + result.stderr)
