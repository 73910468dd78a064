# SPDX-License-Identifier: MIT
"""Which symbol stands before a gate, written from docs/FORMAT.md alone ("Which symbol" to "What the geometry says")."""
import pathlib
import re

from patches import MINUS, NULL, PLUS, Patch, cut_of
from stream import Damaged
from single import add, constant, cross, exp2, f, log2, sub, times

C = constant
ROWS, INPUTS, UNITS, GATE, STATES = 10, 16, 8, 13, 40
FACE_INPUTS, CORNERS, GATE_STATES, PARENTS = 32, 5 * 3 * 40, 64, 29


def squared(a):
    return f(f(f(a[0] * a[0]) + f(a[1] * a[1])) + f(a[2] * a[2]))


def glog(x):
    return log2(max(x, C(0.05)))


def single_sum(values):
    total = 0.0
    for value in values:
        total = f(total + value)
    return total


def bounded(x, low, high):
    return min(max(x, low), high)


class FaceWeights:
    def __init__(self, table):
        self.hidden = table(FACE_INPUTS, UNITS)
        self.gate = table(GATE, UNITS)
        self.bias = table(UNITS)
        self.output = table(UNITS)
        self.linear = table(FACE_INPUTS)
        self.corner = table(CORNERS)
        self.state = table(GATE_STATES)
        self.parent = table(PARENTS)


class Trained:
    """The table of trained numbers."""

    def __init__(self):
        path = pathlib.Path(__file__).parents[2] / "codec/conquest/symbol_weights.cpp"
        text = path.read_text(encoding="utf-8").split("kSymbolWeights = {")[1]
        numbers = [int(x) / 1024 for x in re.findall(r"-?\d+", re.sub(r"//.*", "", text))]
        self.at = 0

        def table(*shape):
            if not shape:
                self.at += 1
                return numbers[self.at - 1]
            return [table(*shape[1:]) for _ in range(shape[0])]

        self.hidden = table(ROWS, INPUTS, UNITS)
        self.gate = table(ROWS, GATE, UNITS)
        self.bias = table(ROWS, UNITS)
        self.output = table(ROWS, UNITS)
        self.linear = table(ROWS, INPUTS)
        self.state = table(2, STATES)
        self.faces = [FaceWeights(table) for _ in range(2)]
        assert self.at == len(numbers)


TRAINED = Trained()


class Hypothesis:
    def __init__(self, symbol, patch, states, inputs):
        self.symbol = symbol
        self.patch = patch
        self.states = states
        self.inputs = [bounded(x, -4.0, 4.0) for x in inputs]
        self.row = 0 if symbol == NULL else symbol - 2 if symbol < 8 else symbol - 3


class Face:
    def __init__(self, inputs, corners, null):
        self.inputs = [bounded(x, -4.0, 4.0) for x in inputs]
        self.corners = corners
        self.null = null


def lanes(values):
    c = [0.0] * 4
    for i, value in enumerate(values):
        c[i % 4] = f(c[i % 4] + value)
    return f(f(c[0] + c[1]) + f(c[2] + c[3]))


