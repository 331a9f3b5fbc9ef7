#!/usr/bin/env python3
"""Code compiled for an instruction set stays in its file. A function that several files define, such as a member of
std::vector, is kept once, and the linker may keep the one with AVX-512: a processor without it would stop there."""
import os
import subprocess
import sys
import unittest

OBJECTS = [path for argument in sys.argv[1:] for path in argument.split(';') if 'inner_loops_' in os.path.basename(path)]


class VectorSymbols(unittest.TestCase):
    def test_no_object_shares_a_function_with_others(self):
        self.assertGreaterEqual(len(OBJECTS), 1, 'no object file was given')
        for path in OBJECTS:
            lines = subprocess.run(['nm', '--defined-only', '-C', path], capture_output=True, text=True,
                                   check=True).stdout.splitlines()
            kinds = {line.split(maxsplit=2)[2]: line.split(maxsplit=2)[1] for line in lines}
            self.assertTrue(any('innerLoops' in name for name in kinds), path)
            shared = [name for name, kind in kinds.items() if kind in 'WVu']
            self.assertEqual(shared, [], path)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
