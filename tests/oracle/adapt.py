#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of models/adapt: a model adapted by probes.
  adapt.py           writes tests/conformance/vectors/adapt.inc
  adapt.py --check   exits 1 if it is not what it would write

The filter of the textbook in 50 digits, with a full covariance matrix instead of factors, and the gate and the model's
own sigma as the headers describe them. The bound of b + (1 + g) m and of sigma is BOUND of the largest number of the
case. Probes lie inside of the gate, outside, and twice or three times outside; none lies within a thousandth of it."""

import copy
import random
from decimal import Decimal, getcontext

from vectors import c_bound, c_double, c_float, deliver, f32

getcontext().prec = 50
BOUND = Decimal("2e-7")
TAKEN, CONFIRMED, MEDIAN, ASK, EARLY, IMPLAUSIBLE = range(6)


def decimal(x):
    return Decimal(float(f32(x)))


def clamp(x, most):
    return min(max(x, -most), most)


class Own:
    """The model's own sigma at one state (models/sigma.h): place, floor, along, and which model."""

    def __init__(self, floor, along, place, model):
        self.floats = [f32(x) for x in (floor, along, *place)]
        self.floor, self.along, *self.place = map(decimal, self.floats)
        self.model = model

    def change(self, place):
        return self.along**2 * sum((a - b)**2 for a, b in zip(self.place, place))

    def variance(self):
        return self.floor**2 + self.change([0] * len(self.place))

    def text(self):
        return "{%s, %s, {%s}, %d}" % (c_float(self.floats[0]), c_float(self.floats[1]),
                                       ", ".join(map(c_float, self.floats[2:])), self.model)


class Filter:
    def __init__(self, settings):
        self.bias_max, self.gain_max, self.step, self.drift, self.gain_drift, self.sigma, self.interval = map(
            decimal, settings)
        self.b = self.g = Decimal(0)
        self.bb, self.bg, self.gg = Decimal(1), Decimal(0), Decimal("0.25")
        self.since, self.pending, self.age, self.asked = None, [], Decimal(0), False
        self.place, self.model = None, 0

    def widened(self, own):
        """b's variance at this place, of a model that may be unknown."""
        if own.model == 0:
            return self.bb
        if own.model == self.model:
            return self.bb + own.change(self.place)
        of_gain = self.bg**2 / self.gg  # the part that g explains
        return of_gain + max(self.bb - of_gain, own.variance())

    def wait(self, hours):
        self.bb += self.drift**2 * hours
        self.gg += self.gain_drift**2 * hours
        self.since = None if self.since is None else self.since + hours
        self.age += hours

    def variance(self, m):
        return self.bb + 2 * self.bg * m + self.gg * m * m

    def take(self, innovation, m):
        s = self.variance(m) + self.sigma**2
        pb, pg = self.bb + self.bg * m, self.bg + self.gg * m
        db = clamp(self.b + pb / s * innovation, self.bias_max) - self.b
        dg = clamp(self.g + pg / s * innovation, self.gain_max) - self.g
        way = db + dg * m
        part = self.step / abs(way) if abs(way) > self.step else Decimal(1)
        self.b, self.g = self.b + part * db, self.g + part * dg
        weight = part * (2 - part)
        self.bb, self.bg, self.gg = (self.bb - weight * pb * pb / s, self.bg - weight * pb * pg / s,
                                     self.gg - weight * pg * pg / s)
        self.since = Decimal(0)
        return part * way

    def margin(self, innovation, m):
        """Square of the distance by that of the gate; below 1 it is inside."""
        return innovation**2 / (9 * (self.variance(m) + self.sigma**2))

    def outside(self, innovation, m):
        rest = innovation - self.take(innovation, m)
        self.pending = [rest] if self.margin(rest, m) > 1 else []
        self.age, self.asked = Decimal(0), False

    def probe(self, z, m, own):
        narrow = self.bb
        self.bb = self.widened(own)
        outcome = self.judge(z, m)
        if outcome > MEDIAN:
            self.bb = narrow
        elif own.model != 0:
            self.place, self.model = own.place, own.model
        return outcome

    def reachable(self, z, m):
        return abs(z - m) - (self.bias_max + self.gain_max * abs(m) + 3 * self.sigma)

    def judge(self, z, m):
        if self.since is not None and self.since * 3600 < self.interval and not self.asked:
            return EARLY
        innovation = z - (self.b + (1 + self.g) * m)
        if self.margin(innovation, m) <= 1:
            self.take(innovation, m)
            self.pending, self.asked = [], False
            return TAKEN
        tolerance = 9 * (2 * self.sigma**2 + (self.drift**2 + self.gain_drift**2 * m * m) * self.age)
        if self.pending and (innovation - self.pending[-1])**2 <= tolerance and self.reachable(z, m) <= 0:
            self.outside(innovation, m)
            return CONFIRMED
        if len(self.pending) == 2:
            self.outside(sorted([*self.pending, innovation])[1], m)
            return MEDIAN
        self.pending.append(innovation)
        self.age, self.asked = Decimal(0), True
        return ASK


