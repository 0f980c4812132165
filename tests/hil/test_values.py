# SPDX-License-Identifier: MIT
"""Right registers and right values, against pymodbus and our own arithmetic."""
import math

import laws
import machine
from box import until
from machine import ACTIVE, ENABLE, STANDBY
from pymodbus_plc import PymodbusPlc
from steps import LOST


def program(t):
    """A stretch at 10 m/min and below, ends of travel left and right of it."""
    return {"X": 5000 + 160 * t, "Y": -1400 + 900 * math.sin(0.4 * t), "Z": 1200 + 60 * t,
            "T1": 20 + 0.5 * t}


def quantised(values):
    """What the PLC's registers make of the values."""
    result = {}
    for signal in machine.FILE["signals"]:
        scale = signal.get("scale", 1)
        value = values[signal["name"]]
        result[signal["name"]] = (value if signal["type"] == "float32"
                                  else math.floor(value / scale + 0.5) * scale)
    return result


def is_of(um, values):
    """The outputs are what the models say of these values."""
    wanted = machine.wanted_um(quantised(values))
    return all(abs(um[name] - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name]) for name in um)


def judged(steps, values_of):
    """Steps that answered a good reading, when the way to its value was behind: so is what they wrote since the last
    time that they were not ACTIVE. out: [(step, values of its reading)]"""
    found, arrived = [], False
    for step in steps:
        arrived = arrived and step.mode == ACTIVE
        if not step.read_ok or step.mode != ACTIVE:
            continue
        values = values_of[step.reading - 1]
        arrived = arrived or is_of(step.um, values)
        if arrived:
            found.append((step, values))
    return found


def test_values_are_those_of_the_models_while_the_axes_move(plc, port, start_box, way):
    """Of the reading that the step before each write had."""
    plc.motion = program
    with PymodbusPlc(plc, port), start_box(change=way) as box:
        until(lambda: len(judged(box.steps, plc.readings)) > 40, every_s=0.3)
        box.stop()
    assert box.code == 0, box.log
    found = judged(box.steps, plc.readings)
    for before, (step, values) in zip([None] + [step for step, _ in found], found):
        # Slewing on behind a gap in which the axes went further than the slew rate.
        late = before is None or step.now_us - before.now_us > 2.5 * machine.PERIOD_S * 1e6 or \
            step.last_write != laws.CONFIRMED
        assert late or is_of(step.um, values) or not is_of(before.um, values_at(plc, before)), (step.um, values)
    right = [step for step, values in found if is_of(step.um, values)]
    assert len(right) > 30
    written = {tuple(w.block) for w in plc.writes}
    assert sum(tuple(step.written) in written for step in right) > 20, "they reached the PLC"
    blocks = {tuple(step.written) for step in box.steps}
    assert all(tuple(w.block) in blocks for w in plc.writes)
    # The test would see a sign, byte order or scale mistake: the values are far from zero.
    assert all(max(abs(step.um[name]) for step in right) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    laws.check_slew(box.steps)
    laws.check_period(box)


def values_at(plc, step):
    return plc.readings[step.reading - 1]


def test_heartbeat_and_status_of_every_write(plc, port, start_box, way):
    with PymodbusPlc(plc, port), start_box(change=way) as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(15)
        box.stop()
    beats = [w.heartbeat for w in plc.writes]
    assert all(1 <= (after - before) & 0xFFFF < 1000 for before, after in zip(beats, beats[1:]))
    steps = box.steps
    assert all((b.heartbeat - a.heartbeat) & 0xFFFF == 1 for a, b in zip(steps, steps[1:])), "each step counts"
    assert plc.writes[-1].mode == machine.STOPPED
    assert plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}


def steps_on_the_way(steps):
    """out: (before, after) where Z moves freely to -124 µm: ACTIVE, and no recent write was lost, which would hold it
    back (firmware/box/limiter.c)"""
    late = 20
    return [(steps[i - 1], steps[i]) for i in range(late, len(steps))
            if steps[i - 1].mode == steps[i].mode == ACTIVE and steps[i].um["Z"] > -120
            and not LOST & {step.last_write for step in steps[i - late:i + 1]}]


def test_the_way_to_the_wanted_value_has_the_slew_rate(plc, port, start_box, way):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}      # Z wants -124 µm
    with PymodbusPlc(plc, port), start_box(change=way) as box:
        def moved_freely():
            plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
            plc.control &= ~ENABLE
            plc.wait_mode(STANDBY)
            plc.wait_writes(20)
            plc.control |= ENABLE
            return len(steps_on_the_way(box.steps)) >= 5
        until(moved_freely)
        box.stop()
    for before, after in steps_on_the_way(box.steps):
        elapsed_s = min((after.now_us - before.now_us) * 1e-6, 2 * machine.PERIOD_S)
        moved = before.um["Z"] - after.um["Z"]
        assert abs(moved - 500 * elapsed_s) < 0.05, (moved, elapsed_s)
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
    """By the box's own stamps: the velocity it looks ahead with is a mean of those between its readings."""
    def lead(data):
        data["cycle"]["lead_ms"] = 90
    others = {"Y": 0, "Z": 0, "T1": 20}
    plc.motion = lambda t: {"X": 4400 + 400 * (t % 20), **others}     # and at once back to the begin
    def judged(steps):
        """How many steps could tell a lead from none; each step with readings in a row is of what it looks ahead to."""
        readings = {step.read_us: step.x_mm for step in steps if step.read_ok}
        stamps = sorted(readings)
        between = {b: (readings[b] - readings[a]) / (b - a) * 1e6 for a, b in zip(stamps, stamps[1:])}
        count, arrived = 0, False
        for step in steps:
            arrived = arrived and step.mode == ACTIVE
            x, window = step.x_mm, (step.read_us - 1_500_000, step.read_us)
            recent = [between[s] for s in stamps if s in between and window[0] < s <= window[1]]
            gaps = [b - a for a, b in zip(stamps, stamps[1:]) if window[0] < b <= window[1]]
            if not step.read_ok or len(recent) < 10 or max(gaps) > 3 * machine.PERIOD_S * 1e6:
                arrived = False        # other tests cover gaps
                continue
            least, most = z_between({"X": x, **others}, x + 0.09 * min(recent), x + 0.09 * max(recent))
            z = machine.written_um(step.written)["Z"]
            right = least - 0.05 <= z <= most + 0.05
            assert right or not arrived, (x, min(recent), max(recent))
            arrived = arrived or right and step.mode == ACTIVE
            at_once = machine.wanted_um({"X": x, **others})["Z"]
            count += right and not least - 0.05 <= at_once <= most + 0.05
        return count

    with PymodbusPlc(plc, port), start_box(change=lead) as box:
        plc.wait_mode(ACTIVE)
        until(lambda: judged(box.steps) > 0, every_s=0.5)
        box.stop()
    steps = box.steps
    judged(steps)
    blocks = {tuple(step.written) for step in steps}
    assert all(tuple(w.block) in blocks for w in plc.writes)


def test_record_and_plc_tell_the_same(plc, port, start_box):
    plc.motion = program
    with PymodbusPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.wait_writes(25)
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
    recorded = [[round(r[f"comp_{n}_um"], 2) for n in "XYZ"] for r in rows]
    rest = iter(recorded)
    assert all(um in rest for um in seen), "row by row the same; what never arrived is left out"
