# SPDX-License-Identifier: MIT
"""Probes of the control: what compboxd makes of them, shows, keeps across a restart and replays."""
import json
import os
import pathlib
import subprocess

import pytest

import machine
from machine import ACTIVE, AT_REST, wanted_um
from raw_plc import RawPlc

COMPBOX = os.environ.get("COMPBOX", str(pathlib.Path(__file__).resolve().parents[2] / "build/host/bin/compbox"))
VALUE, COUNT, REQUEST = 16, 18, 112


def adapted(data):
    """Z has the thermal term GROW adapted by a probe, beside its curves."""
    data["plc"]["request"] = REQUEST
    data["signals"] += [
        {"name": "probe_z", "unit": "um", "plc": VALUE, "type": "float32", "min": -500, "max": 500},
        {"name": "probe_z_n", "unit": "1", "plc": COUNT, "type": "uint16", "min": 0, "max": 65535}]
    data["terms"].append({"name": "Z_adapted", "type": "adapt", "of": "GROW",
                          "probe": {"value": "probe_z", "count": "probe_z_n"}, "bias_max_um": 30, "gain_max": 0.5,
                          "step_max_um": 5, "drift_um_per_sqrt_h": 6, "gain_drift_per_sqrt_h": 0.5,
                          "sigma_um": 1.5, "min_interval_s": 1})
    data["channels"][2]["sum"] = ["EZX", "EZY", "Z_adapted"]


def with_sigma(data):
    """The model states how far it may be off: 3 um at 20 °C, and more away from there."""
    adapted(data)
    grow = next(term for term in data["terms"] if term["name"] == "GROW")
    name = grow["signal"]
    data["terms"].append({"name": "BANK", "type": "linear",
                          "bank": {"inputs": [name], "tau_s": [0], "weights": [[0.5]]},
                          "sigma": {"floor_um": [3], "along_um": [2], "offsets": [-4], "directions": [[0.2]]}})
    data["terms"][-2]["of"] = "BANK"
    data["channels"][2]["sum"] = ["EZX", "EZY", "GROW", "Z_adapted"]


class Probing:
    """A machine whose Z errs by more than the file says, and its touch probe."""

    def __init__(self, stage, plc, snapshot):
        self.stage, self.plc, self.snapshot, self.count = stage, plc, snapshot, 40

    def touch(self, more_um):
        """The probe measures the error, which is `more_um` beyond the model, with the compensation as it is."""
        value = -wanted_um(AT_REST)["Z"] + more_um + self.plc.last().um["Z"]
        self.count += 1
        self.plc.set(VALUE, machine.pack("float32", value) + [self.count])
        self.stage.run_for(2)

    def shown(self):
        return json.loads(self.snapshot.read_text())["adapted"][0]

    def z_um(self):
        return self.plc.last().um["Z"] - wanted_um(AT_REST)["Z"]

    def asks(self):
        return self.plc.last().block[REQUEST - machine.WRITE[0]]


@pytest.fixture
def probing(stage, plc, tmp_path):
    plc.values = dict(AT_REST)
    plc.set(COUNT, [40])
    return Probing(stage, plc, tmp_path / "snapshot.json")


def replayed(tmp_path_factory, tmp_path):
    folder = tmp_path_factory.mktemp("replay")
    for name in ("coefficients.json", "inputs.csv"):
        (folder / name).write_bytes((tmp_path / name).read_bytes())
    return subprocess.run([COMPBOX, "simulate", folder / "coefficients.json", "--replay", folder / "inputs.csv"],
                          text=True, capture_output=True)


