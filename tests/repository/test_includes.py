# SPDX-License-Identifier: MIT
"""The walls between the rooms, read from the #include lines: a room includes only what stands below it.

Three walls matter most: the codec's core, the protocol and the scheduler know nothing but the C++ standard library
and themselves; the network code knows no rule; nobody but codec/import knows CGAL.
"""

import dataclasses
import re
import unittest

import tree
from scratch import ScratchTree

# The C++20 standard headers that neither do input or output nor know threads or files.
_PURE = frozenset("""
algorithm any array atomic bit bitset cassert cerrno cfenv cfloat charconv chrono cinttypes climits cmath compare
complex concepts coroutine cstdarg cstddef cstdint cstdlib cstring ctime cctype deque exception execution forward_list
functional initializer_list iterator limits list map memory memory_resource new numbers numeric optional queue random
ranges ratio set source_location span stack stdexcept string string_view tuple type_traits typeindex typeinfo
unordered_map unordered_set utility valarray variant vector version
""".split())


@dataclasses.dataclass(frozen=True)
class Room:
    folder: str
    own: tuple  # prefixes of this project's headers that it may include
    not_own: tuple = ()  # and prefixes that it may not, although one of `own` covers them
    foreign: tuple = ()  # prefixes of other headers that it may include; "" means all but CGAL
    may_use_cgal: bool = False


# The first room that holds a file decides.
_ROOMS = [
    Room("codec/import", own=("codec/",), foreign=("",), may_use_cgal=True),
    Room("codec", own=("codec/",), not_own=("codec/import/",)),
    Room("proto", own=("proto/",)),
    # Rules know requests and clients, but neither the queue nor the policy that chose them.
    Room("daemon/scheduler/rules", own=("daemon/scheduler/rules/", *("daemon/scheduler/" + name for name in (
        "rule.h", "keyed_rule.h", "request.h", "clients.h", "mesh_profile.h", "key_map.h", "sorted_blocks.h",
        "virtual_server.h", "words.h")))),
    Room("daemon/scheduler", own=("daemon/scheduler/",)),
    Room("daemon/turns", own=("daemon/turns/", "daemon/scheduler/"), not_own=("daemon/scheduler/rules/",)),
    Room("daemon/store", own=("daemon/store/", "proto/", "codec/packet/", "codec/result.h"), foreign=("",)),
    Room("daemon/net", own=("daemon/", "proto/", "codec/packet/", "codec/result.h"),
         not_own=("daemon/scheduler/rules/",), foreign=("",)),
    Room("daemon", own=("daemon/", "proto/", "codec/packet/", "codec/result.h"), foreign=("",)),
    Room("client/tool", own=("client/", "codec/", "proto/"), foreign=("",)),
    Room("client", own=("client/", "codec/", "proto/"), not_own=("client/tool/", "codec/import/"), foreign=("",)),
    Room("admin-cli", own=("admin-cli/", "client/", "codec/", "proto/"), not_own=("client/tool/",), foreign=("",)),
    Room("examples", own=(), foreign=("",)),  # a stranger's programs: nothing but what is installed
    Room("sim", own=("sim/", "daemon/scheduler/", "daemon/turns/"), foreign=("",)),
    Room("bench", own=("",), not_own=("tests/",), foreign=("",)),
    Room("tests", own=("",), not_own=("bench/",), foreign=("",), may_use_cgal=True),
]
_CGAL = re.compile(r"^(CGAL/|gmp|mpfr)")
_CLOCK = re.compile(r"_clock\s*::\s*now\b|\btime\s*\(\s*(?:nullptr|NULL|0)\s*\)|\bclock_gettime\b")


def _starts(header, prefixes):
    return any(header.startswith(prefix) for prefix in prefixes)


def _complaint(room, bracket, header, own_folders):
    if bracket == '"' or header.split("/")[0] in own_folders:
        if not _starts(header, room.own) or _starts(header, room.not_own):
            return f"{room.folder} may not include {header}"
    elif _CGAL.match(header):
        if not room.may_use_cgal:
            return f"only codec/import may include {header}"
    elif header not in _PURE and not _starts(header, room.foreign):
        return f"{room.folder} may not include <{header}>"
    return None


def complaints(root):
    own_folders = {room.folder.split("/")[0] for room in _ROOMS}
    found = []
    for path in tree.cpp_files(root):
        source = tree.text(root, path)
        room = next((room for room in _ROOMS if tree.inside(path, room.folder)), None)
        if room is None:
            found.append(f"{path}: stands in no room")
            continue
        for bracket, header in tree.includes(source):
            complaint = _complaint(room, bracket, header, own_folders)
            if complaint:
                found.append(f"{path}: {complaint}")
        for folder in ("daemon/scheduler", "daemon/turns"):
            if tree.inside(path, folder) and _CLOCK.search(source):
                found.append(f"{path}: {folder} has no clock of its own")
        if path.suffix == ".h" and "#pragma once" not in source:
            found.append(f"{path}: no #pragma once")
    return found


