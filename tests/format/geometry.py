# SPDX-License-Identifier: MIT
"""Positions of refinement packets, written from docs/FORMAT.md alone."""
import math
from mesh import Ring, i32
from repeats import Images, ValueCounts, best_image, repeated
from single import Fit, add, constant, cross, dot, exp2, f, length, log2, logistic, sub, times
from stream import Bit, Damaged, Unsigned

ZERO = (0.0, 0.0, 0.0)
SMALL = constant(1e-6)


def average(values, share):
    total = ZERO
    for value in values:
        total = add(total, value)
    return times(total, share)


def guess(mesh, first, most):
    weight = constant(0.3)
    for v in range(first, len(mesh.points)):
        o = mesh.points[v]
        ring = Ring(mesh, v)
        n = len(ring.vertex)
        share = f(1 / n)
        spread = [0.0, 0.0]
        for w in ring.vertex:
            spread = [f(x + y) for x, y in zip(spread, mesh.spread[w])]
        mesh.spread[v] = tuple(f(x * share) for x in spread)
        at = [mesh.at(w, o) for w in ring.vertex]
        mean = times(add(at[0], at[-1]), 0.5) if ring.border else average(at, share)
        offset = ZERO
        for w, s in zip(ring.vertex, at):
            offset = add(offset, times(sub(s, mesh.mean(w, o)), weight))
            normal = mesh.normals[w]
            offset = add(offset, times(normal, f(weight * dot(normal, sub(s, mean)))))
        target = add(add(mean, times(offset, share)), (0.5, 0.5, 0.5))
        mesh.points[v] = tuple(int(min(max(f(f(x) + t), 0.0), f(most))) for x, t in zip(o, target))


