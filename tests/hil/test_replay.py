# SPDX-License-Identifier: MIT
"""A run with real processes, recorded and stepped through again: the same outputs to the bit."""
import csv
import json
import os
import pathlib
import subprocess

import pytest

import machine
from box import Box, run, until
from fakeplc import FakePlc
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
def test_a_scenario_on_real_processes(name, tmp_path):
    """Its machine, its coefficients, box and PLC as processes: better than before, and replayed."""
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
    (tmp_path / "twin.json").write_text(json.dumps(twin))
    (tmp_path / "scenario.json").write_text(json.dumps(scenario))
    subprocess.run([COMPBOX, "simulate", tmp_path / "scenario.json", "--seeds", str(seed), "-o",
                    tmp_path / "out"], check=True, capture_output=True, timeout=60)
    made = tmp_path / f"out/seed-{seed}/bspline/coefficients.json"
    config = tmp_path / "coefficients.json"
    with FakePlc("--machine", tmp_path / "twin.json", "--map", made, "--log", tmp_path / "plc.csv") as plc:
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
        plc.command("quit")
        plc.process.wait(60)
    done = replay(config, tmp_path / "inputs.csv")
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "plc.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    standing = [max((row for row in rows if float(row["time_s"]) <= s), key=lambda row: float(row["time_s"]))
                for s in at_s]
    for axis in "XY":
        before, after = ([float(row[f"error_{when}_{axis}_um"]) for row in standing] for when in ("before", "after"))
        assert max(after) - min(after) < 0.5 * (max(before) - min(before)) + 1.5


def test_a_file_that_cannot_be_written(tmp_path, port):
    config = machine.write_coefficients(tmp_path / "coefficients.json", port)
    code, _, printed = run("--config", str(config), "--record-inputs", str(tmp_path / "no/inputs.csv"))
    assert code == 1 and "cannot be written" in printed
