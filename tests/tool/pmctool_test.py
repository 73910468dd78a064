#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of pmctool's offline commands. First argument: the binary; PMCD_TEST_MESHES may name a folder of meshes."""

import gzip
import json
import math
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
COMPARER = os.path.join(HERE, "..", "tools", "compare_meshes.py")
BINARY = ""
MESHES = os.environ.get("PMCD_TEST_MESHES", "")


def torus_off(rings, sides):
    positions, faces = [], []
    for r in range(rings):
        for s in range(sides):
            u, v = 2 * math.pi * r / rings, 2 * math.pi * s / sides
            positions.append("%.7g %.7g %.7g" % ((3 + math.cos(v)) * math.cos(u), (3 + math.cos(v)) * math.sin(u),
                                                 math.sin(v)))
            a, b = r * sides + s, (r + 1) % rings * sides + s
            c, d = (r + 1) % rings * sides + (s + 1) % sides, r * sides + (s + 1) % sides
            faces += ["3 %d %d %d" % (a, b, c), "3 %d %d %d" % (a, c, d)]
    return "OFF\n%d %d 0\n" % (len(positions), len(faces)) + "\n".join(positions + faces) + "\n"


class ToolTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="pmctool-test-")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, data):
        with open(self.path(name), "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def tool(self, *arguments, code=0):
        done = subprocess.run([BINARY, *arguments], capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, code, "%s\n%s%s" % (" ".join(arguments), done.stdout, done.stderr))
        return done

    def entries(self):
        return sorted(os.listdir(self.folder))

    def python_says_equal(self, a, b, *options):
        done = subprocess.run([sys.executable, COMPARER, *options, a, b], capture_output=True, text=True, timeout=600,
                              check=False)
        self.assertEqual((done.returncode, done.stdout.strip()), (0, "equal"), done.stdout + done.stderr)


class Usage(ToolTest):
    def test_help_and_version(self):
        self.assertRegex(self.tool("--version").stdout, r"^pmctool \d+\.\d+\.\d+\n$")
        text = self.tool("--help").stdout
        for command in ("encode", "decode", "info", "compare", "list", "fetch"):
            self.assertIn(command, text)
            self.assertIn(command, self.tool(command, "--help").stdout)
        self.assertIn("pmctool encode --bits 12", self.tool("encode", "--help").stdout)

    def test_wrong_usage_ends_with_2(self):
        mesh = self.write("a.off", torus_off(5, 4))
        out = self.path("a.pmcd")
        for arguments in ((), ("frobnicate",), ("encode", mesh), ("encode", mesh, out, "--bits", "3"),
                          ("encode", mesh, out, "--bits", "25"), ("encode", mesh, out, "--levels", "0"),
                          ("encode", mesh, out, "--bits", "many"), ("encode", mesh, out, "--flip-limit", "2"),
                          ("encode", mesh, out, "--shape-limit", "-1"), ("encode", mesh, self.path("b.ply")),
                          ("decode", mesh), ("compare", mesh), ("info",), ("info", "--what", mesh),
                          ("info", "--levels", mesh), ("info", "--levels", "--json", mesh)):
            done = self.tool(*arguments, code=2)
            self.assertEqual(done.stdout, "", arguments)
            self.assertNotEqual(done.stderr, "", arguments)
        self.assertEqual(self.entries(), ["a.off"])


class RoundTrip(ToolTest):
    def test_lossless(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        done = self.tool("encode", mesh, self.path("torus.pmcd"))
        self.assertIn("OFF: 1000 vertices, 2000 faces, coordinates as float32", done.stdout)
        self.assertIn("lossless", done.stdout)
        self.assertRegex(done.stdout, r"encoded in [\d.]+ s .*, proven by decoding in [\d.]+ s, errors measured in [\d.]+ s")
        self.assertEqual(done.stderr, "")
        for name in ("out.ply", "out.obj", "out.off", "out.stl"):
            done = self.tool("decode", self.path("torus.pmcd"), self.path(name))
            self.assertIn("the last level, 1000 vertices, 2000 faces", done.stdout)
            self.assertEqual("note:" in done.stderr, name == "out.stl")
            self.python_says_equal(mesh, self.path(name))
            self.assertIn("same: 1000 vertices", self.tool("compare", mesh, self.path(name)).stdout)
        self.assertIn("same", self.tool("compare", self.path("torus.pmcd"), mesh).stdout)

    def test_info_matches_what_decode_gives(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        self.tool("encode", mesh, self.path("torus.pmcd"))
        info = json.loads(self.tool("info", "--json", self.path("torus.pmcd")).stdout)
        self.assertEqual((info["vertices"], info["faces"], info["lossless"]), (1000, 2000, True))
        self.assertEqual(info["bytes"], len(self.read("torus.pmcd")))
        self.assertIn("format_version", info)
        self.assertRegex(info["generation"], "^[0-9a-f]{16}$")
        self.assertEqual(info["lattice"]["scalar"], "float32")
        self.assertGreater(info["lattice"]["step"], 0)
        levels = info["levels"]
        self.assertGreater(len(levels), 2)
        self.assertEqual([level["level"] for level in levels], list(range(len(levels))))
        self.assertLess(sum(level["bytes"] for level in levels), info["bytes"])
        self.assertEqual((levels[-1]["error_rms"], levels[-1]["error_max"]), (0, 0))
        self.assertGreater(levels[0]["error_max"], levels[-2]["error_max"])
        for level in levels:
            self.assertGreaterEqual(level["error_max"], level["error_rms"])
            self.tool("decode", self.path("torus.pmcd"), self.path("level.ply"), "--level", str(level["level"]))
            head = self.read("level.ply").split(b"end_header")[0].decode()
            self.assertIn("element vertex %d\n" % level["vertices"], head)
            self.assertIn("element face %d\n" % level["faces"], head)
        # What info tells is what compare measures, as close as a directory has it.
        self.tool("decode", self.path("torus.pmcd"), self.path("base.ply"), "--level", "0")
        answer = json.loads(self.tool("compare", "--json", mesh, self.path("base.ply"), code=1).stdout)
        self.assertFalse(answer["same"])
        for name in ("rms", "max"):
            distance = answer["distance"]["a_to_b"][name]
            self.assertAlmostEqual(distance, levels[0]["error_" + name], delta=distance / 2048)
        table = self.tool("info", self.path("torus.pmcd")).stdout
        for level in levels:
            self.assertRegex(table, r"(?m)^ *%d +%d +\d+ +%d +%d +%d " % (level["level"], level["bytes"], level["vertices"],
                                                                         level["faces"], level["bits"]))

    def test_levels_of_a_file(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        self.tool("encode", mesh, self.path("torus.pmcd"), "--bits", "11")
        info = json.loads(self.tool("info", "--json", self.path("torus.pmcd")).stdout)
        levels = json.loads(self.tool("info", "--levels", "--json", self.path("torus.pmcd")).stdout)
        self.assertEqual(levels, info["levels"])
        so_far = 0
        for level in levels:
            so_far += level["bytes"]
            self.assertEqual(level["bytes_so_far"], so_far)
        self.assertEqual(levels[-1]["vertices"], 1000)
        bits = [level["bits"] for level in levels]
        self.assertEqual(bits, sorted(bits))
        self.assertEqual(bits[-1], 11)
        text = self.tool("info", "--levels", self.path("torus.pmcd")).stdout
        head, *lines = text.splitlines()
        self.assertEqual(head.split(), ["level", "bytes", "so", "far", "vertices", "faces", "bits", "rms", "error", "max", "error"])
        self.assertEqual(len(lines), len(levels))
        for line, level in zip(lines, levels):
            *counts, rms, most = line.split()
            self.assertEqual([int(count) for count in counts],
                             [level[name] for name in ("level", "bytes", "bytes_so_far", "vertices", "faces", "bits")])
            self.assertAlmostEqual(float(rms), level["error_rms"], delta=0.01 * level["error_rms"])
            self.assertAlmostEqual(float(most), level["error_max"], delta=0.01 * level["error_max"])
        # The same lines stand in the middle of what info says without it.
        self.assertIn(text, self.tool("info", self.path("torus.pmcd")).stdout)

    def test_where_the_bits_went(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        for options in ((), ("--bits", "10"), ("--double",)):
            with self.subTest(options):
                arguments = ("encode", mesh, self.path("t.pmcd"), "--no-errors", *options)
                text = self.tool(*arguments).stdout
                result = json.loads(self.tool(*arguments, "--json").stdout)
                size = len(self.read("t.pmcd"))
                rows = dict(re.findall(r"(?m)^  (\w[\w ]*?)  +(\d+  +[\d.]+  +[\d.]+ %)$", text))
                bits = result["bits_per_vertex"]
                self.assertEqual(list(rows), ["base mesh", "connectivity", "geometry", "precision", "exactness",
                                              "isolated vertices", "headers and directory", "file"])
                self.assertEqual(rows["file"].split(), [str(size), "%.2f" % (8 * size / 1000), "100.0", "%"])
                for row, value in zip(rows.values(), (bits[key] for key in bits if key != "total")):
                    in_bytes, per_vertex, share, _ = row.split()
                    self.assertAlmostEqual(float(per_vertex), value, delta=0.006)
                    self.assertAlmostEqual(float(in_bytes), 1000 * value / 8, delta=0.6)
                    self.assertAlmostEqual(float(share), 100 * value / bits["total"], delta=0.06)
                self.assertAlmostEqual(sum(bits[key] for key in bits if key != "total"), bits["total"])
                self.assertEqual(bits["exactness"] > 0, "--bits" not in options)
                self.assertEqual(bits["isolated"], 0)
                self.assertGreater(bits["connectivity"], 0)
                self.assertGreater(bits["geometry"], bits["connectivity"])
                scalar, raw = ("float64", 48000) if "--double" in options else ("float32", 36000)
                self.assertEqual(result["raw_bytes"], raw)
                self.assertIn("%.1f %% of plain arrays, %s positions and 32-bit indices (%d bytes): %.1f times smaller"
                              % (100 * size / raw, scalar, raw, raw / size), text)

    def test_a_file_larger_than_its_arrays_says_so(self):
        mesh = self.write("triangle.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        text = self.tool("encode", mesh, self.path("t.pmcd")).stdout
        size = len(self.read("t.pmcd"))
        self.assertGreater(size, 48)
        self.assertIn("%.1f %% of plain arrays, float32 positions and 32-bit indices (48 bytes)\n" % (100 * size / 48), text)

    def test_no_errors(self):
        mesh = self.write("torus.off", torus_off(10, 8))
        done = self.tool("encode", mesh, self.path("t.pmcd"), "--no-errors")
        self.assertRegex(done.stdout, r"encoded in [\d.]+ s .*, proven by decoding in [\d.]+ s\n")
        self.assertNotIn("measured", done.stdout)
        seconds = json.loads(self.tool("encode", mesh, self.path("t.pmcd"), "--no-errors", "--json").stdout)["seconds"]
        self.assertGreater(seconds["prove"], 0)
        self.assertEqual(seconds["measure"], 0)
        info = json.loads(self.tool("info", "--json", self.path("t.pmcd")).stdout)
        self.assertTrue(all(level["error_rms"] is None and level["error_max"] is None for level in info["levels"]))

    def test_bits(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        result = json.loads(self.tool("encode", mesh, self.path("t.pmcd"), "--bits", "10", "--json").stdout)
        self.assertFalse(result["lossless"])
        self.assertEqual(list(result["seconds"]), ["read", "encode", "prove", "measure"])
        self.assertGreater(min(result["seconds"].values()), 0)
        self.assertEqual(result["bytes"], len(self.read("t.pmcd")))
        bits = result["bits_per_vertex"]
        parts = sum(bits[name] for name in bits if name != "total")
        self.assertAlmostEqual(parts, bits["total"])
        info = json.loads(self.tool("info", "--json", self.path("t.pmcd")).stdout)
        self.assertEqual(info["lattice"]["bits"], 10)
        self.assertEqual(info["levels"][-1]["vertices"], 1000)
        # Half a step along each axis is the most that snapping moves a vertex.
        size = [high - low for low, high in zip(info["box_min"], info["box_max"])]
        diagonal = math.sqrt(sum(x * x for x in size))
        self.assertAlmostEqual(info["lattice"]["step"], max(size) / 1023)
        self.assertGreater(info["levels"][-1]["error_max"], 0)
        self.assertLessEqual(info["levels"][-1]["error_max"] * diagonal, info["lattice"]["step"] * math.sqrt(3) / 2 * 1.001)
        self.assertIn("not the same mesh", self.tool("compare", mesh, self.path("t.pmcd"), code=1).stdout)

    def test_effort(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        sizes = {}
        for options in ((), ("--effort", "default"), ("--effort", "best")):
            self.tool("encode", mesh, self.path("t.pmcd"), "--no-errors", *options)
            self.tool("compare", mesh, self.path("t.pmcd"))
            sizes[options[1:]] = len(self.read("t.pmcd"))
        self.assertEqual(sizes[()], sizes[("default",)])
        self.assertLessEqual(sizes[("best",)], sizes[()])
        refused = self.tool("encode", mesh, self.path("u.pmcd"), "--effort", "nonsense", code=2)
        self.assertIn("--effort: nonsense", refused.stderr)
        self.assertNotIn("u.pmcd", self.entries())

    def test_levels_and_other_options(self):
        mesh = self.write("torus.off", torus_off(40, 25))
        for arguments in (("--levels", "3"), ("--cleaning",), ("--flip-limit", "0.2"), ("--shape-limit", "0.3")):
            self.tool("encode", mesh, self.path("t.pmcd"), "--no-errors", *arguments)
            self.tool("compare", mesh, self.path("t.pmcd"))
            if arguments[0] == "--levels":
                info = json.loads(self.tool("info", "--json", self.path("t.pmcd")).stdout)
                self.assertLessEqual(len(info["levels"]), 4)

    def test_double(self):
        lines = torus_off(10, 8).split("\n")
        lines[2] = "0.1 0.2 0.30000000000000004"
        mesh = self.write("torus.off", "\n".join(lines))
        self.tool("encode", mesh, self.path("t.pmcd"), "--double")
        done = self.tool("decode", self.path("t.pmcd"), self.path("out.off"))
        self.assertIn("--double", done.stderr)
        self.python_says_equal(mesh, self.path("out.off"), "--double")
        self.tool("compare", "--double", mesh, self.path("out.off"))
        self.tool("compare", mesh, self.path("t.pmcd"), code=1)
        self.tool("decode", self.path("t.pmcd"), self.path("out.ply"))
        self.assertIn(b"property double x", self.read("out.ply"))
        self.tool("compare", "--double", mesh, self.path("out.ply"))

    def test_repairs_are_told(self):
        quads = "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
        quads += "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 0 4 7 3\n".replace("4 0 4 7 3", "4 3 7 4 0")
        mesh = self.write("cube.off", quads)
        done = self.tool("encode", mesh, self.path("cube.pmcd"))
        self.assertIn("6 polygons triangulated, 12 faces now", done.stdout)
        self.assertIn("2 faces turned to agree with the neighbours, in 1 component", done.stdout)
        text = self.tool("compare", mesh, self.path("cube.pmcd")).stdout
        self.assertIn("2 faces turned", text)

    def test_empty_and_tiny_meshes(self):
        for name, text in (("empty", "OFF\n0 0 0\n"), ("point", "OFF\n1 0 0\n1 2 3\n"),
                           ("points", "OFF\n3 0 0\n1 2 3\n1 2 3\n-0 0 0\n"),
                           ("triangle", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")):
            mesh = self.write(name + ".off", text)
            self.tool("encode", mesh, self.path(name + ".pmcd"))
            self.tool("info", self.path(name + ".pmcd"))
            json.loads(self.tool("info", "--json", self.path(name + ".pmcd")).stdout)
            self.tool("decode", self.path(name + ".pmcd"), self.path(name + ".ply"))
            self.python_says_equal(mesh, self.path(name + ".ply"))
            self.tool("compare", mesh, self.path(name + ".pmcd"))

    def test_progress_is_shown_on_a_terminal_only(self):
        mesh = self.write("torus.off", torus_off(60, 50))
        master, slave = pty.openpty()
        done = subprocess.run([BINARY, "encode", mesh, self.path("t.pmcd")], stdout=subprocess.PIPE, stderr=slave,
                              timeout=600, check=False)
        os.close(slave)
        shown = b""
        try:
            while True:
                piece = os.read(master, 65536)
                if not piece:
                    break
                shown += piece
        except OSError:
            pass  # Linux answers so at the end of a pseudo-terminal
        os.close(master)
        self.assertEqual(done.returncode, 0)
        self.assertIn(b"encoding", shown)
        self.assertIn(b"measuring", shown)
        self.assertTrue(shown.endswith(b"\r\x1b[K"), shown[-40:])


class BadInput(ToolTest):
    def refused(self, arguments, *says):
        before = {name: self.read(name) for name in self.entries()}
        done = self.tool(*arguments, code=3)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for words in says:
            self.assertIn(words, done.stderr)
        self.assertEqual({name: self.read(name) for name in self.entries()}, before, "something was written")

    def test_meshes(self):
        out = self.path("out.pmcd")
        good = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        cases = {
            "empty.off": ("", "empty_file"),
            "cut.off": (good[:-8], "cut.off:6", "truncated"),
            "garbage.ply": (bytes(range(256)), "garbage.ply:1:", "wrong_format"),
            "garbage.stl": (bytes(range(256)), "garbage.stl: byte 256:", "truncated"),
            "nan.off": (good.replace("0 1 0\n3", "0 nan 0\n3"), "nan.off:5:", "non_finite_coordinate"),
            "inf.obj": ("v 0 0 inf\n", "inf.obj:1:", "non_finite_coordinate"),
            "index.off": (good.replace("3 0 1 2", "3 0 1 3"), "index.off:6:", "index_out_of_range"),
            "claims.off": (good.replace("3 1 0\n", "2147483648 2147483648 0\n", 1), "claims.off:7:", "truncated"),
            "claims.ply": ("ply\nformat binary_little_endian 1.0\nelement vertex 2147483648\nproperty float x\n"
                           "property float y\nproperty float z\nend_header\n1234", "claims.ply: byte", "truncated"),
            "claims.stl": (b"x" * 80 + struct.pack("<I", 2 ** 31), "claims.stl: byte 84:", "truncated"),
            "packed.ply": (gzip.compress(b"ply"), "packed.ply: is compressed with gzip; unpack it first"),
            "edge.off": ("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n3 0 1 2\n3 1 0 3\n3 0 1 4\n", "edge.off:8:",
                         "1 edge with more than two faces", "non_manifold_edge"),
            "mesh.glb": ("glTF", "unknown_extension"),
        }
        for name, (content, *says) in cases.items():
            mesh = self.write(name, content)
            self.refused(("encode", mesh, out), *says)
            self.refused(("info", mesh), *says)
            self.refused(("compare", mesh, mesh), *says)
        self.refused(("encode", self.path("missing.ply"), out), "missing.ply", "No such file", "cannot_read")
        self.assertNotIn("out.pmcd", self.entries())

    def test_strict(self):
        mesh = self.write("c.off", "COFF\n3 1 0\n0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n")
        self.refused(("encode", "--strict", mesh, self.path("c.pmcd")), "colours of 3 vertices", "left_out")
        self.assertIn("left out: colours of 3 vertices", self.tool("encode", mesh, self.path("c.pmcd")).stdout)

    def test_packet_files(self):
        mesh = self.write("torus.off", torus_off(12, 10))
        self.tool("encode", mesh, self.path("t.pmcd"))
        whole = self.read("t.pmcd")
        out = self.path("out.ply")
        for name, content in (("cut.pmcd", whole[:-1]), ("half.pmcd", whole[:len(whole) // 2]), ("long.pmcd", whole + b"x"),
                              ("empty.pmcd", b""), ("text.pmcd", b"hello world, this is no packet file at all"),
                              ("magic.pmcd", b"PMCD")):
            bad = self.write(name, content)
            self.refused(("decode", bad, out), name, "fetch or encode it again", "bad_packet_file")
            self.refused(("info", bad), name, "bad_packet_file")
            self.refused(("compare", bad, mesh), name, "bad_packet_file")
        self.refused(("info", self.path("cut.pmcd")), "cut.pmcd: byte %d: " % (len(whole) - 1), "truncated")
        self.refused(("info", self.path("long.pmcd")), "long.pmcd: byte %d: " % len(whole), "trailing_bytes")
        for at in range(0, len(whole), 37):
            self.write("flip.pmcd", whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1:])
            self.refused(("decode", self.path("flip.pmcd"), out), "flip.pmcd", "bad_packet_file")
        self.assertIn("has no level 99", self.tool("decode", self.path("t.pmcd"), out, "--level", "99", code=2).stderr)
        self.assertNotIn("out.ply", self.entries())
        # A .pmcd file is known by its first bytes as well.
        self.write("renamed.bin", whole)
        self.tool("compare", self.path("renamed.bin"), mesh)

    def test_what_cannot_be_written(self):
        mesh = self.write("torus.off", torus_off(12, 10))
        self.refused(("encode", mesh, self.path("no/such/folder/t.pmcd")), "cannot_write")
        self.refused(("encode", mesh, "/dev/full"), "/dev/full", "cannot_write")
        self.tool("encode", mesh, self.path("t.pmcd"))
        self.refused(("decode", self.path("t.pmcd"), self.path("t.xyz")), "unknown_extension")
        self.refused(("decode", self.path("t.pmcd"), self.path("no/t.ply")), "cannot_write")
        older = self.write("older.pmcd", "something of value")
        self.refused(("encode", self.write("bad.off", "OFF\n1 0 0\n"), older))

    def test_full_standard_output(self):
        mesh = self.write("torus.off", torus_off(12, 10))
        with open("/dev/full", "wb") as full:
            done = subprocess.run([BINARY, "info", mesh], stdout=full, stderr=subprocess.PIPE, check=False, timeout=60)
        self.assertEqual(done.returncode, 3)


class Meshes(ToolTest):
    """Real meshes through all three comparisons; without PMCD_TEST_MESHES they are skipped."""

    def test_real_meshes(self):
        if not MESHES:
            self.skipTest("PMCD_TEST_MESHES names no folder of meshes")
        for name in ("bunny00.off", "horse.ply", "screwdriver.ply", "colored_tetra.ply", "diplodocus.off", "rocker-arm.obj",
                     "1002_tray_bottom.STL", "soup.stl", "bones.off", "Laurana50k.ply", "fertility.off"):
            with self.subTest(name):
                mesh = os.path.join(MESHES, name)
                self.tool("encode", mesh, self.path("m.pmcd"), "--no-errors")
                self.tool("decode", self.path("m.pmcd"), self.path("m.ply"))
                self.tool("compare", mesh, self.path("m.ply"))
                self.python_says_equal(mesh, self.path("m.ply"))
        with self.subTest("turned faces"):
            mesh = os.path.join(MESHES, "blobby-shuffled.off")
            self.tool("encode", mesh, self.path("m.pmcd"), "--no-errors")
            self.tool("decode", self.path("m.pmcd"), self.path("m.ply"))
            self.python_says_equal(mesh, self.path("m.ply"), "--any-orientation")
        for name, code in (("conrod.stl", "duplicate_face"), ("deg_faces.obj", "repeated_index_in_face"),
                           ("dragon_vrip_res3.ply", "duplicate_face"), ("hourglass_ico.obj", "non_manifold_vertex"),
                           ("moebius.obj", "not_orientable"), ("dragon_vrip.ply.gz", "compressed")):
            with self.subTest(name):
                done = self.tool("encode", os.path.join(MESHES, name), self.path("refused.pmcd"), code=3)
                self.assertTrue(re.search(r"%s(:\d+| ?: byte \d+|): .* \[%s\]\n$" % (re.escape(name), code), done.stderr),
                                done.stderr)
                self.assertNotIn("refused.pmcd", self.entries())


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: pmctool_test.py PMCTOOL [unittest options]")
    BINARY = os.path.abspath(sys.argv.pop(1))
    unittest.main()
