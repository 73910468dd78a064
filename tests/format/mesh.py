# SPDX-License-Identifier: MIT
"""Faces, half-edges, rings and sums about vertices, written from docs/FORMAT.md alone ("Mesh", "What is known of each vertex")."""
import math
from single import add, cross, dot, f, times

BITS32 = (1 << 32) - 1


def i32(x):
    x &= BITS32
    return x - (1 << 32) if x >> 31 else x


class Ring:
    def __init__(self, mesh, centre):
        self.vertex, self.apex = [], []
        self.border = False
        first = h = mesh.outgoing[centre]
        while True:
            self.vertex.append(mesh.target(h))
            across = mesh.opposite[mesh.next(h)]
            self.apex.append(None if across is None else mesh.apex(across))
            left = mesh.opposite[mesh.prev(h)]
            if left == first or len(self.vertex) == 12:
                return
            if left is None:
                self.vertex.append(mesh.apex(h))
                self.apex.append(None)
                self.border = True
                return
            h = left


class Mesh:
    def __init__(self, faces, points):
        self.faces = list(faces)
        self.points = list(points)
        self.outgoing = [None] * len(points)
        self.opposite = [None] * (3 * len(faces))
        self.spread = [(f(0.2), f(0.2))] * len(points)
        self.normals = []
        seen = {}
        for h in range(len(self.opposite)):
            seen[(self.origin(h), self.target(h))] = h
        for h in range(len(self.opposite)):
            self.opposite[h] = seen.get((self.target(h), self.origin(h)))
            v = self.origin(h)
            if self.outgoing[v] is None or self.opposite[h] is None:
                self.outgoing[v] = h

    @staticmethod
    def next(h):
        return h - 2 if h % 3 == 2 else h + 1

    @staticmethod
    def prev(h):
        return h + 2 if h % 3 == 0 else h - 1

    def origin(self, h):
        return self.faces[h // 3][h % 3]

    def target(self, h):
        return self.faces[h // 3][(h + 1) % 3]

    def apex(self, h):
        return self.faces[h // 3][(h + 2) % 3]

    def link(self, a, b):
        self.opposite[a] = b
        if b is not None:
            self.opposite[b] = a

    def add_vertex(self, point):
        self.points.append(point)
        self.outgoing.append(None)
        self.spread.append((f(0.2), f(0.2)))
        return len(self.points) - 1

    def set_face(self, face, a, b, c):
        while face >= len(self.faces):
            self.faces.append(None)
            self.opposite += [None] * 3
        self.faces[face] = (a, b, c)

    def renumber(self, order):
        """Gives face order[i] the number i."""
        place = {face: i for i, face in enumerate(order)}
        moved = {3 * face + e: 3 * i + e for face, i in place.items() for e in range(3)} | {None: None}
        self.faces = [self.faces[face] for face in order]
        self.opposite = [moved[self.opposite[3 * face + e]] for face in order for e in range(3)]
        self.outgoing = [moved[h] for h in self.outgoing]

    def leaving(self, v):
        """Half-edges that leave v, turning left from the outgoing one."""
        h = self.outgoing[v]
        while h is not None:
            yield h
            h = self.opposite[self.prev(h)]
            if h == self.outgoing[v]:
                return

    def is_boundary(self, v):
        return self.opposite[self.outgoing[v]] is None

    def valence(self, v):
        """Faces at v."""
        return sum(1 for _ in self.leaving(v))

    def neighbours(self, v):
        found = []
        for h in self.leaving(v):
            found.append(self.target(h))
            if self.opposite[self.prev(h)] is None:
                found.append(self.apex(h))
        return found

    # As seen from a point.

    def at(self, v, o):
        return tuple(f(i32(x - y)) for x, y in zip(self.points[v], o))

    def mean(self, v, o):
        around = self.neighbours(v)
        sums = (sum(self.points[w][axis] for w in around) for axis in range(3))
        return tuple(f(f(i32(s - len(around) * y)) / f(len(around))) for s, y in zip(sums, o))

    def build_normals(self):
        total = [(0.0, 0.0, 0.0)] * len(self.points)
        for face in self.faces:
            a, b, c = (self.points[w] for w in face)
            n = cross(*(tuple(f(x - y) for x, y in zip(p, a)) for p in (b, c)))
            for v in face:
                total[v] = add(total[v], n)
        self.normals = []
        for n in total:
            q = dot(n, n)
            self.normals.append(times(n, f(1 / f(math.sqrt(q))) if q > f(1e-6) else 0.0))
