#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Prints the coefficient file of the reference load: 18 B-splines of 20 control points, the
volumetric term, a 19-20-3 network behind its training range, 24 lags of 12 thermometers.

The six curves of an axis stand on the same breaks, as those do that were measured together; with
the option --own-breaks none does. With --bank there is a linear term of 256 lags and three outputs beside them; with
--sigma it states its sigma along four directions too."""

import json
import random
import sys

AXES, ERRORS, TRAVEL_MM = "XYZ", "XYZABC", {"X": 14300, "Y": 3000, "Z": 2500}
POINTS, DEGREE, INPUTS, HIDDEN, OUTPUTS = 20, 3, 19, 20, 3
THERMOMETERS, TAUS_S = 12, (600, 3600)
BANKED = "--bank" in sys.argv or "--sigma" in sys.argv
dice = random.Random(3)


def numbers(count, size):
    return [round(dice.uniform(-size, size), 4) for _ in range(count)]


def signals():
    for i, axis in enumerate(AXES):
        yield {"name": axis, "unit": "mm", "plc": 8 + 2 * i, "type": "int32", "scale": 0.0001,
               "min": 0, "max": TRAVEL_MM[axis]}
    for i in range(THERMOMETERS):
        yield {"name": f"T{i}", "unit": "degC", "plc": 14 + i, "type": "int16", "scale": 0.1,
               "min": -10, "max": 90, "max_rate_per_s": 20, "max_age_ms": 2000}
    for i in range(THERMOMETERS):
        for k, tau_s in enumerate(TAUS_S):
            yield {"name": f"T{i}_{k}", "unit": "degC", "lag_of": f"T{i}", "tau_s": tau_s}


def curve(name, axis):
    """Knots uneven, so that the span is searched; errors of 40 µm or µrad."""
    spans = POINTS - DEGREE
    own_mm = ERRORS.index(name[1]) if "--own-breaks" in sys.argv else 0
    knots = [round(TRAVEL_MM[axis] * (k / spans) ** 2 + own_mm * (0 < k < spans), 3)
             for k in range(spans + 1)]
    return {"name": name, "type": "bspline", "signal": axis, "degree": DEGREE,
            "knots": knots[:1] * DEGREE + knots + knots[-1:] * DEGREE,
            "control_points": numbers(POINTS, 40)}


def network():
    inputs = [f"T{i}" for i in range(7)] + [f"T{i}_1" for i in range(12)]
    return {"name": "net", "type": "bpnet", "inputs": inputs, "activation": "tansig",
            "outputs": ["net_x", "net_y", "net_z"],
            "hidden_weights": [numbers(INPUTS, 1) for _ in range(HIDDEN)],
            "hidden_bias": numbers(HIDDEN, 1), "output_bias": numbers(OUTPUTS, 1),
            "output_weights": [numbers(HIDDEN, 1) for _ in range(OUTPUTS)],
            "output_scale": [8] * OUTPUTS,
            "input_center": [20] * INPUTS, "input_scale": [10] * INPUTS,
            "input_min": [18] * INPUTS, "input_max": [26] * INPUTS}


def bank():
    inputs, taus = [f"T{i}" for i in range(8)], [20 * 2 ** (i / 2) for i in range(16)]
    term = {"name": "bank", "type": "linear", "outputs": ["bank_x", "bank_y", "bank_z"],
            "bank": {"inputs": inputs, "powers": {name: [1, 2] for name in inputs}, "tau_s": taus,
                     "weights": [numbers(256, 0.01) for _ in range(OUTPUTS)]}}
    if "--sigma" in sys.argv:
        term["sigma"] = {"floor_um": [8] * OUTPUTS, "along_um": [2] * OUTPUTS, "offsets": numbers(4, 1),
                         "directions": [numbers(256, 0.01) for _ in range(4)]}
    return term


def terms():
    names = [f"E{kind}{axis}" for axis in AXES for kind in ERRORS]
    yield from (curve(name, name[2]) for name in names)
    yield {"name": "vol", "type": "volumetric", "chain": "XYfZ", "errors": names,
           "outputs": ["vol_x", "vol_y", "vol_z"], "tool_length_mm": 200,
           "squareness_urad": {"C0Y": 12, "B0Z": -7, "A0Z": 20}}
    yield network()
    if BANKED:
        yield bank()


def channels():
    for i, axis in enumerate(AXES):
        name = axis.lower()
        bank = [f"bank_{name}"] * BANKED
        yield {"name": axis, "sum": [f"vol_{name}", f"net_{name}", *bank], "plc": 104 + 2 * i,
               "limit_um": 300, "error_um": 400, "slew_um_per_s": 500, "type": "int32",
               "scale": 0.01}


print(json.dumps({
    "format": "compbox/1", "revision": 1,
    "machine": {"name": "reference load", "axes": list(AXES)},
    "cycle": {"period_ms": 30, "lead_ms": 45},
    "plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}},
            "exchange": "fc3+fc16", "read": {"start": 0, "count": 32},
            "write": {"start": 100, "count": 16}, "control": 0, "plc_heartbeat": 1, "status": 100,
            "box_heartbeat": 101, "heartbeat_timeout_ms": 200},
    "signals": list(signals()), "terms": list(terms()), "channels": list(channels()), "pairs": [],
    "safety": {"hold_ms": 500, "ramp_um_per_s": 50}}))
