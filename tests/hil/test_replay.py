# SPDX-License-Identifier: MIT
"""A run with real processes, recorded and stepped through again: the same outputs to the bit."""
import os
import subprocess
import time

import pytest

import machine
from box import run
from machine import ACTIVE
from pymodbus_plc import PymodbusPlc
from raw_plc import RawPlc
from test_faults import late
from test_values import program

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


def other_curve(data):
    with_memory(data)
    data["terms"][0]["control_points"].reverse()


def recorded(folder):
    lines = (folder / "inputs.csv").read_text().splitlines()
    return lines[0].split(","), [line.split(",") for line in lines[1:]]


def test_a_run_in_real_time_is_stepped_again_to_the_bit(plc, port, start_box, exchange, tmp_path):
    def change(data):
        exchange(data)
        with_memory(data)
    plc.motion = program
    with PymodbusPlc(plc, port), start_box("--record-inputs", tmp_path / "inputs.csv", change=change) as box:
        plc.wait_mode(ACTIVE)
        time.sleep(1.5)
        box.stop()
    assert box.code == 0, box.log
    names, rows = recorded(tmp_path)
    assert len(rows) == box.stats["cycles"] > 40
    assert len({row[names.index("channels")] for row in rows}) > 30  # the outputs were in motion
    done = replay(tmp_path / "coefficients.json", tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{len(rows)} cycles of ")


def test_a_run_with_faults_too(plc, port, start_box, tmp_path):
    plc.motion = program
    count = iter(range(10**6))

    def now_and_then(request, reply):
        faulty = request.is_cyclic_read and next(count) % 9 == 8
        return late(request, reply) if faulty else None
    with RawPlc(plc, port, now_and_then), \
            start_box("--record-inputs", tmp_path / "inputs.csv", change=with_memory) as box:
        plc.wait_mode(ACTIVE, 10)
        time.sleep(1.2)
        box.stop()
    names, rows = recorded(tmp_path)
    assert {row[names.index("read_ok")] for row in rows} == {"0", "1"}
    done = replay(tmp_path / "coefficients.json", tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr


@pytest.fixture
def recording(plc, port, start_box, tmp_path):
    plc.motion = program
    with PymodbusPlc(plc, port), \
            start_box("--record-inputs", tmp_path / "inputs.csv", change=with_memory) as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.8)
        box.stop()
    return tmp_path / "inputs.csv"


def test_what_differs_is_told_with_its_line(recording, tmp_path):
    config, lines = tmp_path / "coefficients.json", recording.read_text().splitlines()
    names, rows = recorded(tmp_path)
    middle = next(i for i, row in enumerate(rows) if row[names.index("mode")] == str(ACTIVE)) + 10

    def changed(column, edit):
        row = list(rows[middle])
        row[names.index(column)] = edit(row[names.index(column)])
        other = tmp_path / "other.csv"
        other.write_text("\n".join(lines[:middle + 1] + [",".join(row)] + lines[middle + 2:]) + "\n")
        return replay(config, other)

    def flip(text):
        return ("1" if text[-1] == "0" else "0").join([text[:-1], ""])
    done = changed("channels", flip)
    assert done.returncode == 1 and f"line {middle + 2}: channel Z is " in done.stderr
    done = changed("written", flip)
    assert done.returncode == 1 and f"line {middle + 2}: register 115 is " in done.stderr
    done = changed("read_us", lambda text: str(int(text) - 3000))  # a time stamp counts
    assert done.returncode == 1 and ": channel " in done.stderr
    done = changed("registers", lambda text: text[:-4])
    assert done.returncode == 1 and "has 31 values where the file has 32" in done.stderr
    done = changed("number", lambda text: str(int(text) + 1))
    assert done.returncode == 0 and f"a cycle before line {middle + 2} is not in" in done.stderr
    done = changed("samples", lambda _: "200:00000000:5")
    assert done.returncode == 1 and "a sample is broken" in done.stderr
    other = machine.write_coefficients(
        tmp_path / "c2.json", 1502, other_curve)
    done = replay(other, recording)
    assert done.returncode == 1 and ": channel " in done.stderr
    done = replay(config, config)
    assert done.returncode == 1 and "is not what compboxd --record-inputs writes" in done.stderr


def test_a_file_that_cannot_be_written(tmp_path, port):
    config = machine.write_coefficients(tmp_path / "coefficients.json", port)
    code, _, said = run("--config", str(config), "--record-inputs", str(tmp_path / "no/inputs.csv"))
    assert code == 1 and "cannot be written" in said
