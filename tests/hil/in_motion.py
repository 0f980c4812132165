# SPDX-License-Identifier: MIT
"""Axes in motion, and what the models say of where they are."""
import math

import machine
from machine import ACTIVE


def program(t):
    """A stretch at 10 m/min and below, ends of travel left and right of it."""
    return {"X": 5000 + 160 * t, "Y": -1400 + 900 * math.sin(0.4 * t), "Z": 1200 + 60 * t,
            "T1": 20 + 0.5 * t}


def quantised(values):
    """What the PLC's registers make of the values."""
    result = {}
    for signal in machine.FILE["signals"]:
        scale = signal.get("scale", 1)
        value = values[signal["name"]]
        result[signal["name"]] = (value if signal["type"] == "float32"
                                  else math.floor(value / scale + 0.5) * scale)
    return result


def is_of(um, values):
    """The outputs are what the models say of these values."""
    wanted = machine.wanted_um(quantised(values))
    return all(abs(um[name] - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name]) for name in um)


def judged(steps, values_of):
    """Steps that answered a good reading, when the way to its value was behind: so is what they wrote since the last
    time that they were not ACTIVE. out: [(step, values of its reading)]"""
    found, arrived = [], False
    for step in steps:
        arrived = arrived and step.mode == ACTIVE
        if not step.read_ok or step.mode != ACTIVE:
            continue
        values = values_of[step.reading - 1]
        arrived = arrived or is_of(step.um, values)
        if arrived:
            found.append((step, values))
    return found
