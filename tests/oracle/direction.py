#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the direction of travel and its blend of two branches.
  direction.py           writes tests/conformance/vectors/direction.inc
  direction.py --check   exits 1 if it is not what it would write

A play operator as in the textbooks: a centre dragged along by x, half the width behind; rational."""

import random
from fractions import Fraction

from vectors import c_bound, c_double, c_float, deliver, f32

UNIT_ROUNDOFF = Fraction(1, 2**24)


def rational(x):
    return Fraction(float(f32(x)))


def path(rng, start, width, grain):
    """Positions in multiples of `grain`: creeping, trembling, reversing, travelling."""
    x, xs = start, []
    for i in range(150):
        size = rng.choice((0, 1, 1, 3, 10, 40, 2000)) * width / 16
        x = round((x + rng.uniform(-1, 1) * float(size)) / float(grain)) * grain
        xs.append(Fraction(x))
    return xs


def rows_of(rng, start, width, xs):
    centre, half, rows = Fraction(start), width / 2, ""
    for x in xs:
        centre = min(max(centre, x - half), x + half)
        b = (x - centre) / half
        forward, backward = rational(rng.uniform(-50, 50)), rational(rng.uniform(-50, 50))
        slopes = [rational(rng.uniform(-0.1, 0.1)) for _ in range(2)]
        f, g = (1 + b) / 2, (1 - b) / 2
        value, slope = f * forward + g * backward, f * slopes[0] + g * slopes[1]
        if abs(b) < 1:
            slope += (forward - backward) / width
        b_bound = 6 * UNIT_ROUNDOFF
        value_bound = (abs(forward) + abs(backward)) * 8 * UNIT_ROUNDOFF
        slope_bound = (sum(map(abs, slopes)) + (abs(forward) + abs(backward)) / width)
        numbers = [c_float(v) for v in (x, forward, slopes[0], backward, slopes[1])]
        numbers += [c_double(b), c_bound(b_bound), c_double(value), c_bound(value_bound),
                    c_double(slope), c_bound(slope_bound * 8 * UNIT_ROUNDOFF)]
        rows += "    {%s},\n" % ", ".join(numbers)
    return rows


def main():
    """Widths and positions are multiples of powers of 2, exact in float32: |b| = 1 is no matter of
    rounding, on which the slope would hang."""
    rng = random.Random(8)
    text, cases = "", ""
    for i, (start, width, grain) in enumerate(((7150, Fraction(1, 2), Fraction(1, 64)),
                                               (0, Fraction(3, 32), Fraction(1, 1024)),
                                               (-200, Fraction(6), Fraction(1, 8)))):
        rows = rows_of(rng, start, width, path(rng, start, width, grain))
        text += f"static const struct direction_row direction_{i}_rows[] = {{\n{rows}}};\n"
        cases += (f"    {{{c_float(start)}, {c_float(width)}, direction_{i}_rows, "
                  f"LENGTH(direction_{i}_rows)}},\n")
    text += f"static const struct direction_case direction_cases[] = {{\n{cases}}};\n"
    deliver({"direction.inc": text}, "direction.py")


if __name__ == "__main__":
    main()
