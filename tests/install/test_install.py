# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed development files: headers that stand for themselves, a CMake package, no CGAL.

Installs the component "development" of the build folder into a temporary prefix, copies the example out of the tree,
builds it there, and runs it against a real daemon. PMCD_BUILD_DIR, PMCD_CMAKE and PMCD_CXX are set by ctest.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

_ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(_ROOT / "tests" / "integration"))
import house  # noqa: E402

_BUILD = pathlib.Path(os.environ.get("PMCD_BUILD_DIR", ""))
_CMAKE = os.environ.get("PMCD_CMAKE", "cmake")
_CXX = os.environ.get("PMCD_CXX", "c++")
_GPL = re.compile(r"cgal|gmp|mpfr", re.IGNORECASE)
_PUBLIC = {
    "client": {"address.h", "backoff.h", "fetch.h", "result.h", "session.h"},
    "codec": {"decoder.h", "encoder.h", "lattice/lattice.h", "lattice/unit.h", "mesh/triangle_mesh.h",
              "packet/crc32c.h", "packet/directory.h", "packet/error_value.h", "packet/header.h", "proof.h", "result.h"},
    "proto": {"bytes.h", "codes.h", "frame.h", "mesh_list.h", "messages.h", "result.h", "text.h"},
}


def check(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=300, check=False,
                          **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}")
    return done.stdout


class Installed(house.HouseTest):
    """One installation and one build for all tests: they take the longest."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="pmcd-install-")
        cls.addClassCleanup(folder.cleanup)
        cls.place = pathlib.Path(folder.name)
        cls.prefix = cls.place / "prefix"
        check(_CMAKE, "--install", _BUILD, "--prefix", cls.prefix, "--component", "development")
        shutil.copytree(_ROOT / "examples" / "fetch_levels", cls.place / "example")
        # No ccache and nothing of the environment: what a stranger has.
        check(_CMAKE, "-G", "Ninja", "-S", cls.place / "example", "-B", cls.place / "build",
              f"-DCMAKE_PREFIX_PATH={cls.prefix}", f"-DCMAKE_CXX_COMPILER={_CXX}", "-DCMAKE_BUILD_TYPE=Release",
              "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
        check(_CMAKE, "--build", cls.place / "build")
        cls.example = cls.place / "build" / "fetch_levels"

    def files(self, folder):
        return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}

    def test_the_public_headers_and_no_others(self):
        include = self.prefix / "include" / "pmcd"
        self.assertEqual(self.files(include), {f"{room}/{name}" for room, names in _PUBLIC.items() for name in names})
        self.assertEqual(self.files(self.prefix / "include"), {f"pmcd/{name}" for name in self.files(include)})

    def test_libraries_and_package(self):
        names = {path.name for path in self.prefix.rglob("*") if path.is_file() and "include" not in path.parts}
        self.assertLessEqual({"libpmcd_client.a", "libpmcd_codec.a", "libpmcd_proto.a", "pmcd-config.cmake",
                              "pmcd-config-version.cmake", "pmcd-targets.cmake"}, names)
        self.assertNotIn("pmctool", names, "programs are another component")
        for path in self.prefix.rglob("*.cmake"):
            text = path.read_text(encoding="utf-8")
            self.assertNotIn(str(_ROOT), text, path)
            self.assertNotIn("Boost", text, path)

    def test_each_header_stands_for_itself(self):
        source = self.place / "headers.cpp"
        for room, names in _PUBLIC.items():
            for name in sorted(names):
                source.write_text(f"#include <pmcd/{room}/{name}>\n", encoding="ascii")
                check(_CXX, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-I", self.prefix / "include",
                      "-I", self.prefix / "include" / "pmcd", source)

    def test_nothing_of_the_source_tree_was_used(self):
        commands = (self.place / "build" / "compile_commands.json").read_text(encoding="utf-8")
        self.assertIn(str(self.prefix), commands)
        self.assertNotIn(str(_ROOT), commands)

    def test_another_minor_version_is_refused(self):
        wrong = self.place / "wrong"
        wrong.mkdir()
        (wrong / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.23)\nproject(wrong LANGUAGES CXX)\n"
                                              "find_package(pmcd 0.2 REQUIRED)\n", encoding="ascii")
        done = subprocess.run([_CMAKE, "-S", wrong, "-B", wrong / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}"],
                              capture_output=True, text=True, timeout=300, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r'compatible\s+with\s+requested\s+version\s+"0\.2"')

    def test_no_cgal_in_the_link_line_or_the_program(self):
        statement = check("ninja", "-C", self.place / "build", "-t", "commands", "fetch_levels")
        self.assertIn("libpmcd_client.a", statement)
        self.assertNotRegex(statement, _GPL)
        self.assertNotRegex(check("ldd", self.example), _GPL)

    def test_the_example_against_a_daemon(self):
        daemon = self.start_daemon()
        mesh = house.write_ply(self.folder / "torus.ply", house.torus(40, 20, wobble=0.1))
        self.ingest(daemon, mesh, "--name", "torus")
        packets = self.folder / "torus.pmcd"
        self.tool("encode", mesh, packets)
        levels = self.json_of("info", packets)["levels"]

        lines = check(self.example, daemon.address, "torus").splitlines()
        self.assertEqual(lines[0], f"{len(levels)} levels, lossless")
        rows = [line.split() for line in lines[2:-1]]
        so_far = 0
        for level, row in zip(levels, rows, strict=True):
            so_far += level["bytes"]
            self.assertEqual(list(map(int, row[:4])), [level["level"], so_far, level["vertices"], level["faces"]])
        self.assertEqual(lines[-1], f"{so_far} bytes came, the line was lost 0 times")
        # 4 pi^2 times the radii 3 and 1, a little less because it is made of triangles and more because it wobbles.
        self.assertAlmostEqual(float(rows[-1][4]), 118.4, delta=6)

        done = subprocess.run([self.example, daemon.address, "nothing"], capture_output=True, text=True, timeout=60,
                              check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("unknown_mesh", done.stderr)


if __name__ == "__main__":
    unittest.main()
