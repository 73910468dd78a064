#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A second decoder against the golden packets: whether what docs/FORMAT.md says is right and enough.

The modules beside this one are written from the document, not from the codec, in plain Python and without regard to speed; they
check form and hashes, and are no example of how to survive hostile input. If a levels.txt stands beside a file, what was decoded
is compared with it, too.

usage: check.py base file.pmcd ...    each file's base packet
       check.py all file.pmcd ...     all packets
"""
import pathlib
import struct
import sys

from base import BaseMesh
from container import BaseHeader, Bytes, level_hash, split_file
from exactness import position, read_exactness
from mesh import Mesh
from refine import State, middle, read_refinement
from stream import Damaged, Reader


def read_isolated(state, reader, limit):
    if not reader.raw(1):
        return
    count = reader.raw(32)
    if len(state.mesh.points) + count > limit:
        raise Damaged("isolated vertices")
    index = [state.base.most // 2] * 3
    for _ in range(count):
        index = [i + model.read(reader) for i, model in zip(index, state.isolated)]
        if not all(0 <= i <= state.base.most for i in index):
            raise Damaged("an isolated vertex leaves the lattice")
        state.mesh.add_vertex(tuple(2 * i for i in index))


def read_base(packet):
    data = Bytes(packet.payload)
    base = BaseHeader(data)
    reader = Reader(packet.payload[data.at:])
    mesh = BaseMesh(reader, base, packet)
    points = [middle(cell, mesh.shift) for cell in mesh.cells]
    return State(base, Mesh(mesh.faces, points), mesh.shift, mesh.seeds, mesh.structure, mesh.reflection), reader


def check_level(state, reader, packet):
    """What follows a mesh, and whether it is the promised one. Answers a line about it."""
    mesh = state.mesh
    read_isolated(state, reader, packet.vertices)
    if (len(mesh.points), len(mesh.faces)) != (packet.vertices, packet.faces):
        raise Damaged(f"level {packet.level}: other counts than the header's")
    lifted = reader.raw(1)
    if lifted != (state.base.lossless and not state.base.exact and packet.last and packet.vertices > 0):
        raise Damaged(f"level {packet.level}: exactness where it does not belong, or none where it does")
    exact = read_exactness(reader, state.base, mesh.points) if lifted else []
    reader.finish()
    value = level_hash(state.base, mesh.points, mesh.faces, exact)
    if value & ((1 << 8 * packet.hash_bytes) - 1) != packet.hash:
        raise Damaged(f"level {packet.level}: the hash differs")
    state.positions_of_level = exact or [position(state.base, point) for point in mesh.points]
    return f"level {packet.level}: {packet.vertices} vertices, {packet.faces} faces, hash {value:016x}"


def digest(state):
    """The one of levels.txt: FNV-1a over counts, coordinates and corners."""
    words = [len(state.mesh.points), len(state.mesh.faces)]
    for place in state.positions_of_level:
        words += struct.unpack("<3Q", struct.pack("<3d", *place))
    for face in state.mesh.faces:
        words += face
    value = 0xCBF29CE484222325
    for byte in struct.pack(f"<{len(words)}Q", *words):
        value = ((value ^ byte) * 0x100000001B3) & ((1 << 64) - 1)
    return value


def expected_levels(path):
    """The lines of levels.txt about a file, if there are any: vertices, faces and digest by level."""
    beside = pathlib.Path(path).with_name("levels.txt")
    if not beside.is_file():
        return {}
    lines = [line.split() for line in beside.read_text(encoding="utf-8").splitlines()]
    return {int(line[1]): line[2:] for line in lines if line[0] == pathlib.Path(path).stem}


def report(path, state, reader, packet, levels):
    print(f"{path}: {check_level(state, reader, packet)}")
    got = [str(packet.vertices), str(packet.faces), f"{digest(state):016x}"]
    if packet.level in levels and levels[packet.level] != got:
        raise Damaged(f"level {packet.level}: levels.txt has {levels[packet.level]}, this is {got}")


def check(path, only_base):
    levels = expected_levels(path)
    with open(path, "rb") as file:
        packets = split_file(file.read())
    state, reader = read_base(packets[0])
    report(path, state, reader, packets[0], levels)
    for packet in packets[1:] if not only_base else []:
        reader = Reader(packet.payload)
        read_refinement(state, reader, packet)
        report(path, state, reader, packet, levels)


def main():
    if len(sys.argv) < 3 or sys.argv[1] not in ("base", "all"):
        sys.exit(__doc__)
    failed = False
    for path in sys.argv[2:]:
        try:
            check(path, sys.argv[1] == "base")
        except Damaged as what:
            print(f"{path}: {what}")
            failed = True
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
