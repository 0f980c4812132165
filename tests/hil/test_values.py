# SPDX-License-Identifier: MIT
"""Right registers and right values, against pymodbus and our own arithmetic."""
import math
import time

import laws
import machine
from machine import ACTIVE
from pymodbus_plc import PymodbusPlc
from steps import steps_of


def program(t):
    """A stretch at 10 m/min and below, ends of travel left and right of it."""
    return {"X": 5000 + 160 * t, "Y": -1400 + 900 * math.sin(0.4 * t), "Z": 1200 + 60 * t,
            "T1": 20 + 0.5 * t}


def settled(writes, after_s=0.8):
    """Writes in ACTIVE, when the way from zero to the wanted value is behind."""
    active = [w for w in writes if w.mode == ACTIVE]
    assert active, "never ACTIVE"
    return [w for w in active if w.time_s - active[0].time_s > after_s]


def quantised(values):
    """What the PLC's registers make of the values."""
    result = {}
    for signal in machine.FILE["signals"]:
        scale = signal.get("scale", 1)
        value = values[signal["name"]]
        result[signal["name"]] = (value if signal["type"] == "float32"
                                  else math.floor(value / scale + 0.5) * scale)
    return result


def is_of(write, values):
    """The write holds what the models say of these values."""
    wanted = machine.wanted_um(quantised(values))
    return all(abs(um - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name])
               for name, um in write.um.items())


def test_values_are_those_of_the_models_while_the_axes_move(plc, port, start_box, exchange):
    plc.motion = program
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait_mode(ACTIVE)
        time.sleep(1.9)
        box.stop()
    assert box.code == 0, box.log
    writes = settled(plc.writes)
    assert len(writes) > 30
    # Of the newest reading; of one before it only as often as a busy machine delivered one too late.
    stale = [w for w in writes if not is_of(w, w.values)]
    assert len(stale) <= box.stats["box"]["reads_failed"], [(w.um, w.values) for w in stale]
    assert all(any(is_of(w, values) for values in w.readings) for w in stale)
    # The test would see a sign, byte order or scale mistake: the values are far from zero.
    assert all(max(abs(w.um[name]) for w in writes) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    laws.check_period(box)


def test_heartbeat_and_status_of_every_write(plc, port, start_box, exchange):
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.5)
        box.stop()
    beats = [w.heartbeat for w in plc.writes]
    missed = box.stats["overruns"] + box.stats["box"]["writes_failed"]
    steps = [(after - before) & 0xFFFF for before, after in zip(beats, beats[1:])]
    assert all(step >= 1 for step in steps)
    assert sum(step != 1 for step in steps) <= missed
    assert plc.writes[-1].mode == machine.STOPPED
    assert plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}


def test_the_way_to_the_wanted_value_has_the_slew_rate(plc, port, start_box, exchange):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}      # Z wants -124 µm
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        box.stop()
    z = [w.um["Z"] for w in plc.writes if w.mode == ACTIVE]
    steps = [before - after for before, after in zip(z, z[1:])]
    usual = 500 * machine.PERIOD_S
    moving = sorted(step for step in steps if step > 0.1)
    assert abs(moving[len(moving) // 2] - usual) < 0.1 * usual
    assert moving[-1] <= 2 * usual + 0.02
    laws.check_writes(plc.writes)


def test_registers_that_are_nobodys_stay_zero(plc, port, start_box):
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.2)
        box.stop()
    used = {100, 101, 104, 105, 106, 108, 109}
    for write in plc.writes:
        for i, word in enumerate(write.block):
            assert word == 0 or machine.WRITE[0] + i in used


def test_a_move_beyond_a_curve_takes_the_value_at_its_end(plc, port, start_box):
    plc.values = {"X": 14300, "Y": 1500, "Z": 2500, "T1": 35}
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(1)
        box.stop()
    last = settled(plc.writes)[-1]
    wanted = machine.wanted_um(quantised(last.values))
    for name, um in last.um.items():
        assert abs(um - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name])


def z_between(values, first_mm, last_mm):
    """Least and largest Z that the models say for X from first to last."""
    z = [machine.wanted_um(dict(values, X=first_mm + (last_mm - first_mm) * i / 50))["Z"] for i in range(51)]
    return min(z), max(z)


def test_lead_evaluates_where_the_axis_will_be(plc, port, start_box, tmp_path):
    """By the box's own stamps: the velocity it looks ahead with is a mean of those between its readings."""
    def lead(data):
        data["cycle"]["lead_ms"] = 90
    others = {"Y": 0, "Z": 0, "T1": 20}
    plc.motion = lambda t: {"X": 4400 + 400 * t, **others}
    with PymodbusPlc(plc, port), start_box("--record-inputs", tmp_path / "inputs.csv", change=lead) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: w.mode == ACTIVE and w.values["X"] > plc.writes[0].values["X"] + 900, 20)
        box.stop()
    steps = steps_of(tmp_path / "inputs.csv")
    readings = {step.read_us: step.x_mm for step in steps if step.read_ok}
    stamps = sorted(readings)
    between = {b: (readings[b] - readings[a]) / (b - a) * 1e6 for a, b in zip(stamps, stamps[1:])}
    judged = 0
    for step in [step for step in steps if step.mode == ACTIVE][35:]:  # the way from zero is behind
        x, window = step.x_mm, (step.read_us - 1_500_000, step.read_us)
        recent = [between[s] for s in stamps if s in between and window[0] < s <= window[1]]
        gaps = [b - a for a, b in zip(stamps, stamps[1:]) if window[0] < b <= window[1]]
        if not step.read_ok or len(recent) < 10 or max(gaps) > 3 * machine.PERIOD_S * 1e6:
            continue           # other tests cover gaps
        least, most = z_between({"X": x, **others}, x + 0.09 * min(recent), x + 0.09 * max(recent))
        z = machine.written_um(step.written)["Z"]
        assert least - 0.05 <= z <= most + 0.05, (x, min(recent), max(recent))
        at_once = machine.wanted_um({"X": x, **others})["Z"]
        judged += not least - 0.05 <= at_once <= most + 0.05
    assert judged > 0, "no step could tell a lead from none"
    blocks = {tuple(step.written) for step in steps}
    assert all(tuple(w.block) in blocks for w in plc.writes)


def test_record_and_plc_tell_the_same(plc, port, start_box):
    plc.motion = program
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.6)
        box.stop()
    rows = box.rows
    assert list(rows[0]) == (["time_s", "X", "Y", "Z", "T1", "EZX", "EYX", "EZY", "EXY", "EXZ", "GROW",
                              "comp_X_um", "comp_Y_um", "comp_Z_um", "mode", "reason"])
    assert rows[0]["time_s"] == 0
    assert len(rows) == box.stats["cycles"] and box.stats["records_lost"] == 0
    active = [r for r in rows if r["mode"] == ACTIVE]
    for row in active[:: 5]:
        position = {name: row[name] for name in ("X", "Y", "Z", "T1")}
        for term in machine.FILE["terms"]:
            value = machine.term_value(term, position[term["signal"]])
            assert abs(row[term["name"]] - value) < 2e-3
    seen = [[round(w.um[n], 2) for n in "XYZ"] for w in plc.writes]
    told = [[round(r[f"comp_{n}_um"], 2) for n in "XYZ"] for r in rows]
    assert any(told[i:i + len(seen)][:20] == seen[:20] for i in range(8)), "row by row the same"
