#!/usr/bin/env python3
"""Code compiled for an instruction set stays in its file. A function that several files define, such as a member of
std::vector, is kept once, and the linker may keep the one with AVX-512: a processor without it would stop there."""
import os
import re
import subprocess
import sys
import unittest

# CMake also lists precompiled headers (.gch).
OBJECTS = [path for argument in sys.argv[1:] for path in argument.split(';') if path.endswith('.o')]
# Those that include simd/vec_avx2.h or simd/vec_avx512.h.
VECTOR = [path for path in OBJECTS if re.search(r'_kernels_avx\w+\.cpp', os.path.basename(path))]
# AVX and what came after it is coded in a form (VEX, EVEX) that disassemblers show by a leading v.
AVX = re.compile(r'\t(v[a-z]\w+) ')


def lines(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


class VectorSymbols(unittest.TestCase):
    def test_no_object_shares_a_function_with_others(self):
        self.assertEqual(len(VECTOR), 12, 'AVX2 and AVX-512, for points, lines, limits, sums, views and distances')
        for path in VECTOR:
            kinds = {line.split(maxsplit=2)[2]: line.split(maxsplit=2)[1]
                     for line in lines('nm', '--defined-only', '-C', path)}
            self.assertTrue(any('Kernels' in name for name in kinds), path)
            shared = [name for name, kind in kinds.items() if kind in 'WVu']
            self.assertEqual(shared, [], path)

    def test_no_other_object_has_vector_instructions(self):
        """Unless the compiler was asked for them everywhere, by -march=native or the like."""
        self.assertGreater(len(OBJECTS), 2 * len(VECTOR))
        for path in OBJECTS:
            found = {match[1] for match in map(AVX.search, lines('objdump', '-d', '--no-show-raw-insn', path)) if match}
            self.assertEqual(bool(found), path in VECTOR, f'{path}: {sorted(found)[:5]}')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
