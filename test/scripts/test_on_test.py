#!/usr/bin/env python3
"""scripts/test_on removes only chroots that it has made."""
import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'scripts/test_on')


class TestOn(unittest.TestCase):
    def test_chroots_that_are_there_already_stay(self):
        with tempfile.TemporaryDirectory() as made:
            root = pathlib.Path(made)
            (root / 'debs').mkdir()
            (root / 'debs/ros-bki-mapping_1_amd64.deb').touch()
            # Functions of bash in place of programs, so that the test needs neither these nor root.
            stand_ins = {'id': 'echo 0', **dict.fromkeys(('git', 'ip', 'mmdebstrap', 'sudo', 'unshare'), 'false')}
            environment = {**os.environ, **{f'BASH_FUNC_{name}%%': f'() {{ {does}; }}' for name, does in stand_ins.items()}}
            for chroot, *options in (('some', ), ('some-package', '--package'), ('some-package-installed', '--package'),
                                     ('some-package', '--debs', root / 'debs'),
                                     ('some-package-installed', '--debs', root / 'debs')):
                there = root / 'systems' / chroot / 'note'
                there.parent.mkdir(parents=True)
                there.touch()
                run = subprocess.run([SCRIPT, *options, '--folder', root / 'systems', 'some'], env=environment,
                                     capture_output=True, text=True, timeout=60, check=False)
                self.assertTrue(there.exists(), f'{chroot} is removed with {options}: {run.stdout}{run.stderr}')
                self.assertEqual(run.returncode, 1)
                self.assertEqual(run.stderr, f'scripts/test_on: {there.parent} is there already; remove it, or choose another '
                                 '--folder\n')
                there.unlink()
                there.parent.rmdir()


if __name__ == '__main__':
    unittest.main()
