# SPDX-License-Identifier: MIT
"""Tangent mode with two processes: compboxd writes value, slope and reference, fakeplc hands them to
its NC as a SINUMERIK 840D gets them, one setting datum after the other.

The axis' error is a straight line. So K0 + tanβ (P − P0) is right wherever the axis is and however
late a set comes, on any machine however busy: what is off comes from a wrong slope or reference, or
from a set that is torn. The box's sets are not; on its way into the NC the 840D tears each of them, and
the PLC program bounds what that can do (docs/fakeplc.md)."""
import csv
import json
import time

import pytest

import box as box_module
from box import until
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
    """Both processes, and what the control has logged."""

    def __init__(self, folder):
        self.config, self.log = folder / "coefficients.json", folder / "plc.csv"
        self.config.write_text(json.dumps(FILE))
        twin = folder / "twin.json"
        twin.write_text(json.dumps(TWIN))
        self.plc = FakePlc("--profile", "sinumerik-840d", "--machine", twin, "--log", self.log)

    def start_box(self):
        data = json.loads(self.config.read_text())
        data["plc"]["transport"]["tcp"]["port"] = self.plc.port
        self.config.write_text(json.dumps(data))
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
        whole = self.log.read_text().rpartition("\n")[0]      # the last line may still be written
        rows = list(csv.DictReader(whole.splitlines()))
        for row in rows:
            row["mode"] = int(row["status"]) & 0xFF
            for key in ("time_s", "X_mm", "nc_X_um", "nc_X_slope", "nc_X_reference_mm"):
                row[key] = float(row[key])
            row["nc_X_slope"] *= 1000  # µm/mm
            row["um"] = row["nc_X_um"] + row["nc_X_slope"] * (row["X_mm"] - row["nc_X_reference_mm"])
        return rows


@pytest.fixture
def rig(tmp_path):
    rig = Rig(tmp_path)
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


def undisturbed(rows, modes=(ACTIVE,), settle_s=1, coupled=True):
    """The runs of rows in these modes in which every scan came in time and the box's heartbeat moved, else the PLC may
    have taken the box for lost; each without its first settle_s. coupled: and without an alarm."""
    runs, run, beat, beat_s, before_s = [], [], None, 0, 0
    for row in rows + [None]:
        if row and row["box_heartbeat"] != beat:
            beat, beat_s = row["box_heartbeat"], row["time_s"]
        if (row and row["mode"] in modes and (row["alarms"] == "0" or not coupled) and
                row["time_s"] - min(before_s, beat_s) < 0.1):
            run.append(row)
        else:
            runs.append([r for r in run if r["time_s"] > run[0]["time_s"] + settle_s])
            run = []
        before_s = row["time_s"] if row else 0
    return runs


def test_what_the_nc_adds_is_the_tangent_wherever_the_axis_is(rig):
    begin_s = None

    def on_the_way():
        rows = [row for row in rig.rows() if row["time_s"] >= begin_s]
        active = max(undisturbed(rows), key=len)
        pairs = list(zip(active, active[1:]))
        return active, [b for a, b in pairs if abs(b["X_mm"] - a["X_mm"]) > 0.5]

    def moved_long():
        rig.wait_settled()
        rig.move(400, 700, feed=10000)
        rig.move(200, 800, feed=30000)
        rig.wait_stand()
        return len(on_the_way()[1]) > 300

    with rig.start_box() as box:
        rig.wait_settled()
        time.sleep(0.5)  # until the NC has it too
        begin_s = rig.plc.status()["time_s"]
        until(moved_long)
        box.stop()
        assert box.code == 0, box.log
    rig.plc.command("quit")
    active, moving = on_the_way()
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
    """The PLC's heartbeat stops for as long as the box needs to come to zero, until a run had HOLD and RAMP while box
    and PLC ran: a PLC that takes a stopped box for lost ramps by itself."""
    def held_and_ramped():
        rig.wait_settled()
        rig.plc.command("freeze heartbeat 1")
        rig.plc.wait(lambda status: status["mode"] == STANDBY and abs(status["applied_X"]) < GRAIN_UM)
        rig.plc.command("freeze heartbeat 0")
        rig.wait_settled()
        return stretch()

    def stretch():
        """out: rows of HOLD and of RAMP of one run, behind 0.2 s in which the PLC applied what the box wrote"""
        for run in undisturbed(rig.rows(), (ACTIVE, HOLD, RAMP), settle_s=0.2, coupled=False):
            parts = [[row for row in run if row["mode"] == mode] for mode in (HOLD, RAMP)]
            if all(len(part) > 10 for part in parts):
                return parts
        return None

    with rig.start_box() as box:
        rig.wait_settled()
        at_mm = rig.position()
        until(held_and_ramped)
        rig.move(500, feed=10000)
        rig.wait_stand()
        rig.wait_settled()
        box.stop()
        assert box.code == 0, box.log
    rig.plc.command("quit")
    held, ramp = stretch()
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
    rig.plc.command("quit")
    rows = rig.rows()
    assert abs(rows[-1]["um"]) <= GRAIN_UM and abs(rows[-1]["nc_X_slope"]) * 300 <= GRAIN_UM
    check_continuous(rows)


def test_a_box_that_dies_on_the_way_leaves_nothing_behind(rig):
    with rig.start_box() as box:
        rig.wait_settled()
        rig.move(500, feed=6000)
        rig.plc.wait(lambda status: rig.position() < 620)
        box.process.kill()
        rig.plc.wait(lambda status: status["alarms"] > 0)
        rig.wait_stand()
        rig.plc.wait(lambda status: status["applied_X"] == 0)
    assert "box-lost" in rig.plc.command("alarms")
    rig.plc.command("quit")
    rows = rig.rows()
    assert abs(rows[-1]["um"]) <= GRAIN_UM and abs(rows[-1]["nc_X_slope"]) * 300 <= GRAIN_UM
    check_continuous(rows)
