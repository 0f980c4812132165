# SPDX-License-Identifier: MIT
"""Right registers and right values, against pymodbus and our own arithmetic."""
import laws
import machine
from in_motion import is_of, program
from machine import ACTIVE
from pymodbus_plc import PymodbusPlc


def test_values_are_those_of_the_models_while_the_axes_move(plc, port, start_box, exchange):
    """Of the reading that the step before each write had, in every write from the first such one on."""
    plc.motion = program
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait(lambda w: w.mode == ACTIVE and is_of(w.um, w.values))
        begin = len(plc.writes)
        plc.wait_writes(60)
        end = len(plc.writes)
        box.stop()
    assert box.code == 0, box.log
    step_of = {step.heartbeat: step for step in box.steps}
    for write in plc.writes[begin:end]:
        step = step_of[write.heartbeat]
        assert step.mode == ACTIVE and write.block == step.written
        assert is_of(step.um, plc.readings[step.reading - 1]), (step.um, plc.readings[step.reading - 1])
    # The test would see a sign, byte order or scale mistake: the values are far from zero.
    assert all(max(abs(w.um[name]) for w in plc.writes[begin:end]) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    laws.check_slew(box.steps)
    laws.check_period(box)


def test_heartbeat_and_status_of_every_write(plc, port, start_box, exchange):
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(15)
        box.stop()
    beats = [w.heartbeat for w in plc.writes]
    assert all((after - before) & 0xFFFF == 1 for before, after in zip(beats, beats[1:]))
    assert plc.writes[-1].mode == machine.STOPPED
    assert plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}


def test_the_way_to_the_wanted_value_has_the_slew_rate(plc, port, start_box, exchange):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}      # Z wants -124 µm
    with PymodbusPlc(plc, port), start_box(change=exchange) as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        box.stop()
    steps = box.steps
    way = [(a, b) for a, b in zip(steps, steps[1:]) if a.mode == b.mode == ACTIVE and b.um["Z"] > -120]
    assert len(way) >= 5
    for before, after in way:
        moved = before.um["Z"] - after.um["Z"]
        assert abs(moved - 500 * (after.now_us - before.now_us) * 1e-6) < 0.05
    laws.check_writes(plc.writes)


def test_registers_that_are_nobodys_stay_zero(plc, port, start_box):
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(7)
        box.stop()
    used = {100, 101, 104, 105, 106, 108, 109}
    for write in plc.writes:
        for i, word in enumerate(write.block):
            assert word == 0 or machine.WRITE[0] + i in used


def test_a_move_beyond_a_curve_takes_the_value_at_its_end(plc, port, start_box):
    plc.values = {"X": 14300, "Y": 1500, "Z": 2500, "T1": 35}
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait(lambda w: w.mode == ACTIVE and is_of(w.um, w.values))
        box.stop()


def z_between(values, first_mm, last_mm):
    """Least and largest Z that the models say for X from first to last."""
    z = [machine.wanted_um(dict(values, X=first_mm + (last_mm - first_mm) * i / 50))["Z"] for i in range(51)]
    return min(z), max(z)


def test_lead_evaluates_where_the_axis_will_be(plc, port, start_box):
    def lead(data):
        data["cycle"]["lead_ms"] = 90
    others = {"Y": 0, "Z": 0, "T1": 20}
    plc.motion = lambda t: {"X": 4400 + 400 * t, **others}
    with PymodbusPlc(plc, port), start_box(change=lead) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(60)                     # the velocity is a mean over a second
        begin = plc.last().heartbeat
        plc.wait_writes(100)
        end = plc.last().heartbeat
        box.stop()
    judged = [step for step in box.steps if begin < step.heartbeat <= end]
    for step in judged:
        least, most = z_between(others, step.x_mm + 0.09 * 399, step.x_mm + 0.09 * 401)
        assert least - 0.05 <= step.um["Z"] <= most + 0.05
    without = [machine.wanted_um({"X": step.x_mm, **others})["Z"] - step.um["Z"] for step in judged]
    assert max(map(abs, without)) > 0.3, "the test would see that it does not look ahead"


def test_record_and_plc_tell_the_same(plc, port, start_box):
    plc.motion = program
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(25)
        box.stop()
    rows = box.rows
    assert list(rows[0]) == (["time_s", "X", "Y", "Z", "T1", "EZX", "EYX", "EZY", "EXY", "EXZ", "GROW",
                              "comp_X_um", "comp_Y_um", "comp_Z_um", "mode", "reason", "unix_s"])
    assert rows[0]["time_s"] == 0
    assert len(rows) == box.stats["cycles"] and box.stats["records_lost"] == 0
    active = [r for r in rows if r["mode"] == ACTIVE]
    for row in active[:: 5]:
        position = {name: row[name] for name in ("X", "Y", "Z", "T1")}
        for term in machine.FILE["terms"]:
            value = machine.term_value(term, position[term["signal"]])
            assert abs(row[term["name"]] - value) < 2e-3
    seen = [[round(w.um[n], 2) for n in "XYZ"] for w in plc.writes]
    recorded = [[round(r[f"comp_{n}_um"], 2) for n in "XYZ"] for r in rows]
    assert seen == recorded[len(recorded) - len(seen):], "row by row the same"
