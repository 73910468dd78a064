# SPDX-License-Identifier: MIT
"""Refinement packets, written from docs/FORMAT.md alone ("Refinement packet", "The walk")."""
from geometry import Expectation, Positions, Predictor, guess
from patches import MINUS, NULL, PLUS, insert_ear
from single import f
from stream import Bit, Damaged, Signed
from symbols import Surroundings, SymbolModel

DECIMATING, CLEANING, EARS = range(3)


def middle(cell, shift):
    return tuple((c << (shift + 1)) + (1 << shift) - 1 for c in cell)


class State:
    """All that lives from packet to packet."""

    def __init__(self, base, mesh, shift, seeds, structure, reflection):
        self.base = base
        self.mesh = mesh
        self.shift = shift
        self.seeds = seeds
        self.symbols = {DECIMATING: SymbolModel(0), CLEANING: SymbolModel(1)}
        self.ear = Bit()
        self.positions = Positions(structure, reflection)
        self.predictor = Predictor()
        self.isolated = [Signed() for _ in range(3)]
        self.before_last_pass = 0


def walk(state, reader, kind, header, previous, clear):
    mesh = state.mesh
    surroundings = Surroundings(mesh, kind == CLEANING, previous)
    model = state.symbols[kind]
    face_done = [False] * len(mesh.faces)
    order = []  # faces as they become conquered
    vertex_done = [False] * len(mesh.points)
    tag = [None] * len(mesh.points)
    for s, t in state.seeds:
        vertex_done[s] = vertex_done[t] = True
        tag[t], tag[s] = PLUS, MINUS
        first = next((h for h in mesh.leaving(s) if mesh.target(h) == t), None)
        if first is None:
            raise Damaged("a seed without its edge")
        queue = [(first, 27), (mesh.opposite[first], 27)]
        for gate, parent in queue:
            if gate is None or face_done[gate // 3]:
                continue
            sv, tv, front = mesh.origin(gate), mesh.target(gate), mesh.apex(gate)

            def taken(h):
                across = mesh.opposite[h]
                return across is None or face_done[across // 3]

            f_state = {None: 1, PLUS: 2, MINUS: 3}[tag[front]] if vertex_done[front] else 0
            beside = 2 * taken(mesh.next(gate)) + taken(mesh.prev(gate))
            gate_state = (4 * f_state + beside) * 4 + 2 * (tag[sv] == PLUS) + (tag[tv] == PLUS)
            holds = model.read(reader, surroundings, gate, tag, face_done, gate_state, parent, clear)
            if holds.symbol == NULL:
                surroundings.keep(gate // 3)
                face_done[gate // 3] = True
                order.append(gate // 3)
                vertex_done[front] = True
                if tag[front] is None:
                    tag[front] = MINUS if tag[sv] == PLUS and tag[tv] == PLUS else PLUS
                queue.append((mesh.opposite[mesh.next(gate)], 0))
                queue.append((mesh.opposite[mesh.prev(gate)], 1))
                continue
            patch = holds.patch
            _, point = patch.open(mesh)
            if len(mesh.points) > header.vertices or len(mesh.faces) > header.faces:
                raise Damaged("more than the header's vertices or faces")
            surroundings.opened(holds, point)
            face_done += [True] * (len(mesh.faces) - len(face_done))
            vertex_done.append(True)
            tag.append(PLUS)
            for face in patch.faces:
                face_done[face] = True
            order += patch.star
            for v in patch.ring:
                vertex_done[v] = True
            if kind == DECIMATING:
                for i, new in enumerate(patch.cut.tags):
                    if tag[patch.ring[i + 1]] is None:
                        tag[patch.ring[i + 1]] = new
                for i in range(patch.size - 1):
                    queue.append((patch.outside[i], 22 + i if holds.symbol >= 8 else 2 + 5 * (holds.symbol - 3) + i))
                continue
            for x in patch.outside[:2]:
                if x is None or face_done[x // 3]:
                    continue
                surroundings.keep(x // 3)
                face_done[x // 3] = True
                order.append(x // 3)
                vertex_done[mesh.apex(x)] = True
                queue.append((mesh.opposite[mesh.next(x)], 28))
                queue.append((mesh.opposite[mesh.prev(x)], 28))
    mesh.renumber(order)


def read_ears(state, reader, header):
    mesh = state.mesh
    for h in range(3 * len(mesh.faces)):
        if mesh.opposite[h] is None and reader.bit(state.ear):
            insert_ear(mesh, h)
            if len(mesh.points) > header.vertices or len(mesh.faces) > header.faces:
                raise Damaged("more than the header's vertices or faces")


def read_refinement(state, reader, header):
    mesh = state.mesh
    shift_before, count_before = state.shift, len(mesh.points)
    state.shift = header.shift
    if not 0 <= shift_before - state.shift <= 8:
        raise Damaged("shift")
    often = reader.raw(1)
    clear = f(reader.raw(3) / 7)
    passes = reader.raw(11)
    if passes > 1024:
        raise Damaged("passes")
    most_point = 2 * state.base.most
    ends = []
    for number in range(passes):
        kind = reader.raw(2)
        first = len(mesh.points)
        previous, state.before_last_pass = state.before_last_pass, first
        if kind == EARS:
            read_ears(state, reader, header)
        elif kind in state.symbols:
            walk(state, reader, kind, header, previous, clear)
        else:
            raise Damaged("kind of pass")
        if len(mesh.points) == first:
            raise Damaged("a pass that inserts nothing")
        ends.append(len(mesh.points))
        if often and number + 1 < passes:
            mesh.build_normals()
            guess(mesh, first, most_point)
    most = state.base.most >> state.shift
    first = count_before
    images = state.positions.images
    images.begin(len(mesh.points), most_point)
    mesh.build_normals()
    for point in mesh.points[:count_before]:
        images.add(point)
    for number, end in enumerate(ends):
        if often:
            guess(mesh, first, most_point)
            mesh.build_normals()
        for v in range(first, end):
            e = Expectation(state.predictor, mesh, v, state.shift, min(passes - 1 - number, 3))
            cell = state.positions.read(reader, mesh, e, most)
            state.predictor.settle(mesh, v, e, middle(cell, state.shift))
            images.add(mesh.points[v])
        first = end
    if state.shift == shift_before:
        return
    for v in range(count_before):
        if mesh.outgoing[v] is None:
            continue
        e = Expectation(state.predictor, mesh, v, state.shift, 4)
        known = [x >> (shift_before + 1) for x in mesh.points[v]]
        cell = state.positions.read(reader, mesh, e, most, known, shift_before - state.shift)
        state.predictor.settle(mesh, v, e, middle(cell, state.shift))
