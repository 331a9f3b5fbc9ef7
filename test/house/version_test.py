#!/usr/bin/env python3
"""The version stands in package.xml: programs and Debian packages take it from there. The packages hold all programs."""
import fnmatch
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

ROOT, BIN = os.environ['BKI_MAPPING_SOURCE_DIR'], os.environ['BKI_MAPPING_BIN']
PACKAGE = xml.etree.ElementTree.parse(os.path.join(ROOT, 'package.xml'))
VERSION = PACKAGE.findtext('version')


def output_of(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, universal_newlines=True, timeout=60).stdout


def programs():
    """Those that are built; the tests are beside them. print_parameters, for scripts/generate_parameters, has no options."""
    sources = {name for folder in ('src/tools', 'lab/tools') for name in os.listdir(os.path.join(ROOT, folder))}
    return sorted({name[:-len('.cpp')] for name in sources if name.endswith('.cpp')} & set(os.listdir(BIN)) - {'print_parameters'})


def text_of(name):
    with open(os.path.join(ROOT, name)) as file:
        return file.read()


def control():
    return text_of('packaging/debian/control')


def packed():
    """What is installed as programs where Debian packages are built: there is nothing of the lab but the demo's drive."""
    sources = [name for name in os.listdir(os.path.join(ROOT, 'src/tools')) if name.endswith('.cpp')]
    tools = {name[:-len('.cpp')] for name in sources if re.search(r'^int main\(', text_of(f'src/tools/{name}'), re.MULTILINE)}
    scripts = re.findall(r'\bscripts/([\w.]+)', text_of('cmake/ros.cmake') + text_of('cmake/python_module.cmake'))
    return sorted(tools | set(scripts) | {'mapping_node', 'simulate_drive'})


class Version(unittest.TestCase):
    def test_programs_say_it(self):
        self.assertIn('map_sequence', programs())
        for name in programs():
            self.assertEqual(output_of(os.path.join(BIN, name), '--version'), f'bki_mapping {VERSION}\n', name)

    def test_debian_packages_have_it(self):
        with tempfile.NamedTemporaryFile('w+') as changelog:
            changelog.write(output_of(os.path.join(ROOT, 'scripts/package'), '--changelog'))
            changelog.flush()
            fields = dict(re.findall(r'^(\w+): (.*)$', output_of('dpkg-parsechangelog', '-l', changelog.name), re.MULTILINE))
        maintainer = PACKAGE.find('maintainer')
        self.assertEqual(fields['Source'], re.search(r'^Source: (.*)$', control(), re.MULTILINE)[1])
        self.assertEqual(fields['Version'], VERSION)
        self.assertEqual(fields['Maintainer'], f"{maintainer.text} <{maintainer.get('email')}>")
        self.assertIn(f"Maintainer: {fields['Maintainer']}\n", control())

    def test_packages_need_a_date_in_the_changelog(self):
        with tempfile.TemporaryDirectory() as root:
            os.mkdir(os.path.join(root, 'scripts'))
            for name in ('package.xml', 'scripts/common.sh', 'scripts/package'):
                shutil.copy(os.path.join(ROOT, name), os.path.join(root, name))
            for text in ('', f'## [{VERSION}]\n', '## [Unreleased]\n\n## [0.0.1] - 2026-01-01\n'):
                with open(os.path.join(root, 'CHANGELOG.md'), 'w') as changelog:
                    changelog.write(text)
                made = subprocess.run([os.path.join(root, 'scripts/package'), '--changelog'], capture_output=True, text=True,
                                      timeout=60, check=False)
                self.assertEqual((made.returncode, made.stdout), (1, ''), text)
                self.assertEqual(made.stderr.count('\n'), 1)
                self.assertIn(f'CHANGELOG.md has no date of {VERSION}', made.stderr)

    def test_each_program_is_in_one_debian_package(self):
        folder = os.path.join(ROOT, 'packaging/debian')
        lists = {name: text_of(f'packaging/debian/{name}').split() for name in os.listdir(folder) if name.endswith('.install')}
        self.assertIn('map_bag', packed())
        self.assertIn('map_city', packed())
        for program in packed():
            packages = [name for name, patterns in lists.items()
                        if any(fnmatch.fnmatchcase(f'usr/lib/bki_mapping/{program}', pattern) for pattern in patterns)]
            self.assertEqual(len(packages), 1, f'{program} is in {packages}')


if __name__ == '__main__':
    unittest.main()
