# SPDX-License-Identifier: MIT
"""Tangent mode: compboxd writes value, slope and reference, fakeplc hands them to
its NC as a SINUMERIK 840D gets them, one setting datum after the other.

The axis' error is a straight line. So K0 + tanβ (P − P0) is right wherever the axis is and however
late a set comes: what is off comes from a wrong slope or reference, or from a set that is torn. The box's sets are
not; on its way into the NC the 840D tears each of them, and
the PLC program bounds what that can do (docs/fakeplc.md)."""
import csv
import json

import pytest

import box as box_module
from fakeplc import FakePlc
from machine import ACTIVE, HOLD, RAMP, STANDBY

SLOPE = 0.2                    # error, µm/mm
ZERO_MM = 500                  # where it is zero
BOX_SLEW, BOX_RAMP = 120, 100    # µm/s
PLC_SLOPE, PLC_RAMP = 150, 100   # µm/s, what the PLC program takes over at most
# The PLC program's grain (docs/fakeplc.md): its deadband, and what one datum of a set may change
# before the next one is there.
GRAIN_UM = 0.1 + 0.25
ROUNDING_UM = 0.02             # of the registers
SET_S = 0.06                   # from a scan of the PLC to its whole set in the NC, at most

FILE = {
    "format": "compbox/1", "revision": 1,
    "machine": {"name": "axis with a slope", "axes": ["X"]},
    "cycle": {"period_ms": 30, "lead_ms": 0},
    "plc": {
        "profile": "sinumerik-840d",
        "transport": {"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}},
        "read": {"start": 0, "count": 28}, "write": {"start": 100, "count": 12, "counters": True},
        "control": 0, "plc_heartbeat": 1, "status": 101, "box_heartbeat": 102,
        "heartbeat_timeout_ms": 200},
    "signals": [{"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -10,
                 "max": 1010}],
    "terms": [{"name": "EXX", "type": "polynomial", "signal": "X",
               "coefficients": [-SLOPE * ZERO_MM, SLOPE]}],
    "channels": [
        {"name": "X", "sum": ["EXX"], "limit_um": 300, "error_um": 400, "slew_um_per_s": BOX_SLEW,
         "plc": 104, "type": "int32", "scale": 0.01,
         "tangent": {"signal": "X", "slope_plc": 106, "slope_type": "int32", "slope_scale": 1e-8,
                     "slope_limit": 0.01, "slope_slew_per_s": 0.1, "reference_plc": 108,
                     "reference_type": "int32", "reference_scale": 0.0001}}],
    "safety": {"hold_ms": 400, "ramp_um_per_s": BOX_RAMP}}

TWIN = {
    "format": "compbox-twin/1", "machine": "axis with a slope", "seed": 3,
    "axes": {"X": {"travel_mm": [0, 1000], "max_velocity_mm_per_min": 40000,
                   "acceleration_mm_per_s2": 3000}},
    "plc": {"slope_um_per_s": PLC_SLOPE, "ramp_um_per_s": PLC_RAMP, "reference_s": 0.1,
            "enable_s": 0.2},
    "start_mm": {"X": 650}, "coefficients": "coefficients.json"}


def law_um(x_mm):
    """The correction that takes the error away."""
    return -SLOPE * (x_mm - ZERO_MM)


class Rig:
    """Box and control, and what the control has logged."""

    def __init__(self, folder, config):
        self.config, self.log = config, folder / "plc.csv"
        (folder / "coefficients.json").write_text(json.dumps(FILE))
        twin = folder / "twin.json"
        twin.write_text(json.dumps(TWIN))
        self.plc = FakePlc("--profile", "sinumerik-840d", "--machine", twin, "--log", self.log)

    def start_box(self):
        self.config.write_text(json.dumps(FILE))
        return box_module.Box(self.config)

    def wait_mode(self, mode):
        return self.plc.wait(lambda status: status["mode"] == mode)

    def position(self):
        return float(self.plc.command("position").split("X=")[1].split()[0])

    def wait_settled(self):
        """ACTIVE, the axis stands, the correction is that of the law there."""
        self.plc.wait(lambda status: status["mode"] == ACTIVE and not status["moving"] and
                      abs(status["applied_X"] - law_um(self.position())) < GRAIN_UM)

    def move(self, *places, feed):
        for x in places:
            self.plc.command(f"move X={x} feed={feed}")

    def wait_stand(self):
        self.plc.wait(lambda status: not status["moving"])

    def rows(self):
        """The log: the NC's own numbers and what they make where the axis is, a row for each scan."""
        self.plc.command("status")          # what it has logged is written
        rows = list(csv.DictReader(self.log.read_text().splitlines()))
        for row in rows:
            row["mode"] = int(row["status"]) & 0xFF
            for key in ("time_s", "X_mm", "nc_X_um", "nc_X_slope", "nc_X_reference_mm"):
                row[key] = float(row[key])
            row["nc_X_slope"] *= 1000  # µm/mm
            row["um"] = row["nc_X_um"] + row["nc_X_slope"] * (row["X_mm"] - row["nc_X_reference_mm"])
        return rows


@pytest.fixture
def rig(real_path, tmp_path):
    rig = Rig(real_path, tmp_path / "coefficients.json")
    with rig.plc:
        yield rig


def check_continuous(rows):
    """Whatever happens, what the NC adds at the axis moves by no more than the PLC's rate allows from
    one set to the next, and the slope makes of the way."""
    for before, after in zip(rows, rows[1:]):
        allowed = (PLC_SLOPE * (after["time_s"] - before["time_s"] + SET_S) +
                   SLOPE * abs(after["X_mm"] - before["X_mm"]) + 2 * GRAIN_UM)
        assert abs(after["um"] - before["um"]) <= allowed, (before, after)


def is_whole(row):
    """The NC has K0 and P0 of one set."""
    return abs(row["nc_X_um"] - law_um(row["nc_X_reference_mm"])) <= ROUNDING_UM


def is_right(row):
    return abs(row["um"] - law_um(row["X_mm"])) <= 2 * ROUNDING_UM


def since(rows, begin_s, modes=(ACTIVE,)):
    return [row for row in rows if row["time_s"] >= begin_s and row["mode"] in modes]


def test_what_the_nc_adds_is_the_tangent_wherever_the_axis_is(stage, rig):
    with rig.start_box() as box:
        rig.wait_settled()
        stage.run_for(0.5)      # until the NC has it too
        begin_s = rig.plc.status()["time_s"]
        rig.move(400, 700, feed=10000)
        rig.move(200, 800, feed=30000)
        rig.wait_stand()
        end_s = rig.plc.status()["time_s"]
        box.stop()
        assert box.code == 0, box.log
    active = [row for row in since(rig.rows(), begin_s) if row["time_s"] <= end_s]
    assert {row["alarms"] for row in active} == {"0"}
    moving = [b for a, b in zip(active, active[1:]) if abs(b["X_mm"] - a["X_mm"]) > 0.5]
    assert len(moving) > 300
    whole = [row for row in moving if is_whole(row)]
    assert len(whole) > 0.6 * len(moving)
    assert all(is_right(row) for row in whole)
    assert all(abs(row["nc_X_slope"] + SLOPE) < 1e-4 for row in active)
    # Between the first and the last datum of a set the NC is behind by the way since the set before.
    for before, row in zip(active, active[1:]):
        speed = abs(row["X_mm"] - before["X_mm"]) / (row["time_s"] - before["time_s"])
        way_um = SLOPE * max(speed, 1) * SET_S
        assert abs(row["um"] - law_um(row["X_mm"])) <= way_um + GRAIN_UM, row
    # The value alone stands for where the axis was: the test would see a slope that is not used.
    assert max(abs(row["nc_X_um"] - law_um(row["X_mm"])) for row in moving) > 3 * GRAIN_UM
    check_continuous(active)


def test_hold_keeps_what_is_applied_then_ramps_and_comes_back(rig):
    """The PLC's heartbeat stops for as long as the box needs to come to zero."""
    with rig.start_box() as box:
        rig.wait_settled()
        at_mm, begin_s = rig.position(), rig.plc.status()["time_s"]
        rig.plc.command("freeze heartbeat 1")
        rig.plc.wait(lambda status: status["mode"] == STANDBY and abs(status["applied_X"]) < GRAIN_UM)
        rig.plc.command("freeze heartbeat 0")
        rig.wait_settled()
        rig.move(500, feed=10000)
        rig.wait_stand()
        rig.wait_settled()
        box.stop()
        assert box.code == 0, box.log
    held, ramp = (since(rig.rows(), begin_s, (mode,)) for mode in (HOLD, RAMP))
    assert len(held) > 10 and len(ramp) > 10
    for row in held:
        assert abs(row["um"] - law_um(at_mm)) <= GRAIN_UM + ROUNDING_UM, row
    assert all(abs(after["um"]) <= abs(before["um"]) + GRAIN_UM for before, after in zip(ramp, ramp[1:]))
    check_continuous(rig.rows())


def test_enable_withdrawn_on_the_way_takes_value_and_slope_to_zero(rig):
    with rig.start_box() as box:
        rig.wait_settled()
        rig.move(500, feed=6000)
        rig.plc.wait(lambda status: rig.position() < 620)
        rig.plc.command("enable 0")
        rig.wait_stand()
        rig.plc.wait(lambda status: status["applied_X"] == 0)
        box.stop()
        assert box.code == 0, box.log
    rows = rig.rows()
    assert abs(rows[-1]["um"]) <= GRAIN_UM and abs(rows[-1]["nc_X_slope"]) * 300 <= GRAIN_UM
    check_continuous(rows)


def test_a_box_that_dies_on_the_way_leaves_nothing_behind(rig):
    with rig.start_box() as box:
        rig.wait_settled()
        rig.move(500, feed=6000)
        rig.plc.wait(lambda status: rig.position() < 620)
        box.kill()
        rig.plc.wait(lambda status: status["alarms"] > 0)
        rig.wait_stand()
        rig.plc.wait(lambda status: status["applied_X"] == 0)
    assert "box-lost" in rig.plc.command("alarms")
    rows = rig.rows()
    assert abs(rows[-1]["um"]) <= GRAIN_UM and abs(rows[-1]["nc_X_slope"]) * 300 <= GRAIN_UM
    check_continuous(rows)
