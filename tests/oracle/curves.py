#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the curves: B-spline, polyline, polynomial.
  curves.py           writes tests/conformance/vectors/{bspline,polyline,polynomial}.inc
  curves.py --check   exits 1 if they are not what it would write"""

import math
import random
from fractions import Fraction

import numpy as np
from exact import Bspline, Polyline, Polynomial
from vectors import c_array, c_float, curve_row, deliver, f32, ulps


def probes(curve, rng, inside):
    """The x to try: every break and its neighbours, random points, the outside, the absurd."""
    start, end = f32(float(curve.start)), f32(float(curve.end))
    xs = []
    for b in curve.breaks():
        b = f32(float(b))
        xs += [ulps(b, -1), b, ulps(b, 1)]
    xs += [f32(rng.uniform(float(start), float(end))) for _ in range(inside)]
    width = float(end) - float(start)
    xs += [f32(float(start) - width / 3), f32(float(end) + width / 3)]
    xs += [f32(v) for v in (0.0, -0.0, 1e-45, 3.4028235e38, -3.4028235e38)]
    return xs + [f32(math.inf), f32(-math.inf), f32(math.nan)]


def rows(curve, xs):
    """Expected rows; NaN and what lies below get the start, what lies above the end."""
    lines = []
    for x in xs:
        if np.isnan(x) or x < float(curve.start):
            exact, outside = curve.at(curve.start).held(), True
        elif x > float(curve.end):
            exact, outside = curve.at(curve.end).held(), True
        else:
            exact, outside = curve.at(Fraction(float(x))), False
        lines.append("    " + curve_row(x, exact, outside) + ",\n")
    return lines


def table(name, lines):
    return f"static const struct cb_curve_row {name}[] = {{\n{''.join(lines)}}};\n"


def clamped(start, end, inner, degree):
    """Knots with both ends repeated degree+1 times."""
    return [start] * (degree + 1) + sorted(inner) + [end] * (degree + 1)


def uniform_inner(start, end, count):
    return [f32(start + (end - start) * i / (count + 1)) for i in range(1, count + 1)]


def bsplines(rng):
    """(title, degree, knots, control points): every degree with every kind of knots."""
    def points(count, size=200.0):
        return [rng.uniform(-size, size) for _ in range(count)]

    def alternating(count, size=200.0):
        return [size * rng.uniform(0.9, 1.0) * (-1) ** i for i in range(count)]

    yield "gantry X, 20 control points", 3, clamped(0, 14300, uniform_inner(0, 14300, 16), 3), points(20)
    yield "gantry X, knots by curvature", 3, clamped(
        0, 14300, [rng.uniform(0, 14300) for _ in range(16)], 3), points(20)
    for p in range(1, 6):
        yield "one span", p, clamped(-1, 1, [], p), points(p + 1)
        yield "clamped, random knots", p, clamped(
            -700, 2500, [rng.uniform(-700, 2500) for _ in range(4)], p), points(p + 5)
        yield "unclamped, random knots", p, sorted(
            rng.uniform(-50, 300) for _ in range(2 * p + 6)), points(p + 5)
        yield "unclamped, uniform knots", p, [10 * i for i in range(2 * p + 5)], alternating(p + 4)
        yield "alternating points", p, clamped(
            0, 3000, [rng.uniform(0, 3000) for _ in range(3)], p), alternating(p + 4)
        repeated = [[100] * m + [200] for m in range(2, p + 2)]
        for inner in repeated[-2:]:
            yield f"knot of multiplicity {len(inner) - 1}", p, clamped(
                0, 300, inner, p), points(p + 1 + len(inner))
        yield "repeated beyond the domain", p, (
            [0] * p + [5] + [8, 9] + [20] * (p + 1) + [21]), points(p + 4)
        yield "narrow beside wide", p, clamped(0, 10000, [1, 1.0001, 1.0002, 9000], p), alternating(p + 5)
        yield "widest spans", p, clamped(-(2**24), 2**24, [0], p), points(p + 2)
        yield "small waves on a large offset", p, clamped(
            0, 100, [30, 60], p), [1e5 + rng.uniform(-1, 1) for _ in range(p + 3)]
        yield "nearly uniform knots", p, clamped(
            0, 80, [10 * i + rng.uniform(-4, 4) for i in range(1, 8)], p), points(p + 8)


def polylines(rng):
    def values(count):
        return [rng.uniform(-200, 200) for _ in range(count)]

    yield "one segment", [-5, 7], values(2)
    yield "every 240 mm, short last interval", [240 * i for i in range(12)] + [2750], values(13)
    yield "random positions", sorted(rng.uniform(-1000, 14300) for _ in range(12)), values(12)
    yield "one ulp apart", [1000, ulps(1000, 1), ulps(1000, 2), 1001], [-200, 200, -200, 200]
    yield "thirds", [0, 0.1, 0.2, 0.3, 0.7], [1 / 3, -1 / 3, 2 / 3, 1 / 7, 0]


def polynomials(rng):
    """(title, coefficients, center, inverse half range, from, to)"""
    def size_of(k):
        return rng.uniform(-100, 100)

    for degree in (0, 1, 2, 3, 5, 7, 11, 15):
        yield f"degree {degree} over 14 300 mm", [size_of(k) for k in range(degree + 1)], 7150, 1 / 7150, 0, 14300
    plain = [12.5, -0.031, 4.7e-5, -2.9e-8, 5.1e-12]
    yield "plain x, fourth order (S4)", plain, 0, 1, 0, 2500
    yield "off centre", [size_of(k) for k in range(5)], 20, 0.1, -10, 45
    chebyshev = [0, 0, 0, 0, 0, 0, 0, 0]
    for k, a in ((1, -7), (3, 56), (5, -112), (7, 64)):
        chebyshev[k] = a
    yield "Chebyshev T7, cancelling", chebyshev, 0, 1, -1, 1


def write_bsplines(rng):
    text, cases = "", ""
    for i, (title, degree, knots, points) in enumerate(bsplines(rng)):
        knots, points = [f32(v) for v in knots], [f32(v) for v in points]
        curve = Bspline(degree, knots, points)
        text += c_array(f"bspline_{i}_knots", knots) + c_array(f"bspline_{i}_points", points)
        text += table(f"bspline_{i}_rows", rows(curve, probes(curve, rng, 6)))
        cases += (f'    {{"{title}", {degree}, {len(points)}, bspline_{i}_knots, '
                  f"bspline_{i}_points, bspline_{i}_rows, LENGTH(bspline_{i}_rows)}},\n")
    return text + f"static const struct bspline_case bspline_cases[] = {{\n{cases}}};\n"


def write_polylines(rng):
    text, cases = "", ""
    for i, (title, xs, ys) in enumerate(polylines(rng)):
        xs, ys = [f32(v) for v in xs], [f32(v) for v in ys]
        curve = Polyline(xs, ys)
        text += c_array(f"polyline_{i}_x", xs) + c_array(f"polyline_{i}_y", ys)
        text += table(f"polyline_{i}_rows", rows(curve, probes(curve, rng, 10)))
        cases += (f'    {{"{title}", {len(xs)}, polyline_{i}_x, polyline_{i}_y, '
                  f"polyline_{i}_rows, LENGTH(polyline_{i}_rows)}},\n")
    return text + f"static const struct polyline_case polyline_cases[] = {{\n{cases}}};\n"


def write_polynomials(rng):
    text, cases = "", ""
    for i, (title, a, center, inverse, start, end) in enumerate(polynomials(rng)):
        a = [f32(v) for v in a]
        center, inverse, start, end = f32(center), f32(inverse), f32(start), f32(end)
        curve = Polynomial(a, center, inverse, start, end)
        text += c_array(f"polynomial_{i}_a", a)
        text += table(f"polynomial_{i}_rows", rows(curve, probes(curve, rng, 20)))
        numbers = ", ".join(c_float(v) for v in (center, inverse, start, end))
        cases += (f'    {{"{title}", {{polynomial_{i}_a, {numbers}, {len(a) - 1}}}, '
                  f"polynomial_{i}_rows, LENGTH(polynomial_{i}_rows)}},\n")
    return text + f"static const struct polynomial_case polynomial_cases[] = {{\n{cases}}};\n"


if __name__ == "__main__":
    deliver({"bspline.inc": write_bsplines(random.Random(1)),
             "polyline.inc": write_polylines(random.Random(2)),
             "polynomial.inc": write_polynomials(random.Random(3))}, "curves.py")