def test_a_probe_moves_the_axis_and_a_wrong_one_asks_first(plc, port, start_box, probing, tmp_path, tmp_path_factory):
    with RawPlc(plc, port), start_box("--snapshot", probing.snapshot, change=adapted) as box:
        plc.wait_mode(ACTIVE)
        probing.stage.run_for(5)
        assert abs(probing.z_um()) < 0.02 and probing.shown()["taken"] == 0 and probing.shown()["expected_um"] is None
        probing.touch(2)
        assert -2.1 < probing.z_um() < -1, "the tool goes the other way"
        before = probing.z_um()
        probing.touch(100)
        assert probing.asks() == 1 and probing.z_um() == before
        shown = probing.shown()
        assert (shown["name"], shown["of"], shown["asks"]) == ("Z_adapted", "GROW", True)
        assert (shown["taken"], shown["asked"], shown["refused"], shown["skipped"]) == (1, 1, 0, 0)
        probing.touch(2)
        shown = probing.shown()
        assert probing.asks() == 0 and (shown["taken"], shown["asks"]) == (2, False)
        assert abs(shown["innovation_um"]) < 1.5 and 0 < shown["sigma_um"] < 3
        assert 0 <= shown["cusum"] < 10
        box.stop()
    done = replayed(tmp_path_factory, tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_models_sigma_is_shown_and_recorded(plc, port, start_box, probing, tmp_path):
    record = tmp_path / "record.csv"
    with RawPlc(plc, port), start_box("--snapshot", probing.snapshot, "--record", record, change=with_sigma) as box:
        plc.wait_mode(ACTIVE)
        probing.stage.run_for(2)
        snapshot = json.loads(probing.snapshot.read_text())
        box.stop()
    terms = {term["name"]: term["sigma_um"] for term in snapshot["terms"]}
    value = next(term["value"] for term in snapshot["terms"] if term["name"] == "BANK")  # half the input
    assert terms["BANK"] == pytest.approx((9 + (2 * (0.4 * value - 4))**2)**0.5, rel=1e-5)
    assert terms["Z_adapted"] >= terms["BANK"] and terms["EZX"] is None
    assert terms["Z_adapted"] == snapshot["adapted"][0]["sigma_um"]
    rows = [line.split(",") for line in record.read_text().splitlines()]
    assert sorted(name for name in rows[0] if name.startswith("sigma_")) == ["sigma_BANK", "sigma_Z_adapted"]
    assert float(rows[-1][rows[0].index("sigma_BANK")]) == pytest.approx(terms["BANK"], rel=1e-5)


def test_a_restart_goes_on_with_what_was_probed(plc, port, start_box, probing, tmp_path, tmp_path_factory):
    arguments = ("--snapshot", probing.snapshot, "--state", str(tmp_path / "state"))
    with RawPlc(plc, port), start_box(*arguments, change=adapted) as box:
        plc.wait_mode(ACTIVE)
        probing.stage.run_for(5)
        probing.touch(3)
        probing.touch(3)
        before = probing.shown()
        box.stop()
    plc.set(COUNT, [99])  # the control has probed alone: only a reference
    with RawPlc(plc, port), start_box(*arguments, change=adapted) as box:
        plc.wait_mode(ACTIVE)
        probing.stage.run_for(5)
        shown = probing.shown()
        assert (shown["bias_um"], shown["gain"], shown["taken"]) == (before["bias_um"], before["gain"], 2)
        assert shown["sigma_um"] >= before["sigma_um"] and -3.2 < probing.z_um() < -2
        box.stop()
    assert ",probes,0:" in (tmp_path / "inputs.csv").read_text().splitlines()[1]
    done = replayed(tmp_path_factory, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("piece, other", [(",probes,0:", ",probes,1:"), (",probes,0:", ",probes,0:0"),
                                          (",probes,0:", ",probes,0:0:")])
def test_a_broken_state_of_a_probe_is_refused(plc, port, start_box, probing, tmp_path, tmp_path_factory, piece, other):
    for _ in range(2):
        with RawPlc(plc, port), start_box("--state", str(tmp_path / "state"), change=adapted) as box:
            plc.wait_mode(ACTIVE)
            plc.wait_writes(3)
            box.stop()
    recording = tmp_path / "inputs.csv"
    recording.write_text(recording.read_text().replace(piece, other, 1))
    done = replayed(tmp_path_factory, tmp_path)
    assert done.returncode == 1 and ":2: " in done.stderr, done.stderr
