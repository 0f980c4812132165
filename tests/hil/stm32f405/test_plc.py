# SPDX-License-Identifier: MIT
"""The exchange with the PLC: right values while the axes move, and bits equal to the host's core."""
import json
import math
import random
import re
import subprocess

import pytest

import laws
import machine
from emulator import ROOT, Box, packed
from following import active, counters_of, replay, replayed, start_with_trace, wait_for
from machine import ACTIVE
from rtu_plc import RtuPlc


def fc23(data):
    data["plc"]["exchange"] = "fc23"


def program(t):
    """By the count of readings, not by the clock: the emulator's may go slower."""
    return {"X": 5000 + 160 * t, "Y": -1400 + 900 * math.sin(0.4 * t), "Z": 1200 + 60 * t, "T1": 20 + 0.5 * t}


def quantised(values):
    """What the PLC's registers make of the values."""
    result = {}
    for signal in machine.FILE["signals"]:
        scale, value = signal.get("scale", 1), values[signal["name"]]
        result[signal["name"]] = value if signal["type"] == "float32" else math.floor(value / scale + 0.5) * scale
    return result


def is_of(write, values):
    wanted = machine.wanted_um(quantised(values))
    return all(abs(um - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name])
               for name, um in write.um.items())


@pytest.mark.parametrize("change", [None, fc23], ids=["fc3+fc16", "fc23"])
def test_compensation_arrives_while_the_axes_move(plc, rtu, start_box, tmp_path, change):
    plc.motion = lambda _: program(machine.PERIOD_S * len(plc.readings))
    with rtu(), start_box(change) as box:
        start_with_trace(box)
        plc.writes.clear()
        wait_for(lambda: len(active(plc)) > 75)
        counters, wires = counters_of(box), counters_of(box, "wires")
        box.console.command("dump")
        box.console.wait("dump: end")
    settled = active(plc)[35:]
    stale = [w for w in settled if not is_of(w, w.values)]
    assert all(any(is_of(w, values) for values in plc.readings) for w in stale), stale
    lost = sum(counters.get(name, 0) for name in ("reads_failed", "writes_failed", "writes_unknown"))
    # a probe is a reading, too, which moves the axes of this PLC on
    assert len(stale) <= lost + wires.get("retries", 0) + wires["probes"], (len(stale), counters, wires)
    assert all(max(abs(w.um[name]) for w in settled) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    reported = replayed(box, tmp_path)
    assert reported["active"] > 60 and reported["records"] > 60, reported


class ReferenceMachine:
    """Registers of the reference load (tests/gates/instructions/reference_load.py): three axes travel,
    twelve thermometers wander."""

    def __init__(self):
        self.registers, self.reads, self.status = [0] * 200, 0, []
        self.temperatures = [220] * 12

    def read(self, start, count):
        self.reads += 1
        self.registers[0:2] = [machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME, self.reads & 0xFFFF]
        for axis in range(3):
            turn = (50000 + 13000 * axis) * self.reads % 40000000
            position = turn if turn < 20000000 else 40000000 - turn
            self.registers[8 + 2 * axis:10 + 2 * axis] = [position >> 16, position & 0xFFFF]
        self.temperatures = [t + random.choice((-1, 0, 0, 1)) for t in self.temperatures]
        self.registers[14:26] = self.temperatures
        return self.registers[start:start + count]

    def write(self, start, words):
        self.registers[start:start + len(words)] = words
        self.status.append(self.registers[100])


def test_the_reference_load_has_the_hosts_bits(tmp_path):
    """18 splines, the volumetric term, a network behind its range and 24 lags."""
    script = ROOT / "tests/gates/instructions/reference_load.py"
    data = json.loads(subprocess.run(["/usr/bin/python3", script], capture_output=True, check=True).stdout)
    data["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200}}
    text = json.dumps(data)
    (tmp_path / "coefficients.json").write_text(text)
    device = ReferenceMachine()
    with RtuPlc(tmp_path / "plc.sock", {1: device}), \
            Box(tmp_path, {"A": packed(text, 1)}, plc=tmp_path / "plc.sock") as box:
        start_with_trace(box)
        device.status.clear()
        wait_for(lambda: sum(status & 0xFF == ACTIVE for status in device.status) > 90)
    reported = replayed(box, tmp_path)
    assert reported["active"] > 80, reported
    # The replay sees one bit, of an output or of an input, and a line that is missing.
    lines = [line for line in box.console.lines if line.startswith("T ")]
    at = next(i for i in range(60, len(lines)) if " R" in lines[i])
    for pattern, printed in ((r"( W.*)(.)( C)", "registers differ"), (r"( R.{35})(.)(.*)", "differ"),
                          (r"(.*)(.)($)", "channels differ")):
        wrong = re.sub(pattern, lambda m: f"{m[1]}{int(m[2], 16) ^ 1:x}{m[3]}", lines[at], count=1)
        done = replay([*lines[:at], wrong, *lines[at + 1:]], tmp_path)
        assert done.returncode == 1 and printed in done.stdout, (pattern, done.stdout)
    done = replay([*lines[:at], *lines[at + 1:]], tmp_path)
    assert done.returncode == 1 and "line of the trace is missing" in done.stdout
