# SPDX-License-Identifier: MIT
"""Single precision in plain Python, written from docs/FORMAT.md alone ("Arithmetic", "Fits").

A double holds sums, products, quotients and square roots of singles well enough that rounding them once more gives what
single precision gives. So each operation is Python's, then f().
"""
import ctypes
import math
import struct


def f(x):
    return ctypes.c_float(x).value


def constant(text):
    return f(float(text))


def add(a, b):
    return (f(a[0] + b[0]), f(a[1] + b[1]), f(a[2] + b[2]))


def sub(a, b):
    return (f(a[0] - b[0]), f(a[1] - b[1]), f(a[2] - b[2]))


def times(a, k):
    return (f(a[0] * k), f(a[1] * k), f(a[2] * k))


def dot(a, b):
    return f(f(f(a[0] * b[0]) + f(a[1] * b[1])) + f(a[2] * b[2]))


def cross(a, b):
    return tuple(f(f(a[i - 2] * b[i - 1]) - f(a[i - 1] * b[i - 2])) for i in range(3))


def length(a):
    return f(math.sqrt(dot(a, a)))


def polynomial(t, coefficients):
    value = constant(coefficients[-1])
    for c in reversed(coefficients[:-1]):
        value = f(constant(c) + f(t * value))
    return value


def log2(x):
    bits = struct.unpack("<I", struct.pack("<f", x))[0]
    exponent = (bits >> 23) - 127
    t = f(struct.unpack("<f", struct.pack("<I", (bits & 0x7FFFFF) | 0x3F800000))[0] - 1)
    return f(exponent + f(t * polynomial(t, (1.4391, -0.6785, 0.3202, -0.0808))))


def exp2(x):
    shifted = f(x + 128)
    n = int(shifted)
    t = f(shifted - n)
    return f(2.0 ** (n - 128) * polynomial(t, (1.0, 0.69580, 0.22606, 0.07814)))


def _logistic_table():
    term = ratio = 1.0
    for k in range(1, 30):
        term = term * (-1.0 / 32) / k
        ratio += term
    table = [0] * 1025
    decay = 1.0
    for i in range(513):
        upper = 1 / (1 + decay)
        table[512 + i] = int(upper * 16777216.0 + 0.5)
        table[512 - i] = int((1 - upper) * 16777216.0 + 0.5)
        decay *= ratio
    return table


_TABLE = _logistic_table()


def logistic(t):
    t = min(max(f(t + 16), 0.0), 32 - 2.0 ** -10)
    p = int(f(t * 32768))
    j = p >> 10
    return _TABLE[j] + ((((_TABLE[j + 1] - _TABLE[j]) >> 3) * (p & 1023)) >> 7)


class Fit:
    """Least squares that forget."""

    def __init__(self, priors, decay, every):
        self.terms = len(priors[0])
        self.prior = [[constant(x) for x in prior] for prior in priors]
        self.weights = [list(prior) for prior in self.prior]
        self.rows = [[0.0] * (self.terms + len(priors)) for _ in range(self.terms)]
        self.growth = 1.0
        self.gain = f(1 / constant(decay))
        self.every = every
        self.counter = 0

    def observe(self, importance, equations):
        self.growth = f(self.growth * self.gain)
        scale = f(importance * self.growth)
        for e in equations:
            for i, row in enumerate(self.rows):
                k = f(scale * e[i])
                for j, value in enumerate(e):
                    row[j] = f(row[j] + f(k * value))
        self.counter += 1
        if self.counter < self.every:
            return
        self.counter = 0
        shrink = f(1 / self.growth)
        self.growth = 1.0
        self.rows = [[f(value * shrink) for value in row] for row in self.rows]
        self.solve()

    def solve(self):
        ridge = 4.0
        count = self.terms
        factor = [[0.0] * count for _ in range(count)]
        inverse = [0.0] * count
        for i in range(count):
            for j in range(i + 1):
                s = self.rows[i][j] + (ridge if i == j else 0.0)
                for k in range(j):
                    s -= factor[i][k] * factor[j][k]
                if j < i:
                    factor[i][j] = s * inverse[j]
                    continue
                if not s > 1e-9:
                    return
                inverse[i] = 1 / math.sqrt(s)
                factor[i][i] = s * inverse[i]
        for u, prior in enumerate(self.prior):
            z = [0.0] * count
            for i in range(count):
                b = self.rows[i][count + u] + ridge * prior[i]
                for k in range(i):
                    b -= factor[i][k] * z[k]
                z[i] = b * inverse[i]
            for i in reversed(range(count)):
                b = z[i]
                for k in range(i + 1, count):
                    b -= factor[k][i] * z[k]
                z[i] = b * inverse[i]
            self.weights[u] = [f(x) for x in z]
