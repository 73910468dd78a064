# SPDX-License-Identifier: MIT
"""Values that a coordinate may repeat, written from docs/FORMAT.md alone ("Spikes")."""
from mesh import BITS32
from single import constant, f


def repeated(mesh, ring, axis, kind, shift):
    """The most frequent value and how often it came."""
    def x(v):
        return mesh.points[v][axis]

    values = []
    n = len(ring.vertex)
    for i, w in enumerate(ring.vertex):
        value = x(w)
        if kind == 1:
            if ring.apex[i] is None:
                continue
            value += x(ring.vertex[(i + 1) % n]) - x(ring.apex[i])
            if value < 0:
                continue
        if kind == 2:
            if ring.border:
                return 0, 0
            value = (value + x(ring.vertex[(i + n // 2) % n]) + 2) >> 1
        values.append(value >> (shift + 1))
    if not values:
        return 0, 0
    best = max(values, key=values.count)
    return best, values.count(best)


class ValueCounts:
    SLOTS = 1 << 14

    def __init__(self):
        self.shift = None

    def begin(self, shift):
        if self.shift != shift:
            self.shift = shift
            self.counts = [0] * self.SLOTS

    def learn(self, value):
        slot = value % self.SLOTS
        self.counts[slot] = min(self.counts[slot] + 1, 255)

    def best_near(self, centre, reach):
        """The value and its count."""
        radius, middle = int(min(reach, 64.0)), int(centre + 0.5)
        inverse = f(1 / f(reach))
        best, value, times = 0.0, middle, 0
        first = max(middle - radius, 0)
        offset = f(first - centre)
        for v in range(first, first + (middle + radius - first) // 4 * 4 + 4):
            count = self.counts[v % self.SLOTS]
            away = f(f(f(v - first) + offset) * inverse)
            score = f(f(count) / f(constant(0.1) + f(away * away)))
            if score > best:
                best, value, times = score, v, count
        return value, times


class Images:
    def __init__(self, reflection):
        self.reflection = reflection

    def begin(self, vertices, most):
        vertices = max(vertices, 1)
        self.bucket = 1
        while 4 ** (self.bucket + 1) * vertices < most * most:
            self.bucket += 1
        self.slots = 16
        while self.slots < vertices:
            self.slots *= 2
        self.chains = {}

    def slot(self, bucket):
        h = 0
        for x, k in zip(bucket, (73856093, 19349663, 83492791)):
            h ^= x * k & BITS32
        return (h ^ h >> 15) & (self.slots - 1)

    def bucket_of(self, point):
        return tuple(x >> self.bucket for x in point)

    def add(self, point):
        if self.reflection is not None:
            image = tuple(x if s is None else s - x for x, s in zip(point, self.reflection))
            self.chains.setdefault(self.slot(self.bucket_of(image)), []).append(image)

    def near(self, point):
        found, steps = [], 0
        here = self.bucket_of(point)
        for at in range(27):
            bucket = (here[0] + at % 3 - 1, here[1] + at // 3 % 3 - 1, here[2] + at // 9 - 1)
            for image in reversed(self.chains.get(self.slot(bucket), [])):
                steps += 1
                if steps > 256:
                    return found
                if self.bucket_of(image) != bucket:
                    continue
                if len(found) == 32:
                    return found
                found.append(image)
        return found


def best_image(nearby, axes, i, cell, mean, spread, shift):
    """The value and how many images fit about as well."""
    inverse = 1 / (spread * spread + 0.5)
    best, fitting, value = 40.0, 0, 0
    for image in nearby:
        away = 0.0
        for j, axis in enumerate(axes):
            at = image[axis] >> (shift + 1)
            if j < i:
                off = float(at - cell[axis])
                away += off * off * 3
            else:
                off = at - mean[j]
                away += off * off * inverse
        if away < best + 3:
            fitting = 1 if away < best - 3 else fitting + 1
        if away < best:
            best, value = away, image[axes[i]] >> (shift + 1)
    return value, fitting