class Includes(unittest.TestCase):
    def test_this_tree(self):
        self.assertEqual(complaints(tree.ROOT), [])

    def test_the_rooms_are_looked_at(self):
        """A wall round an empty room proves nothing: the parser has to find the includes that are there."""
        for folder in ("codec", "proto", "daemon/scheduler", "daemon/turns", "client"):
            found = [header for path in tree.cpp_files(tree.ROOT) if tree.inside(path, folder)
                     for _, header in tree.includes(tree.text(tree.ROOT, path))]
            self.assertGreater(len(found), 5, folder)


class IncludeCheck(ScratchTree):
    def refuse(self, path, *lines):
        self.write(path, "#pragma once\n" + "\n".join(lines) + "\n")
        self.assertEqual(len(complaints(self.root)), len(lines), complaints(self.root))

    def accept(self, path, *lines):
        self.write(path, "#pragma once\n" + "\n".join(lines) + "\n")
        self.assertEqual(complaints(self.root), [])

    def test_codec_core(self):
        self.accept("codec/mesh/a.h", "#include <vector>", '#include "codec/result.h"')
        self.refuse("codec/mesh/a.h", "#include <iostream>", "#include <fstream>", "#include <cstdio>",
                    "#include <thread>", "#include <sys/socket.h>", "#include <boost/asio.hpp>",
                    '#include "codec/import/reader.h"', '#include "proto/frame.h"', "#include <codec/import/reader.h>",
                    "  #  include <mutex>")

    def test_proto(self):
        self.accept("proto/a.h", "#include <span>", '#include "proto/frame.h"')
        self.refuse("proto/a.h", '#include "codec/result.h"', "#include <netinet/in.h>", '#include "frame.h"')

    def test_scheduler(self):
        self.accept("daemon/scheduler/a.h", "#include <chrono>", '#include "daemon/scheduler/rules/fifo.h"')
        self.refuse("daemon/scheduler/a.h", '#include "daemon/store/store.h"', '#include "daemon/net/session.h"',
                    "#include <sqlite3.h>", "auto now = std::chrono::steady_clock::now();")

    def test_turns(self):
        self.accept("daemon/turns/a.h", "#include <chrono>", '#include "daemon/scheduler/scheduler.h"')
        self.refuse("daemon/turns/a.h", '#include "daemon/scheduler/rules/fifo.h"', '#include "daemon/net/session.h"',
                    "#include <boost/asio.hpp>", "auto now = std::chrono::steady_clock::now();")

    def test_rules_know_only_the_request_view(self):
        self.accept("daemon/scheduler/rules/a.h", '#include "daemon/scheduler/rule.h"')
        self.refuse("daemon/scheduler/rules/a.h", '#include "daemon/scheduler/scheduler.h"')

    def test_net_knows_no_rule(self):
        self.accept("daemon/net/a.cpp", '#include "daemon/scheduler/scheduler.h"', "#include <boost/asio.hpp>")
        self.refuse("daemon/net/a.cpp", '#include "daemon/scheduler/rules/fifo.h"', '#include "codec/decoder.h"')

    def test_only_import_uses_cgal(self):
        self.accept("codec/import/a.cpp", "#include <CGAL/Surface_mesh.h>")
        for folder in ("codec/mesh", "proto", "client", "client/tool", "daemon", "admin-cli", "bench/codec"):
            self.write(f"{folder}/b.cpp", "#include <CGAL/Surface_mesh.h>\n#include <gmp.h>\n")
        self.assertEqual(len(complaints(self.root)), 14)

    def test_client_without_import(self):
        self.accept("client/tool/a.cpp", '#include "codec/import/reader.h"')
        self.refuse("client/a.cpp", '#include "codec/import/reader.h"', '#include "client/tool/encode.h"',
                    '#include "daemon/store/store.h"')

    def test_file_outside_the_rooms(self):
        self.write("helpers/a.cpp", "")
        self.assertEqual(complaints(self.root), ["helpers/a.cpp: stands in no room"])

    def test_header_without_guard(self):
        self.write("proto/a.h", "#include <span>\n")
        self.assertEqual(complaints(self.root), ["proto/a.h: no #pragma once"])


if __name__ == "__main__":
    unittest.main()