class Expectation:
    def __init__(self, predictor, mesh, v, shift, stage):
        self.stage = stage
        self.shift = shift
        self.cell = float(1 << (shift + 1))
        self.o = o = mesh.points[v]
        self.ring = ring = Ring(mesh, v)
        n = len(ring.vertex)
        self.group = min(n, 4) + 4 if ring.border else min(max(n - 3, 0), 5)
        share = f(1 / n)
        a = [mesh.at(w, o) for w in ring.vertex]
        ring_mean = average(a, share)
        mean = times(add(a[0], a[-1]), 0.5) if ring.border else ring_mean
        polygon = parallelograms = bilaplacian = normals = near = ZERO
        radius = near_sum = flat = across = 0.0
        corners = []
        for i, w in enumerate(ring.vertex):
            after = a[(i + 1) % n]
            s = sub(a[i], mean)
            polygon = add(polygon, cross(s, sub(after, mean)))
            d = length(s)
            radius = f(radius + d)
            k = f(1 / f(d + 2))
            near = add(near, times(s, k))
            near_sum = f(near_sum + k)
            flat = f(flat + mesh.spread[w][0])
            across = f(across + mesh.spread[w][1])
            bilaplacian = add(bilaplacian, sub(a[i], mesh.mean(w, o)))
            normal = mesh.normals[w]
            normals = add(normals, times(normal, dot(normal, s)))
            if ring.apex[i] is not None:
                c = sub(sub(add(a[i], after), mesh.at(ring.apex[i], o)), mean)
                corners.append(c)
                parallelograms = add(parallelograms, c)
        self.radius = radius = max(f(radius * share), 1.0)
        area = length(polygon)
        self.normal = N = times(polygon, f(1 / area)) if area > SMALL else ZERO
        features = [ZERO] * 5
        features[0] = times(bilaplacian, share)
        features[1] = times(normals, share)
        if ring.border:
            features[2] = parallelograms if n == 2 and corners else sub(ring_mean, mean)
        else:
            if corners:
                features[2] = times(parallelograms, f(1 / len(corners)))
                features[3] = tuple(self.median([c[axis] for c in corners]) for axis in range(3))
        features[4] = times(near, f(1 / near_sum))
        self.features = features
        offset = ZERO
        for feature, weight in zip(features, predictor.position[stage][self.group].weights[0]):
            offset = add(offset, times(feature, weight))
        reach = length(offset)
        most = f(1.5 * radius)
        if reach > most:
            offset = times(offset, f(most / reach))
        self.mean = mean
        self.position = add(mean, offset)

        flat = f(flat * f(radius * share))
        across = f(across * f(radius * share))
        uneven = 0.0
        for x in a:
            h = dot(sub(x, mean), N)
            uneven = f(uneven + f(h * h))
        uneven = f(math.sqrt(f(uneven * share)))
        along = dot(features[2], N)
        signs = (radius, flat, across, uneven, abs(along), length(sub(features[2], times(N, along))), length(features[4]),
                 abs(dot(features[0], N)))
        inverse = f(1 / self.cell)
        self.terms = [1.0] + [log2(f(f(y * inverse) + constant(0.1))) for y in signs]
        self.spread = []
        for t in range(2):
            l = 0.0
            for x, weight in zip(self.terms, predictor.spread[stage].weights[t]):
                l = f(l + f(x * weight))
            actual, expected = predictor.calibration[stage][self.group][t]
            value = f(exp2(min(max(l, -60.0), 60.0)) * f(actual / expected))
            self.spread.append(min(max(value, constant(0.02)), 2.0 ** 24))

    @staticmethod
    def median(values):
        values = sorted(values)
        return f(0.5 * f(values[(len(values) - 1) // 2] + values[len(values) // 2]))


class Predictor:
    def __init__(self):
        self.position = [[Fit([(0.3, 0.3, 0, 0, 0)], 0.998, 32) for _ in range(9)] for _ in range(5)]
        self.spread = [Fit([(-0.5, 0, 1) + (0,) * 6, (-0.5, 0, 0, 1) + (0,) * 5], 0.999, 64) for _ in range(5)]
        self.calibration = [[[(1.0, 1.0)] * 2 for _ in range(9)] for _ in range(5)]

    def settle(self, mesh, v, e, point):
        x = tuple(f(i32(p - o)) for p, o in zip(point, e.o))
        y = sub(x, e.mean)
        flat, across = e.spread
        variance = f(f(flat * flat) + f(across * across))
        importance = f(1 / f(f(f(variance * e.cell) * e.cell) + constant(0.4)))
        self.position[e.stage][e.group].observe(
            importance, [[feature[axis] for feature in e.features] + [y[axis]] for axis in range(3)])
        r = sub(x, e.position)
        along = dot(r, e.normal)
        inverse = f(1 / e.cell)
        seen = (f(length(sub(r, times(e.normal, along))) * f(constant(0.70710678) * inverse)), f(abs(along) * inverse))
        self.spread[e.stage].observe(1.0, [e.terms + [log2(f(s + constant(0.15))) for s in seen]])
        decay = constant(0.99)
        calibration = self.calibration[e.stage][e.group]
        for t in range(2):
            actual, expected = calibration[t]
            g = f(e.spread[t] * f(expected / actual))
            calibration[t] = (f(f(actual * decay) + f(f(seen[t] + constant(0.1)) / g)), f(f(expected * decay) + 1))
        if e.stage != 4:
            unit = f(e.cell / e.radius)
            mesh.spread[v] = tuple(min(max(f(f(s + constant(0.1)) * unit), constant(1e-4)), 4.0) for s in seen)
        mesh.points[v] = point


class Mixture:
    WIDTHS = tuple(constant(w) for w in (0.35, 0.7, 1.6))

    def __init__(self, centre, spread, weights, spikes):
        self.centre = centre
        self.weights = weights
        widths = [f(f(w * spread) + constant(0.04)) for w in self.WIDTHS]
        self.inverse = [f(1 / w) for w in widths]
        self.reach = 12 * widths[2] + 2
        self.body = 1.0
        self.spikes = []
        for value, spike in spikes:
            self.spikes.append((value, spike, self.part_of_body(spike[0]), self.part_of_body(spike[1])))
        nearly_all = constant(0.99998)
        self.share = [f(w * f(self.body * nearly_all)) for w in weights]
        self.near_share = [f(near * nearly_all) for _, _, _, near in self.spikes] + [0.0] * (4 - len(spikes))

    def part_of_body(self, weight):
        part = f(max(weight, constant(0.0004)) * self.body)
        self.body = f(self.body - part)
        return part

    def begin_at(self, first):
        self.first = first
        self.start = f(first - 0.5 - self.centre)

    def parts(self, n):
        t = f(self.start + f(n))
        return [f(logistic(f(t * v))) for v in self.inverse]

    def near(self, n):
        """Of each spike, 0 of those that are not there."""
        starts = [f(-0.5 - f(value - self.first)) for value, _, _, _ in self.spikes]
        parts = [f(logistic(f(f(start + f(n)) * constant(2.2)))) for start in starts]
        return parts + [0.0] * (4 - len(parts))

    def below(self, n):
        p, h = self.parts(n), self.near(n)
        near = [f(share * part) for share, part in zip(self.near_share, h)]
        wide = [f(share * part) for share, part in zip(self.share, p)]
        mass = f(f(wide[0] + wide[1]) + f(wide[2] + near[0]))
        if len(self.spikes) > 1:
            mass = f(mass + f(f(near[1] + near[2]) + near[3]))
        for value, _, exact, _ in self.spikes:
            if value < self.first + n:
                mass = f(mass + f(exact * 16777216.0))
        return int(min(mass, 16777216.0))

    def learn(self, start, end):
        masses = [f(b - a) for a, b in zip(self.parts(start), self.parts(end))]
        parts = [f(w * f(m + 1)) for w, m in zip(self.weights, masses)]
        total = f(f(parts[0] + parts[1]) + parts[2])
        share = f(1 / total)
        for k in range(3):
            self.weights[k] = f(self.weights[k] + f(constant(0.02) * f(f(parts[k] * share) - self.weights[k])))
        if not self.spikes:
            return
        total = f(total * self.body)
        gains = []
        for (value, _, exact, near), a, b in zip(self.spikes, self.near(start), self.near(end)):
            e = f(exact * 16777216.0) if start <= value - self.first < end else 0.0
            h = f(near * f(b - a))
            total = f(total + f(e + h))
            gains.append((e, h))
        share = f(1 / total)
        for (_, weights, _, _), gain in zip(self.spikes, gains):
            for i in range(2):
                weights[i] = f(weights[i] + f(weights[2] * f(f(gain[i] * share) - weights[i])))
            weights[2] = f(weights[2] + f(f(constant(0.025) - weights[2]) * constant(0.08)))


class Coordinates:
    def __init__(self):
        self.weights = [[[constant(0.3), 0.5, constant(0.2)] for _ in range(20)] for _ in range(3)]
        self.spikes = [[[constant(0.03), constant(0.03), constant(0.3)] for _ in range(96)] for _ in range(4)]
        self.beyond = Unsigned()

    def mixture(self, centre, spread, order, spikes):
        half_octave = int(f(f(2 * log2(spread)) + 64)) - 58
        return Mixture(centre, spread, self.weights[order][min(max(half_octave, 0), 19)],
                       [(value, self.spikes[kind][context]) for kind, value, context in spikes])

    def read(self, reader, mixture, most):
        b = 0
        while mixture.reach * 2 > 2048 << b:
            b += 1

        def bin_of(x):
            return int(min(max(x, 0.0), float(most))) >> b

        lowest = bin_of(mixture.centre - mixture.reach)
        n = bin_of(mixture.centre + mixture.reach + 1) - lowest + 1
        first = lowest << b
        mixture.begin_at(first)

        def distribution(i):
            if i == 0:
                return 0
            if i == n + 2:
                return 1 << 24
            return 96 + (i - 1) + ((mixture.below((i - 1) << b) * ((1 << 24) - 192 - n)) >> 24)

        s = reader.symbol(n + 2, distribution)
        if s == 0:
            value = first - 1 - self.beyond.read(reader)
        elif s == n + 1:
            value = first + (n << b) + self.beyond.read(reader)
        else:
            mixture.learn((s - 1) << b, s << b)
            value = first + ((s - 1) << b) + reader.raw(b)
        if not 0 <= value <= most:
            raise Damaged("a position leaves the lattice")
        return value

    def read_digits(self, reader, mixture, known, digits):
        first = known << digits
        mixture.begin_at(first)

        def distribution(i):
            return mixture.below(i) - mixture.below(0) + i * (8192 >> digits)

        s = reader.symbol(1 << digits, distribution)
        mixture.learn(s, s + 1)
        return first + s


class Positions:
    def __init__(self, structure, reflection):
        self.structure = structure
        self.images = Images(reflection)
        self.values = [ValueCounts() for _ in range(3)]
        self.first = Coordinates()
        self.further = Coordinates()

    def read(self, reader, mesh, e, most, known=None, digits=0):
        """The cell."""
        n = e.normal
        axes = [0, 1, 2]
        for i in (0, 1, 0):
            if n[axes[i]] * n[axes[i]] > n[axes[i + 1]] * n[axes[i + 1]]:
                axes[i], axes[i + 1] = axes[i + 1], axes[i]
        inverse = 1.0 / e.cell
        half = float((1 << e.shift) - 1)
        t = e.spread[0] * e.spread[0]
        difference = e.spread[1] * e.spread[1] - t

        def covariance(i, j):
            return difference * n[axes[i]] * n[axes[j]]

        mean = [(e.o[axis] + e.position[axis] - half) * inverse for axis in axes]
        seen, noise = [0.0] * 3, [0.0] * 3
        if known:
            width = float(1 << digits)
            for i, axis in enumerate(axes):
                seen[i] = known[axis] * width + (width - 1) / 2 - mean[i]
                noise[i] = width * width * (1.0 / 12)
        cell = [0] * 3
        outcome = [0] * 4
        reflects = self.images.reflection is not None and not known
        if reflects:
            about = [0] * 3
            for axis, m in zip(axes, mean):
                about[axis] = int(min(max(m, 0.0), float(most))) << (e.shift + 1)
            nearby = self.images.near(about)
        for i in range(3):
            j, k = [x for x in range(3) if x != i]
            centre, variance = mean[i], t + covariance(i, i)
            I, H = covariance(i, j), covariance(i, k)
            J = t + covariance(j, j) + noise[j] + 1e-9
            K = t + covariance(k, k) + noise[k] + 1e-9
            if known or i == 2:
                G = covariance(j, k)
                s = 1 / (J * K - G * G + 1e-9)
                g = (I * K - H * G) * s
                h = (H * J - I * G) * s
                centre += g * seen[j] + h * seen[k]
                variance -= g * I + h * H
            elif i == 1:
                g = I / J
                centre += g * seen[j]
                variance -= g * I
            variance = max(variance, 1e-3)
            centre = min(max(centre, 0.0), float(most))
            spread = math.sqrt(variance)
            axis = axes[i]
            if known:
                mixture = self.further.mixture(centre, f(spread), i, [])
                value = self.further.read_digits(reader, mixture, known[axis], digits)
            else:
                spikes = []
                for kind in range(4):
                    if self.structure < (1 if kind == 3 else 2) and not (reflects and kind == 1):
                        continue
                    if reflects and kind == 1:
                        at, count = best_image(nearby, axes, i, cell, mean, e.spread[0], e.shift)
                    elif kind < 3:
                        at, count = repeated(mesh, e.ring, axis, kind, e.shift)
                    else:
                        self.values[axis].begin(e.shift)
                        at, count = self.values[axis].best_near(centre, 3 * spread + 1)
                        count = count.bit_length()
                    away = f(at - centre)
                    square = f(away * away)
                    far = sum(square >= f(constant(bound) * f(spread * spread)) for bound in (0.09, 1, 6.25))
                    spikes.append((kind, at, (min(count, 7) * 3 + outcome[kind]) * 4 + far))
                mixture = self.first.mixture(centre, f(spread), i, spikes)
                value = self.first.read(reader, mixture, most)
                for kind, at, _ in spikes:
                    outcome[kind] = 1 if at == value else 2
                if self.structure:
                    self.values[axis].learn(value)
            cell[axis] = value
            seen[i] = value - mean[i]
            noise[i] = 1.0 / 12
        return tuple(cell)
