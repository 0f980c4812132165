#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of tanh and 1 - exp(-x).
  transcendental.py           writes tests/conformance/vectors/transcendental.inc
  transcendental.py --check   exits 1 if it is not what it would write"""

import random
from fractions import Fraction

import functions
import numpy as np
from vectors import c_bound, c_double, c_float, deliver, f32, ulps

LN2 = 0.6931471805599453


def arguments(rng, start, end, seams):
    """Both ends, seams of the formulas and their neighbours, sizes from the smallest number up."""
    xs = [f32(v) for v in (0.0, -0.0, 1e-45, -1e-45, 1e-38, 2e-20, -1e-7, start, end)]
    for s in seams:
        xs += [ulps(s, n) for n in (-2, -1, 0, 1, 2)]
    while len(xs) < 300:
        size = 10 ** rng.uniform(-9, 2.1)
        x = f32(rng.choice((-size, size)))
        if start <= x <= end:
            xs.append(x)
    return xs


def table(name, function, xs, bound_ulp):
    """One array of struct function_row (tests/conformance/transcendental.c)."""
    rows = ""
    for x in xs:
        y = function(Fraction(float(x)))
        bound = c_bound(Fraction(bound_ulp) * functions.spacing(y))
        rows += "    {%s, %s, %s},\n" % (c_float(x), c_double(y), bound)
    return f"static const struct function_row {name}_rows[] = {{\n{rows}}};\n"


def main():
    rng = random.Random(4)
    halves = [(n + 0.5) * LN2 for n in range(-150, 128)]
    text = table("tanh", functions.tanh,
                 arguments(rng, -20, 20, [0.54930615, -0.54930615, 9.0109, 9.25] +
                           [h / 2 for h in halves if 1 < h < 18]), "2.3")
    text += table("one_minus_exp", functions.one_minus_exp,
                  arguments(rng, -1, 100, [18] + [h for h in halves if 0 < h < 18]), "1.1")
    deliver({"transcendental.inc": text}, "transcendental.py")


if __name__ == "__main__":
    with np.errstate(all="ignore"):
        main()
