#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the plain-Python mesh comparer: equal and different meshes in each format, and exact rounding of decimals."""

import contextlib
import io
import itertools
import math
import os
import random
import struct
import sys
import tempfile
import unittest
from fractions import Fraction

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import compare_meshes as cm  # noqa: E402

TETRAHEDRON = ([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)],
               [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def torus(rings, sides):
    positions, faces = [], []
    for r, s in itertools.product(range(rings), range(sides)):
        u, v = 2 * math.pi * r / rings, 2 * math.pi * s / sides
        positions.append(tuple(cm.nearest_float32(repr(x)) for x in
                               ((3 + math.cos(v)) * math.cos(u), (3 + math.cos(v)) * math.sin(u), math.sin(v))))
        a, b = r * sides + s, (r + 1) % rings * sides + s
        c, d = (r + 1) % rings * sides + (s + 1) % sides, r * sides + (s + 1) % sides
        faces += [(a, b, c), (a, c, d)]
    return positions, faces


def strips(n, twice_round):
    """Two closed strips over the same places: one that walks round twice, or two rings."""
    positions, faces = [], []
    for _, i in itertools.product(range(2), range(n)):
        angle = 2 * math.pi * i / n
        positions += [(math.cos(angle), math.sin(angle), z) for z in (0.0, 1.0)]
    for layer, i in itertools.product(range(2), range(n)):
        to_layer = 1 - layer if twice_round and i + 1 == n else layer
        a, b = 2 * (layer * n + i), 2 * (to_layer * n + (i + 1) % n)
        faces += [(a, b, b + 1), (a, b + 1, a + 1)]
    return positions, faces


def joined(a, b):
    shift = len(a[0])
    return a[0] + b[0], a[1] + [tuple(v + shift for v in face) for face in b[1]]


def renumbered(mesh, seed):
    rng = random.Random(seed)
    positions, faces = mesh
    name = list(range(len(positions)))
    rng.shuffle(name)
    moved = [None] * len(positions)
    for v, position in enumerate(positions):
        moved[name[v]] = position
    out = []
    for face in faces:
        turn = rng.randrange(3)
        out.append(tuple(name[face[(turn + i) % 3]] for i in range(3)))
    rng.shuffle(out)
    return moved, out


class Difference(unittest.TestCase):
    def same(self, a, b, any_orientation=False):
        self.assertIsNone(cm.difference(a, b, any_orientation))
        self.assertIsNone(cm.difference(b, a, any_orientation))

    def different(self, a, b, says, any_orientation=False):
        self.assertIn(says, cm.difference(a, b, any_orientation) or "equal")
        self.assertIsNotNone(cm.difference(b, a, any_orientation))

    def test_numbering_does_not_matter(self):
        for seed in range(5):
            self.same(torus(9, 7), renumbered(torus(9, 7), seed))

    def test_bits_matter(self):
        positions, faces = TETRAHEDRON
        self.different(TETRAHEDRON, ([(0.0, -0.0, 0.0)] + positions[1:], faces), "vertex (0.0, 0.0, 0.0)")
        self.different(TETRAHEDRON, (positions + [(5.0, 5.0, 5.0)], faces), "4 vertices against 5")
        self.different(TETRAHEDRON, (positions, faces[1:]), "4 faces against 3")

    def test_orientation_matters_unless_told_otherwise(self):
        positions, faces = TETRAHEDRON
        turned = (positions, [faces[0][::-1]] + faces[1:])
        self.different(TETRAHEDRON, turned, "face")
        self.same(TETRAHEDRON, renumbered(turned, 1), any_orientation=True)

    def test_multiplicity_matters(self):
        positions, faces = TETRAHEDRON
        a = (positions + [(5.0, 5.0, 5.0)] * 2 + [(6.0, 6.0, 6.0)], faces)
        b = (positions + [(5.0, 5.0, 5.0)] + [(6.0, 6.0, 6.0)] * 2, faces)
        self.different(a, b, "vertex (5.0, 5.0, 5.0): 2 times against 1")
        self.same(a, renumbered(a, 3))
        self.different((positions, faces + faces[:1]), (positions, faces + faces[1:2]), "face")

    def test_coincident_vertices(self):
        positions = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)]
        shared, split = (positions, [(0, 1, 2), (0, 3, 4)]), (positions, [(0, 1, 2), (5, 3, 4)])
        self.different(shared, split, "connected differently")
        self.same(split, renumbered(split, 1))
        doubled = joined(torus(6, 5), torus(6, 5))
        for seed in range(4):
            self.same(doubled, renumbered(doubled, seed))
            self.same(doubled, renumbered(doubled, seed), any_orientation=True)

    def test_meshes_that_look_alike_from_each_vertex(self):
        self.different(strips(12, True), strips(12, False), "connected differently")
        self.same(strips(12, True), renumbered(strips(12, True), 3))
        a, b = joined(strips(8, True), strips(8, False)), joined(strips(8, False), strips(8, True))
        self.same(a, renumbered(b, 5))
        self.different(a, joined(strips(8, True), strips(8, True)), "connected differently")

    def test_against_trying_all_numberings(self):
        rng = random.Random(4)
        same = 0
        for number in range(600):
            positions = [(float(v > 1), 0.0, 0.0) for v in range(5)]
            a = (positions, [tuple(rng.sample(range(5), 3)) for _ in range(4)])
            b = renumbered(a, number) if number % 2 else (positions, [tuple(rng.sample(range(5), 3)) for _ in range(4)])
            for any_orientation in (False, True):
                def forms(faces):
                    return sorted(cm.turned(face, any_orientation) for face in faces)
                expected = any(all(a[0][v] == b[0][name[v]] for v in range(5))
                               and forms([tuple(name[v] for v in face) for face in a[1]]) == forms(b[1])
                               for name in itertools.permutations(range(5)))
                self.assertEqual(cm.difference(a, b, any_orientation) is None, expected, (a, b, any_orientation))
                same += expected
        self.assertGreaterEqual(same, 600)


