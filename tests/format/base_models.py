# SPDX-License-Identifier: MIT
"""What the base packet's numbers and decisions are coded under, written from docs/FORMAT.md alone ("One number")."""
import math
from bisect import bisect_right

from stream import Bit, Damaged, Unsigned
from vectors import bounded

ROOT2 = 1.4142135623730951


def prime(model, share, decisions):
    due = 0.5
    for _ in range(decisions):
        due += share
        bit = due >= 1
        if bit:
            due -= 1
        model.learn(bit)


class Numbers:
    """The numbers that stand for the cells of one axis."""

    def __init__(self, most):
        self.cells = None
        self.most_cell = most

    def read_list(self, reader, limit):
        if not reader.raw(1):
            return
        count_model, distance = Unsigned(), Unsigned()
        count = count_model.read(reader)
        if not 1 <= count <= limit:
            raise Damaged("list")
        self.cells = []
        cell = -1
        for _ in range(count):
            cell += 1 + distance.read(reader)
            if cell > self.most_cell:
                raise Damaged("list")
            self.cells.append(cell)

    def most(self):
        return self.most_cell if self.cells is None else len(self.cells) - 1

    def cell(self, number):
        return number if self.cells is None else self.cells[number]

    def number(self, x):
        x = max(float(x), 0.0)
        if self.cells is None:
            return min(x, float(self.most_cell))
        i = bisect_right(self.cells, x) - 1
        if i < 0:
            return 0.0
        if i == len(self.cells) - 1:
            return float(i)
        return i + (x - self.cells[i]) / (self.cells[i + 1] - self.cells[i])

    def nearest(self, x):
        return int(self.number(x) + 0.5)

    def spread(self, x, s):
        if self.cells is None:
            return s
        return max((self.number(x + s) - self.number(x - s)) * 0.5, 0.05)


class NumberModel:
    """One number, given expectation and spread."""

    def __init__(self):
        self.nonzero = [[Bit() for _ in range(3)] for _ in range(13)]
        self.more = [[Bit() for _ in range(24)] for _ in range(13)]
        self.negative = [[Bit() for _ in range(4)] for _ in range(3)]
        self.longer = [Bit() for _ in range(24)]
        m = 0.15
        for k in range(13):
            t = (math.sqrt(1 + m * m) - 1) / m
            for model in self.nonzero[k]:
                prime(model, 2 * t / (1 + t), 12)
            for model in self.more[k]:
                prime(model, t, 12)
            m = m * ROOT2

    def read(self, reader, expectation, spread, most):
        e = bounded(expectation, 0.0, float(most))
        centre = int(e)
        if e - centre >= 0.5:
            centre += 1
        s = min(spread, 1e8)
        shift = 0
        while s >= 9.6 and shift < 24:
            s = s * 0.5
            shift += 1
        k = 0
        bound = 0.15 * 1.189207115
        while k < 12 and s >= bound:
            k += 1
            bound = bound * ROOT2
        off = e - centre
        side = 1 if shift > 0 else 0 if off < -0.15 else 2 if off > 0.15 else 1
        bin_number = 0
        if reader.bit(self.nonzero[k][side]):
            negative = reader.bit(self.negative[side][centre * 4 // (most + 1)])
            size = 0
            while size < 24 and reader.bit(self.more[k][size]):
                size += 1
            if size == 24:
                n = 0
                while n < 24 and reader.bit(self.longer[n]):
                    n += 1
                size += ((1 << n) | reader.raw(n)) - 1
            bin_number = -size - 1 if negative else size + 1
        number = centre - ((1 << shift) >> 1) + (bin_number << shift) + reader.raw(shift)
        if not 0 <= number <= most:
            raise Damaged("a number beyond its axis")
        return number


class OddsModel:
    def __init__(self):
        self.model = [Bit() for _ in range(21)]
        ones = 1.0
        for i in range(11):
            n = 1
            while n < ones:
                self.model[10 + i].learn(1)
                self.model[10 - i].learn(0)
                n += 1
            ones = min(60.0, ones * 1.6487212707)

    def read(self, reader, log_odds):
        return reader.bit(self.model[int(bounded(log_odds * 2 + 10.5, 0.0, 20.0))])
