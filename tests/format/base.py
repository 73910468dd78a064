# SPDX-License-Identifier: MIT
"""The base packet's mesh, written from docs/FORMAT.md alone ("Base packet")."""
import math
from heapq import heappop, heappush

from base_models import NumberModel, Numbers, OddsModel
from stream import Bit, Damaged, Unsigned
from vectors import add, angle, bounded, cross, dot, length, sub, times, vector


class Outlook:
    """What the geometry says of what lies beyond a gate."""


def read_reflection(reader):
    """By axis the sum of a coordinate and its image, half steps, None where it does not flip; None without a reflection."""
    if not reader.raw(1):
        return None
    return [2 * reader.raw(25) if reader.raw(1) else None for _ in range(3)]


class BaseMesh:
    def __init__(self, reader, base, header):
        self.reader = reader
        self.header = header
        self.shift = header.shift
        if self.shift >= base.bits:
            raise Damaged("shift")
        self.structure = reader.raw(2)
        if self.structure == 3:
            raise Damaged("structure")
        self.reflection = read_reflection(reader)
        self.most = base.most >> self.shift
        self.cells = []
        self.faces = []
        self.seeds = []
        # By half-edge: neighbours in the chain; open, boundary, or None.
        self.after, self.before, self.state = [], [], []
        self.open_count = 0
        self.leaving = []  # by vertex: half-edges, oldest first
        self.known_angles = []
        self.queue = []
        self.queued = 0
        self.boundary_model = [Bit() for _ in range(3)]
        self.closing = [OddsModel(), OddsModel()]
        self.new = OddsModel()
        self.rank = Unsigned()
        self.looked_at = 0
        self.start_numbers, self.numbers_model = NumberModel(), NumberModel()
        self.share = [[0] * 8 for _ in range(3)]
        self.hit = [[[Bit() for _ in range(7)] for _ in range(8)] for _ in range(3)]
        self.matrix = [[0.0] * 4 for _ in range(4)]
        self.right = [0.0] * 4
        self.change = [0.0] * 4
        self.new_vertices = 0
        self.flat_sum, self.across_sum, self.seen = 2.75, 2.75, 5.0

        components = Unsigned().read(reader)
        if components > header.faces:
            raise Damaged("components")
        self.axes = [Numbers(self.most) for _ in range(3)]
        if components:
            self.has_boundary = reader.raw(1)
            for axis in self.axes:
                axis.read_list(reader, header.vertices)
        self.start = (self.most // 2,) * 3
        self.jump = self.most * 0.25 + 0.5
        self.edge = self.most * 0.125 + 0.5
        for _ in range(components):
            self.read_component()

    # The region's border.

    def origin(self, h):
        return self.faces[h // 3][h % 3]

    def target(self, h):
        return self.faces[h // 3][(h + 1) % 3]

    def third(self, h):
        return self.faces[h // 3][(h + 2) % 3]

    def is_open(self, h):
        return self.state[h] == "open"

    def link(self, h, following):
        self.after[h] = following
        self.before[following] = h

    def add_face(self, a, b, c):
        if len(self.faces) == self.header.faces:
            raise Damaged("too many faces")
        h = 3 * len(self.faces)
        self.faces.append((a, b, c))
        for i in range(3):
            self.after.append(h + i)
            self.before.append(h + i)
            self.state.append("open")
            self.leaving[self.faces[-1][i]].append(h + i)
        self.open_count += 3
        return h

    def leave(self, h, state):
        self.state[h] = state
        self.open_count -= 1

    def runs(self, a, b):
        return any(self.target(h) == b for h in self.leaving[a][:-65:-1])

    def close_if_met(self, h):
        for other in reversed(self.leaving[self.target(h)]):
            if self.is_open(other) and self.target(other) == self.origin(h):
                before_h, after_h = self.before[h], self.after[h]
                before_other, after_other = self.before[other], self.after[other]
                self.link(before_h, after_other)
                self.link(before_other, after_h)
                self.leave(h, None)
                self.leave(other, None)
                return

    def attach(self, gate, entry, vertex):
        h = self.add_face(self.target(gate), self.origin(gate), vertex)
        self.leave(h, None)
        self.leave(gate, None)
        left, right = self.before[gate], self.after[gate]
        self.link(left, h + 1)
        if entry is None:
            self.link(h + 1, h + 2)
        else:
            arriving = self.before[entry]
            self.link(h + 1, entry)
            self.link(arriving, h + 2)
        self.link(h + 2, right)
        self.close_if_met(h + 1)
        self.close_if_met(h + 2)
        return h

    # Geometry.

    def at(self, v):
        return vector(self.cells[v])

    def learn_angles(self, face):
        for i in range(3):
            here = self.at(face[i])
            self.known_angles[face[i]] += angle(sub(self.at(face[(i + 1) % 3]), here), sub(self.at(face[(i + 2) % 3]), here))

    def gap(self, h):
        v = self.origin(h)
        here = self.at(v)
        between = angle(sub(self.at(self.origin(self.before[h])), here), sub(self.at(self.target(h)), here))
        return 2 * math.pi - between if self.known_angles[v] < math.pi else between

    def push(self, h):
        if self.is_open(h):
            heappush(self.queue, (min(self.gap(h), self.gap(self.after[h])), self.queued, h))
            self.queued += 1

    def look(self, gate):
        o = Outlook()
        before, after = self.before[gate], self.after[gate]
        av, bv, cv = self.origin(gate), self.target(gate), self.third(gate)
        pv, nv = self.origin(before), self.target(after)
        a, b, c, p, n = (self.at(v) for v in (av, bv, cv, pv, nv))
        o.middle = times(add(a, b), 0.5)
        o.length = max((length(sub(b, a)) + length(sub(c, b)) + length(sub(a, c))) * (1.0 / 3), 0.5)
        normal = cross(sub(b, a), sub(c, a))
        area = length(normal)
        o.normal = times(normal, 1.0 / area) if area > 1e-9 else (0.0, 0.0, 0.0)
        gap_left, gap_right = self.gap(gate), self.gap(after)
        left, right = self.is_open(before), self.is_open(after)
        zero = (0.0, 0.0, 0.0)
        f0 = sub(o.middle, c)
        f1 = times(o.normal, length(f0))

        def two(gap):
            return max(0.0, 1 - abs(gap * (3 / math.pi) - 2))

        f2 = times(sub(sub(sub(add(p, b), a), o.middle), f0), two(gap_left)) if left else zero
        f3 = times(sub(sub(sub(add(n, a), b), o.middle), f0), two(gap_right)) if right else zero
        o.features = (f0, f1, f2, f3)
        o.exact = [sub(add(a, b), c), sub(add(p, b), a) if left else None, sub(add(n, a), b) if right else None,
                   a, b, c, p if left else None, n if right else None]
        offset = zero
        for f, usual, change in zip(o.features, (0.8, -0.15, 0.35, 0.35), self.change):
            offset = add(offset, times(f, usual + change))
        reach = length(offset)
        most = 2.5 * o.length
        if not reach < 1e15:
            offset = f0
        elif reach > most:
            offset = times(offset, most / reach)
        o.position = add(o.middle, offset)
        o.flat = o.length * (self.flat_sum / self.seen) + 0.02
        o.across = o.length * (self.across_sum / self.seen) + 0.02

        has_left = left and pv != bv
        has_right = right and nv != av
        both = has_left and has_right
        three = both and pv == nv
        four = both and self.before[before] == self.after[after]

        def side(vertex, entry, v, w, gap, third_edge):
            if vertex == cv or self.runs(*third_edge):
                return None
            q, here, there = self.at(vertex), self.at(v), self.at(w)
            face = cross(sub(a, b), sub(q, b))
            size = length(face)
            bend = dot(face, o.normal) * (1.0 / size) if size > 1e-9 else 0.0
            miss = min(4.0, length(sub(q, o.position)) / o.length)
            faces_here, faces_far = len(self.leaving[v]), len(self.leaving[vertex])
            odds = (-0.43 * gap - 0.49 * miss + 0.67 * max(0.0, miss - 0.7) -
                    0.94 * min(4.0, length(sub(q, there)) / o.length) +
                    0.47 * min(4.0, length(sub(q, here)) / o.length) + 0.44 * bend + (0.57 if faces_here == 2 else 0) +
                    (0.19 if faces_here == 3 else 0) - (0.91 if three else 0) + (0.23 if four else 0) -
                    0.30 * min(8.0, 2 * math.pi - self.known_angles[v] - angle(sub(here, there), sub(q, here))) +
                    0.14 * min(8.0, self.known_angles[vertex]) + (0.56 if faces_far == 1 else 0) +
                    (0.16 if faces_far == 2 else 0))
            return (vertex, entry, odds)

        o.left = side(pv, before, av, bv, gap_left, (pv, bv)) if has_left else None
        o.right = side(nv, self.after[after], bv, av, gap_right, (av, nv)) if has_right else None
        return o

    def learn(self, o, cell):
        actual = vector(cell)
        residual = sub(actual, o.position)
        along = dot(residual, o.normal)
        flat = sub(residual, times(o.normal, along))
        self.flat_sum = self.flat_sum * 0.995 + min(4.0, length(flat) * 0.6 / o.length)
        self.across_sum = self.across_sum * 0.995 + min(4.0, abs(along) / o.length)
        self.seen = self.seen * 0.995 + 1
        target = sub(actual, o.middle)
        for f, usual in zip(o.features, (0.8, -0.15, 0.35, 0.35)):
            target = sub(target, times(f, usual))
        importance = 1.0 / (o.length * o.length)
        for i in range(4):
            for j in range(i + 1):
                self.matrix[i][j] = self.matrix[i][j] * 0.995 + importance * dot(o.features[i], o.features[j])
            self.right[i] = self.right[i] * 0.995 + importance * dot(o.features[i], target)
        self.new_vertices += 1
        if self.new_vertices % 4 != 1:
            return
        factor = [[0.0] * 4 for _ in range(4)]
        solution = [0.0] * 4
        for i in range(4):
            for j in range(i + 1):
                total = self.matrix[i][j] + (1.5 if i == j else 0)
                for k in range(j):
                    total -= factor[i][k] * factor[j][k]
                if i == j:
                    if not total > 1e-9:
                        return
                    factor[i][i] = math.sqrt(total)
                else:
                    factor[i][j] = total / factor[j][j]
            known = self.right[i]
            for k in range(i):
                known -= factor[i][k] * solution[k]
            solution[i] = known / factor[i][i]
        for i in reversed(range(4)):
            known = solution[i]
            for k in range(i + 1, 4):
                known -= factor[k][i] * solution[k]
            solution[i] = known / factor[i][i]
        self.change = solution

    # The mesh.

    def new_vertex(self):
        if len(self.leaving) == self.header.vertices:
            raise Damaged("too many vertices")
        self.leaving.append([])
        self.known_angles.append(0.0)
        return len(self.leaving) - 1

    def read_start(self, around, spread):
        cell = []
        for axis in range(3):
            numbers = self.axes[axis]
            number = self.start_numbers.read(self.reader, numbers.number(around[axis]), numbers.spread(around[axis], spread),
                                             numbers.most())
            cell.append(numbers.cell(number))
        self.cells.append(tuple(cell))
        return tuple(cell)

    def read_component(self):
        first = len(self.leaving)
        for _ in range(3):
            self.new_vertex()
        h = self.add_face(first, first + 1, first + 2)
        self.link(h, h + 1)
        self.link(h + 1, h + 2)
        self.link(h + 2, h)
        a = self.read_start(self.start, self.jump)
        if first == 0:
            self.jump = max(0.5, self.most * 0.25)
        else:
            self.jump = max(0.5, self.jump * 0.8 + length(sub(vector(a), vector(self.start))) * 0.5 * 0.2)
        self.start = a
        b = self.read_start(a, self.edge)
        d = max(0.5, length(sub(vector(a), vector(b))) * 0.5)
        self.edge = d if first == 0 else self.edge * 0.7 + d * 0.3
        self.read_start(tuple((x + y) // 2 for x, y in zip(a, b)), d)
        self.learn_angles(self.faces[-1])
        for i in range(3):
            self.push(h + i)
        while self.queue:
            gate = heappop(self.queue)[2]
            if self.is_open(gate):
                self.grow(gate)
        self.seeds.append((first, first + 1))

    def grow(self, gate):
        o = self.look(gate)
        before, after = self.before[gate], self.after[gate]
        if self.has_boundary:
            beside = (self.state[before] == "boundary") + (self.state[after] == "boundary")
            if self.reader.bit(self.boundary_model[beside]):
                self.leave(gate, "boundary")
                self.push(before)
                self.push(after)
                return
        entry = self.read_entry(gate, o)
        if entry is None:
            vertex = self.new_vertex()
            arriving = None
        else:
            vertex = self.origin(entry)
            if vertex in (self.origin(gate), self.target(gate)):
                raise Damaged("a face with a vertex twice")
            arriving = self.before[entry]
        h = self.attach(gate, entry, vertex)
        if entry is None:
            cell = self.read_position(o)
            self.cells.append(cell)
            self.learn(o, cell)
        self.learn_angles(self.faces[-1])
        for other in (before, after, entry, arriving, h + 1, h + 2):
            if other is not None:
                self.push(other)

    def read_entry(self, gate, o):
        """The border half-edge whose origin is the third vertex; None: a new vertex."""
        odds_left = o.left[2] if o.left else 0.0
        odds_right = o.right[2] if o.right else 0.0
        sides = [o.right, o.left] if odds_right > odds_left else [o.left, o.right]
        for place, side in enumerate(sides):
            if side is None or (place == 1 and sides[0] and sides[0][1] == side[1]):
                continue
            if self.closing[place].read(self.reader, side[2]):
                return side[1]
        self.looked_at += self.open_count
        if self.looked_at > 1 << 24:
            if self.new.read(self.reader, 3.0):
                return None
            entry = self.reader.raw((3 * len(self.faces) - 1).bit_length())
            if entry >= len(self.state) or self.state[entry] is None:
                raise Damaged("entry")
            return entry
        others = self.others(gate, o)
        if not others:
            return None
        d = min(4.0, math.sqrt(float(others[0][0])) / o.length)
        if self.new.read(self.reader, 1.53 * d + 1.22 * max(0.0, d - 0.5) - 0.66 * max(0.0, d - 1.2) - 0.35):
            return None
        rank = self.rank.read(self.reader)
        if rank >= len(others):
            raise Damaged("rank")
        return others[rank][1]

    def others(self, gate, o):
        a, b = self.origin(gate), self.target(gate)
        barred = {a, b, self.third(gate)} | {side[0] for side in (o.left, o.right) if side}
        around = [int(x) for x in o.position]
        found = []

        def consider(h):
            v = self.origin(h)
            if v not in barred:
                found.append((sum((x - y) ** 2 for x, y in zip(self.cells[v], around)), h))

        for h, state in enumerate(self.state):
            if state == "open":
                consider(h)
                if self.state[self.after[h]] == "boundary":
                    consider(self.after[h])
        found.sort()
        near = [x for x in found[:16] if not (self.runs(a, self.origin(x[1])) or self.runs(self.origin(x[1]), b))]
        return near + found[16:]

    def read_position(self, o):
        n = o.normal
        order = [0, 1, 2]
        for i in (0, 1, 0):
            if n[order[i]] * n[order[i]] > n[order[i + 1]] * n[order[i + 1]]:
                order[i], order[i + 1] = order[i + 1], order[i]
        t = o.flat * o.flat
        difference = o.across * o.across - t
        factor = [[0.0] * 3 for _ in range(3)]
        z = [0.0] * 3
        cell = [0] * 3
        hits = 0
        for i, axis in enumerate(order):
            expected = o.position[axis]
            variance = difference * n[axis] * n[axis] + t
            for j in range(i):
                total = difference * n[axis] * n[order[j]]
                for k in range(j):
                    total -= factor[i][k] * factor[j][k]
                factor[i][j] = total / factor[j][j]
                variance -= factor[i][j] * factor[i][j]
                expected += factor[i][j] * z[j]
            factor[i][i] = math.sqrt(max(variance, 4e-4))
            numbers = self.axes[axis]
            exact = [None if value is None else numbers.nearest(value[axis]) for value in o.exact]
            number = None
            for kind, value in enumerate(exact):
                if number is not None or value is None or value in exact[:kind] or self.share[axis][kind] < 10922:
                    continue
                if self.reader.bit(self.hit[axis][kind][hits]):
                    number = value
            hits = 2 * hits + (1 if number is None else 2)
            if number is None:
                number = self.numbers_model.read(self.reader, numbers.number(expected),
                                                 numbers.spread(expected, factor[i][i]), numbers.most())
            for kind, value in enumerate(exact):
                if value is not None:
                    share = self.share[axis][kind]
                    self.share[axis][kind] += (65536 - share) // 32 if value == number else -(share // 32)
            cell[axis] = numbers.cell(number)
            z[i] = bounded((cell[axis] - expected) / factor[i][i], -8.0, 8.0)
        return tuple(cell)
