# SPDX-License-Identifier: MIT
"""No file names a folder of somebody's machine, a folder outside the tree, or the host of a package registry.

Only .ci/run may name the folder of test meshes beside the tree. The patterns are written so that this file does not
match itself.
"""

import re
import unittest

import tree
from scratch import ScratchTree

_PATTERNS = [
    ("a machine's folder", re.compile(r"(?<![\w.])/(?:wor[k]|roo[t]|hom[e]|User[s])/")),
    ("a folder outside the tree", re.compile(r"\.\./share[d]")),
    ("a registry's host", re.compile(r"\b(?:de[b]|securit[y])\.debian\.org|registr[y]\.npmjs|\bpyp[i]\.org"
                                     r"|\bcrate[s]\.io")),
]
_MAY_NAME_MESHES = ".ci/run"


def complaints(root):
    found = []
    for path in tree.files(root):
        content = tree.text(root, path)
        if content is None:
            continue
        for number, line in enumerate(content.splitlines(), 1):
            for what, pattern in _PATTERNS:
                if what == "a folder outside the tree" and str(path) == _MAY_NAME_MESHES:
                    continue
                match = pattern.search(line)
                if match:
                    found.append(f"{path}:{number}: {what}: {match[0]}")
    return found


class Names(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT), [])


class NameCheck(ScratchTree):
    def test_machine_folders(self):
        for folder in ("work", "root", "home", "Users"):
            self.write(f"codec/{folder}.cpp", f'open("/{folder}/me/bunny.off");\n')
        self.assertEqual(len(complaints(self.root)), 4)

    def test_place_is_told(self):
        self.write("docs/A.md", "fine\nsee /" + "work/main\n")
        self.assertEqual(complaints(self.root), ["docs/A.md:2: a machine's folder: /" + "work/"])

    def test_outside_folder_only_in_ci(self):
        line = "meshes=.." + "/shared/meshes\n"
        self.write(".ci/run", line)
        self.assertEqual(complaints(self.root), [])
        self.write("scripts/test", line)
        self.assertEqual(len(complaints(self.root)), 1)

    def test_registry_hosts(self):
        for number, host in enumerate(("deb" + ".debian.org", "registry" + ".npmjs.org", "pypi" + ".org")):
            self.write(f"scripts/{number}", f"fetch https://{host}/x\n")
        self.assertEqual(len(complaints(self.root)), 3)

    def test_urls_and_words_pass(self):
        self.write("README.md", "network/work/flow, https://example.org/home/page, ${root}/x, build/root/\n")
        self.assertEqual(complaints(self.root), [])

    def test_binary_files_pass(self):
        (self.root / "golden.bin").write_bytes(b"\xff\xfe/" + b"work/")
        self.assertEqual(complaints(self.root), [])


if __name__ == "__main__":
    unittest.main()
