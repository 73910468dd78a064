#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A second decoder against the golden packets: what docs/FORMAT.md says is enough to decode a base packet.

The modules beside this one are written from the document, not from the codec, in plain Python and without regard to speed; they
check form and hashes, and are no example of how to survive hostile input.

usage: check.py base file.pmcd ...    each file's base packet
"""
import sys
from base import BaseMesh
from container import BaseHeader, Bytes, level_hash, split_file
from stream import Damaged, Reader, Signed


def middle(cell, shift):
    return tuple((c << (shift + 1)) + (1 << shift) - 1 for c in cell)


def read_isolated(reader, models, base, points, limit):
    if not reader.raw(1):
        return
    count = reader.raw(32)
    if len(points) + count > limit:
        raise Damaged("isolated vertices")
    index = [base.most // 2] * 3
    for _ in range(count):
        index = [i + model.read(reader) for i, model in zip(index, models)]
        if not all(0 <= i <= base.most for i in index):
            raise Damaged("an isolated vertex leaves the lattice")
        points.append(tuple(2 * i for i in index))


def check_base(path):
    with open(path, "rb") as file:
        packet = split_file(file.read())[0]
    data = Bytes(packet.payload)
    base = BaseHeader(data)
    reader = Reader(packet.payload[data.at:])
    mesh = BaseMesh(reader, base, packet)
    points = [middle(cell, mesh.shift) for cell in mesh.cells]
    read_isolated(reader, [Signed() for _ in range(3)], base, points, packet.vertices)
    if (len(points), len(mesh.faces)) != (packet.vertices, packet.faces):
        raise Damaged("other counts than the header's")
    if reader.raw(1):
        return f"{packet.vertices} vertices, {packet.faces} faces; exactness is not read here"
    reader.finish()
    value = level_hash(base, points, mesh.faces, [])
    if value & ((1 << 8 * packet.hash_bytes) - 1) != packet.hash:
        raise Damaged("the hash differs")
    return f"{packet.vertices} vertices, {packet.faces} faces, hash {value:016x}"


def main():
    if len(sys.argv) < 3 or sys.argv[1] != "base":
        sys.exit(__doc__)
    failed = False
    for path in sys.argv[2:]:
        try:
            print(f"{path}: {check_base(path)}")
        except Damaged as what:
            print(f"{path}: {what}")
            failed = True
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