def features_of_gate(state, parent):
    front, tags = state // 16, state % 4
    g = [0.0] * GATE
    g[0], g[1], g[2] = float(front > 0), float(front == 2), float(front == 3)
    g[3], g[4] = float(state // 4 % 2), float(state // 8 % 2)
    g[5], g[6] = float(tags % 2), float(tags // 2)
    kind = 0 if parent < 2 else 1 + (parent - 2) // 5 if parent < 22 else 5
    if kind < 5:
        g[7 + kind] = 1.0
    g[12] = f(C(0.3) * (parent if parent < 2 else (parent - 2) % 5))
    return g


def hidden_units(inputs, g, hidden, gate, bias):
    units = []
    for q in range(UNITS):
        a = bias[q]
        for i in range(7):
            a = f(a + f(g[i] * gate[i][q]))
        b = 0.0
        for i in range(7, 13):
            b = f(b + f(g[i] * gate[i][q]))
        whole = sum(int(2048 * x) * int(1024 * weights[q]) for x, weights in zip(inputs, hidden))
        units.append(max(f(f(f(whole) * 2.0 ** -21) + f(a + b)), 0.0))
    return units


def against(share, rest):
    return int(bounded(f(f(1 - f(share / max(rest, C(1e-9)))) * 65536), 24.0, 65512.0))


class FaceModel:
    def __init__(self, kind):
        self.trained = trained = TRAINED.faces[kind]
        self.linear, self.output = list(trained.linear), list(trained.output)
        self.corner, self.state, self.parent = list(trained.corner), list(trained.state), list(trained.parent)

    def share(self, face, state, parent):
        """And the units, for learning."""
        units = hidden_units(face.inputs, features_of_gate(state, parent), self.trained.hidden, self.trained.gate,
                             self.trained.bias)
        score = lanes([f(x * w) for x, w in zip(units + face.inputs, self.output + self.linear)])
        k = [0.0 if corner is None else self.corner[corner] for corner in face.corners]
        score = f(score + f(f(f(k[0] + k[1]) + f(k[2] + k[3])) + f(k[4] + f(self.state[state] + self.parent[parent]))))
        return f(1 / f(1 + exp2(bounded(-score, -30.0, 30.0)))), units

    def learn(self, face, state, parent, units, d):
        SymbolModel.adapt(self.linear, f(C(0.007) * d), face.inputs)
        SymbolModel.adapt(self.output, f(C(0.005) * d), units)
        step = f(C(0.004) * d)
        for corner in face.corners:
            if corner is not None:
                self.corner[corner] = f(self.corner[corner] + step)
        self.state[state] = f(self.state[state] + step)
        self.parent[parent] = f(self.parent[parent] + step)


class SymbolModel:
    def __init__(self, kind):
        self.face = FaceModel(kind)
        self.linear = [list(row) for row in TRAINED.linear]
        self.output = [list(row) for row in TRAINED.output]
        self.state = [list(row) for row in TRAINED.state]

    def read(self, reader, surroundings, gate, tag, conquered, state, parent, clear_above):
        m = surroundings.mesh
        face = surroundings.face(gate, tag, conquered)
        share, units = self.face.share(face, state, parent)
        clear = share > clear_above
        if clear and reader.bit_at(against(share, 1.0)):
            self.face.learn(face, state, parent, units, f(1 - share))
            return face.null
        hypotheses = surroundings.look(gate, tag[m.origin(gate)], tag[m.target(gate)], conquered)
        if not clear:
            hypotheses = [face.null] + hypotheses
        if not hypotheses:
            raise Damaged("no patch fits")
        holds = self.decide(reader, hypotheses, state, parent) if len(hypotheses) > 1 else hypotheses[0]
        self.face.learn(face, state, parent, units, f((1 if holds.symbol == NULL else 0) - share))
        return holds

    def decide(self, reader, hypotheses, state, parent):
        g = features_of_gate(state, parent)
        hidden, scores = [], []
        for h in hypotheses:
            units = hidden_units(h.inputs, g, TRAINED.hidden[h.row], TRAINED.gate[h.row], TRAINED.bias[h.row])
            values = units + h.inputs
            score = lanes([f(x * w) for x, w in zip(values, self.output[h.row] + self.linear[h.row])])
            s = [self.state[0 if h.row == 0 else 1][v] for v in h.states] + [0.0] * (6 - len(h.states))
            score = f(score + f(f(f(s[0] + s[1]) + f(s[2] + s[3])) + f(s[4] + s[5])))
            hidden.append(units)
            scores.append(bounded(score, -60.0, 60.0))
        most = max(scores)
        powers = [exp2(max(f(score - most), -30.0)) for score in scores]
        missing = [exp2(-30.0)] * (-len(powers) % 4)
        share = f(1 / lanes(powers + missing))
        shares = [f(p * share) for p in powers]
        rest = 1.0
        holds = 0
        while holds + 1 < len(hypotheses):
            if reader.bit_at(against(shares[holds], rest)):
                break
            rest = f(rest - shares[holds])
            holds += 1
        for i, h in enumerate(hypotheses):
            d = f((1 if i == holds else 0) - shares[i])
            self.adapt(self.linear[h.row], f(C(0.007) * d), h.inputs)
            self.adapt(self.output[h.row], f(C(0.005) * d), hidden[i])
            states = self.state[0 if h.row == 0 else 1]
            for v in h.states:
                states[v] = f(states[v] + f(C(0.004) * d))
        return hypotheses[holds]

    @staticmethod
    def adapt(weights, k, values):
        for j, value in enumerate(values):
            weights[j] = f(weights[j] + f(k * value))


class Sums:
    def __init__(self):
        self.A = self.E = self.F = 0.0

    def add(self, area, edge):
        self.A, self.E, self.F = f(self.A + area), f(self.E + edge), f(self.F + 1)

    def fade(self, by):
        self.A, self.E, self.F = f(self.A * by), f(self.E * by), f(self.F * by)


class Corner(Sums):
    def __init__(self, point, faces, valence):
        super().__init__()
        self.at = tuple(f(x) for x in point)
        self.open = faces
        self.valence = valence


class Surroundings:
    """What one pass knows of the coarse faces and of those that are refined already."""

    def __init__(self, mesh, cleaning, previous):
        self.mesh = mesh
        self.cleaning = cleaning
        self.previous = previous
        self.all = Sums()
        self.has_boundary = None in mesh.opposite
        self.vertex = []
        for v, point in enumerate(mesh.points):
            faces = min(mesh.valence(v), 10000)
            boundary = mesh.outgoing[v] is not None and mesh.is_boundary(v)
            self.vertex.append(Corner(point, faces, faces + 3 if boundary else faces))
        self.area, self.log_area, self.log_length = [], [], []
        for face in mesh.faces:
            a, b, c = (self.vertex[v].at for v in face)
            normal = squared(cross(sub(b, a), sub(c, a)))
            self.area.append(f(normal ** 0.5))
            self.log_area.append(f(0.5 * glog(normal)))
            self.log_length += [f(0.5 * glog(squared(d))) for d in (sub(b, a), sub(c, b), sub(a, c))]

    def recent(self, v):
        return float(v >= self.previous)

    def look(self, gate, s, t, conquered):
        """The patches that could stand before the gate, whose face was looked at last; s, t: tags."""
        m = self.mesh
        found = []
        symbols = [6, 5, 4, 3]
        if self.cleaning:
            symbols = [3]
        elif self.near_boundary(gate):
            symbols = [10, 11, 12, 8, 9] + symbols
        for symbol in symbols:
            cut, closing = cut_of(symbol, PLUS, MINUS) if self.cleaning else cut_of(symbol, s, t)
            patch = Patch.collect(m, gate, cut, closing, conquered)
            if patch:
                found.append(self.describe(symbol, patch, conquered))
        return found

    def near_boundary(self, gate):
        m = self.mesh
        return self.has_boundary and any(m.is_boundary(v) for v in (m.origin(gate), m.target(gate), m.apex(gate)))

    def rlog(self, x):
        return f(0.5 * log2(f(f(x * self.u) + C(0.003))))

    @staticmethod
    def state(open_faces, valence):
        return 10 * bounded(open_faces, 0, 3) + bounded(valence, 2, 11) - 2

    def face(self, gate, tag, conquered):
        m = self.mesh
        sv, tv, fv = m.origin(gate), m.target(gate), m.apex(gate)
        S, T, front = (self.vertex[v] for v in (sv, tv, fv))
        p = f(0.5 / max(self.all.F, 1.0))
        k = f(f(S.F + T.F) + 0.5)
        self.a = f(f(f(f(S.A + T.A) + front.A) + f(p * self.all.A)) / f(k + front.F))
        self.e = f(f(f(S.E + T.E) + f(p * self.all.E)) / k)
        self.a_s, self.a_t = f(S.A / max(S.F, 1.0)), f(T.A / max(T.F, 1.0))
        self.u = exp2(f(-2 * self.e))
        total = add(add(S.at, T.at), front.at)

        def kite(h, corner):
            return squared(add(sub(add(corner.at, corner.at), total), self.vertex[m.apex(h)].at))

        def few(n):
            return f(C(0.2) * min(n, 16))

        def corner_of(v, i):
            tags = {None: 0, PLUS: 1, MINUS: 2}[tag[v]]
            vertex = self.vertex[v]
            return (3 * i + tags) * 40 + self.state(vertex.open, min(vertex.valence, 15))

        behind = m.opposite[gate]
        back = 0.0 if behind is None else kite(behind, front)
        kites, beyond = [], [[0.0] * 7, [0.0] * 7]
        corners = [corner_of(sv, 0), corner_of(tv, 1), corner_of(fv, 2), None, None]
        recent_beyond = 0.0
        for side, (edge, corner) in enumerate(((m.next(gate), S), (m.prev(gate), T))):
            h = m.opposite[edge]
            if h is None:
                continue
            if conquered[h // 3]:
                kites.append(kite(h, corner))
                continue
            v = m.apex(h)
            beyond[side] = [f(self.log_area[h // 3] - self.a), f(self.log_length[m.next(h)] - self.e),
                            f(self.log_length[m.prev(h)] - self.e), 1.0, self.rlog(kite(h, corner)),
                            f(few(self.vertex[v].valence) - C(1.2)), few(self.vertex[v].open)]
            recent_beyond += self.recent(v)
            corners[3 + side] = corner_of(v, 3 + side)
        both = f(0.5 * f(kites[0] + kites[1])) if len(kites) > 1 else kites[0] if kites else 0.0
        G, X, Y = (self.log_length[h] for h in (gate, m.next(gate), m.prev(gate)))
        inputs = [f(self.log_area[gate // 3] - self.a), f(f(X + Y) - f(2 * self.e)), f(few(front.valence) - C(1.2)), few(front.open),
                  few(S.open + T.open), self.recent(fv), f(max(X, Y) - G), f(G - self.e),
                  f(f(few(S.valence) + few(T.valence)) - C(2.4)), f(X - Y), self.rlog(back),
                  self.rlog(both) if kites else 0.0, self.recent(sv) + self.recent(tv), f(self.a_s - self.a), f(self.a_t - self.a),
                  few(front.F)]
        inputs += beyond[0][:4] + beyond[1][:4]
        inputs += [side[k] for k in (4, 5, 6) for side in beyond]
        inputs += [float(self.near_boundary(gate)), recent_beyond]
        states = [self.state(v.open - 1, min(v.valence, 15)) for v in (T, front, S)]
        return Face(inputs, corners, Hypothesis(NULL, None, states, inputs[:INPUTS]))

    def describe(self, symbol, patch, conquered):
        n = patch.size
        share = f(1 / n)
        ring = [self.vertex[v] for v in patch.ring]
        states, regular = [], 0
        for i, v in enumerate(ring):
            change = patch.star_faces(i) - patch.cut.at[i]
            w = bounded(min(v.valence, 15) + change, 2, 11)
            states.append(self.state(v.open - patch.cut.at[i], w))
            regular += abs(w - 6) - abs(w - change - 6)
        areas = [self.log_area[face] for face in patch.faces]
        star = n if patch.closing is None else n - 1
        log_area = glog(f(single_sum(self.area[face] for face in patch.faces) * f(1 / star)))
        mean = (0.0, 0.0, 0.0)
        for v in ring:
            mean = add(mean, v.at)
        mean = times(mean, share)
        z = [squared(sub(v.at, mean)) for v in ring]
        spokes = f(f(f(z[0] + z[1]) + z[2]) if n == 3 else f(f(f(z[0] + z[1]) + f(z[2] + z[3])) + single_sum(z[4:])))
        l = [self.log_length[h] for h in patch.inside]
        m = f(single_sum(l) * share)
        kites, by_edge = [], [0.0] * 8
        for i, h in enumerate(patch.outside):
            if h is not None and conquered[h // 3]:
                apex = self.vertex[self.mesh.apex(h)].at
                kites.append(squared(sub(sub(apex, ring[(i + 1) % n].at), sub(ring[i].at, mean))))
                by_edge[i] = kites[-1]
        diagonals = [squared(sub(ring[a].at, ring[b].at)) for _, (a, b) in patch.cut.entries[1:]]
        back = by_edge[n - 1]
        average = f(lanes(by_edge) * f(1 / len(kites))) if kites else 0.0
        inputs = [f(log_area - self.a), f(C(0.3) * regular), self.rlog(min(diagonals)) if n > 3 else 0.0, f(m - self.e),
                  f(max(l) - m), f(single_sum(self.recent(v) for v in patch.ring) * share),
                  self.rlog(f(single_sum(diagonals) * f(1 / (n - 3)))) if n > 3 else 0.0,
                  self.rlog(max(diagonals)) if n > 3 else 0.0, f(min(l) - m), self.rlog(max(z)), self.rlog(min(z)),
                  self.rlog(back) if back > 0 else 0.0, self.rlog(average) if kites else 0.0, f(len(kites) * share),
                  f(min(areas) - self.a), f(max(areas) - self.a)]
        hypothesis = Hypothesis(symbol, patch, states, inputs)
        hypothesis.log_area = log_area
        hypothesis.log_spoke = f(0.5 * glog(f(spokes * share)))
        return hypothesis

    def keep(self, face):
        edge = f(f(f(self.log_length[3 * face] + self.log_length[3 * face + 1]) + self.log_length[3 * face + 2]) * f(1 / 3))
        for v in self.mesh.faces[face]:
            self.vertex[v].add(self.log_area[face], edge)
            self.vertex[v].open = max(self.vertex[v].open - 1, 0)
        self.all.fade(C(0.98))
        self.all.add(self.log_area[face], edge)

    def opened(self, hypothesis, point):
        patch = hypothesis.patch
        n = patch.size
        self.all.fade(C(0.9))
        centre = Corner(point, 0, n if patch.closing is None else n + 2)
        for i in range(n):
            v = self.vertex[patch.ring[i]]
            v.open = max(v.open - patch.cut.at[i], 0)
            v.valence = bounded(v.valence + patch.star_faces(i) - patch.cut.at[i], 0, 20000)
            if i == patch.closing:
                continue
            edge = f(f(f(2 * hypothesis.log_spoke) + self.log_length[patch.inside[i]]) * f(1 / 3))
            for corner in (v, self.vertex[patch.ring[(i + 1) % n]], self.all, centre):
                corner.add(hypothesis.log_area, edge)
        self.vertex.append(centre)
