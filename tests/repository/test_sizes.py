# SPDX-License-Identifier: MIT
"""One concept a file: a source file of over 500 lines needs a reason, and the reason stands here."""

import unittest

import tree
from scratch import ScratchTree

_MOST_LINES = 500
# path: why it is better long. An entry that is no longer needed is a failure too.
_REASONS = {}


def complaints(root, reasons):
    found = []
    for path in tree.sources(root):
        lines = len(tree.text(root, path).splitlines())
        if lines > _MOST_LINES and str(path) not in reasons:
            found.append(f"{path}: {lines} lines")
        if lines <= _MOST_LINES and str(path) in reasons:
            found.append(f"{path}: {lines} lines, needs no reason any more")
    found += [f"{path}: has a reason, but does not exist" for path in reasons if not (root / path).is_file()]
    return found


class Sizes(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT, _REASONS), [])


class SizeCheck(ScratchTree):
    def test_limit(self):
        self.write("codec/a.cpp", "x\n" * 500)
        self.assertEqual(complaints(self.root, {}), [])
        self.write("codec/b.cpp", "x\n" * 501)
        self.assertEqual(complaints(self.root, {}), ["codec/b.cpp: 501 lines"])
        self.assertEqual(complaints(self.root, {"codec/b.cpp": "a table"}), [])

    def test_stale_reasons(self):
        self.write("codec/a.cpp", "x\n")
        self.assertEqual(complaints(self.root, {"codec/a.cpp": "was long", "codec/gone.cpp": "was there"}),
                         ["codec/a.cpp: 1 lines, needs no reason any more",
                          "codec/gone.cpp: has a reason, but does not exist"])


if __name__ == "__main__":
    unittest.main()
