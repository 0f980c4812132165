#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of models/sigma: how far a model may be off at a state.
  sigma.py           writes tests/conformance/vectors/sigma.inc
  sigma.py --check   exits 1 if it is not what it would write

In 50 digits, from the floats. The bounds are those of the header: 10 * 2^-24 of the value."""

import random
from decimal import Decimal, getcontext

from vectors import c_bound, c_double, c_float, deliver, f32

getcontext().prec = 50
BOUND = Decimal(10) / 2**24


def decimal(x):
    return Decimal(float(f32(x)))


def change(along, place, before):
    return decimal(along)**2 * sum((decimal(a) - decimal(b))**2 for a, b in zip(place, before))


def row(floor, along, place, before):
    variance = decimal(floor)**2 + change(along, place, [0] * 4)
    numbers = ", ".join(f"{c_double(x)}, {c_bound(BOUND * x)}"
                        for x in (variance, change(along, place, before), variance.sqrt()))
    return "    {{%s, %s, {%s}, 1}, {%s}, %s},\n" % (
        c_float(floor), c_float(along), ", ".join(map(c_float, place)), ", ".join(map(c_float, before)), numbers)


def write(rng):
    text = ""
    for k in range(200):
        floor, along = f32(10**rng.uniform(-1, 3)), f32(10**rng.uniform(-2, 2))
        size = 10**rng.uniform(-1, 5) if k % 4 == 0 else 1
        place = [f32(size * rng.gauss(0, 1)) for _ in range(4)]
        before = [f32(x + 10**rng.uniform(-5, 1) * rng.gauss(0, 1)) for x in place]
        if k % 5 == 0:  # a model of two directions
            place[2] = place[3] = before[2] = before[3] = f32(0)
        text += row(floor, along, place, before)
    text += row(f32(0), f32(1e6), [f32(1e9)] * 4, [f32(-1e9)] * 4)
    text += row(f32(1e6), f32(0), [f32(0.5)] * 4, [f32(2)] * 4)
    return f"static const struct sigma_row sigma_rows[] = {{\n{text}}};\n"


if __name__ == "__main__":
    deliver({"sigma.inc": write(random.Random(22))}, "sigma.py")
