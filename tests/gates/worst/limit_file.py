#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Makes coefficient files at the limits of the loader, for the search of the dearest step: {name: count} of
SHAPE says how many parts of each kind a file has. The box's target is the STM32F405."""

import json
import random

# Of each count: its range. The loader refuses a file whose parts do not fit together.
SHAPE = {"positions": (2, 24), "velocities": (0, 1), "temperatures": (1, 40), "bus": (0, 20), "lags": (0, 40),
         "nets": (0, 64), "net_inputs": (1, 64), "net_hidden": (1, 64), "net_outputs": (1, 8), "net_linear": (0, 1),
         "branched": (0, 32), "curves": (0, 64), "points": (4, 60), "shared": (0, 1), "polynomials": (0, 64),
         "linears": (0, 30), "linear_inputs": (1, 64), "banks": (0, 16), "bank_inputs": (1, 64),
         "bank_taus": (1, 32), "bank_outputs": (1, 8), "volumetrics": (0, 20), "products": (0, 30), "adapts": (0, 8),
         "channels": (1, 16), "tangents": (0, 8), "sum": (1, 32), "pairs": (0, 8), "applied": (0, 1),
         "period_ms": (5, 30)}
LEAST = {name: least for name, (least, _) in SHAPE.items()}
# The dearest one that the search met: many small networks of two positions, and eight channels whose slopes are by
# one of the two in turn.
DEAREST = {**LEAST, "nets": 30, "net_inputs": 2, "net_hidden": 64, "net_linear": 1, "temperatures": 20, "bus": 2,
           "lags": 8, "linears": 4, "volumetrics": 4, "products": 6, "channels": 8, "tangents": 8, "sum": 32,
           "period_ms": 30}


def change(dice, shape):
    """out: the shape with one to three other counts"""
    shape = dict(shape)
    for name in dice.sample(sorted(SHAPE), dice.randint(1, 3)):
        least, most = SHAPE[name]
        near = shape[name] + dice.choice((-8, -4, -2, -1, 1, 2, 4, 8))
        shape[name] = min(max(near, least), most) if dice.random() < 0.7 else dice.randint(least, most)
    return shape


def signals(n):
    for i in range(n["positions"]):
        extra = {"velocity": "V"} if n["velocities"] else {}
        yield {"name": f"P{i}", "unit": "mm", "plc": 4 + 2 * (i % 3), "type": "int32", "scale": 0.0001, "min": 0,
               "max": 1000 + i, **extra}
    if n["velocities"]:
        yield {"name": "V", "unit": "mm/s", "plc": 10, "type": "int16", "min": -2000, "max": 2000}
    for i in range(n["temperatures"]):
        yield {"name": f"T{i}", "unit": "degC", "plc": 11 + i % 12, "type": "int16", "scale": 0.1, "min": -10,
               "max": 90, "max_rate_per_s": 20, "max_age_ms": 2000}
    for i in range(n["bus"]):
        yield {"name": f"B{i}", "unit": "degC", "bus": "pt100", "unit_id": 1 + i, "register": 0, "type": "int16",
               "scale": 0.1, "min": -10, "max": 90, "max_rate_per_s": 20, "max_age_ms": 2000}
    if n["adapts"]:
        yield {"name": "probe", "unit": "um", "plc": 11, "type": "int16", "scale": 0.1, "min": -1000, "max": 1000}
        yield {"name": "probes", "unit": "1", "plc": 23, "type": "uint16", "min": 0, "max": 65535}
    sources = [f"T{i}" for i in range(n["temperatures"])] + [f"B{i}" for i in range(n["bus"])]
    for i in range(n["lags"]):
        yield {"name": f"L{i}", "unit": "degC", "lag_of": sources[i % len(sources)], "tau_s": 600 + 7 * i}


