#!/usr/bin/env python3
"""Documents name only existing paths and link targets, and the version of the package."""
import glob
import os
import re
import unittest
import xml.etree.ElementTree

ROOT = os.environ['BKI_MAPPING_SOURCE_DIR']
DOCUMENTS = sorted(os.path.relpath(path, ROOT) for pattern in ('*.md', 'docs/*.md') for path in glob.glob(f'{ROOT}/{pattern}'))
FOLDERS = ('cfg', 'cmake', 'config', 'docs', 'examples', 'include', 'lab', 'launch', 'msg', 'packaging', 'python', 'rviz', 'scripts', 'src', 'srv', 'test')
SOURCE = re.compile(r'[\w./-]+\.(h|cpp|py|launch|cfg|msg|srv|cmake|test)')
PLACEHOLDER = re.compile(r'\b(NAME|ROOM|FILE|DIR|MODE)\b')


def all_files():
    for folder, folders, names in os.walk(ROOT):
        folders[:] = [name for name in folders if not name.startswith(('.', 'build'))]
        for name in names:
            yield os.path.relpath(os.path.join(folder, name), ROOT)


FILES = list(all_files())


def words_of(text):
    """The words in code spans and blocks, without surrounding punctuation."""
    spans = re.findall(r'^```.*?\n(.*?)^```$', text, re.MULTILINE | re.DOTALL)
    spans += re.findall(r'`([^`\n]+)`', re.sub(r'^```.*?^```$', '', text, flags=re.MULTILINE | re.DOTALL))
    for span in spans:
        for word in span.split():
            yield re.sub(r'^\w+:=', '', word).strip('.,;:()"\'')


def missing_paths(text):
    """Words that look like paths of the tree or source files, but do not exist."""
    missing = []
    for word in words_of(text):
        if PLACEHOLDER.search(word):
            continue
        if word.split('/')[0] in FOLDERS and '/' in word:
            if not glob.glob(os.path.join(ROOT, word)):
                missing.append(word)
        elif SOURCE.fullmatch(word) and not any(f'/{file}'.endswith(f'/{word}') for file in FILES):
            missing.append(word)
    return missing


def anchors_of(text):
    """Anchors of a document's headings, as GitHub makes them."""
    headings = re.findall(r'^#+ (.*)$', re.sub(r'^```.*?^```$', '', text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    return {re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings}


def read(path):
    with open(os.path.join(ROOT, path)) as file:
        return file.read()


def broken_links(document, text):
    broken = []
    for target in re.findall(r'\]\(([^)\s]+)\)', text):
        if re.match(r'https?://', target):
            continue
        path, _, anchor = target.partition('#')
        path = os.path.normpath(os.path.join(os.path.dirname(document), path)) if path else document
        if not os.path.exists(os.path.join(ROOT, path)):
            broken.append(target)
        elif anchor and anchor not in anchors_of(text if path == document else read(path)):
            broken.append(target)
    return broken


class Links(unittest.TestCase):
    def test_paths_exist(self):
        count = 0
        for document in DOCUMENTS:
            text = read(document)
            with self.subTest(document=document):
                self.assertEqual(missing_paths(text), [])
            count += sum(word.split('/')[0] in FOLDERS for word in words_of(text))
        self.assertGreater(count, 50)

    def test_links_lead_somewhere(self):
        for document in DOCUMENTS:
            with self.subTest(document=document):
                self.assertEqual(broken_links(document, read(document)), [])

    def test_what_is_missing_is_found(self):
        text = 'See `src/no_such/file.cpp`, `mapper.cpp --fast` and `scripts/demo`.\n```sh\nscripts/nothing --here\n```\n'
        self.assertEqual(missing_paths(text), ['scripts/nothing', 'src/no_such/file.cpp', 'mapper.cpp'])
        self.assertEqual(missing_paths('`free_space/registry.cpp`, `src/update`, `config/presets/NAME.yaml`'), [])
        text = '# A heading: one\n[a](#a-heading-one) [b](#two) [c](docs/ros.md) [d](docs/none.md) [e](docs/ros.md#none)'
        self.assertEqual(broken_links('README.md', text), ['#two', 'docs/none.md', 'docs/ros.md#none'])

    def test_changelog_begins_with_the_version_of_the_package(self):
        version = xml.etree.ElementTree.parse(os.path.join(ROOT, 'package.xml')).findtext('version')
        releases = re.findall(r'^## \[(.*?)\](.*)$', read('CHANGELOG.md'), re.MULTILINE)
        released = [release for release in releases if release[0] != 'Unreleased']
        self.assertEqual(released[0][0], version)
        self.assertRegex(released[0][1], r'^ - \d{4}-\d{2}-\d{2}$')


if __name__ == '__main__':
    unittest.main()
