#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Are two mesh files the same mesh up to numbering?

Prints "equal" and exits 0, or the first difference and exits 1; 2 for usage, 3 for a file that cannot be read.
Same: there is a bijection of the vertices that keeps every position's bits (-0.0 and +0.0 differ) and maps the cyclic
corner triples of one mesh onto those of the other, with multiplicity. Text becomes the nearest float32 (--double: the
nearest double); PLY doubles stay double; corners of an STL file with equal bits are one vertex. Polygons are not
triangulated: a file with any is refused. Python's standard library only, and no code in common with pmcd.
"""

import argparse
import struct
import sys
from fractions import Fraction


class Unreadable(Exception):
    """The file cannot be read as a triangle mesh."""


# ---- numbers ---------------------------------------------------------------------------------------------------------

def float_bits(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


def float_from_bits(bits):
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def nearest_float32(text):
    """The float32 nearest to a decimal text, as a double; ties to even. By exact fractions where double rounding could
    make a difference: where the double nearest to the text lies exactly in the middle between two float32."""
    value = float(text)
    if value != value or value in (float("inf"), float("-inf")):
        raise Unreadable("coordinate %r is not finite" % text)
    try:
        near = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        raise Unreadable("coordinate %r is too large for float32" % text) from None
    if near == value:
        # The double is a float32; the text may still be off it, but by less than half a double step: no other is nearer.
        return near
    bits = float_bits(abs(near))
    if abs(near) > abs(value):
        low, high = float_from_bits(bits - 1), abs(near)
    else:
        low, high = abs(near), float_from_bits(bits + 1) if bits + 1 < 0x7F800000 else float("inf")
    middle = (low + high) / 2  # exact: two neighbours among float32 have their middle among the doubles
    if abs(value) != middle:
        return near
    exact = abs(Fraction(text.lstrip("+")))
    if exact < middle:
        chosen = low
    elif exact > middle:
        chosen = high
    else:
        chosen = low if float_bits(low) % 2 == 0 else high
    return -chosen if value < 0 else chosen


def coordinate(text, double):
    try:
        if not double:
            return nearest_float32(text)
        value = float(text)
    except ValueError:
        raise Unreadable("%r is not a number" % text) from None
    if value - value != 0:
        raise Unreadable("coordinate %r is not finite" % text)
    return value


# ---- files -----------------------------------------------------------------------------------------------------------

PLY_TYPES = {
    "char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h", "ushort": "H", "uint16": "H",
    "int": "i", "int32": "i", "uint": "I", "uint32": "I", "float": "f", "float32": "f", "double": "d", "float64": "d",
}


def read_ply(data, double):
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise Unreadable("no PLY header")
    body = data.index(b"\n", end) + 1
    encoding, elements = None, []
    for line in data[:end].decode("ascii", "replace").split("\n"):
        words = line.split()
        if not words:
            continue
        if words[0] == "format":
            encoding = words[1]
        elif words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            if words[1] == "list":
                elements[-1][2].append((words[4], PLY_TYPES[words[3]], PLY_TYPES[words[2]]))
            else:
                elements[-1][2].append((words[2], PLY_TYPES[words[1]], None))
    positions, faces = [], []
    if encoding == "ascii":
        rows = (line.split() for line in data[body:].split(b"\n") if line.strip())
        for name, count, properties in elements:
            for _ in range(count):
                row, item, at = next(rows), {}, 0
                for prop, kind, counter in properties:
                    if counter is None:
                        item[prop] = (row[at].decode(), kind)
                        at += 1
                    else:
                        n = int(row[at])
                        item[prop] = [int(float(word)) for word in row[at + 1:at + 1 + n]]
                        at += 1 + n
                if name == "vertex":
                    positions.append(tuple(coordinate(item[a][0], double or item[a][1] in "diI") for a in "xyz"))
                elif name == "face":
                    faces.append(tuple(item.get("vertex_indices", item.get("vertex_index"))))
        return positions, faces
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[encoding]
    for name, count, properties in elements:
        if all(counter is None for _, _, counter in properties):
            record = struct.Struct(order + "".join(kind for _, kind, _ in properties))
            names = [prop for prop, _, _ in properties]
            if name == "vertex":
                columns = [names.index(a) for a in "xyz"]
                for values in record.iter_unpack(data[body:body + record.size * count]):
                    positions.append(tuple(float(values[c]) for c in columns))
            body += record.size * count
            continue
        for _ in range(count):
            item = {}
            for prop, kind, counter in properties:
                n = 1
                if counter is not None:
                    n = struct.unpack_from(order + counter, data, body)[0]
                    body += struct.calcsize(counter)
                item[prop] = struct.unpack_from("%s%d%s" % (order, n, kind), data, body)
                body += struct.calcsize("%s%d%s" % (order, n, kind))
            if name == "vertex":
                positions.append(tuple(float(item[a][0]) for a in "xyz"))
            elif name == "face":
                faces.append(tuple(int(i) for i in item.get("vertex_indices", item.get("vertex_index"))))
    return positions, faces


def read_obj(data, double):
    positions, faces = [], []
    text = data.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    for line in text.split("\n"):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0] == "v":
            positions.append(tuple(coordinate(word, double) for word in words[1:4]))
        elif words[0] == "f":
            indices = [int(word.split("/")[0]) for word in words[1:]]
            faces.append(tuple(i - 1 if i > 0 else len(positions) + i for i in indices))
    return positions, faces


def read_off(data, double):
    lines = []
    for line in data.decode("utf-8", "replace").splitlines():
        words = line.split("#")[0].split()
        if words:
            lines.append(words)
    if not lines or not lines[0][0].endswith("OFF"):
        raise Unreadable("no OFF header")
    if len(lines[0]) > 1:
        counts, start = lines[0][1:], 1
    else:
        counts, start = lines[1], 2
    vertices, polygons = int(counts[0]), int(counts[1])
    positions = [tuple(coordinate(word, double) for word in words[:3]) for words in lines[start:start + vertices]]
    faces = []
    for words in lines[start + vertices:start + vertices + polygons]:
        faces.append(tuple(int(word) for word in words[1:1 + int(words[0])]))
    if len(positions) != vertices or len(faces) != polygons:
        raise Unreadable("cut short")
    return positions, faces


def read_stl(data, double):
    corners = []
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        for record in struct.iter_unpack("<12fH", data[84:]):
            corners += [record[3:6], record[6:9], record[9:12]]
    else:
        words = data.decode("ascii", "replace").split()
        at = -1
        while True:
            try:
                at = words.index("vertex", at + 1)
            except ValueError:
                break
            corners.append(tuple(coordinate(word, double) for word in words[at + 1:at + 4]))
    numbers, positions = {}, []
    indices = []
    for corner in corners:
        key = bits_of(corner)
        if key not in numbers:
            numbers[key] = len(positions)
            positions.append(tuple(corner))
        indices.append(numbers[key])
    return positions, [tuple(indices[i:i + 3]) for i in range(0, len(indices), 3)]


READERS = {"ply": read_ply, "obj": read_obj, "off": read_off, "stl": read_stl}


def read(path, double):
    extension = path.rsplit(".", 1)[-1].lower()
    if extension not in READERS:
        raise Unreadable("%s: unknown extension" % path)
    try:
        with open(path, "rb") as file:
            positions, faces = READERS[extension](file.read(), double)
    except Unreadable as error:
        raise Unreadable("%s: %s" % (path, error)) from None
    except (OSError, ValueError, KeyError, IndexError, TypeError, StopIteration, struct.error) as error:
        raise Unreadable("%s: %s: %s" % (path, type(error).__name__, error)) from None
    for number, face in enumerate(faces):
        if len(face) != 3:
            raise Unreadable("%s: face %d has %d corners; compare triangulated meshes" % (path, number, len(face)))
        if not all(0 <= v < len(positions) for v in face):
            raise Unreadable("%s: face %d names a vertex that does not exist" % (path, number))
    return positions, faces


# ---- comparing -------------------------------------------------------------------------------------------------------

def bits_of(position):
    return struct.pack("<3d", *position)


def turned(face, any_orientation):
    """One form for all cyclic shifts of a face; with any_orientation for its mirror image as well."""
    a, b, c = face
    forms = [(a, b, c), (b, c, a), (c, a, b)]
    if any_orientation:
        forms += [(a, c, b), (c, b, a), (b, a, c)]
    return min(forms)


class Side:
    """A mesh with, for each vertex, the pairs of other corners of its faces."""

    def __init__(self, positions, faces):
        self.positions = positions
        self.faces = faces
        self.around = [[] for _ in positions]
        for a, b, c in faces:
            self.around[a].append((b, c))
            self.around[b].append((c, a))
            self.around[c].append((a, b))

    def components(self):
        """Lists of vertices that are connected by faces; vertices without faces are in none."""
        seen = [False] * len(self.positions)
        for start in range(len(self.positions)):
            if seen[start] or not self.around[start]:
                continue
            seen[start] = True
            component = [start]
            for v in component:
                for pair in self.around[v]:
                    for w in pair:
                        if not seen[w]:
                            seen[w] = True
                            component.append(w)
            yield component


def histogram(items):
    counts = {}
    for item in items:
        counts[item] = counts.get(item, 0) + 1
    return counts


def first_surplus(a, b):
    """An item that `a` has more often than `b`, and both numbers; None if there is none."""
    for item, count in a.items():
        if count > b.get(item, 0):
            return item, count, b.get(item, 0)
    return None


def named(label):
    return "(%r, %r, %r)" % struct.unpack("<3d", label)


def paired(a, b, label_a, label_b, any_orientation):
    """The vertex pairs of one isomorphism, or None. Component by component: a vertex of A's component is paired with each
    candidate of B in turn and the pairing spread along faces; where a face leaves a choice, each is tried."""
    image = [None] * len(a.positions)
    taken = [False] * len(b.positions)
    candidates, places = {}, histogram(label_a)
    for w, label in enumerate(label_b):
        candidates.setdefault(label, []).append(w)
    for v, label in enumerate(label_a):
        if places[label] == 1:
            image[v] = candidates[label][0]
            taken[image[v]] = True

    def pairs_of(side, label, v, other):
        """For faces at v and `other`: the third corners, by which way round the face runs."""
        out = []
        for x, y in side.around[v]:
            if x == other:
                out.append((label[y], False if not any_orientation else None, y))
            if y == other:
                out.append((label[x], True if not any_orientation else None, x))
        return out

    def spread(v, w, trail):
        """Pairs v with w and everything that follows from it without a choice; False on a contradiction."""
        queue = [(v, w)]
        while queue:
            v, w = queue.pop()
            if image[v] is not None or taken[w]:
                if image[v] != w:
                    return False
                continue
            if label_a[v] != label_b[w] or len(a.around[v]) != len(b.around[w]):
                return False
            image[v] = w
            taken[w] = True
            trail.append((v, w))
            # What is alone of its kind around v and around w belongs together.
            kinds_a, kinds_b = {}, {}
            for side, label, vertex, kinds in ((a, label_a, v, kinds_a), (b, label_b, w, kinds_b)):
                for pair in side.around[vertex]:
                    for x in pair:
                        kinds.setdefault(label[x], set()).add(x)
            if {k: len(s) for k, s in kinds_a.items()} != {k: len(s) for k, s in kinds_b.items()}:
                return False
            for kind, members in kinds_a.items():
                if len(members) == 1:
                    queue.append((next(iter(members)), next(iter(kinds_b[kind]))))
            # So does what is alone beside an edge that is paired already.
            for n in {x for pair in a.around[v] for x in pair}:
                if image[n] is None:
                    continue
                thirds_a = {}
                thirds_b = {}
                for label, way, x in pairs_of(a, label_a, v, n):
                    thirds_a.setdefault((label, way), set()).add(x)
                for label, way, x in pairs_of(b, label_b, w, image[n]):
                    thirds_b.setdefault((label, way), set()).add(x)
                if {k: len(s) for k, s in thirds_a.items()} != {k: len(s) for k, s in thirds_b.items()}:
                    return False
                for key, members in thirds_a.items():
                    if len(members) == 1:
                        queue.append((next(iter(members)), next(iter(thirds_b[key]))))
        return True

    def undo(trail, length):
        while len(trail) > length:
            v, w = trail.pop()
            image[v] = None
            taken[w] = False

    def faces_fit(component):
        wanted = histogram(turned((image[v], image[x], image[y]), any_orientation)
                           for v in component for x, y in a.around[v])
        found = histogram(turned((image[v], x, y), any_orientation) for v in component for x, y in b.around[image[v]])
        return wanted == found

    def settle(component):
        """Depth first over the choices for one component's vertices at repeated places, without recursion."""
        trail, stack = [], []

        def open_vertex():
            # Beside what is paired already, so that a choice has consequences at once.
            for v in component:
                if image[v] is None and any(image[x] is not None for pair in a.around[v] for x in pair):
                    return v
            return next((v for v in component if image[v] is None), None)

        v = open_vertex()
        if v is None:
            return faces_fit(component)
        stack.append((v, iter(candidates[label_a[v]]), 0))
        while stack:
            v, choices, mark = stack[-1]
            undo(trail, mark)
            w = next((w for w in choices if not taken[w]), None)
            if w is None:
                stack.pop()
                continue
            if not spread(v, w, trail):
                continue
            following = open_vertex()
            if following is not None:
                stack.append((following, iter(candidates[label_a[following]]), len(trail)))
            elif faces_fit(component):
                return True
        return False

    for component in a.components():
        # Faces whose corners are all alone at their places were compared as triples of places.
        repeated = [v for v in component if places[label_a[v]] > 1]
        if repeated and not settle(repeated):
            return label_a[repeated[0]]
    return None