class Terms:
    """The terms of a file, and the outputs that a channel may sum."""

    def __init__(self, n, names):
        self.n, self.names, self.dice, self.all, self.outputs = n, names, random.Random(3), [], []
        self.positions = [name for name in names if name[0] == "P"]
        for _ in range(n["nets"]):
            self.net()
        for k in range(n["branched"]):
            self.curve({"reversal_mm": 0.5, "backward": self.pieces(k + 7)})
        for _ in range(n["curves"]):
            self.curve({})
        for k in range(n["polynomials"]):
            self.add({"type": "polynomial", "signal": self.position(), "half_range": 1000,
                      "coefficients": self.numbers(16)})
        for _ in range(n["linears"]):
            inputs = names[:n["linear_inputs"]]
            self.add({"type": "linear", "inputs": inputs, "weights": self.numbers(len(inputs))})
        for _ in range(n["products"]):
            self.add({"type": "product", "signal": self.position(), "term": self.outputs[0] if self.outputs else "t0"})
        for k in range(n["adapts"]):  # in no sum, because a channel may have its model
            self.all.append({"name": f"adapted{k}", "type": "adapt", "of": self.outputs[0] if self.outputs else "t0",
                             "probe": {"value": "probe", "count": "probes"}, "measures": "whole", "bias_max_um": 30,
                             "gain_max": 0.5, "step_max_um": 5, "drift_um_per_sqrt_h": 6, "gain_drift_per_sqrt_h": 0.5,
                             "sigma_um": 1.5})
        for _ in range(n["volumetrics"]):
            self.volumetric()
        for _ in range(n["banks"]):
            self.bank()

    def numbers(self, count, size=9):
        return [round(self.dice.uniform(-size, size), 1) for _ in range(count)]

    def add(self, term, outputs=()):
        name = f"t{len(self.all)}"
        self.all.append({"name": name, **term})
        self.outputs += outputs or [name]

    def position(self):
        return self.positions[len(self.all) % len(self.positions)]

    def net(self):
        n = self.n
        inputs = self.names[:n["net_inputs"]]
        outputs = [f"n{len(self.all)}_{k}" for k in range(n["net_outputs"])]
        linear = {"linear_weights": [self.numbers(len(inputs), 1) for _ in outputs]} if n["net_linear"] else {}
        self.add({"type": "bpnet", "inputs": inputs, "outputs": outputs, "activation": "tansig",
                  "hidden_weights": [self.numbers(len(inputs), 0.9) for _ in range(n["net_hidden"])],
                  "hidden_bias": self.numbers(n["net_hidden"], 1), "output_bias": self.numbers(len(outputs)),
                  "output_weights": [self.numbers(n["net_hidden"], 1) for _ in outputs],
                  "input_scale": [400] * len(inputs), "input_min": [20 * (name[0] != "P") for name in inputs],
                  "input_max": [30 if name[0] != "P" else 2000 for name in inputs], "fade": [9000] * len(inputs),
                  **linear}, outputs)

    def bank(self):
        n = self.n
        inputs, taus = self.names[:n["bank_inputs"]], [60 * k for k in range(n["bank_taus"])]
        outputs = [f"k{len(self.all)}_{k}" for k in range(n["bank_outputs"])]
        self.add({"type": "linear", "outputs": outputs, "bank": {
            "inputs": inputs, "tau_s": taus, "input_min": [20] * len(inputs), "input_max": [30] * len(inputs),
            "fade": [9000] * len(inputs), "powers": {inputs[-1]: [1, 2]},
            "weights": [self.numbers((len(inputs) + 1) * len(taus), 1) for _ in outputs]}}, outputs)

    def pieces(self, k):
        spans = self.n["points"] - 3
        knots = [round(900 * (i / spans) ** 2 + (0 if self.n["shared"] else 0.1 * k) * (0 < i < spans), 2)
                 for i in range(spans + 1)]
        return {"degree": 3, "knots": knots[:1] * 3 + knots + knots[-1:] * 3,
                "control_points": self.numbers(self.n["points"])}

    def curve(self, extra):
        self.add({"type": "bspline", "signal": self.position(), **self.pieces(len(self.all)), **extra})

    def volumetric(self):
        outputs = [f"v{len(self.all)}_{k}" for k in range(3)]
        self.add({"type": "volumetric", "chain": "XYfZ", "positions": (self.positions * 3)[:3], "outputs": outputs,
                  "errors": [], "tool_length_mm": 200}, outputs)


def channels(n, outputs):
    """out: the channels, and the registers that they take behind the first three of the write block."""
    made, at = [], 3
    for i in range(n["channels"]):
        most = min(n["sum"], len(outputs))
        one = {"name": f"c{i}", "sum": [outputs[(i + k) % len(outputs)] for k in range(most)], "limit_um": 300,
               "error_um": 1000000, "slew_um_per_s": 500, "type": "int16", "scale": 0.1, "plc": 100 + at}
        at += 1
        if n["applied"]:
            one["applied"] = 24 + i
        if i < n["tangents"]:
            one["tangent"] = {"signal": f"P{i % n['positions']}", "slope_plc": 100 + at, "slope_type": "int16",
                              "slope_scale": 1e-6, "slope_limit": 0.01, "slope_slew_per_s": 0.02,
                              "reference_plc": 101 + at, "reference_type": "int16", "reference_scale": 1}
            at += 2
        made.append(one)
    return made, at


def make(n):
    """in : a number of parts for each key of SHAPE. out: the text of the file"""
    all_signals = list(signals(n))
    terms = Terms(n, [one["name"] for one in all_signals])
    made, registers = channels(n, terms.outputs)
    read = 24 + (n["channels"] if n["applied"] else 0) + 1
    pairs = [{"channels": [f"c{2 * i}", f"c{2 * i + 1}"], "max_difference_um": 50} for i in range(n["pairs"])]
    buses = [{"name": "pt100", "every_ms": 1000, "rtu": {"device": "/dev/ttyS2", "baud": 115200}}]
    rtu = {"device": "/dev/ttyS1", "baud": 921600, "slave_delay_ms": 0}
    return json.dumps({
        "format": "compbox/1", "revision": 1, "machine": {"name": "at the limits", "axes": ["X"]},
        "cycle": {"period_ms": n["period_ms"], "lead_ms": "measured"},
        "plc": {"profile": "generic", "transport": {"rtu": rtu}, "exchange": "fc23",
                "read": {"start": 0, "count": read, "counters": True},
                "write": {"start": 100, "count": registers + 1, "counters": True}, "control": 1, "plc_heartbeat": 2,
                "status": 101, "box_heartbeat": 102, "heartbeat_timeout_ms": 2000},
        **({"buses": buses} if n["bus"] else {}), "signals": all_signals, "terms": terms.all, "channels": made,
        "pairs": pairs, "safety": {"hold_ms": 500, "ramp_um_per_s": 50}}, separators=(",", ":"))
