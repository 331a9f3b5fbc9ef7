#!/usr/bin/env python3
"""The reader that needs SQLite and NumPy alone reads test/store/data/version_N.bkm as test/store/versions_test.cpp does."""
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
sys.path.insert(0, os.path.join(SOURCE, 'scripts'))
import read_map  # noqa: E402

FILES = [os.path.join(SOURCE, 'test', 'store', 'data', f'version_{version}.bkm') for version in (1, 2, 3, 4, 5, 6)]
UNITS = 65536  # in 1 of evidence


def planes_of(file, part):
    return {(*block, label): (evidence * UNITS).astype('<i4') for block, label, evidence in read_map.read_planes(file, part)}


def checksum_of(planes):
    checksum = 0
    for key in sorted(planes):
        checksum = zlib.crc32(planes[key].tobytes(), zlib.crc32(struct.pack('<4i', *key), checksum))
    return checksum


class ReadMap(unittest.TestCase):
    def test_evidence(self):
        for file in FILES:
            planes = planes_of(file, 0)
            if 'version_6' in file:
                self.assertEqual(len(planes), 10)
                self.assertEqual(checksum_of(planes), 0x81f7b573)
                self.assertEqual(planes[2, 0, 0, 255][7, 6, 4], 2 * 38339 + 3 * 98 + 500 % 98)
                self.assertEqual(planes[2, 5, 0, 255][7, 6, 4], 1 * 38339 + 1 * 98 + 500 % 98)
                self.assertEqual(planes[-2, -1, -1, 40][7, 7, 0], 400 * 1278 + 504)
            else:
                self.assertEqual(len(planes), 7)
                self.assertEqual(checksum_of(planes), 0x5f49333b)
            self.assertEqual(planes[0, 0, 0, 40][0, 0, 3], 2147483647)  # z, y, x
            self.assertEqual(planes[-1, -1, -1, 255][7, 7, 7], -2147483647)
            self.assertEqual(planes[1, 0, 0, 0][1, 4, 4], -1)
            self.assertEqual(planes[7, 7, 7, 253][0, 0, 1], 333336240)

    def test_evidence_of_a_drive_alone(self):
        for file in FILES:
            planes = planes_of(file, 1)
            self.assertEqual(len(planes), 2)
            self.assertEqual(checksum_of(planes), 0x9b41d26f)

    def test_newer_versions_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'map.bkm')
            shutil.copyfile(FILES[-1], path)
            with open(path, 'r+b') as file:
                file.seek(63)
                file.write(b'\7')
            with self.assertRaisesRegex(ValueError, 'is not a map file of version 1 to 6'):
                list(read_map.read_planes(path))

    def test_as_a_program(self):
        lines = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'read_map.py'), FILES[-1]], capture_output=True, text=True,
                               check=True).stdout.splitlines()
        self.assertEqual(len(lines), 10)
        self.assertIn('1 0 0 40 512.0', lines)


if __name__ == '__main__':
    unittest.main()
