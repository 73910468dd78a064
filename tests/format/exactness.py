# SPDX-License-Identifier: MIT
"""Lattice positions and the exactness section, written from docs/FORMAT.md alone ("Lattice", "Exactness")."""
import math
import struct

from container import multiple_of
from single import f
from stream import Bit, Damaged

MOST_WHOLE = 1 << 50


def whole(x, up):
    if math.isnan(x):
        return 0
    x = min(max(x, -float(MOST_WHOLE)), float(MOST_WHOLE))
    return math.ceil(x) if up else math.floor(x)


class Scalar:
    """f32 or f64: rounding, and the floats in their order."""

    def __init__(self, double):
        self.double = double
        self.size, self.real, self.integer = (64, "<d", "<Q") if double else (32, "<f", "<I")
        self.most = (0x7FEFFFFFFFFFFFFF if double else 0x7F7FFFFF)
        self.sign = 1 << (self.size - 1)

    def round(self, x):
        return x if self.double else f(x)

    def order(self, value):
        bits = struct.unpack(self.integer, struct.pack(self.real, value))[0]
        return -1 - (bits - self.sign) if bits & self.sign else bits

    def value(self, order):
        bits = order if order >= 0 else self.sign + (-1 - order)
        return struct.unpack(self.real, struct.pack(self.integer, bits))[0]

    def first(self, x):
        top = self.value(self.most)
        if not x > -top:
            return self.order(-top)
        if x > top:
            return self.most + 1
        value = self.round(x)
        if math.isinf(value):
            return self.most + 1 if value > 0 else self.order(-top)
        if value < x:
            return self.order(value) + 1
        return -1 if value == 0 else self.order(value)


def position(base, point):
    """The coordinates of a point."""
    scalar = Scalar(base.double)
    result = []
    for axis, m in enumerate(point):
        if base.unit:
            k = base.whole[axis] + (m >> 1)
            value = multiple_of(*base.unit, k)
            if m & 1:
                value = value * 0.5 + multiple_of(*base.unit, k + 1) * 0.5
        else:
            value = base.origin[axis] + (m * 0.5) * base.step
        result.append(scalar.round(value))
    return result


