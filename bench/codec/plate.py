#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed thick plate with 200 round holes, of genus 200, as a binary PLY file: python3 plate.py OUT.ply.

Both sides carry a smooth relief, the whole is bent in its plane, and the holes differ in width, so that it is neither
planes nor one part repeated. Coordinates are made of + - * / and square roots only: the same bytes everywhere.
"""

import math
import struct
import sys

COLUMNS, ROWS = 20, 10
HOLES = COLUMNS * ROWS
HALF_THICKNESS = 0.3
# Quarters of a cell around its square, counter-clockwise from the lower left corner.
SQUARE = ([(i, 0) for i in range(4)] + [(4, i) for i in range(4)] + [(4 - i, 4) for i in range(4)]
          + [(0, 4 - i) for i in range(4)])


def wave(t):
    """Something like a sine with period 2, of parabolas: smooth enough, and exact everywhere."""
    t -= 2 * math.floor(t / 2)
    return 4 * t * (1 - t) if t < 1 else -4 * (t - 1) * (2 - t)


def heights(x, y):
    """Of the bottom, the middle and the top."""
    top = HALF_THICKNESS + 0.20 * wave(x / 7 + y / 11) + 0.10 * wave(x / 3.1 - y / 4.3) + 0.02 * wave(1.3 * x + 0.9 * y)
    bottom = -HALF_THICKNESS + 0.15 * wave(x / 6 - y / 9) + 0.02 * wave(1.1 * y - 0.7 * x)
    return bottom, (bottom + top) / 2, top


class Plate:
    """Vertices are known by where they come from, so that neighbouring cells share theirs."""

    def __init__(self):
        self.positions = []
        self.faces = []
        self._known = {}
        for row in range(ROWS):
            for column in range(COLUMNS):
                self._cell(column, row)
        self._rim()
        self._check()

    def _vertex(self, key, x, y, layer):
        index = self._known.setdefault((key, layer), len(self.positions))
        if index == len(self.positions):
            self.positions.append((x + 0.15 * wave(y / 5), y + 0.10 * wave(x / 6), heights(x, y)[layer]))
        return index

    def _quad(self, a, b, c, d):
        """Counter-clockwise from outside; the diagonals alternate."""
        even = len(self.faces) // 2 % 2 == 0
        self.faces += [(a, b, c), (a, c, d)] if even else [(a, b, d), (b, c, d)]

    def _square_vertex(self, column, row, at, layer):
        x, y = 4 * column + SQUARE[at % 16][0], 4 * row + SQUARE[at % 16][1]
        return self._vertex((x, y), x / 4, y / 4, layer)

    def _ring_vertex(self, column, row, at, share, layer):
        """On the hole (share 0) or between it and the square (share 1)."""
        at %= 16
        dx, dy = SQUARE[at][0] / 4 - 0.5, SQUARE[at][1] / 4 - 0.5
        radius = 0.25 + 0.1 * wave(column / 3.7 + row / 2.9)
        scale = (1 - share) * radius / math.sqrt(dx * dx + dy * dy) + share
        return self._vertex((column, row, at, share), column + 0.5 + scale * dx, row + 0.5 + scale * dy, layer)

    def _cell(self, column, row):
        for at in range(16):
            for layer, turned in ((0, True), (2, False)):
                square = [self._square_vertex(column, row, at + i, layer) for i in (0, 1)]
                middle = [self._ring_vertex(column, row, at + i, 0.45, layer) for i in (0, 1)]
                hole = [self._ring_vertex(column, row, at + i, 0, layer) for i in (0, 1)]
                for outer, inner in ((square, middle), (middle, hole)):
                    corners = [outer[0], outer[1], inner[1], inner[0]]
                    self._quad(*(corners[::-1] if turned else corners))
            for layer in (0, 1):
                low = [self._ring_vertex(column, row, at + i, 0, layer) for i in (0, 1)]
                high = [self._ring_vertex(column, row, at + i, 0, layer + 1) for i in (0, 1)]
                self._quad(low[1], low[0], high[0], high[1])

    def _rim(self):
        right, top = 4 * COLUMNS, 4 * ROWS
        around = ([(x, 0) for x in range(right)] + [(right, y) for y in range(top)]
                  + [(right - x, top) for x in range(right)] + [(0, top - y) for y in range(top)])
        for a, b in zip(around, around[1:] + around[:1]):
            for layer in (0, 1):
                low = [self._vertex(p, p[0] / 4, p[1] / 4, layer) for p in (a, b)]
                high = [self._vertex(p, p[0] / 4, p[1] / 4, layer + 1) for p in (a, b)]
                self._quad(low[0], low[1], high[1], high[0])

    def _check(self):
        edges = {edge for a, b, c in self.faces for edge in ((a, b), (b, c), (c, a))}
        closed = len(edges) == 3 * len(self.faces) and all((b, a) in edges for a, b in edges)
        genus = 1 - (len(self.positions) - len(edges) // 2 + len(self.faces)) // 2
        if not closed or genus != HOLES:
            raise AssertionError(f"the plate is not closed, or of genus {genus}")

    def ply(self):
        header = ("ply\nformat binary_little_endian 1.0\n"
                  f"element vertex {len(self.positions)}\nproperty float x\nproperty float y\nproperty float z\n"
                  f"element face {len(self.faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        return (header.encode() + b"".join(struct.pack("<3f", *position) for position in self.positions)
                + b"".join(struct.pack("<B3i", 3, *face) for face in self.faces))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: plate.py OUT.ply")
    with open(sys.argv[1], "wb") as out:
        out.write(Plate().ply())
