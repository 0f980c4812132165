#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the network and of the guard of its training range.
  bpnet.py           writes tests/conformance/vectors/{bpnet,training_range}.inc
  bpnet.py --check   exits 1 if they are not what it would write

The network is evaluated as trained (models/bpnet.h), unfolded, in rationals and 50-digit tanh."""

import random
from fractions import Fraction

import functions
from vectors import c_array, c_bound, c_double, c_float, deliver, f32

UNIT_ROUNDOFF = Fraction(1, 2**24)
CENTRES, HALVES = (7150, 1500, 24, 40, 12000), (7150, 1500, 9, 22, 12000)


def rational(x):
    return Fraction(float(f32(x)))


def rationals(rng, count, size):
    return [rational(rng.uniform(-size, size)) for _ in range(count)]


class Network:
    ARRAYS = ("w1", "b1", "w2", "b2", "linear", "in_offset", "in_scale", "out_offset", "out_scale")

    def __init__(self, rng, inputs, hidden, outputs, logsig, linear):
        self.inputs, self.hidden, self.outputs, self.logsig = inputs, hidden, outputs, logsig
        self.w1, self.b1 = rationals(rng, hidden * inputs, 1.5), rationals(rng, hidden, 2)
        self.w2, self.b2 = rationals(rng, outputs * hidden, 1), rationals(rng, outputs, 1)
        self.linear = rationals(rng, outputs * inputs, 1) if linear else []
        self.in_offset = [rational(CENTRES[j % 5]) for j in range(inputs)]
        self.in_scale = [rational(1 / HALVES[j % 5]) for j in range(inputs)]
        self.out_offset = rationals(rng, outputs, 20)
        self.out_scale = [rational(rng.uniform(40, 120)) for _ in range(outputs)]

    def rows(self, weights):
        return [weights[k * self.inputs : (k + 1) * self.inputs] for k in range(self.outputs)]

    def sized(self, weights, x):
        """Sum of |w| (|x| + |offset|) in folded weights: what a running sum rounds."""
        return sum(abs(w * s) * (abs(v) + abs(o))
                   for w, s, v, o in zip(weights, self.in_scale, x, self.in_offset))

    def hidden_unit(self, i, n, x):
        """Value, error bound of the C (bpnet.c) and derivative by the argument."""
        weights = self.w1[i * self.inputs : (i + 1) * self.inputs]
        s = self.b1[i] + sum(w * v for w, v in zip(weights, n))
        error = UNIT_ROUNDOFF * (
            (self.inputs + 3) * (abs(self.b1[i]) + self.sized(weights, x)) + Fraction(23, 10))
        t = Fraction(functions.tanh(s / 2 if self.logsig else s))
        if self.logsig:
            return (1 + t) / 2, error, (1 - t * t) / 4
        return t, error, 1 - t * t

    def outputs_at(self, x, by):
        """[(y, bound, slope by input `by`, bound)] of each output."""
        n = [(v - o) * s for v, o, s in zip(x, self.in_offset, self.in_scale)]
        units = [self.hidden_unit(i, n, x) for i in range(self.hidden)]
        result = []
        for k in range(self.outputs):
            w = self.w2[k * self.hidden : (k + 1) * self.hidden]
            linear = self.rows(self.linear)[k] if self.linear else [Fraction(0)] * self.inputs
            m = sum(a * u[0] for a, u in zip(w, units)) + self.b2[k]
            m += sum(a * v for a, v in zip(linear, n))
            size = sum(map(abs, w)) + abs(self.b2[k]) + self.sized(linear, x)
            carried = sum(abs(a) * u[1] for a, u in zip(w, units))
            scale = self.out_scale[k]
            count = Fraction(self.hidden + self.inputs, 4) + 8
            bound = UNIT_ROUNDOFF * count * (scale * size + abs(self.out_offset[k]))
            bound += scale * carried
            slope = sum(a * u[2] * self.w1[i * self.inputs + by]
                        for i, (a, u) in enumerate(zip(w, units))) + linear[by]
            slope *= scale * self.in_scale[by]
            result.append((self.out_offset[k] + scale * m, bound, slope,
                           8 * bound * self.in_scale[by]))
        return result

    def input(self, rng):
        return [rational(o + Fraction(rng.uniform(-1.2, 1.2)) / s)
                for o, s in zip(self.in_offset, self.in_scale)]


def networks(rng):
    yield "S3, 19-20-3", Network(rng, 19, 20, 3, False, False)
    yield "logsig with a linear path, 7-9-2", Network(rng, 7, 9, 2, True, True)
    yield "the smallest, 1-1-1", Network(rng, 1, 1, 1, False, True)
    yield "blocks of 8 and 4, 3-12-8", Network(rng, 3, 12, 8, True, False)


def write_networks(rng):
    text, cases = "", ""
    for i, (title, net) in enumerate(networks(rng)):
        rows = ""
        for name in Network.ARRAYS:
            if getattr(net, name):
                text += c_array(f"bpnet_{i}_{name}", getattr(net, name))
        for _ in range(10):
            x, by = net.input(rng), rng.randrange(net.inputs)
            columns = list(zip(*net.outputs_at(x, by)))
            lists = ["{" + ", ".join(f(v) for v in vs) + "}"
                     for f, vs in zip((c_double, c_bound, c_double, c_bound), columns)]
            rows += "    {{%s}, %d, %s},\n" % (", ".join(map(c_float, x)), by, ", ".join(lists))
        text += f"static const struct bpnet_row bpnet_{i}_rows[] = {{\n{rows}}};\n"
        names = ["0" if not getattr(net, n) else f"bpnet_{i}_{n}" for n in Network.ARRAYS]
        cases += ('    {"%s", {%s, %d, %d, %d, %s}, bpnet_%d_rows, LENGTH(bpnet_%d_rows)},\n' %
                  (title, ", ".join(names), net.inputs, net.hidden, net.outputs,
                   "CB_BPNET_LOGSIG" if net.logsig else "CB_BPNET_TANSIG", i, i))
    return text + f"static const struct bpnet_case bpnet_cases[] = {{\n{cases}}};\n"


def guard(ranges, x):
    """models/training_range.h in rationals: inside, weight, extrapolated, beyond."""
    inside, weight, extrapolated, beyond = [], Fraction(1), 0, 0
    for (low, high, margin, inverse_fade), v in zip(ranges, x):
        excess = max(low - margin - v, v - high - margin)
        extrapolated += v < low or v > high
        beyond += excess > 0
        weight = min(weight, max(Fraction(0), 1 - max(Fraction(0), excess) * inverse_fade))
        inside.append(min(max(v, low - margin), high + margin))
    return inside, weight, extrapolated, beyond


def write_ranges(rng):
    """Numbers that are exact in float32 (sixteenths), so that counts cannot hang on a rounding."""
    ranges = [(15, 35, 5, Fraction(1, 8)), (0, 14300, 100, Fraction(1, 128)),
              (-4, -4, 0, Fraction(4)), (0, 24000, 0, Fraction(1, 1024))]
    rows = ""
    for _ in range(60):
        x = []
        for low, high, margin, inverse_fade in ranges:
            reach = margin + 2 / inverse_fade
            where = rng.choice((0, 0, 0, 1, -1))
            start = rng.uniform(low, high)
            start = start if where == 0 else (high if where > 0 else low)
            x.append(Fraction(round(16 * (start + where * rng.uniform(0, float(reach)))), 16))
        inside, weight, extrapolated, beyond = guard(ranges, x)
        rows += "    {{%s}, {%s}, %s, %d, %d},\n" % (
            ", ".join(map(c_float, x)), ", ".join(map(c_float, inside)), c_double(weight),
            extrapolated, beyond)
    listed = ", ".join("{" + ", ".join(map(c_float, r)) + "}" for r in ranges)
    return (f"static const struct cb_training_range training_ranges[] = {{{listed}}};\n"
            f"static const struct training_row training_rows[] = {{\n{rows}}};\n")


if __name__ == "__main__":
    deliver({"bpnet.inc": write_networks(random.Random(5)),
             "training_range.inc": write_ranges(random.Random(6))}, "bpnet.py")
