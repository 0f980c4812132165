# SPDX-License-Identifier: MIT
"""The machine of these tests: its coefficient file, and what the box has to write for it.

The expected values are computed here in double precision by de Boor's algorithm and from the
file's own numbers. Nothing is shared with the box: not its curves, its signs or its codec.
"""
import copy
import json
import math
import struct

PERIOD_S = 0.03
READ, WRITE = (0, 32), (100, 16)          # first register, count
CONTROL, PLC_HEARTBEAT, STATUS, BOX_HEARTBEAT = 0, 1, 100, 101
READING = 31                              # counts the readings of the read block
ENABLE, REFERENCED, RESET, PERMIT_RESUME = 1, 2, 4, 8
STANDBY, ACTIVE, HOLD, RAMP, FAULT, STOPPED = range(6)
STOOD_STILL = (FAULT, 19)   # mode and reason of a box that missed its periods

FILE = {
    "format": "compbox/1",
    "revision": 7,
    "machine": {"name": "test gantry", "axes": ["X", "Y", "Z"]},
    "cycle": {"period_ms": 30, "lead_ms": 0},
    "plc": {
        "profile": "generic",
        "transport": {"tcp": {"host": "127.0.0.1", "port": 0, "unit": 1}},
        "exchange": "fc3+fc16",
        "read": {"start": READ[0], "count": READ[1]},
        "write": {"start": WRITE[0], "count": WRITE[1]},
        "control": CONTROL, "plc_heartbeat": PLC_HEARTBEAT,
        "status": STATUS, "box_heartbeat": BOX_HEARTBEAT, "heartbeat_timeout_ms": 200,
    },
    "signals": [
        {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": 0, "max": 14300},
        {"name": "Y", "unit": "mm", "plc": 10, "type": "int32cdab", "scale": 0.001, "min": -1500, "max": 1500},
        {"name": "Z", "unit": "mm", "plc": 12, "type": "float32", "min": 0, "max": 2500},
        {"name": "T1", "unit": "degC", "plc": 14, "type": "int16", "scale": 0.1, "min": -10, "max": 90,
         "max_age_ms": 400},
    ],
    "terms": [
        {"name": "EZX", "type": "bspline", "signal": "X", "degree": 3,
         "knots": [0, 0, 0, 0, 3000, 7000, 9000, 14300, 14300, 14300, 14300],
         "control_points": [0, 60, -40, 120, 30, -80, 10]},
        {"name": "EYX", "type": "bspline", "signal": "X", "degree": 2,
         "knots": [0, 0, 0, 5000, 14300, 14300, 14300], "control_points": [5, -30, 25, 0]},
        {"name": "EZY", "type": "polyline", "signal": "Y", "positions": [-1500, -200, 300, 1500],
         "values": [-26, 4, 13, 40]},
        {"name": "EXY", "type": "polynomial", "signal": "Y", "coefficients": [3, -12, 4, 9],
         "center": 100, "half_range": 1600},
        {"name": "EXZ", "type": "polyline", "signal": "Z", "positions": [0, 2500], "values": [-10, 15]},
        {"name": "GROW", "type": "polynomial", "signal": "T1", "coefficients": [-40, 2]},
    ],
    "channels": [
        {"name": "X", "sum": ["EXY", "EXZ"], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500,
         "plc": 108, "type": "float32", "scale": 1},
        {"name": "Y", "sum": ["EYX"], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500,
         "sign": -1, "plc": 106, "type": "int16", "scale": 0.1},
        {"name": "Z", "sum": ["EZX", "EZY", "GROW"], "limit_um": 300, "error_um": 400,
         "slew_um_per_s": 500, "plc": 104, "type": "int32", "scale": 0.01},
    ],
    "pairs": [],
    "safety": {"hold_ms": 300, "ramp_um_per_s": 200},
}


def coefficients(port, change=None):
    """The file for a PLC on this port; `change` may edit the copy."""
    data = copy.deepcopy(FILE)
    data["plc"]["transport"]["tcp"]["port"] = port
    if change:
        change(data)
    return data


def write_coefficients(path, port, change=None):
    path.write_text(json.dumps(coefficients(port, change), indent=1))
    return path


# Registers, by hand from the Modbus specification and the types' names.

def pack(kind, value):
    """A number as the PLC holds it."""
    form = {"int16": ">h", "uint16": ">H", "int32": ">i", "int32cdab": ">i", "float32": ">f"}[kind]
    words = list(struct.unpack(f">{struct.calcsize(form) // 2}H", struct.pack(form, value)))
    return words[::-1] if kind.endswith("cdab") else words


def unpack(kind, words):
    form = {"int16": ">h", "int32": ">i", "float32": ">f"}[kind]
    return struct.unpack(form, struct.pack(f">{len(words)}H", *words))[0]


def signal_registers(values):
    """{address: word} of the signals' values, quantised as a PLC would."""
    registers = {}
    for signal in FILE["signals"]:
        raw = values[signal["name"]] / signal.get("scale", 1)
        raw = raw if signal["type"] == "float32" else math.floor(raw + 0.5)
        for i, word in enumerate(pack(signal["type"], raw)):
            registers[signal["plc"] + i] = word
    return registers


# The terms, from their definitions.

def de_boor(knots, points, degree, x):
    x = min(max(x, knots[degree]), knots[-degree - 1])
    span = max(i for i in range(degree, len(points)) if knots[i] <= x or i == degree)
    d = [points[span - degree + j] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            i = span - degree + j
            a = (x - knots[i]) / (knots[i + degree - r + 1] - knots[i])
            d[j] = (1 - a) * d[j - 1] + a * d[j]
    return d[degree]


def polyline(positions, values, x):
    if x <= positions[0]:
        return values[0]
    for (x0, x1, y0, y1) in zip(positions, positions[1:], values, values[1:]):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return values[-1]


def term_value(term, x):
    if term["type"] == "bspline":
        return de_boor(term["knots"], term["control_points"], term["degree"], x)
    if term["type"] == "polyline":
        return polyline(term["positions"], term["values"], x)
    u = (x - term.get("center", 0)) / term.get("half_range", 1)
    return sum(c * u ** k for k, c in enumerate(term["coefficients"]))


def wanted_um(values):
    """Wanted displacement of each channel, -sum of its terms, before any limit."""
    terms = {t["name"]: term_value(t, values[t["signal"]]) for t in FILE["terms"]}
    return {c["name"]: -sum(terms[name] for name in c["sum"]) for c in FILE["channels"]}


def written_um(block):
    """What a write of the whole block tells the control, per channel, sign and scale undone."""
    result = {}
    for channel in FILE["channels"]:
        size = 1 if channel["type"] == "int16" else 2
        at = channel["plc"] - WRITE[0]
        raw = unpack(channel["type"], block[at:at + size])
        result[channel["name"]] = channel.get("sign", 1) * raw * channel["scale"]
    return result


AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}   # all channels are far from zero


def at_wanted(write, values=None):
    """in : a write, or a step; values: of the signals, else those that it knew"""
    wanted = wanted_um(values or write.values)
    return all(abs(um - wanted[name]) < 0.06 for name, um in write.um.items())


def resolution_um(channel):
    """Half a step of the register, and what float32 arithmetic may add."""
    step = 0 if channel["type"] == "float32" else channel["scale"] / 2
    return step + 2e-3


CHANNELS = {c["name"]: c for c in FILE["channels"]}
