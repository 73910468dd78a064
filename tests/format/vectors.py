# SPDX-License-Identifier: MIT
"""Vectors of doubles, written from docs/FORMAT.md alone. Python's floats are IEEE doubles."""
import math


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def times(a, k):
    return (a[0] * k, a[1] * k, a[2] * k)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(dot(a, a))


def vector(point):
    return (float(point[0]), float(point[1]), float(point[2]))


def bounded(x, low, high):
    return min(max(x, low), high)


def angle(a, b):
    product = length(a) * length(b)
    if not product > 1e-9:
        return math.pi / 2
    x = bounded(dot(a, b) / product, -1.0, 1.0)
    y = abs(x)
    root = math.sqrt(1 - y if y < 1 else 0.0)
    result = root * (1.5707288 + y * (-0.2121144 + y * (0.0742610 - 0.0187293 * y)))
    return math.pi - result if x < 0 else result
