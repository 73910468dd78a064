# SPDX-License-Identifier: MIT
"""What the documents point at is there: links inside the tree, and the commands that a reader is told to run."""

import os
import re
import unittest

import tree
from scratch import ScratchTree

_LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)(?:#[^)]*)?\)")
_COMMAND = re.compile(r"(?:^|[\s`])(?:\./)?((?:scripts|bench|\.ci)/[\w./-]+)", re.MULTILINE)


def complaints(root):
    found = []
    for path in tree.files(root):
        if path.suffix != ".md":
            continue
        content = tree.text(root, path)
        for target in _LINK.findall(content):
            if "://" not in target and not (root / path.parent / target).exists():
                found.append(f"{path}: links to {target}, which is not there")
        for command in _COMMAND.findall(content):
            file = root / command.rstrip(".")
            if not file.exists():
                found.append(f"{path}: names {command}, which is not there")
            elif file.is_file() and tree.is_script(root, file) and not os.access(file, os.X_OK):
                found.append(f"{path}: names {command}, which cannot be run")
    return found


class Documents(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT), [])

    def test_the_readme_is_looked_at(self):
        readme = tree.text(tree.ROOT, "README.md")
        self.assertIn("scripts/demo", _COMMAND.findall(readme))
        self.assertIn("scripts/test", _COMMAND.findall(readme))
        self.assertIn("HACKING.md", _LINK.findall(readme))


class DocumentCheck(ScratchTree):
    def test_links(self):
        self.write("docs/A.md", "[up](../README.md), [web](https://example.org/x), [part](B.md#chapter)\n")
        self.assertEqual(complaints(self.root), ["docs/A.md: links to ../README.md, which is not there",
                                                 "docs/A.md: links to B.md, which is not there"])
        self.write("README.md", "text\n")
        self.write("docs/B.md", "# Chapter\n")
        self.assertEqual(complaints(self.root), [])

    def test_commands(self):
        self.write("README.md", "    ./scripts/run --fast\n")
        self.assertEqual(complaints(self.root), ["README.md: names scripts/run, which is not there"])
        self.write("scripts/run", "#!/bin/sh\n")
        self.assertEqual(complaints(self.root), ["README.md: names scripts/run, which cannot be run"])
        (self.root / "scripts/run").chmod(0o755)
        self.assertEqual(complaints(self.root), [])


if __name__ == "__main__":
    unittest.main()
