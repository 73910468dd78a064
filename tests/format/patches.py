# SPDX-License-Identifier: MIT
"""Patches and ears, written from docs/FORMAT.md alone ("Patches", "Ear pass")."""

PLUS, MINUS = "+", "-"
NULL = 0


class Cut:
    """How a polygon is cut into triangles, by ring numbers."""

    def __init__(self, size, triangles, tags):
        self.size = size
        self.triangles = [tuple(int(c) for c in t) for t in triangles.split()]
        self.tags = tags.split()
        self.entries = []  # triangle before and the edge's ends there, by triangle
        for k, triangle in enumerate(self.triangles):
            self.entries.append(None)
            for j in range(k):
                common = [v for v in self.triangles[j] if v in triangle]
                if len(common) == 2:
                    self.entries[k] = (j, common)
        self.at = [sum(i in t for t in self.triangles) for i in range(size)]
        self.apart = [(i, j) for i in range(size) for j in range(i) if not any(i in t and j in t for t in self.triangles)]


_CUTS = {name: Cut(int(name[0]), triangles, tags) for name, triangles, tags in (
    ("3-", "012", "-"), ("3+", "012", "+"),
    ("4t", "023 012", "- +"), ("4s", "013 123", "+ -"),
    ("5both", "024 012 234", "- + -"), ("5t", "034 013 123", "+ - +"), ("5s", "014 134 123", "+ - +"),
    ("6t", "045 024 012 234", "- + - +"), ("6s", "015 135 123 345", "+ - + -"))}


def cut_of(symbol, s, t):
    """The cut and the closing edge of a patch before a gate with the tags s and t."""
    if symbol >= 8:
        if symbol < 10:
            return _CUTS["3+"], symbol - 8
        closing = symbol - 10
        return _CUTS["4s" if (t == MINUS) == (closing % 2 == 0) else "4t"], closing
    both = s == PLUS and t == PLUS
    shrinks = s == MINUS and t == PLUS
    if symbol == 3:
        return _CUTS["3-" if both else "3+"], None
    if symbol == 5:
        return _CUTS["5both" if both else "5t" if shrinks else "5s"], None
    return _CUTS[str(symbol) + ("t" if both or shrinks else "s")], None


class Patch:
    """The polygon as it lies before the gate; collect answers None if it does not lie there."""

    @staticmethod
    def collect(mesh, gate, cut, closing, conquered):
        p = Patch()
        p.cut, p.closing, p.size = cut, closing, cut.size
        p.ring, p.outside, p.inside = [None] * p.size, [None] * p.size, [None] * p.size
        p.faces = []
        halfedge = {}  # by ring numbers of its ends
        for k, triangle in enumerate(cut.triangles):
            if k == 0:
                start, h = p.size - 1, gate
            else:
                ends = cut.entries[k][1]
                a, b = ends if ends in ([triangle[i], triangle[(i + 1) % 3]] for i in range(3)) else ends[::-1]
                start, h = a, mesh.opposite[halfedge[(b, a)]]
            if h is None or conquered[h // 3]:
                return None
            p.faces.append(h // 3)
            first = triangle.index(start)
            for e in range(3):
                a, b = triangle[(first + e) % 3], triangle[(first + e + 1) % 3]
                halfedge[(a, b)] = h
                p.ring[a] = mesh.origin(h)
                if b == (a + 1) % p.size:
                    p.inside[a] = h
                    p.outside[a] = mesh.opposite[h]
                h = mesh.next(h)
        if any(p.ring[i] == p.ring[j] for i, j in cut.apart):
            return None
        if closing is not None and p.outside[closing] is not None:
            return None
        return p

    def star_faces(self, i):
        return 1 if self.closing is not None and i in (self.closing, self.closing + 1) else 2

    def open(self, mesh):
        """Inserts the new vertex. Answers it and the point where it stands for now."""
        n = self.size
        sums = [sum(mesh.points[v][axis] for v in self.ring) for axis in range(3)]
        point = tuple((2 * s + n) // (2 * n) for s in sums)
        boundary = [mesh.is_boundary(v) for v in self.ring]
        x = mesh.add_vertex(point)
        slots = list(self.faces)
        star = {}
        self.star = []  # its faces
        for i in range(n):
            if i == self.closing:
                continue
            face = slots.pop(0) if slots else len(mesh.faces)
            mesh.set_face(face, self.ring[i], self.ring[(i + 1) % n], x)
            star[i] = 3 * face
            self.star.append(face)
        for i in range(n):
            after = (i + 1) % n
            if i in star and after in star:
                mesh.link(star[i] + 1, star[after] + 2)
            elif i in star:
                mesh.link(star[i] + 1, None)
            else:
                mesh.link(star[after] + 2, None)
        for i, h in star.items():
            mesh.link(h, self.outside[i])
            if not boundary[i] or self.outside[i] is None:
                mesh.outgoing[self.ring[i]] = h
        if self.closing is None:
            mesh.outgoing[x] = star[0] + 2
        else:
            mesh.outgoing[self.ring[self.closing]] = star[(self.closing - 1) % n] + 1
            mesh.outgoing[x] = star[self.closing + 1] + 2
        return x, point


def insert_ear(mesh, h):
    a, b = mesh.origin(h), mesh.target(h)
    x = mesh.add_vertex(tuple((p + q) // 2 for p, q in zip(mesh.points[a], mesh.points[b])))
    face = len(mesh.faces)
    mesh.set_face(face, b, a, x)
    mesh.link(3 * face, h)
    mesh.outgoing[a] = 3 * face + 1
    mesh.outgoing[x] = 3 * face + 2
    return x
