# SPDX-License-Identifier: MIT
"""ISO 230-2 and straightness once more, from the standard's definitions (FACTS of the project: n runs,
targets i, both directions, s with n - 1), with numpy and nothing of the tools."""

import itertools

import numpy


def figures(forward, backward):
    """readings[run][target] of each direction, or None. Figures by name; None where the standard has
    none for so few runs."""
    sides = [numpy.array(side, float) for side in (forward, backward) if side is not None]
    runs = min(len(side) for side in sides)
    mean = [side.mean(axis=0) for side in sides]
    s = [side.std(axis=0, ddof=1) if runs > 1 else None for side in sides]
    out = {"E": max(m.max() for m in mean) - min(m.min() for m in mean)} if len(sides) == 2 else {}
    if len(sides) == 2:
        B = mean[0] - mean[1]
        middle = (mean[0] + mean[1]) / 2
        out |= {"B": abs(B).max(), "B_mean": B.mean(), "M": middle.max() - middle.min()}
    if runs > 1 and len(sides) == 2:
        R = numpy.maximum.reduce([2 * s[0] + 2 * s[1] + abs(B), 4 * s[0], 4 * s[1]])
        out |= {"R": R.max(), "A": max((m + 2 * x).max() for m, x in zip(mean, s)) -
                min((m - 2 * x).min() for m, x in zip(mean, s))}
    names = [n for n, side in (("forward", forward), ("backward", backward)) if side is not None]
    for name, m, x in zip(names, mean, s):
        out[name] = {"E": m.max() - m.min()}
        if runs > 1:
            out[name] |= {"R": 4 * x.max(), "A": (m + 2 * x).max() - (m - 2 * x).min()}
    return out


def about(x, y, slope):
    rest = y - slope * x
    return rest.max() - rest.min()


def straightness(x, y):
    """Deviation about the three reference lines of ISO 230-1. The narrowest zone has a slope that two
    of the points span, so every pair is tried."""
    x, y = numpy.array(x, float), numpy.array(y, float)
    slopes = [(y[j] - y[i]) / (x[j] - x[i]) for i, j in itertools.combinations(range(len(x)), 2)]
    return {"end_point": about(x, y, (y[-1] - y[0]) / (x[-1] - x[0])),
            "least_squares": about(x, y, numpy.polyfit(x, y, 1)[0]),
            "minimum_zone": min(about(x, y, slope) for slope in slopes)}
