#!/usr/bin/env python3
"""The version stands in package.xml: programs and Debian packages take it from there."""
import os
import re
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


def control():
    with open(os.path.join(ROOT, 'packaging/debian/control')) as file:
        return file.read()


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


if __name__ == '__main__':
    unittest.main()
