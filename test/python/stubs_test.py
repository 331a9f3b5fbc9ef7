#!/usr/bin/env python3
"""The type stubs name what the module has, with the same arguments; everything has a help text."""
import ast
import inspect
import re
import unittest

import bki_mapping


def stub_of(path):
    with open(path) as file:
        return ast.parse(file.read())


def arguments_of(function):
    """Names of the arguments of a function of the stub, and which of them have defaults."""
    own = [argument.arg for argument in function.args.args]
    optional = own[len(own) - len(function.args.defaults):]
    return own, optional, function.args.kwarg is not None


def signature_of(function):
    """The same of a function of the module, from the first line of its text, which pybind11 writes."""
    listed = re.match(r'\w+\((.*)\) -> ', inspect.getdoc(function)).group(1)
    parts, depth = [''], 0
    for character in listed:
        depth += (character in '([{') - (character in ')]}')
        if character == ',' and depth == 0:
            parts.append('')
        else:
            parts[-1] += character
    names = [re.match(r'\s*(\*{0,2}\w+)', part).group(1) for part in parts if part.strip()]
    optional = [name for name, part in zip(names, parts) if ' = ' in part]
    takes_more = '**kwargs' in names
    return [name for name in names if name != '**kwargs'], optional, takes_more


def help_of(thing):
    """The help text without the signature."""
    return re.sub(r'^\w+\(.*\) -> .*\n*', '', inspect.getdoc(thing) or '')


class Stubs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        body = stub_of(re.sub('py$', 'pyi', bki_mapping.__file__)).body
        cls.constants = {node.target.id for node in body if isinstance(node, ast.AnnAssign)}
        cls.classes = {node.name: node for node in body if isinstance(node, ast.ClassDef)}
        cls.functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}

    def test_names(self):
        self.assertEqual(self.constants | set(self.classes) | set(self.functions), set(bki_mapping.__all__))
        self.assertEqual({name for name in dir(bki_mapping._core) if not name.startswith('_')}, set(bki_mapping.__all__))
        self.assertLessEqual(set(bki_mapping.__all__), set(dir(bki_mapping)))
        for name in self.constants:
            self.assertIsInstance(getattr(bki_mapping, name), (int, float))

    def test_functions(self):
        for name, node in self.functions.items():
            self.assertEqual(arguments_of(node), signature_of(getattr(bki_mapping, name)), name)
            self.assertGreater(len(help_of(getattr(bki_mapping, name))), 20, name)

    def test_classes(self):
        count = 0
        for name, node in self.classes.items():
            own = getattr(bki_mapping, name)
            if issubclass(own, Exception):
                self.assertEqual([base.id for base in node.bases], [base.__name__ for base in own.__bases__])
                continue
            self.assertGreater(len(help_of(own)), 10, name)
            functions = {each.name: each for each in node.body}
            public = {each for each in vars(own) if not each.startswith('_')}
            self.assertEqual({each for each in functions if not each.startswith('_')}, public, name)
            for each, function in functions.items():
                count += 1
                member = inspect.getattr_static(own, each)
                with self.subTest(member=f'{name}.{each}'):
                    is_property = [decorator.id for decorator in function.decorator_list] == ['property']
                    self.assertEqual(is_property, isinstance(member, property))
                    if each not in ('__contains__', '__len__', '__iter__', '__getitem__'):
                        self.assertGreater(len(help_of(member)), 10)
                    if not is_property and each not in ('__len__', '__iter__'):
                        self.assertEqual(arguments_of(function), signature_of(getattr(own, each)))
        self.assertGreater(count, 60)


if __name__ == '__main__':
    bki_mapping.SemanticMapper  # loads the module
    unittest.main()
