# SPDX-License-Identifier: MIT
"""A source tree made for one test, so that each check is seen to complain about what it exists for."""

import pathlib
import tempfile
import unittest


class ScratchTree(unittest.TestCase):
    """A test with an empty tree in `self.root`; write(path, text) puts a file there."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text, encoding="utf-8")
