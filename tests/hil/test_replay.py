# SPDX-License-Identifier: MIT
"""A run with real processes, recorded and stepped through again: the same outputs to the bit."""
import os
import subprocess

import machine
from box import run
from machine import ACTIVE
from pymodbus_plc import PymodbusPlc
from in_motion import program

COMPBOX = os.environ.get("COMPBOX", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/compbox"))


def replay(config, recording):
    return subprocess.run([COMPBOX, "simulate", str(config), "--replay", str(recording)], text=True,
                          capture_output=True, timeout=60)


def with_memory(data):
    """A lag, a measured lead and counters: all that makes an output depend on times."""
    data["cycle"]["lead_ms"] = "measured"
    data["signals"].append({"name": "T1_slow", "unit": "degC", "lag_of": "T1", "tau_s": 20})
    data["terms"].append({"name": "SLOW", "type": "polynomial", "signal": "T1_slow",
                          "coefficients": [0, -1.5]})
    data["channels"][2]["sum"].append("SLOW")


def recorded(folder):
    lines = (folder / "inputs.csv").read_text().splitlines()[2:]  # before: the site's ceiling, the state
    return lines[0].split(","), [line.split(",") for line in lines[1:]]


def test_a_run_in_real_time_is_stepped_again_to_the_bit(plc, port, start_box, exchange, tmp_path):
    def change(data):
        exchange(data)
        with_memory(data)
    plc.motion = program
    with PymodbusPlc(plc, port), start_box(change=change) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(50)
        box.stop()
    assert box.code == 0, box.log
    names, rows = recorded(tmp_path)
    assert len(rows) == box.stats["cycles"] > 40
    assert len({row[names.index("channels")] for row in rows}) > 30  # the outputs were in motion
    done = replay(tmp_path / "coefficients.json", tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{len(rows)} cycles of ")


def test_a_file_that_cannot_be_written(tmp_path, port):
    config = machine.write_coefficients(tmp_path / "coefficients.json", port)
    code, _, printed = run("--config", str(config), "--record-inputs", str(tmp_path / "no/inputs.csv"))
    assert code == 1 and "cannot be written" in printed
