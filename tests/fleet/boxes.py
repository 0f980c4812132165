# SPDX-License-Identifier: MIT
"""Simulated boxes in a folder: each takes signed files and shows in its snapshot what a probe measures. The
compensation is that of its own file; the error is that of its twin."""

import json
import math
import random

from fleet import receiving
from fleet.registry import write_file
from twins import NOISE_UM

PROBES, ROWS, STEP_S = 12, 12, 600  # of a day: a probe every two hours


def bank_um(file, pairs, step_s):
    """in: a coefficient file with a linear bank of T1 and T2; temperatures by step. out: its error at each step,
    from a steady state at the first one; test_rollout.py compares it with `compbox eval`, which takes a second"""
    bank = next(term["bank"] for term in file["terms"] if "bank" in term)
    lags = [[value] * len(bank["tau_s"]) for value in pairs[0]]
    found = []
    for pair in pairs:
        for value, row in zip(pair, lags):
            for k, tau_s in enumerate(bank["tau_s"]):
                row[k] += (value - row[k]) * (1 - math.exp(-step_s / tau_s) if tau_s else 1)
        values = [value for row in lags for value in row]
        found.append(bank["bias"][0] + sum(w * v for w, v in zip(bank["weights"][0], values)))
    return found


class Box:
    """in: its folder, in which its first file is; its twin; folder of public keys"""

    def __init__(self, folder, twin, keys):
        self.folder, self.twin, self.keys = folder, twin, keys
        self.place, self.dice, self.count = folder / "coefficients.json", random.Random(twin.seed), 0
        self.known, self.residuals_um, self.taken = None, {}, []

    def compensation_um(self):
        """out: (temperatures, compensation) at each probe of a day, by the file that runs"""
        day, found = random.Random(f"box {self.twin.seed}"), []
        pairs = [self.twin.temperatures(k * STEP_S, day) for k in range(PROBES * ROWS)]
        errors = bank_um(json.loads(self.place.read_text()), pairs, STEP_S)
        for k in range(0, len(pairs), ROWS):
            found.append((pairs[k], -errors[k]))
        return found

    def turn(self):
        """Takes a file that has arrived; probes once."""
        arrived = self.folder / "file.json"
        if arrived.exists() and arrived.stat().st_mtime_ns != self.known:
            self.known = arrived.stat().st_mtime_ns
            if receiving.take(arrived.read_bytes(), self.keys, self.place) is not None:
                self.taken.append(json.loads(self.place.read_text())["revision"])
        revision = json.loads(self.place.read_text())["revision"]
        if revision not in self.residuals_um:
            self.residuals_um[revision] = [self.twin.error_um(pair) + applied
                                           for pair, applied in self.compensation_um()]
        left = self.residuals_um[revision]
        self.count += 1
        value = left[self.count % len(left)] + self.dice.gauss(0, NOISE_UM)
        signals = [{"name": "probe_x", "value": value}, {"name": "probe_x_n", "value": self.count}]
        write_file(self.folder / "snapshot.json", json.dumps({"revision": revision, "signals": signals}).encode())

    def rms_um(self):
        """out: what its file leaves, without the probe's noise"""
        left = list(self.residuals_um.values())[-1]
        return (sum(value * value for value in left) / len(left)) ** 0.5