def clear(filter, z, m, own):
    """No comparison of this probe is close."""
    filter = copy.copy(filter)
    filter.bb = filter.widened(own)
    innovation = z - (filter.b + (1 + filter.g) * m)
    near = [filter.margin(innovation, m)]
    if filter.pending:
        tolerance = 9 * (2 * filter.sigma**2 + (filter.drift**2 + filter.gain_drift**2 * m * m) * filter.age)
        near.append((innovation - filter.pending[-1])**2 / tolerance)
    if filter.since is not None and filter.interval > 0:
        near.append(filter.since * 3600 / filter.interval)
    return all(abs(x - 1) > Decimal("1e-3") for x in near) and abs(filter.reachable(z, m)) > Decimal("1e-2")


def rows_of(rng, settings, count):
    filter, rows, largest, seen = Filter(settings), [], Decimal(1), set()
    error, gain = rng.uniform(-10, 10), rng.uniform(-0.3, 0.3)
    floor, along = rng.uniform(2, 15), rng.uniform(0.5, 6)
    models = rng.choice(((0,), (7,), (7,) * 40 + (0,), (7,) * 30 + (8,)))
    place = [rng.gauss(0, 1) for _ in range(4)]
    while len(rows) < count:
        hours = rng.choice((1, 1, 0.5, 0.02, 0.005, 24))
        error += 3 * hours**0.5 * rng.gauss(0, 1)
        m = f32(rng.choice((rng.uniform(-70, 70), rng.uniform(-5, 5), 0)))
        place = [0.8 * x + 0.6 * rng.gauss(0, 1) for x in place]
        own = Own(floor, along, place, rng.choice(models))
        kind = rng.randrange(12)
        z = error + (1 + gain) * float(m) + 1.5 * rng.gauss(0, 1)
        z = f32(z + (0 if kind < 8 else rng.choice((-100, 100, -100, 400, -40))))
        hours = f32(hours)
        filter.wait(decimal(hours))
        while not clear(filter, decimal(z), decimal(m), own):
            z = f32(z + 0.1)
        outcome = filter.probe(decimal(z), decimal(m), own)
        seen.add(outcome)
        largest = max(largest, abs(decimal(z)), abs(decimal(m)))
        y = filter.b + (1 + filter.g) * decimal(m)
        variance = filter.variance(decimal(m)) - filter.bb + filter.widened(own)
        rows.append((hours, z, m, own, outcome, y, variance.sqrt()))
    text = "".join("    {%s, %s, %s, %s, %d, %s, %s, %s, %s},\n" % (
        c_float(hours), c_float(z), c_float(m), own.text(), outcome, c_double(y), c_bound(BOUND * largest),
        c_double(sigma), c_bound(BOUND * largest)) for hours, z, m, own, outcome, y, sigma in rows)
    return text, seen


def write(rng):
    text = cases = ""
    seen = set()
    for i, settings in enumerate([(30, 0.5, 5, 6, 0.5, 1.5, 60), (1000, 1, 1000, 6, 0.5, 1.5, 0),
                                  (10, 0.2, 2, 3, 0.1, 1, 30), (30, 0, 15, 2, 0, 0.5, 60), (0, 0.5, 5, 0, 0.3, 2, 0)]):
        rows, outcomes = rows_of(rng, settings, 150)
        seen |= outcomes
        text += f"static const struct adapt_row adapt_{i}_rows[] = {{\n{rows}}};\n"
        cases += "    {{%s}, adapt_%d_rows, LENGTH(adapt_%d_rows)},\n" % (", ".join(map(c_float, settings)), i, i)
    assert seen == {TAKEN, CONFIRMED, MEDIAN, ASK, EARLY}, seen
    return text + f"static const struct adapt_case adapt_cases[] = {{\n{cases}}};\n"


if __name__ == "__main__":
    deliver({"adapt.inc": write(random.Random(12))}, "adapt.py")
