#!/usr/bin/env python3
"""config/default.yaml, cfg/Mapping.cfg and the tables of docs/parameters.md are up to date with the parameters."""
import os
import shutil
import subprocess
import tempfile
import unittest

SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
FILES = ('config/default.yaml', 'cfg/Mapping.cfg', 'docs/parameters.md')


def generate(*arguments):
    program = os.path.join(SOURCE, 'scripts/generate_parameters')
    return subprocess.run(['/usr/bin/python3', program, '--bin', os.environ['BKI_MAPPING_BIN'], *arguments],
                          capture_output=True, text=True, check=False)


class GeneratedParameters(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.copy = folder.name
        for name in FILES:
            os.makedirs(os.path.dirname(os.path.join(self.copy, name)))
            shutil.copy(os.path.join(SOURCE, name), os.path.join(self.copy, name))

    def edit(self, name, old, new):
        path = os.path.join(self.copy, name)
        with open(path) as file:
            text = file.read()
        self.assertIn(old, text)
        with open(path, 'w') as file:
            file.write(text.replace(old, new, 1))

    def text_of(self, name, root=SOURCE):
        with open(os.path.join(root, name)) as file:
            return file.read()

    def test_the_files_are_up_to_date(self):
        check = generate('--check')
        self.assertEqual((check.returncode, check.stderr), (0, ''))

    def test_an_edited_file_is_named_and_written_anew(self):
        for name, old, new in (('config/default.yaml', 'resolution: 0.3', 'resolution: 0.2'),
                               ('cfg/Mapping.cfg', "'free_space_gap'", "'free_space_gape'"),
                               ('docs/parameters.md', '| `prior` | `0.001` |', '| `prior` | `0.002` |')):
            self.edit(name, old, new)
            check = generate('--check', '--root', self.copy)
            self.assertEqual((check.returncode, check.stderr),
                             (1, f'{name} differs from the parameters in the code; run scripts/generate_parameters\n'))
            self.assertIn(new, self.text_of(name, self.copy), 'a check writes nothing')
            written = generate('--root', self.copy)
            self.assertEqual((written.returncode, written.stdout), (0, f'wrote {name}\n'))
            self.assertEqual(self.text_of(name, self.copy), self.text_of(name))
            self.assertTrue(name != 'cfg/Mapping.cfg' or os.access(os.path.join(self.copy, name), os.X_OK))

    def test_what_stands_around_the_tables_stays(self):
        self.edit('docs/parameters.md', '# Parameters\n', '# Settings\n')
        self.assertEqual(generate('--check', '--root', self.copy).returncode, 0)
        self.edit('docs/parameters.md', '<!-- end of node -->', '')
        broken = generate('--root', self.copy)
        self.assertEqual(broken.returncode, 1)
        self.assertIn('docs/parameters.md lacks the lines', broken.stderr)

    def test_missing_programs_are_named(self):
        missing = generate('--check', '--bin', self.copy)
        self.assertEqual(missing.returncode, 1)
        self.assertIn('build it, or name its folder with --bin', missing.stderr)


if __name__ == '__main__':
    unittest.main()
