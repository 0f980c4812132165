#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""What the twin's roughness spectrum means for those who fit it: the figures of docs/twin.md.

Draws random curves with the spectrum of host-tools/twin/curve.h (own code, numpy's generator) and
prints, relative to each curve's range and as the median and the largest of 300 curves:
  poly7   range of what a polynomial of degree 7 through the whole curve leaves
  cubic   range of what a noise-free cubic spline through the measured points leaves
  linear  the same for straight lines between the points

usage: twin_spectrum.py [--curves N]
"""
import argparse

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.interpolate import CubicSpline


def random_curves(rng, count, length, cutoff, exponent, roll_off):
    """Positions and `count` curves on them, less their lines, range 1."""
    fundamental = 4 * length
    k = np.arange(1, int(np.ceil(4 * fundamental / cutoff)) + 1)
    density = k**-float(exponent) / (1 + (k / fundamental * cutoff) ** roll_off)
    x = np.linspace(0, length, 2001)
    angle = 2 * np.pi * np.outer(k / fundamental, x)
    cosines, sines = np.sqrt(density) * rng.standard_normal((2, count, len(k)))
    y = cosines @ np.cos(angle) + sines @ np.sin(angle)
    y -= np.array([np.polyval(np.polyfit(x, row, 1), x) for row in y])
    return x, y / np.ptp(y, axis=1, keepdims=True)


def leftovers(x, y, interval):
    points = np.append(np.arange(0, x[-1] - 1e-6 * interval, interval), x[-1])
    at = np.interp(points, x, y)
    return (
        np.ptp(y - Chebyshev.fit(x, y, 7)(x)),
        np.ptp(y - CubicSpline(points, at)(x)),
        np.ptp(y - np.interp(x, points, at)),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--curves", type=int, default=300)
    count = parser.parse_args().curves
    print("axis exponent roll_off   poly7 median max   cubic median max   linear median max  (%)")
    for axis, length, cutoff, interval in (("X", 14300, 1200, 240), ("Y", 3000, 600, 120)):
        for exponent in (2, 2.5, 3, 4):
            rng = np.random.default_rng(2015)
            x, curves = random_curves(rng, count, length, cutoff, exponent, 8)
            left = 100 * np.array([leftovers(x, y, interval) for y in curves])
            cells = [f"{np.median(c):7.2f} {np.max(c):6.2f}" for c in left.T]
            print(f"{axis:4} {exponent:8} {8:8}   " + "   ".join(cells))


if __name__ == "__main__":
    main()
