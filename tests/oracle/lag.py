#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the first-order lag.
  lag.py           writes tests/conformance/vectors/lag.inc
  lag.py --check   exits 1 if it is not what it would write

The exact solution of tau dy/dt = u - y for an input made of straight pieces, in 50 digits."""

import random
from decimal import Decimal
from fractions import Fraction

import functions
from functions import decimal
from vectors import c_bound, c_double, c_float, deliver, f32

BOUND = Fraction(3, 10**7)  # models/lag.h, of the largest |u|


def rational(x):
    return Fraction(float(f32(x)))


class Lag:
    def __init__(self, tau, u):
        self.tau, self.u, self.y = decimal(tau), decimal(u), decimal(u)

    def straight_to(self, u, dt):
        u, dt = decimal(u), decimal(dt)
        slope = (u - self.u) / dt
        steady = self.u - slope * self.tau
        self.y = steady + slope * dt + (self.y - steady) * (-dt / self.tau).exp()
        self.u = u
        return self.y


def gains(h):
    """1 - e^-h, and 1 - (1 - e^-h) / h by its series."""
    gain, term, ramp = functions.one_minus_exp(h), decimal(h) / 2, Decimal(0)
    if h > 1:
        return gain, 1 - gain / decimal(h)
    for k in range(3, 60):
        ramp += term
        term *= -decimal(h) / k
    return gain, ramp


def gain_rows(rng):
    steps = [(0.001, 7200), (0.001, 16000), (0.03, 600), (0.03, 7200), (60, 600), (600, 600),
             (601, 600), (1e4, 600), (1e-9, 1e9)]
    steps += [(10 ** rng.uniform(-4, 4), 10 ** rng.uniform(0, 4.2)) for _ in range(80)]
    rows = ""
    for dt, tau in steps:
        dt, tau = rational(dt), rational(tau)
        numbers = [c_float(dt), c_float(tau)]
        for g in gains(dt / tau):
            numbers += [c_double(g), c_bound(4 * functions.spacing(g))]
        rows += "    {%s},\n" % ", ".join(numbers)
    return f"static const struct gain_row gain_rows[] = {{\n{rows}}};\n"


def walk_rows(rng, tau):
    """Real cycles and pauses; the input any walk."""
    lag, u, rows = Lag(tau, 20), 20.0, ""
    for i in range(120):
        u = min(90.0, max(-10.0, u + rng.uniform(-8, 8)))
        dt = rng.choice((0.001, 0.03, 0.03 + rng.uniform(-0.01, 0.01), 1, 20, 400, 5000))
        y = lag.straight_to(rational(u), rational(dt))
        rows += "    {%s, %s, %s, %s},\n" % (c_float(dt), c_float(u), c_double(y),
                                             c_bound(BOUND * 90))
    return rows


def course(tau, dt, pieces):
    """Long runs of equal steps: (steps, input at the end) of straight pieces, y after each."""
    dt, lag, rows = rational(dt), Lag(tau, 20), ""
    for steps, to in pieces:
        y = lag.straight_to(rational(to), steps * dt)
        rows += "{%d, %s, %s, %s}, " % (steps, c_float(to), c_double(y), c_bound(BOUND * 90))
    return "    {%s, %s, {%s}},\n" % (c_float(tau), c_float(dt), rows.rstrip(", "))


def main():
    rng = random.Random(7)
    text, names = gain_rows(rng), []
    for tau in (5, 600, 3600):
        names.append(f"walk_{tau}")
        text += f"static const struct walk_row walk_{tau}[] = {{\n{walk_rows(rng, tau)}}};\n"
    walks = ", ".join("{%s, %s, LENGTH(%s)}" % (c_float(n[5:]), n, n) for n in names)
    text += f"static const struct walk walks[] = {{{walks}}};\n"
    courses = course(600, 0.03, [(1, 80), (20000, 80), (80000, 80), (300000, 80)])
    courses += course(7200, 0.03, [(1, 80), (100000, 80), (200000, 25), (200000, 25)])
    courses += course(600, 0.001, [(1, 80), (200000, 80), (200000, 10), (200000, 10)])
    courses += course(7200, 0.001, [(1, 80), (100000, 80), (200000, 90), (200000, 90)])
    text += f"static const struct course courses[] = {{\n{courses}}};\n"
    deliver({"lag.inc": text}, "lag.py")


if __name__ == "__main__":
    main()
