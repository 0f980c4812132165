# SPDX-License-Identifier: MIT
"""Curves in exact rational arithmetic, from their definitions, with the error bounds that models/
states. Shares nothing with the C: the B-spline is the Cox-de Boor basis recursion of the textbook
(S1: 0/0 = 0), not a conversion and not de Boor's scheme."""

from fractions import Fraction

UNIT_ROUNDOFF = Fraction(1, 2**24)
SECOND_ORDER = Fraction(1001, 1000)  # "1.001" of the stated bounds: products of roundings
SMALLEST = Fraction(1, 2**149)


class Exact:
    """Value and slope at one x, each with its stated bound."""

    def __init__(self, value, value_bound, slope, slope_bound):
        self.value, self.value_bound = value, SECOND_ORDER * value_bound
        self.slope, self.slope_bound = slope, SECOND_ORDER * slope_bound

    def held(self):
        """The same value outside the range: held, slope 0."""
        held = Exact(self.value, 0, Fraction(0), 0)
        held.value_bound, held.slope_bound = self.value_bound, Fraction(0)
        return held


def ratio(numerator, denominator):
    return numerator / denominator if denominator else Fraction(0)


def basis(t, j, p, span, x):
    """N_j,p(x) for an x of the half-open span [t_span, t_span+1) (or its right end)."""
    if p == 0:
        return Fraction(1 if j == span else 0)
    if not j <= span <= j + p:
        return Fraction(0)
    left = ratio(x - t[j], t[j + p] - t[j])
    right = ratio(t[j + p + 1] - x, t[j + p + 1] - t[j + 1])
    return left * basis(t, j, p - 1, span, x) + right * basis(t, j + 1, p - 1, span, x)


def basis_slope(t, j, p, span, x):
    left = ratio(Fraction(p), t[j + p] - t[j])
    right = ratio(Fraction(p), t[j + p + 1] - t[j + 1])
    return left * basis(t, j, p - 1, span, x) - right * basis(t, j + 1, p - 1, span, x)


class Bspline:
    def __init__(self, degree, knots, points):
        self.p = degree
        self.t = [Fraction(float(v)) for v in knots]
        self.c = [Fraction(float(v)) for v in points]
        spans = range(degree, len(self.c))
        self.spans = [m for m in spans if self.t[m] < self.t[m + 1]]
        self.start, self.end = self.t[degree], self.t[len(self.c)]

    def breaks(self):
        return [self.t[m] for m in self.spans] + [self.end]

    def at(self, x):
        """in: x of the domain. A knot belongs to the span on its right, the end to the last."""
        span = [m for m in self.spans if self.t[m] <= x][-1]
        active = range(span - self.p, span + 1)
        value = sum(self.c[j] * basis(self.t, j, self.p, span, x) for j in active)
        slope = sum(self.c[j] * basis_slope(self.t, j, self.p, span, x) for j in active)
        return Exact(value, self.value_bound(span), slope, self.slope_bound(span))

    def value_bound(self, span):
        """models/bspline.c: e (p M + K_p R), and the underflow."""
        p, points = self.p, self.c[span - self.p : span + 1]
        largest, half_range = max(map(abs, points)), (max(points) - min(points)) / 2
        k = 3 ** (p - 1) * (25 * p - 27) + 11 * 2**p - p - 1
        wide = max(Fraction(1), self.t[span + 1] - self.t[span]) ** p
        return UNIT_ROUNDOFF * (p * largest + k * half_range) + k * SMALLEST * wide

    def slope_bound(self, span):
        """models/bspline.c: e L_p R / h, and the underflow."""
        p, points = self.p, self.c[span - self.p : span + 1]
        half_range, h = (max(points) - min(points)) / 2, self.t[span + 1] - self.t[span]
        factor = Fraction(2 * p * 3**p * (25 * p - 31), 9) + 11 * p * 2**p
        return factor / h * (UNIT_ROUNDOFF * half_range + SMALLEST * max(Fraction(1), h) ** p)


class Polyline:
    def __init__(self, xs, ys):
        self.x = [Fraction(float(v)) for v in xs]
        self.y = [Fraction(float(v)) for v in ys]
        self.start, self.end = self.x[0], self.x[-1]

    def breaks(self):
        return self.x

    def at(self, x):
        i = [i for i in range(len(self.x) - 1) if self.x[i] <= x][-1]
        rise = self.y[i + 1] - self.y[i]
        slope = rise / (self.x[i + 1] - self.x[i])
        largest = max(abs(self.y[i]), abs(self.y[i + 1]))
        # models/polyline.c: e (M + 5 |y1 - y0|) and 3 e |slope|
        value_bound = UNIT_ROUNDOFF * (largest + 5 * abs(rise))
        return Exact(self.y[i] + slope * (x - self.x[i]), value_bound, slope,
                     3 * UNIT_ROUNDOFF * abs(slope))


class Polynomial:
    def __init__(self, coefficients, center, inverse_half_range, start, end):
        self.a = [Fraction(float(v)) for v in coefficients]
        self.center, self.inverse = Fraction(float(center)), Fraction(float(inverse_half_range))
        self.start, self.end = Fraction(float(start)), Fraction(float(end))

    def breaks(self):
        return [self.start, self.center, self.end]

    def at(self, x):
        u = (x - self.center) * self.inverse
        terms = [a * u**k for k, a in enumerate(self.a)]
        slopes = [k * a * u ** (k - 1) * self.inverse for k, a in enumerate(self.a) if k]
        # models/polynomial.c: e sum (4k + 1) |a_k u^k|, e inverse sum k (4k + 1) |a_k u^(k-1)|
        value_bound = UNIT_ROUNDOFF * sum((4 * k + 1) * abs(v) for k, v in enumerate(terms))
        slope_bound = UNIT_ROUNDOFF * sum((4 * k + 5) * abs(v) for k, v in enumerate(slopes))
        return Exact(sum(terms), value_bound, sum(slopes), slope_bound)
