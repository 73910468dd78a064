# SPDX-License-Identifier: MIT
"""Range-coded streams, written from docs/FORMAT.md alone ("Range-coded stream"): bits, integers, distributions."""


class Damaged(Exception):
    """The packet is none that an encoder writes."""


MASK64 = (1 << 64) - 1


class Bit:
    """A binary model."""

    __slots__ = ("p0", "seen")

    def __init__(self):
        self.p0 = 32768
        self.seen = 0

    def learn(self, bit):
        distance = (32 if bit else 65504) - self.p0
        step = abs(distance) * (65536 // (min(self.seen, 159) + 3)) // 65536
        self.p0 += step if distance > 0 else -step
        self.seen += 1


class Reader:
    def __init__(self, data):
        self.data = data
        self.at = 0
        self.missing = 0
        self.range = MASK64
        self.code = 0
        self._take(8)

    def _take(self, count):
        for _ in range(count):
            self.code = (self.code << 8) & MASK64
            if self.at < len(self.data):
                self.code |= self.data[self.at]
                self.at += 1
            else:
                self.missing += 1
                if self.missing > 8:
                    raise Damaged("the payload ends too early")

    def _renew(self):
        if self.range < 1 << 32:
            self.range = (self.range << 32) & MASK64
            self._take(4)

    def bit_at(self, p0):
        bound = (self.range >> 16) * p0
        if self.code < bound:
            self.range = bound
            bit = 0
        else:
            self.code -= bound
            self.range -= bound
            bit = 1
        self._renew()
        return bit

    def bit(self, model):
        bit = self.bit_at(model.p0)
        model.learn(bit)
        return bit

    def raw(self, count):
        if count == 0:
            return 0
        self.range >>= count
        return self._number((1 << count) - 1)

    def uniform(self, count):
        self.range //= count
        return self._number(count - 1)

    def _number(self, most):
        value = min(self.code // self.range, most)
        self.code -= value * self.range
        self._renew()
        return value

    def symbol(self, count, distribution):
        self.range //= distribution(count)
        scaled = self.code // self.range
        low, high = 0, count
        while high - low > 1:
            middle = (low + high) // 2
            if distribution(middle) <= scaled:
                low = middle
            else:
                high = middle
        start = distribution(low)
        self.code -= self.range * start
        self.range *= distribution(low + 1) - start
        self.code = min(self.code, self.range - 1)
        self._renew()
        return low

    def finish(self):
        if self.at != len(self.data):
            raise Damaged("the payload has bytes too many")


class Unsigned:
    def __init__(self):
        self.longer = [Bit() for _ in range(30)]
        self.upper = [Bit() for _ in range(31)]

    def read(self, reader):
        n = 0
        while n < 30 and reader.bit(self.longer[n]):
            n += 1
        if n == 0:
            return 0
        top = 2 + reader.bit(self.upper[n])
        return (top << (n - 1)) + reader.raw(n - 1) - 1


class Signed:
    def __init__(self):
        self.nonzero = Bit()
        self.negative = Bit()
        self.magnitude = Unsigned()

    def read(self, reader):
        if not reader.bit(self.nonzero):
            return 0
        negative = reader.bit(self.negative)
        size = self.magnitude.read(reader) + 1
        return -size if negative else size
