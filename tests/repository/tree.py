# SPDX-License-Identifier: MIT
"""The files of a source tree, for the checks beside this file: which there are, and what they include.

It reads the tree as it lies on the disk; it neither asks git nor looks at what was built.
"""

import os
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

_SKIPPED_FOLDERS = {".git", "build", "__pycache__", "node_modules", ".cache"}
_SOURCE_SUFFIXES = {".h", ".cpp", ".py", ".sh", ".cmake", ".sql", ".js", ".ts", ".html", ".css"}
_INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def files(root):
    """Paths of all files, relative to `root`, sorted."""
    found = []
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if name not in _SKIPPED_FOLDERS]
        found += [pathlib.Path(folder, name).relative_to(root) for name in names]
    return sorted(found)


def is_script(root, path):
    with open(root / path, "rb") as file:
        return file.read(2) == b"#!"


def sources(root):
    """The files that people write code in: by their suffix, or by a #! in a file without one."""
    return [path for path in files(root)
            if path.suffix in _SOURCE_SUFFIXES or path.name == "CMakeLists.txt"
            or (not path.suffix and is_script(root, path))]


def cpp_files(root):
    return [path for path in files(root) if path.suffix in (".h", ".cpp")]


def text(root, path):
    """The file's text, or None for a binary one."""
    try:
        return (root / path).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None


def includes(source):
    """The (bracket, header) pairs of a C++ source, in order; bracket is '<' or '"'."""
    return _INCLUDE.findall(source)


def inside(path, folder):
    """Is `path` in `folder` or below?"""
    return pathlib.PurePath(folder) in path.parents
