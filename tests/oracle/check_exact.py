#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The oracle itself against scipy, which shares nothing with it: B-spline values and slopes to
1e-9 of the control points' size, on random knots of every degree. Exits 1 at the first mismatch."""

import random
import sys
from fractions import Fraction

from exact import Bspline
from scipy.interpolate import BSpline


def random_knots(rng, degree, count):
    """Integers, so that knots repeat; at most degree+1 of a value."""
    while True:
        knots = sorted(rng.randint(0, 12) for _ in range(count + degree + 1))
        repeats = max(knots.count(k) for k in knots)
        if repeats <= degree and knots[degree] < knots[count]:
            return [float(k) for k in knots]


def mismatch(rng, degree):
    """A sentence about the first difference, or None."""
    count = degree + 1 + rng.randint(0, 6)
    knots = random_knots(rng, degree, count)
    points = [rng.uniform(-1, 1) for _ in range(count)]
    ours, theirs = Bspline(degree, knots, points), BSpline(knots, points, degree)
    for _ in range(10):
        x = rng.uniform(knots[degree], knots[count])
        exact = ours.at(Fraction(x))
        if abs(float(exact.value) - theirs(x)) > 1e-9:
            return f"value at {x}: {float(exact.value)}, scipy {theirs(x)}; knots {knots}"
        if abs(float(exact.slope) - theirs(x, 1)) > 1e-8 * max(1.0, abs(theirs(x, 1))):
            return f"slope at {x}: {float(exact.slope)}, scipy {theirs(x, 1)}; knots {knots}"
    return None


if __name__ == "__main__":
    generator = random.Random(4)
    for trial in range(300):
        problem = mismatch(generator, 1 + trial % 5)
        if problem:
            sys.exit(problem)
    print("300 random B-splines: the oracle and scipy agree")
