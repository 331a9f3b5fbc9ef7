#!/usr/bin/env python3
"""A processor without AVX maps as one with it: map_sequence on an emulated Nehalem, of 2008, against a native run.

The emulator refuses instructions that Nehalem lacks, as the processor does; the first test makes sure of that."""
import os
import platform
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import unittest

QEMU = shutil.which('qemu-x86_64')
if QEMU is None or platform.machine() != 'x86_64':
    print('SKIPPED: needs qemu-x86_64 (package qemu-user), and a machine that is x86-64 itself', file=sys.stderr)
    sys.exit(77)
VERSION = re.search(r'version (\d+)\.(\d+)', subprocess.check_output([QEMU, '--version'], text=True))
if tuple(map(int, VERSION.groups())) < (7, 2):
    print('SKIPPED: needs QEMU 7.2 or later; earlier ones do not refuse AVX', file=sys.stderr)
    sys.exit(77)
BIN = os.environ['BKI_MAPPING_BIN']
SCANS = 2
UNIT = 2.0 ** -16  # of evidence; each scan's sum is rounded to it
ROUNDING = 50 * 2e-6 * 0.1 + SCANS * UNIT


def emulated(processor, *command):
    """Without a time limit of its own: emulation takes long on a busy machine, and ctest has a limit."""
    return subprocess.run([QEMU, '-cpu', processor, *command], capture_output=True, text=True)


def program_with_avx(path):
    """Writes the smallest program with an AVX instruction: vzeroupper, and exit(0)."""
    code = bytes.fromhex('c5f877' 'b83c000000' '31ff' '0f05')
    base, offset = 0x400000, 64 + 56  # after the headers
    header = b'\x7fELF' + bytes([2, 1, 1]) + bytes(9) + struct.pack(
        '<HHIQQQIHHHHHH', 2, 62, 1, base + offset, 64, 0, 0, 64, 56, 1, 0, 0, 0)
    segment = struct.pack('<IIQQQQQQ', 1, 5, 0, base, base, offset + len(code), offset + len(code), 0x1000)
    with open(path, 'wb') as file:
        file.write(header + segment + code)
    os.chmod(path, 0o755)


def voxels(path):
    """Of a map file: what is exact by position, and what is rounded."""
    with open(path, 'rb') as file:
        content = file.read()
    end = content.index(b'end_header\n') + len(b'end_header\n')
    header = content[:end].decode().splitlines()
    count = next(int(line.split()[2]) for line in header if line.startswith('element vertex'))
    codes = {'float': 'f', 'uchar': 'B', 'ushort': 'H', 'int': 'i', 'uint': 'I'}
    fields = [line.split()[1:] for line in header if line.startswith('property')]
    row = struct.Struct('<' + ''.join(codes[kind] for kind, _ in fields))
    names = [name for _, name in fields]
    result = {}
    for values in row.iter_unpack(content[end:end + count * row.size]):
        voxel = dict(zip(names, values))
        result[voxel.pop('x'), voxel.pop('y'), voxel.pop('z')] = voxel
    assert len(result) == count
    return result


class Nehalem(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.drive = os.path.join(cls.folder.name, 'drive')
        subprocess.run([os.path.join(BIN, 'simulate_drive'), '--output', cls.drive, '--scans', str(SCANS), '--beams',
                        '16', '--columns', '300'], check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_emulator_refuses_avx(self):
        path = os.path.join(self.folder.name, 'avx')
        program_with_avx(path)
        self.assertEqual(emulated('Haswell', path).returncode, 0)
        self.assertEqual(emulated('Nehalem', path).returncode, -signal.SIGILL)

    def expect_same_map(self, *settings):
        command = [os.path.join(BIN, 'map_sequence'), '--sequence', self.drive, '--include', 'occupied,free',
                   '--threads', '2']
        for each in settings:
            command += ['--set', each]
        maps = {}
        for name, run in (('native', lambda *command: subprocess.run(command, capture_output=True, text=True)),
                          ('nehalem', lambda *command: emulated('Nehalem', *command))):
            path = os.path.join(self.folder.name, name + '.ply')
            done = run(*command, '--output', path)
            self.assertEqual(done.returncode, 0, done.stderr)
            maps[name] = voxels(path)
        native, nehalem = maps['native'], maps['nehalem']
        self.assertGreater(len(native), 500)
        self.compare(native, nehalem)

    def compare(self, native, nehalem):
        """Instruction sets round differently: kernel values are right to 1e-6 of their scale of 0.1 on each, and up to
        some 50 of them add up in a voxel, whose sum may then be rounded to the next unit. A voxel of which hardly
        anything is known may be lost by that, and the state may change where two are as probable."""
        for one, other in ((native, nehalem), (nehalem, native)):
            lost = [voxel for at, voxel in one.items() if at not in other and voxel['evidence'] > ROUNDING]
            self.assertEqual(lost, [])
        for at in native.keys() & nehalem.keys():
            one, other = native[at], nehalem[at]
            self.assertAlmostEqual(one['evidence'], other['evidence'], delta=1e-5 * one['evidence'] + ROUNDING, msg=at)
            if one['state'] != other['state']:
                tie = ROUNDING / one['evidence'] + 1e-5
                self.assertAlmostEqual(one['probability'], other['probability'], delta=tie, msg=(at, one, other))

    def test_lines(self):
        self.expect_same_map('free_space/mode=line')

    def test_lines_of_wide_kernels(self):
        self.expect_same_map('free_space/mode=line', 'kernel/length=0.6')

    def test_points(self):
        self.expect_same_map('free_space/mode=linear')


if __name__ == '__main__':
    unittest.main()
