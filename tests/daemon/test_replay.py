# SPDX-License-Identifier: MIT
"""Recorded runs, stepped through again by compbox: the same outputs to the bit, or the line that differs."""
import os
import pathlib
import signal
import subprocess

import pytest

import machine
from box import until
from in_motion import program
from machine import ACTIVE
from plc_faults import late
from raw_plc import RawPlc

COMPBOX = os.environ.get("COMPBOX", str(pathlib.Path(__file__).resolve().parents[2] / "build/host/bin/compbox"))


@pytest.fixture
def replay(tmp_path_factory):
    """compbox simulate --replay of files of the simulated disk."""
    folder = tmp_path_factory.mktemp("replay")

    def simulate(config, recording):
        for name, file in (("config", config), ("recording", recording)):
            (folder / name).write_bytes(file.read_bytes())
        return subprocess.run([COMPBOX, "simulate", folder / "config", "--replay", folder / "recording"], text=True,
                              capture_output=True)
    return simulate


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
    lines = (folder / "inputs.csv").read_text().splitlines()[2:]  # before: the site's ceiling, the state
    return lines[0].split(","), [line.split(",") for line in lines[1:]]


def test_a_run_with_faults_too(plc, port, start_box, tmp_path, replay):
    plc.motion = program
    count = iter(range(10**6))

    def now_and_then(request, reply):
        faulty = request.is_cyclic_read and next(count) % 9 == 8
        return late(request, reply) if faulty else None
    with RawPlc(plc, port, now_and_then), start_box(change=with_memory) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(50)
        box.stop()
    names, rows = recorded(tmp_path)
    assert {row[names.index("read_ok")] for row in rows} == {"0", "1"}
    done = replay(tmp_path / "coefficients.json", tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr


@pytest.fixture
def recording(plc, port, start_box, tmp_path):
    plc.motion = program
    with RawPlc(plc, port), start_box(change=with_memory) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(30)
        box.stop()
    return tmp_path / "inputs.csv"


def test_a_run_below_the_site_ceiling(plc, port, start_box, tmp_path, replay):
    """The recording has the ceiling, which lowers the file's slew rate: without it the steps are larger."""
    plc.motion = program
    with RawPlc(plc, port), start_box("--most-um", "300", "--most-um-per-s", "100", change=with_memory) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(30)
        box.stop()
    recording = tmp_path / "inputs.csv"
    done = replay(tmp_path / "coefficients.json", recording)
    assert done.returncode == 0, done.stderr
    text = recording.read_text()
    assert text.startswith("most_um,300,most_um_per_s,100\nstopped,0,beat,0,plc_heartbeat,0,beat_us,0,lags,\n")
    recording.write_text(text.replace("per_s,100", "per_s,0", 1))
    done = replay(tmp_path / "coefficients.json", recording)
    assert done.returncode == 1 and ": another coefficient file or another version" in done.stderr


def test_a_run_that_resumed_a_state_file(plc, port, start_box, tmp_path, replay):
    """The recording has the state: the lag goes on, and without that line the outputs differ."""
    plc.motion = program
    config, recording = tmp_path / "coefficients.json", tmp_path / "inputs.csv"
    for before in ("stopped,0,beat,0,", "stopped,1,beat,1,"):
        with RawPlc(plc, port), start_box("--state", str(tmp_path / "state"), change=with_memory) as box:
            plc.wait_mode(ACTIVE)
            plc.wait_writes(30)
            box.stop()
        limits, state, *steps = recording.read_text().splitlines()
        assert state.startswith(before), state
        done = replay(config, recording)
        assert done.returncode == 0, done.stderr
    assert state.rpartition(",lags,")[2]
    recording.write_text("\n".join([limits, "stopped,0,beat,0,plc_heartbeat,0,beat_us,0,lags,", *steps]) + "\n")
    done = replay(config, recording)
    assert done.returncode == 1 and ": channel Z is " in done.stderr


def test_a_run_with_a_reload_ends_at_the_take_over(plc, port, start_box, tmp_path, replay):
    plc.motion = program
    with RawPlc(plc, port), \
            start_box("--most-um", "300", "--most-um-per-s", "100", change=with_memory) as box:
        plc.wait_mode(ACTIVE)
        machine.write_coefficients(tmp_path / "coefficients.json", port, other_curve)
        box.send_signal(signal.SIGHUP)
        until(lambda: box.stats["reloads"]["taken"] == 1)
        box.stop()
    first = machine.write_coefficients(tmp_path / "first.json", port, with_memory)
    done = replay(first, tmp_path / "inputs.csv")
    assert done.returncode == 0 and "another coefficient file took over at line" in done.stderr


def test_what_differs_is_reported_with_its_line(recording, tmp_path, replay):
    config, lines = tmp_path / "coefficients.json", recording.read_text().splitlines()
    names, rows = recorded(tmp_path)
    middle = next(i for i, row in enumerate(rows) if row[names.index("mode")] == str(ACTIVE)) + 10

    def changed(column, edit):
        row = list(rows[middle])
        row[names.index(column)] = edit(row[names.index(column)])
        other = tmp_path / "other.csv"
        other.write_text("\n".join(lines[:middle + 3] + [",".join(row)] + lines[middle + 4:]) + "\n")
        return replay(config, other)

    def flip(text):
        return ("1" if text[-1] == "0" else "0").join([text[:-1], ""])
    done = changed("channels", flip)
    assert done.returncode == 1 and f"line {middle + 4}: channel Z is " in done.stderr
    done = changed("written", flip)
    assert done.returncode == 1 and f"line {middle + 4}: register 115 is " in done.stderr
    done = changed("read_us", lambda text: str(int(text) - 3000))  # a time stamp counts
    assert done.returncode == 1 and ": channel " in done.stderr
    done = changed("registers", lambda text: text[:-4])
    assert done.returncode == 1 and "has 31 values where the file has 32" in done.stderr
    done = changed("number", lambda text: str(int(text) + 1))
    assert done.returncode == 0 and f"a cycle before line {middle + 4} is not in" in done.stderr
    done = changed("samples", lambda _: "200:00000000:5")
    assert done.returncode == 1 and "a sample is broken" in done.stderr
    other = machine.write_coefficients(
        tmp_path / "c2.json", 1502, other_curve)
    done = replay(other, recording)
    assert done.returncode == 1 and ": channel " in done.stderr
    done = replay(config, config)
    assert done.returncode == 1 and "is not what compboxd --record-inputs writes" in done.stderr
