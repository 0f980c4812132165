# SPDX-License-Identifier: MIT
"""Recorded runs, stepped through again by compbox: the same outputs to the bit, or the line that differs."""
import csv
import json
import os
import pathlib
import signal
import subprocess

import pytest

import machine
from box import Box, until
from fakeplc import FakePlc
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
    """A lag, a bank of them, a measured lead and counters: all that makes an output depend on times."""
    data["cycle"]["lead_ms"] = "measured"
    data["signals"].append({"name": "T1_slow", "unit": "degC", "lag_of": "T1", "tau_s": 20})
    data["terms"].append({"name": "SLOW", "type": "polynomial", "signal": "T1_slow",
                          "coefficients": [0, -1.5]})
    data["terms"].append({"name": "BANK", "type": "linear",
                          "bank": {"inputs": ["T1", "X"], "powers": {"T1": [1, 2]}, "tau_s": [5, 40],
                                   "weights": [[0.5, -0.75, 0.003, 0.002, 0.001, 0.002]]}})
    data["channels"][2]["sum"] += ["SLOW", "BANK"]


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
    lags, _, bank = state.rpartition(",lags,")[2].partition(",bank,")
    assert lags and len(bank.partition(",inputs,")[0].split()) == 6
    for lost in ("stopped,0,beat,0,plc_heartbeat,0,beat_us,0,lags,", state.partition(",bank,")[0]):
        recording.write_text("\n".join([limits, lost, *steps]) + "\n")
        done = replay(config, recording)
        assert done.returncode == 1 and ": channel Z is " in done.stderr


@pytest.mark.parametrize("piece, other", [("0:", "0:0:"), ("0:", "x:"), ("0:", "6:"), (",inputs,", " "),
                                          (",inputs,0:", ",inputs,64:"), (",inputs,0:", ",inputs,0:0:")])
def test_a_broken_state_of_a_bank_is_refused(plc, port, start_box, tmp_path, replay, piece, other):
    config, recording = tmp_path / "coefficients.json", tmp_path / "inputs.csv"
    for _ in range(2):
        with RawPlc(plc, port), start_box("--state", str(tmp_path / "state"), change=with_memory) as box:
            plc.wait_mode(ACTIVE)
            plc.wait_writes(3)
            box.stop()
    text = recording.read_text()
    before, bank, after = text.partition(",bank,")
    recording.write_text(before + (bank + after).replace(piece, other, 1))
    done = replay(config, recording)
    assert done.returncode == 1 and "recording:2: " in done.stderr, done.stderr


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


EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
# A scenario, the seed of its machine, where its axes go, and the feed.
SCENARIOS = {"gantry-straightness": (2015, {"X": 4800, "Y": 1000, "Z": 850}, 60000),
             "dual-drive": (120, {"X": 90, "Y": 90}, 6000)}


def settle(plc):
    """Waits until the axes stand and ten writes in a row changed nothing; out: the time, by the PLC."""
    def settled():
        before = plc.wait(lambda s: s["mode"] == ACTIVE and s["moving"] == 0)
        after = plc.wait(lambda s: (s["box_heartbeat"] - before["box_heartbeat"]) % 65536 >= 10)
        same = all(abs(after[key] - before[key]) < 0.02 and
                   abs(after[key] - after[key.replace("applied", "commanded")]) < 0.02
                   for key in after if key.startswith("applied_"))
        return after["time_s"] if same and after["mode"] == ACTIVE else None
    return until(settled)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_with_the_whole_daemon(name, tmp_path, real_path, replay):
    """Its machine, its coefficients, box and PLC: better than before, and replayed."""
    seed, target, feed = SCENARIOS[name]
    scenario = json.loads((EXAMPLES / name / "scenario.json").read_text())
    scenario["methods"], scenario["paths"] = scenario["methods"][:1], scenario["paths"][:1]
    scenario["moving_mm_per_min"] = []
    scenario["machine"] = str(EXAMPLES / name / scenario["machine"])
    scenario.pop("measurements", None)
    twin = json.loads((EXAMPLES / name / scenario["twin"]).read_text())
    for key in ("program", "coefficients"):     # the move is ours, the registers are those below
        twin.pop(key, None)
    scenario["twin"] = "twin.json"
    (real_path / "twin.json").write_text(json.dumps(twin))
    (real_path / "scenario.json").write_text(json.dumps(scenario))
    subprocess.run([COMPBOX, "simulate", real_path / "scenario.json", "--seeds", str(seed), "-o",
                    real_path / "out"], check=True, capture_output=True)
    made = real_path / f"out/seed-{seed}/bspline/coefficients.json"
    config = tmp_path / "coefficients.json"
    with FakePlc("--machine", real_path / "twin.json", "--map", made, "--log", real_path / "plc.csv") as plc:
        data = json.loads(made.read_text())
        data["plc"]["transport"]["tcp"]["port"] = plc.port
        config.write_text(json.dumps(data))
        with Box(config) as box:
            at_s = []
            for part in (0.4, 0.7, 1):
                plc.command("move " + " ".join(f"{axis}={part * to}" for axis, to in target.items()) + f" feed={feed}")
                at_s.append(settle(plc))
            box.stop()
        assert box.code == 0, box.log
    done = replay(config, tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr
    with open(real_path / "plc.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    standing = [max((row for row in rows if float(row["time_s"]) <= s), key=lambda row: float(row["time_s"]))
                for s in at_s]
    for axis in "XY":
        before, after = ([float(row[f"error_{when}_{axis}_um"]) for row in standing] for when in ("before", "after"))
        assert max(after) - min(after) < 0.5 * (max(before) - min(before)) + 1.5
