# SPDX-License-Identifier: MIT
"""The exchange with the PLC: right values while the axes move, and bits equal to the host's core."""
import json
import math
import subprocess

import pytest

import laws
import machine
from conftest import HOST
from following import active, counters_of, wait_for


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


def start_with_trace(box):
    box.console.wait("now ACTIVE")
    since = box.console.mark()
    box.console.say("trace start")
    box.console.wait("started: restart asked for", since)


def replayed(box, folder):
    """The console's trace and dump, replayed by the host's core."""
    file = folder / "trace.txt"
    file.write_text("".join(line + "\n" for line in box.console.lines if line[:2] in ("T ", "D ")))
    done = subprocess.run([HOST / "stm32f405_replay", folder / "coefficients.json", file],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("change", [None, fc23], ids=["fc3+fc16", "fc23"])
def test_compensation_arrives_while_the_axes_move(plc, rtu, start_box, tmp_path, change):
    plc.motion = lambda _: program(machine.PERIOD_S * len(plc.readings))
    with rtu(), start_box(change) as box:
        start_with_trace(box)
        plc.writes.clear()
        wait_for(lambda: len(active(plc)) > 110)
        counters, wires = counters_of(box), counters_of(box, "wires")
        box.console.say("dump")
        box.console.wait("dump: end")
    settled = active(plc)[40:]
    stale = [w for w in settled if not is_of(w, w.values)]
    assert all(any(is_of(w, values) for values in w.readings) for w in stale), stale
    allowed = counters.get("reads_failed", 0) + wires.get("retries", 0)
    assert len(stale) <= allowed, (len(stale), counters, wires)
    assert all(max(abs(w.um[name]) for w in settled) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    told = replayed(box, tmp_path)
    assert told["active"] > 100 and told["records"] > 100, told

