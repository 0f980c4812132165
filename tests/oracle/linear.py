#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the terms `linear` and `product`, in rationals.
  linear.py           writes tests/conformance/vectors/linear.inc
  linear.py --check   exits 1 if it is not what it would write

y = constant + sum w x, z = y (x0 - origin); bounds as firmware/terms/terms.c states them. Inputs lie at
both ends of their signals' ranges, between, and at the origin, where the product vanishes."""

import random
from fractions import Fraction

from vectors import c_array, c_bound, c_double, c_float, deliver, f32, ulps

U = Fraction(1001, 1000) / 2**24
LIMITS = ((0, 14300), (-10, 90), (0, 24000), (-150, 150))


def rational(x):
    return Fraction(float(f32(x)))


def place(rng, low, high, origin):
    """A float32 in the range, often at its very end."""
    kind = rng.randrange(6)
    if kind < 2:
        return f32(high if kind else low)
    if kind < 4:
        return ulps(high, -1) if kind == 3 else ulps(low, 1)
    return origin if kind == 4 and low <= origin <= high else f32(rng.uniform(low, high))


def row(weights, constant, origin, x):
    n, x0 = len(weights), Fraction(float(x[0]))
    parts = [constant] + [w * Fraction(float(v)) for w, v in zip(weights, x)]
    y, y_bound = sum(parts), (n + 1) * U * sum(map(abs, parts))
    way = x0 - origin
    z, z_bound = y * way, abs(way) * (y_bound + 2 * U * (abs(y) + y_bound))
    slope = y + way * weights[0]
    slope_bound = y_bound + 3 * U * (abs(y) + y_bound + abs(way * weights[0]))
    numbers = ", ".join(f(v) for pair in ((y, y_bound), (z, z_bound), (slope, slope_bound))
                        for f, v in zip((c_double, c_bound), pair))
    return "    {{%s}, %s},\n" % (", ".join(map(c_float, x)), numbers)


def write(rng):
    text = cases = ""
    for i, n in enumerate((1, 2, 3, 7, 19, 64)):
        limits = [LIMITS[j % 4] for j in range(n)]
        weights = [rational(rng.uniform(-60, 60) / (high - low)) for low, high in limits]
        constant = rational(rng.uniform(-40, 40)) if i else Fraction(0)
        origin = f32(rng.uniform(0, 14300))
        rows = "".join(row(weights, constant, Fraction(float(origin)),
                           [place(rng, *limit, origin) for limit in limits]) for _ in range(20))
        text += c_array(f"linear_{i}_weights", weights + [constant])
        text += f"static const struct linear_row linear_{i}_rows[] = {{\n{rows}}};\n"
        cases += "    {%d, linear_%d_weights, %s, linear_%d_rows, LENGTH(linear_%d_rows)},\n" % (
            n, i, c_float(origin), i, i)
    return text + f"static const struct linear_case linear_cases[] = {{\n{cases}}};\n"


if __name__ == "__main__":
    deliver({"linear.inc": write(random.Random(8))}, "linear.py")