class NearestFloat32(unittest.TestCase):
    @staticmethod
    def by_fractions(text):
        """The nearest of all candidates around, ties to even, without a double in the way."""
        exact = abs(Fraction(text))
        near = cm.float_bits(float(exact)) if exact < 3.4e38 else 0x7F7FFFFF
        around = [b for b in range(max(0, near - 2), min(0x7F7FFFFF, near + 2) + 1)]
        best = min(around, key=lambda b: (abs(Fraction(cm.float_from_bits(b)) - exact), b % 2))
        value = cm.float_from_bits(best)
        return -value if text.startswith("-") else value

    def test_double_rounding_is_avoided(self):
        self.assertEqual(cm.nearest_float32("1.00000005960464477540"), cm.float_from_bits(0x3F800001))
        self.assertEqual(cm.nearest_float32("1.00000005960464477538"), 1.0)
        self.assertEqual(cm.nearest_float32("-1.00000017881393432616"), -cm.float_from_bits(0x3F800001))
        self.assertEqual(cm.nearest_float32("1.00000017881393432618"), cm.float_from_bits(0x3F800002))

    def test_against_fractions(self):
        rng = random.Random(8)
        for _ in range(3000):
            low = rng.randrange(0, 0x7F7FFFFE)
            middle = (Fraction(cm.float_from_bits(low)) + Fraction(cm.float_from_bits(low + 1))) / 2
            digits = 60
            scaled = middle * 10 ** digits
            for offset in (-1, 0, 1):
                number = scaled.numerator // scaled.denominator + offset
                text = "%s%de-%d" % (rng.choice(["", "-"]), number, digits)
                self.assertEqual(cm.float_bits(cm.nearest_float32(text)), cm.float_bits(self.by_fractions(text)), text)

    def test_ends_of_the_range(self):
        self.assertEqual(math.copysign(1, cm.nearest_float32("-1e-60")), -1)
        self.assertEqual(cm.nearest_float32("1e-45"), cm.float_from_bits(1))
        for text in ("1e39", "nan", "inf", "3.4028236e38"):
            self.assertRaises(cm.Unreadable, cm.nearest_float32, text)


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def write(self, name, data):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return path

    def run_main(self, *arguments):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = cm.main(list(arguments))
        return code, out.getvalue().strip(), err.getvalue().strip()

    def test_the_same_mesh_in_every_format(self):
        positions, faces = torus(5, 4)
        text = "\n".join("%r %r %r" % p for p in positions)
        paths = [
            self.write("a.off", "COFF # torus\n\n20 40 0\n" + text + "\n" + "\n".join("3 %d %d %d 1 2 3" % f for f in faces)),
            self.write("a.obj", "".join("v %r %r %r\r\n" % p for p in positions) + "".join(
                "f %d/1 %d//2 \\\r\n %d/3/4\r\n" % (a + 1, b + 1, c - 20) for a, b, c in faces)),
            self.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 20\nproperty uchar q\nproperty float x\n"
                       "property float y\nproperty float z\nelement face 40\nproperty list uchar int vertex_index\n"
                       "end_header\n" + "\n".join("7 " + row for row in text.split("\n")) + "\n"
                       + "\n".join("3 %d %d %d" % f for f in faces)),
        ]
        for order, name in (("<", "little"), (">", "big")):
            data = ("ply\nformat binary_%s_endian 1.0\nelement vertex 20\nproperty float x\nproperty float y\n"
                    "property float z\nproperty uchar q\nelement face 40\nproperty uchar q\n"
                    "property list uchar int vertex_indices\nend_header\n" % name).encode()
            data += b"".join(struct.pack(order + "fffB", *p, 9) for p in positions)
            data += b"".join(struct.pack(order + "BBiii", 9, 3, *f) for f in faces)
            paths.append(self.write(name + ".ply", data))
        stl = b"solid nonsense".ljust(80) + struct.pack("<I", len(faces))
        for face in faces:
            stl += struct.pack("<12fH", 0, 0, 1, *(c for v in face for c in positions[v]), 0)
        paths.append(self.write("binary.stl", stl))
        paths.append(self.write("ascii.STL", "solid x\n" + "".join(
            "facet normal 0 0 1\nouter loop\n" + "".join("vertex %r %r %r\n" % positions[v] for v in face)
            + "endloop\nendfacet\n" for face in faces) + "endsolid x\n"))
        for a, b in itertools.product(paths, paths):
            self.assertEqual(self.run_main(a, b), (0, "equal", ""), (a, b))

    def test_differences_and_errors(self):
        good = self.write("good.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 0.1 0\n3 0 1 2\n")
        moved = self.write("moved.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 0.10000001 0\n3 0 1 2\n")
        close = self.write("close.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 0.1000000001 0\n3 0 1 2\n")
        self.assertEqual(self.run_main(good, moved)[0], 1)
        self.assertEqual(self.run_main(good, close), (0, "equal", ""))
        self.assertEqual(self.run_main("--double", good, close)[0], 1)
        quad = self.write("quad.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
        for bad in (quad, self.write("cut.off", "OFF\n3 1 0\n0 0 0\n"), self.write("bad.xyz", ""),
                    self.write("nan.off", "OFF\n1 0 0\n0 nan 0\n"), os.path.join(self.folder.name, "missing.ply")):
            code, out, err = self.run_main(good, bad)
            self.assertEqual((code, out), (3, ""), bad)
            self.assertIn(os.path.basename(bad), err)


if __name__ == "__main__":
    unittest.main()
