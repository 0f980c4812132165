# SPDX-License-Identifier: MIT
"""tanh and 1 - exp(-x) of a rational number, to 50 digits (the standard library's decimal,
which rounds exp correctly), and the float32 spacing that bounds are counted in."""

import math
from decimal import Decimal, getcontext
from fractions import Fraction

getcontext().prec = 50
getcontext().Emin, getcontext().Emax = -(10**12), 10**12


def decimal(x):
    x = Fraction(x)
    return Decimal(x.numerator) / Decimal(x.denominator)


def one_minus_exp(x):
    """1 - e^-x for x > 0, 0 below; the series where the difference would lose digits."""
    x = decimal(x)
    if x <= 0:
        return Decimal(0)
    if x > Decimal("1e-6"):
        return 1 - (-x).exp()
    return x * (1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6)))))


def tanh(x):
    rest = one_minus_exp(2 * abs(Fraction(x)))
    value = rest / (2 - rest)
    return value if x >= 0 else -value


def spacing(x):
    """Of float32 at x, subnormal numbers included."""
    exponent = math.frexp(float(abs(x)))[1] if float(x) else -149
    return Fraction(2) ** (max(exponent, -125) - 24)