def difference(mesh_a, mesh_b, any_orientation):
    """The first difference in words; None if the meshes are the same."""
    (positions_a, faces_a), (positions_b, faces_b) = mesh_a, mesh_b
    if len(positions_a) != len(positions_b):
        return "%d vertices against %d" % (len(positions_a), len(positions_b))
    if len(faces_a) != len(faces_b):
        return "%d faces against %d" % (len(faces_a), len(faces_b))
    label_a = [bits_of(p) for p in positions_a]
    label_b = [bits_of(p) for p in positions_b]
    surplus = first_surplus(histogram(label_a), histogram(label_b))
    if surplus:
        return "vertex %s: %d times against %d" % (named(surplus[0]), surplus[1], surplus[2])

    def labelled(faces, label):
        return histogram(turned(tuple(label[v] for v in face), any_orientation) for face in faces)

    surplus = first_surplus(labelled(faces_a, label_a), labelled(faces_b, label_b))
    if surplus:
        return "face %s: %d times against %d" % (" ".join(named(x) for x in surplus[0]), surplus[1], surplus[2])
    if len(set(label_a)) == len(label_a):
        return None
    stuck = paired(Side(positions_a, faces_a), Side(positions_b, faces_b), label_a, label_b, any_orientation)
    if stuck is not None:
        return "the component at %s is connected differently" % named(stuck)
    return None


def main(arguments):
    parser = argparse.ArgumentParser(description="Are two mesh files the same mesh up to numbering?")
    parser.add_argument("a")
    parser.add_argument("b")
    parser.add_argument("--any-orientation", action="store_true", help="a face and its mirror image count as the same")
    parser.add_argument("--double", action="store_true", help="text coordinates are doubles, not float32")
    options = parser.parse_args(arguments)
    try:
        found = difference(read(options.a, options.double), read(options.b, options.double), options.any_orientation)
    except Unreadable as error:
        print(error, file=sys.stderr)
        return 3
    print(found if found else "equal")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
