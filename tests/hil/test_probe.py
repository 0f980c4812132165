# SPDX-License-Identifier: MIT
"""compboxd and fakeplc with a touch probe: a machine 14 um off, whose model is zero, is brought to below 1 um by
probes; a wrong probe is not taken, and asks for another one. Facts of the exchange: what fakeplc measured, what the box
counted, and the machine's true error afterwards."""
import json

import pytest

from box import Box, until
from fakeplc import FakePlc
from machine import ACTIVE

AXES = {axis: {"travel_mm": [0, 500], "max_velocity_mm_per_min": 12000, "acceleration_mm_per_s2": 1000}
        for axis in "XZ"}
TWIN = {"format": "compbox-twin/1", "machine": "14 um off", "axes": AXES, "start_mm": {"X": 250, "Z": 250},
        "errors": {"EXX": {"points": [[0, 14], [500, 14]]}}, "repeatability_um": 0,
        "probe": {"sigma_um": 0.2, "duration_s": 0.3}, "plc": {"reference_s": 0.1, "enable_s": 0.1}}


def coefficients(**adapt):
    """The registers of compbox init, and a model of X that says zero, adapted by the probe."""
    def signal(name, unit, plc, kind, scale, low, high):
        return {"name": name, "unit": unit, "plc": plc, "type": kind, "scale": scale, "min": low, "max": high}
    return {
        "format": "compbox/1", "revision": 1, "machine": {"name": "14 um off", "axes": ["X", "Z"]},
        "cycle": {"period_ms": 30, "lead_ms": 0},
        "plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}},
                "exchange": "fc3+fc16", "read": {"start": 0, "count": 30}, "write": {"start": 100, "count": 8},
                "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101, "request": 106,
                "heartbeat_timeout_ms": 1000},
        "signals": [signal("X", "mm", 8, "int32", 0.0001, -10, 510),
                    signal("probe_x", "um", 26, "int32", 0.01, -500, 500),
                    signal("probe_x_n", "1", 28, "uint16", 1, 0, 65535)],
        "terms": [{"name": "EXX", "type": "polynomial", "signal": "X", "from": -10, "to": 510, "coefficients": [0]},
                  {"name": "X_adapted", "type": "adapt", "of": "EXX",
                   "probe": {"value": "probe_x", "count": "probe_x_n"}, "bias_max_um": 30, "gain_max": 0.5,
                   "step_max_um": 10, "drift_um_per_sqrt_h": 6, "gain_drift_per_sqrt_h": 0, "sigma_um": 0.5, **adapt}],
        "channels": [{"name": "X", "sum": ["X_adapted"], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500,
                      "deadband_um": 0, "sign": 1, "plc": 104, "type": "int32", "scale": 0.01, "applied": 24}],
        "pairs": [], "safety": {"hold_ms": 2000, "ramp_um_per_s": 50}}


def error_um(plc):
    """The true error of X with the compensation as it is; what only a report may see."""
    return float(plc.command("error").split("after X=")[1].split()[0])


def settled(plc):
    """Waits until the box has written the same for a second, and nobody asks for another probe."""
    seen = []

    def same():
        status = plc.status()
        seen.append((status["probes"], status["applied_X"]))
        return len(seen) > 50 and len(set(seen[-50:])) == 1
    until(same, every_s=0.02)
    return seen[-1][1]


class Running:
    def __init__(self, plc, box):
        self.plc, self.box = plc, box

    def probe(self, off_um=0):
        """One cycle and what the box asks for behind it; out: count of the measurements so far"""
        before = self.plc.status()["probes"]
        self.plc.command(f"probe X {off_um}")
        self.plc.wait(lambda status: status["probes"] > before)
        settled(self.plc)
        return self.plc.status()["probes"]

    def counter(self, name):
        self.box.stop()
        return self.box.stats["box"][name]


@pytest.fixture
def running(tmp_path):
    twin, config = tmp_path / "twin.json", tmp_path / "coefficients.json"
    data = coefficients()
    config.write_text(json.dumps(data))
    twin.write_text(json.dumps({**TWIN, "coefficients": "coefficients.json"}))
    with FakePlc("--machine", twin) as plc:
        data["plc"]["transport"]["tcp"]["port"] = plc.port
        config.write_text(json.dumps(data))
        with Box(config) as box:
            plc.wait(lambda status: status["mode"] == ACTIVE)
            yield Running(plc, box)
            if box.code is None:
                box.stop()
            assert box.code == 0, box.log


def test_probes_bring_the_machine_to_below_a_micrometre(running):
    plc = running.plc
    assert error_um(plc) == pytest.approx(14, abs=0.01)
    for _ in range(4):
        measurements = running.probe()
    assert abs(error_um(plc)) < 1
    assert measurements <= 4 + 2 * 4, "a request is obeyed twice at most"
    before = plc.status()["applied_X"]
    assert before == pytest.approx(-14, abs=1)
    assert running.counter("probes_taken") >= 2


def test_a_wrong_probe_is_not_taken_and_asks_for_another(running):
    plc = running.plc
    for _ in range(4):
        running.probe()
    applied, measured = plc.status()["applied_X"], plc.status()["probes"]
    assert running.probe(off_um=100) == measured + 2, "the repetition agrees with the model, so there is one"
    assert plc.status()["applied_X"] == pytest.approx(applied, abs=1)
    assert abs(error_um(plc)) < 1
    assert running.counter("probes_asked") >= 2


def test_what_the_record_has_of_a_probe(running):
    running.probe()
    running.box.stop()
    counts = [row["probe_x_n"] for row in running.box.rows if row["probe_x_n"] is not None]
    assert counts == sorted(counts) and counts[0] == 0 and counts[-1] >= 1
    for before, after in zip(running.box.rows, running.box.rows[1:]):
        if before["probe_x_n"] is not None and after["probe_x_n"] != before["probe_x_n"]:
            assert after["probe_x"] is not None and after["probe_x"] != 0, "no count without its value"