class Decimals:
    def __init__(self, reader):
        self.multiple = reader.raw(3)
        exponent = reader.raw(16)
        self.exponent = exponent - (1 << 16) if exponent >> 15 else exponent
        self.digits = reader.raw(4)
        most = 1000 if self.multiple == 0 else 22
        if self.multiple not in (0, 1, 2, 5) or abs(self.exponent) > most or (self.digits and self.multiple != 1):
            raise Damaged("decimals")

    def in_units(self, x, j=0):
        e = self.exponent + j
        if self.multiple == 0:
            return x * 2.0 ** -e
        tens = x * float(10 ** -e) if e < 0 else x / float(10 ** e)
        return tens / self.multiple

    def value(self, number):
        limit = 10 ** self.digits
        if self.digits == 0 or abs(number) < limit:
            return multiple_of(self.multiple, self.exponent, number)
        each = limit - limit // 10
        j, k = divmod(abs(number) - limit, each)
        k += limit // 10
        e = self.exponent + j + 1
        if e > 22:
            e, k = 22, k * 10
        return multiple_of(1, e, -k if number < 0 else k)

    def first(self, x):
        return self.magnitude(x, True) if x >= 0 else -self.magnitude(-x, False)

    def magnitude(self, x, up):
        limit = 10 ** self.digits
        q = self.in_units(x)
        if self.digits == 0 or q < limit:
            return whole(q, up)
        j = 0
        while q >= limit and self.exponent + j < 22:
            j += 1
            q = self.in_units(x, j)
        k = max(whole(min(q, float(limit)), up), limit // 10)
        return limit + (j - 1) * (limit - limit // 10) + k - limit // 10


class Floats:
    def __init__(self, scalar):
        self.first = scalar.first
        self.value = scalar.value


class Grid:
    def __init__(self, reader):
        self.step, *self.origin = [struct.unpack(">d", struct.pack(">II", reader.raw(32), reader.raw(32)))[0] for _ in range(4)]
        if not all(map(math.isfinite, self.origin)) or not 0 < self.step < math.inf:
            raise Damaged("grid")


class GridAxis:
    def __init__(self, grid, axis, fine):
        self.step, self.origin, self.fine = grid.step, grid.origin[axis], fine

    def first(self, x):
        return whole((x - self.origin) / self.step, True)

    def value(self, n):
        point = self.origin + float(n) * self.step
        if self.fine is None:
            return point
        above = self.fine.first(point)
        high, low = self.fine.value(above), self.fine.value(above - 1)
        return low if point - low < high - point else high


class Strays:
    def __init__(self):
        self.nonzero, self.negative = Bit(), Bit()
        self.longer = [Bit() for _ in range(63)]

    def read(self, reader):
        if not reader.bit(self.nonzero):
            return 0
        negative = reader.bit(self.negative)
        n = 0
        while n < 63 and reader.bit(self.longer[n]):
            n += 1
        size = read_bits(reader, 1, n)
        return -size if negative else size


def read_bits(reader, value, count):
    while count:
        group = min(count, 32)
        count -= group
        value = (value << group) | reader.raw(group)
    return value


def read_below(reader, c):
    if c <= 1:
        return 0
    rest = max((c - 1).bit_length() - 23, 0)
    return read_bits(reader, reader.uniform(((c - 1) >> rest) + 1), rest)


def edge(base, axis, index):
    return base.origin[axis] + (index - 0.5) * base.step


def read_exactness(reader, base, points):
    """The exact coordinates, by vertex."""
    scalar = Scalar(base.double)
    fine = Decimals(reader) if reader.raw(1) else None
    coarse = Decimals(reader) if reader.raw(1) else None
    grid = Grid(reader) if coarse is None and reader.raw(1) else None
    forms, negated = [], []
    for _ in range(3):
        repeats = reader.raw(1)
        negated.append(reader.raw(1) if repeats else 0)
        forms.append([repeats, reader.raw(1), reader.raw(1)])
    if base.unit and any(negated):
        raise Damaged("negated multiples")
    if coarse is None and grid is None and any(form[1] for form in forms):
        raise Damaged("coarse numbers of nothing")
    most_slots = min(max(len(points), 1), base.most)
    slots = 1 << (most_slots - 1).bit_length()
    tables = [{}, {}, {}]
    again = [[[Bit() for _ in range(8)] for _ in range(3)] for _ in range(3)]
    is_coarse = [Bit() for _ in range(3)]
    strays = [Strays() for _ in range(3)]

    def number_of(kind, axis, index):
        """The kind's numbers in the cell: the first, and how many."""
        first = kind.first(edge(base, axis, index))
        return first, max(kind.first(edge(base, axis, index + 1)) - first, 0)

    def read_coordinate(axis, index, point):
        if forms[axis][1]:
            kind = GridAxis(grid, axis, fine) if grid else coarse
            first, count = number_of(kind, axis, index)
            if count and reader.bit(is_coarse[axis]):
                return scalar.round(kind.value(first + read_below(reader, count)))
        kind = fine if fine else Floats(scalar)
        first, count = number_of(kind, axis, index)
        if count:
            value = scalar.round(kind.value(first + read_below(reader, count)))
        else:
            value = position(base, point)[axis]
        if not forms[axis][2]:
            return value
        steps = strays[axis].read(reader)
        if not steps:
            return value
        order = (scalar.order(value) + steps + (1 << 63)) % (1 << 64) - (1 << 63)
        if not -1 - scalar.most <= order <= scalar.most:
            raise Damaged("a stray that is not finite")
        return scalar.value(order)

    def index_of(axis, x):
        if not base.step:
            return 0
        index = (x - base.origin[axis]) / base.step + 0.5
        return int(min(index, float(base.most))) if index > 0 else 0

    def learn(axis, index, value):
        entry = tables[axis].get(index % slots)
        known = entry is not None and entry[0] == index
        if known and struct.pack("<d", entry[1]) == struct.pack("<d", value):
            entry[2] = min(entry[2] + 1, 7)
        elif known and entry[2] > 0:
            entry[2] -= 1
        else:
            tables[axis][index % slots] = [index, value, 0]

    result = []
    for point in points:
        came_again = 0
        coordinates = []
        for axis in range(3):
            index = point[axis] // 2
            if not forms[axis][0]:
                coordinates.append(read_coordinate(axis, index, point))
                continue
            entry = tables[axis].get(index % slots)
            known = entry is not None and entry[0] == index
            if known and reader.bit(again[axis][came_again][entry[2]]):
                value = entry[1]
                came_again += 1
            else:
                value = read_coordinate(axis, index, point)
            learn(axis, index, value)
            if negated[axis]:
                learn(axis, index_of(axis, -value), -value)
            coordinates.append(value)
        if not all(map(math.isfinite, coordinates)):
            raise Damaged("a coordinate that is not finite")
        result.append(coordinates)
    return result
