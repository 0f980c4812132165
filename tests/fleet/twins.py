# SPDX-License-Identifier: MIT
"""Twins of machines for the tests of this folder: an error linear in two temperatures, seen by a probe."""

import json
import math
import random

TRUTH = (4.0, -2.5)  # um/K of T1 and T2 above 20 degC
NOISE_UM = 1.0
START_S = 1750000000


class Twin:
    """One machine. in: its seed; truth_um_per_K may drift between records"""

    def __init__(self, seed, truth_um_per_K=TRUTH):
        self.seed, self.truth_um_per_K, self.count, self.clock_s = seed, truth_um_per_K, 0, 0

    def error_um(self, temperatures, coefficients=None):
        return sum(slope * (t - 20) for slope, t in zip(coefficients or self.truth_um_per_K, temperatures))

    def temperatures(self, time_s, dice):
        day = 2 * math.pi * time_s / 86400 + self.seed
        works = 5 * dice.random() if (time_s // 14400) % 2 else 0
        return 20 + 3 * math.sin(day) + works, 20 + 2 * math.sin(day + 1) + dice.gauss(0, 0.3)

    def record(self, days, compensated=None, shift_um=0.0, every_s=600, probe_s=1800):
        """in: the coefficients that the box applies (none: it is in standby); shift_um: what a wrong probe adds.
        out: the text of the record; time and count go on in the next one"""
        dice = random.Random(f"{self.seed} {self.clock_s}")
        rows, value = ["time_s,T1,T2,probe_x,probe_x_n,comp_X_um,unix_s"], 0.0
        for time_s in range(self.clock_s, self.clock_s + int(days * 86400), every_s):
            pair = self.temperatures(time_s, dice)
            applied = -self.error_um(pair, compensated) if compensated else 0.0
            if time_s % probe_s == 0:
                self.count += 1
                value = self.error_um(pair) + applied + dice.gauss(0, NOISE_UM) + shift_um
            rows.append(f"{time_s},{pair[0]:.3f},{pair[1]:.3f},{value:.3f},{self.count},{applied:.3f},"
                        f"{START_S + time_s}")
        self.clock_s += int(days * 86400)
        return "\n".join(rows) + "\n"


def machine_file(compbox):
    """Writes machine.json of a lathe with a probe of X and two thermometers. out: its name"""
    compbox.good("init", "--host", "127.0.0.1", "--port", "1502", "--axes", "X,Z", "--profile", "generic", "--probe",
                 "X", "--travel", "X=400,Z=500", "-o", "machine.json")
    machine = compbox.read("machine.json")
    for place, name in enumerate(("T1", "T2")):
        machine["signals"].append({"name": name, "plc": 2 + place, "type": "int16", "scale": 0.01, "unit": "degC",
                                   "min": -20, "max": 90})
    return compbox.write("machine.json", json.dumps(machine, indent=1))
