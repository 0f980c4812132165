# SPDX-License-Identifier: MIT
"""The uncertainty of ISO 230 figures once more, with numpy and nothing of the tools: each figure of iso230_2.py is
differentiated by every reading, and the environment's variance goes through these derivatives (GUM, 5.1.2)."""

import numpy

from iso230_2 import figures, straightness

STEP = 1e-5  # µm


def contributions(length_mm, device_um=0, device_um_per_m=0, misalignment_mm=0, temperature_K=0, expansion_range=0,
                  eve_um=0, expansion=0, degC=20):
    """U (k = 2) of each contribution in µm, as ISO/TR 230-9 has them."""
    metres = length_mm / 1000
    return {"device": (device_um ** 2 + (device_um_per_m * metres) ** 2) ** 0.5,
            "misalignment": 1000 * 0.3 * misalignment_mm ** 2 / length_mm,
            "temperature": 0.6 * expansion * metres * temperature_K,
            "expansion": 0.6 * abs(degC - 20) * metres * expansion_range,
            "environment": 0.6 * eve_um}


def effect(value, readings):
    """out: the root of the sum of squares of a value's derivatives by each reading"""
    squares = 0.0
    for place in numpy.ndindex(readings.shape):
        ends = []
        for sign in 1, -1:
            moved = readings.copy()
            moved[place] += sign * STEP
            ends.append(value(moved))
        squares += ((ends[0] - ends[1]) / (2 * STEP)) ** 2
    return squares ** 0.5


def uncertainties(forward, backward, x, parts):
    """in: readings[run][target] of both directions; parts: contributions(). out: U by the figure's key"""
    both = numpy.array([forward, backward], float)
    along = sum(parts[name] ** 2 for name in ("device", "misalignment", "temperature", "expansion")) ** 0.5
    out = {}
    for key in "A", "R", "E", "M", "B", "A+", "R+", "E+", "A-", "R-", "E-":
        def value(readings, key=key):
            all_of_them = figures(*readings)
            side = {"": all_of_them, "+": all_of_them["forward"], "-": all_of_them["backward"]}[key[1:]]
            return side[key[0]]
        systematic = along if key[0] in "AEM" else 0.0
        out[key] = numpy.hypot(systematic, parts["environment"] * effect(value, both))
    for line, key in ("end_point", "end-point"), ("least_squares", "least-squares"), ("minimum_zone", "minimum-zone"):
        out[key] = numpy.hypot(parts["device"], parts["environment"] * effect(
            lambda readings, line=line: straightness(x, readings.mean(axis=(0, 1)))[line], both))
    return out
