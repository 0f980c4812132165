#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of linear terms with a bank, in 50 digits.
  bank.py           writes tests/conformance/vectors/bank.inc
  bank.py --check   exits 1 if it is not what it would write

y = bias + sum w c over the columns c: powers of the inputs, lagged as in lag.py or not. An input has a new value in
some of the rows only; its lags move over the time between."""

import random
from fractions import Fraction

from functions import decimal
from lag import BOUND, Lag, rational
from vectors import c_array, c_bound, c_double, c_float, deliver, f32

U = Fraction(1001, 1000) / 2**24
LIMITS = ((-10, 90), (0, 24000), (-150, 150))
CASES = (  # powers of each input, time constants, rows
    (((1,), (1, 2, 3), (1, 4)), (0, 30, 600, 7200), 120),
    (((1, 2), (3,), (2,)), (5, 3600), 60),
    (((2,), (1, 2, 3, 4), (1,)), (0,), 30))
OUTPUTS = 2


def column_sizes(powers, taus):
    return [Fraction(max(map(abs, limits))) ** p for limits, own in zip(LIMITS, powers) for p in own for _ in taus]


class Columns:
    def __init__(self, powers, taus):
        self.powers, self.taus, self.lags = powers, taus, {}

    def move(self, i, x, dt_us):
        """Input i has the new value x, dt_us after its last one (None: its first)."""
        for p in self.powers[i]:
            for tau in filter(None, self.taus):
                if dt_us is None:
                    self.lags[i, p, tau] = Lag(tau, x**p)
                else:
                    self.lags[i, p, tau].straight_to(x**p, Fraction(dt_us, 10**6))

    def values(self, xs):
        return [self.lags[i, p, tau].y if tau else decimal(x**p)
                for i, x in enumerate(xs) for p in self.powers[i] for tau in self.taus]


def slope(powers, taus, weights, x):
    """By input 1, the speed, and its bound."""
    total, size, at = Fraction(0), Fraction(0), 0
    for i, own in enumerate(powers):
        for p in own:
            if i == 1 and taus[0] == 0:
                part = weights[at] * p * x ** (p - 1)
                total, size = total + part, size + abs(part)
            at += len(taus)
    return total, 8 * U * size


def row_text(powers, taus, weights, biases, xs, new, dt_us, columns):
    values, numbers = columns.values(xs), []
    sizes = column_sizes(powers, taus)
    for w, bias in zip(weights, biases):
        parts = [decimal(a) * b for a, b in zip(w, values)]
        own = sum(abs(a) * size * (BOUND + 4 * U) for a, size in zip(w, sizes))
        rounding = (len(parts) + 1) * U * (sum(abs(Fraction(p)) for p in parts) + own + abs(bias))
        numbers += [c_double(sum(parts) + decimal(bias)), c_bound(own + rounding)]
    for w in weights:
        numbers += [f(v) for f, v in zip((c_double, c_bound), slope(powers, taus, w, xs[1]))]
    return "    {%d, %d, {%s}, %s},\n" % (dt_us, new, ", ".join(map(c_float, xs)), ", ".join(numbers))


def rows_of(rng, powers, taus, weights, biases, count):
    columns, xs, since, text = Columns(powers, taus), [None] * 3, [None] * 3, ""
    for k in range(count):
        dt_us = rng.choice((1000, 30000, 30000 + rng.randrange(-9000, 9000), 10**6, 40 * 10**6, 5 * 10**9))
        new = 7 if k == 0 else rng.randrange(8)
        for i in range(3):
            since[i] = None if since[i] is None else since[i] + dt_us
            if not new >> i & 1:
                continue
            low, high = LIMITS[i]
            x = rng.uniform(low, high) if xs[i] is None or rng.random() < 0.2 else \
                float(xs[i]) + rng.uniform(-0.05, 0.05) * (high - low)
            xs[i] = rational(f32(min(high, max(low, x))))
            columns.move(i, xs[i], since[i])
            since[i] = 0
        text += row_text(powers, taus, weights, biases, xs, new, dt_us, columns)
    return text


def write(rng):
    text = cases = ""
    for n, (powers, taus, count) in enumerate(CASES):
        sizes = column_sizes(powers, taus)
        weights = [[rational(rng.uniform(-30, 30) / float(size)) for size in sizes] for _ in range(OUTPUTS)]
        biases = [rational(rng.uniform(-40, 40)) for _ in range(OUTPUTS)]
        pool = [Fraction(tau) for tau in taus] + [w for row in weights for w in row] + biases
        sets = [sum(1 << (p - 1) for p in own) for own in powers]
        text += c_array(f"bank_{n}_pool", pool)
        text += f"static const struct bank_row bank_{n}_rows[] = {{\n" + \
            rows_of(rng, powers, taus, weights, biases, count) + "};\n"
        cases += "    {{0, 1, 2, %s}, %d, %s, %d, bank_%d_pool, LENGTH(bank_%d_pool), bank_%d_rows, " \
            "LENGTH(bank_%d_rows)},\n" % (", ".join(map(str, sets)), len(taus), str(taus[0] == 0).lower(),
                                         len(sizes), n, n, n, n)
    return text + f"static const struct bank_case bank_cases[] = {{\n{cases}}};\n"


if __name__ == "__main__":
    deliver({"bank.inc": write(random.Random(21))}, "bank.py")
