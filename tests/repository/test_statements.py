# SPDX-License-Identifier: MIT
"""The numbered statements of docs/PROTOCOL.md: each is defined once and named by a test, and no test names another.

Also that docs/protocol.ksy has the document's types and codes. It reads text; whether a test really checks what it
names is for its reviewers.
"""

import re
import unittest

import tree
from scratch import ScratchTree

_DOCUMENT, _KAITAI = "docs/PROTOCOL.md", "docs/protocol.ksy"
_DEFINITION = re.compile(r"^\*\*([A-Z]-\d+)\*\*", re.MULTILINE)
_TEST_FILE = re.compile(r"(?:^|/)(?:\w+_test\.cpp|test_\w+\.py|\w+_test\.py|check_\w+\.py|scenarios/\w+\.json)$")
_MESSAGE = re.compile(r"^\| (0x[0-9a-f]{4}) \| (\w+) \|", re.MULTILINE)
_CODE = re.compile(r"^\| (\d+) \| (\w+) \| (?:session|request|mesh) \|", re.MULTILINE)


def marks_in(text, letters):
    """The marks that a text names as words, of statements with these letters."""
    return set(re.findall(rf"(?<![\w-])([{letters}]-\d+)(?![\w-])", text)) if letters else set()


def _enum(kaitai, name):
    """{name: number} of an enum of the .ksy, in whose regular form a line is one entry."""
    block = re.search(rf"^  {name}:\n((?:    .*\n)+)", kaitai, re.MULTILINE)
    lines = re.findall(r"^    (\w+): (\w+)$", block[1], re.MULTILINE) if block else []
    return {word: int(number, 0) for number, word in lines}


def _differences(what, document, kaitai):
    return [f"{_KAITAI}: {what} {name}: {kaitai.get(name)}, {_DOCUMENT} has {document.get(name)}"
            for name in sorted(document | kaitai) if document.get(name) != kaitai.get(name)]


def complaints(root):
    document, found = tree.text(root, _DOCUMENT), []
    defined = _DEFINITION.findall(document)
    found += [f"{_DOCUMENT}: {mark} is defined more than once" for mark in sorted(set(defined))
              if defined.count(mark) > 1]
    letters = "".join(sorted({mark[0] for mark in defined}))
    found += [f"{_DOCUMENT}: names {mark}, which is not defined"
              for mark in sorted(marks_in(document, letters) - set(defined))]

    named = set()
    for path in tree.files(root):
        content = tree.text(root, path) if tree.inside(path, "tests") else None
        if content is None or path.name == "test_statements.py":
            continue
        here = marks_in(content, letters)
        found += [f"{path}: names {mark}, which is not defined" for mark in sorted(here - set(defined))]
        if _TEST_FILE.search(path.as_posix()):
            named |= here
    found += [f"{_DOCUMENT}: no test names {mark}" for mark in sorted(set(defined) - named)]

    kaitai = tree.text(root, _KAITAI)
    found += _differences("type", {name: int(number, 16) for number, name in _MESSAGE.findall(document)},
                          _enum(kaitai, "message_type"))
    found += _differences("code", {name: int(number) for number, name in _CODE.findall(document)} | {"none": 0},
                          _enum(kaitai, "code"))
    cases = set(re.findall(r"^            message_type::(\w+): \1$", kaitai, re.MULTILINE))
    found += [f"{_KAITAI}: type {name} has no body" for name in sorted(set(_enum(kaitai, "message_type")) - cases)]
    return found


class Statements(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT), [])

    def test_the_document_is_looked_at(self):
        document = tree.text(tree.ROOT, _DOCUMENT)
        self.assertGreater(len(_DEFINITION.findall(document)), 50)
        self.assertGreater(len(_MESSAGE.findall(document)), 25)
        self.assertGreater(len(_CODE.findall(document)), 25)


class StatementCheck(ScratchTree):
    def setUp(self):
        super().setUp()
        self.write(_DOCUMENT, "**F-1** one\nand F-2 too\n\n**F-2** two\n\n| 0x0001 | hello | C |\n| 4 | bad | session | x |\n")
        self.write(_KAITAI, "enums:\n  message_type:\n    0x0001: hello\n  code:\n    0: none\n    4: bad\n"
                            "            message_type::hello: hello\n")
        self.write("tests/a/frame_test.cpp", "// F-1\n")
        self.write("tests/conformance/check_frames.py", '@checks("F-2")\n')

    def test_right_tree(self):
        self.assertEqual(complaints(self.root), [])

    def test_no_test(self):
        self.write("tests/conformance/check_frames.py", "# F-20x UTF-2 F-2-1\n")
        self.write("tests/conformance/README.md", "F-2\n")
        self.assertEqual(complaints(self.root), [f"{_DOCUMENT}: no test names F-2"])

    def test_a_scenario_is_a_test(self):
        self.write("tests/conformance/check_frames.py", "\n")
        self.write("tests/conformance/scenarios/a.json", '{"marks": ["F-2"]}\n')
        self.assertEqual(complaints(self.root), [])

    def test_unknown_marks(self):
        self.write("tests/a/frame_test.cpp", "// F-1, F-3; X-1 is no letter of ours\n")
        self.assertEqual(complaints(self.root), ["tests/a/frame_test.cpp: names F-3, which is not defined"])
        self.write("tests/a/frame_test.cpp", "// F-1\n")
        self.write(_DOCUMENT, tree.text(self.root, _DOCUMENT) + "see F-9\n")
        self.assertEqual(complaints(self.root), [f"{_DOCUMENT}: names F-9, which is not defined"])

    def test_defined_twice(self):
        self.write(_DOCUMENT, tree.text(self.root, _DOCUMENT) + "\n**F-1** again\n")
        self.assertEqual(complaints(self.root), [f"{_DOCUMENT}: F-1 is defined more than once"])

    def test_kaitai(self):
        self.write(_KAITAI, "enums:\n  message_type:\n    0x0002: hello\n    0x0003: more\n  code:\n    0: none\n"
                            "            message_type::hello: hello\n")
        self.assertEqual(complaints(self.root), [f"{_KAITAI}: type hello: 2, {_DOCUMENT} has 1",
                                                 f"{_KAITAI}: type more: 3, {_DOCUMENT} has None",
                                                 f"{_KAITAI}: code bad: None, {_DOCUMENT} has 4",
                                                 f"{_KAITAI}: type more has no body"])


if __name__ == "__main__":
    unittest.main()
