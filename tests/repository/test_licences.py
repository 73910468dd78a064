# SPDX-License-Identifier: MIT
"""Each source file names its licence in its first lines, and the right one for its room.

What links codec/import (CGAL's mesh processing is GPL) is GPL-3.0-or-later; what others link is MIT; tests and
helpers may be either.
"""

import re
import unittest

import tree
from scratch import ScratchTree

_EITHER = ("MIT", "GPL-3.0-or-later")
# The first folder that holds a file decides.
_ROOMS = [
    ("codec/import", ("GPL-3.0-or-later",)),
    ("codec", ("MIT",)),
    ("proto", ("MIT",)),
    ("client/tool", ("GPL-3.0-or-later",)),
    ("client", ("MIT",)),
    ("examples", ("MIT",)),
    ("web", ("MIT",)),
    ("daemon", ("MIT",)),
    ("sim", ("MIT",)),
    ("admin-cli", ("GPL-3.0-or-later",)),
]
_SPDX = re.compile(r"SPDX-License-Identifier: (\S+)")


def allowed_licences(path):
    return next((licences for folder, licences in _ROOMS if tree.inside(path, folder)), _EITHER)


def complaints(root):
    found = []
    for path in tree.sources(root):
        lines = tree.text(root, path).splitlines()
        # A #! line has to be the first; then the licence is the second.
        first = lines[1:2] if lines and lines[0].startswith("#!") else lines[:1]
        match = _SPDX.search(first[0]) if first else None
        if not match:
            found.append(f"{path}: no SPDX-License-Identifier in the first line")
        elif match[1] not in allowed_licences(path):
            found.append(f"{path}: {match[1]}, but here it must be {' or '.join(allowed_licences(path))}")
        elif path.suffix in (".h", ".cpp") and not first[0].startswith("// SPDX"):
            found.append(f"{path}: the licence line does not start with // SPDX")
    for _, licences in _ROOMS:
        for licence in licences:
            if not (root / "LICENSES" / f"{licence}.txt").is_file():
                found.append(f"LICENSES/{licence}.txt is missing")
    return sorted(set(found))


class Licences(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT), [])


class LicenceCheck(ScratchTree):
    def setUp(self):
        super().setUp()
        for licence in _EITHER:
            self.write(f"LICENSES/{licence}.txt", "text\n")

    def test_right_licences_pass(self):
        self.write("codec/a.h", "// SPDX-License-Identifier: MIT\n")
        self.write("codec/import/a.h", "// SPDX-License-Identifier: GPL-3.0-or-later\n")
        self.write("client/tool/a.cpp", "// SPDX-License-Identifier: GPL-3.0-or-later\n")
        self.write("scripts/run", "#!/bin/sh\n# SPDX-License-Identifier: MIT\n")
        self.assertEqual(complaints(self.root), [])

    def test_missing_line(self):
        self.write("codec/a.h", "#pragma once\n")
        self.write("codec/empty.h", "")
        self.assertEqual(complaints(self.root), ["codec/a.h: no SPDX-License-Identifier in the first line",
                                                 "codec/empty.h: no SPDX-License-Identifier in the first line"])

    def test_line_too_late(self):
        self.write("proto/a.h", "#pragma once\n// SPDX-License-Identifier: MIT\n")
        self.assertEqual(len(complaints(self.root)), 1)

    def test_gpl_in_a_library_that_others_link(self):
        self.write("codec/mesh/a.cpp", "// SPDX-License-Identifier: GPL-3.0-or-later\n")
        self.assertEqual(complaints(self.root), ["codec/mesh/a.cpp: GPL-3.0-or-later, but here it must be MIT"])

    def test_mit_beside_cgal(self):
        self.write("codec/import/a.cpp", "// SPDX-License-Identifier: MIT\n")
        self.write("admin-cli/a.cpp", "// SPDX-License-Identifier: MIT\n")
        self.assertEqual(len(complaints(self.root)), 2)

    def test_another_licence(self):
        self.write("tests/a.py", "# SPDX-License-Identifier: Apache-2.0\n")
        self.assertEqual(len(complaints(self.root)), 1)

    def test_missing_licence_text(self):
        (self.root / "LICENSES/MIT.txt").unlink()
        self.assertEqual(complaints(self.root), ["LICENSES/MIT.txt is missing"])


if __name__ == "__main__":
    unittest.main()
