# SPDX-License-Identifier: MIT
"""What the box does when the PLC, the signals or a person change their mind (docs/faults.md)."""
import pytest

import laws
import machine
from box import until
from machine import (ACTIVE, AT_REST, ENABLE, FAULT, HOLD, PERIOD_S, PERMIT_RESUME, RAMP, REFERENCED, RESET, STANDBY,
                     at_wanted)
from raw_plc import RawPlc
from steps import check_after, index_of


@pytest.fixture
def running(plc, port, start_box, exchange):
    """A box that compensates, at its wanted values; checked against the laws at the end."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(change=exchange) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(at_wanted)
        yield box
        if box.code is None:
            box.stop()
        assert box.code == 0, box.log
        laws.check_writes(plc.writes)
        laws.check_slew(box.steps)
        laws.check_period(box)


def at_zero(write):
    return all(um == 0 for um in write.um.values())


def check_ramp(steps, um_per_s=200):
    """Every channel goes straight to zero at the ramp rate, together or one after the other, never faster and never
    back."""
    laws.check_slew(steps, um_per_s)
    for before, after in zip(steps, steps[1:]):
        for name in after.um if after.last_write == laws.CONFIRMED else ():
            assert abs(after.um[name]) <= abs(before.um[name]) + 1e-3


def stretch(steps, mode, reason):
    """out: the first stretch of steps of this mode and reason"""
    begin = index_of(steps, lambda step: (step.mode, step.reason) == (mode, reason))
    end = index_of(steps, lambda step: (step.mode, step.reason) != (mode, reason), begin)
    return steps[begin:end]


def test_enable_off_ramps_to_zero_and_on_comes_back(plc, running):
    plc.control &= ~ENABLE
    plc.wait(lambda w: w.mode == STANDBY and w.reason == 2)
    plc.control |= ENABLE
    plc.wait_mode(ACTIVE)
    plc.wait(at_wanted)
    running.stop()
    steps = running.steps
    ramp = stretch(steps, RAMP, 2)
    check_ramp(ramp)
    standby = steps[steps.index(ramp[-1]) + 1]
    assert standby.mode == STANDBY and at_zero(standby)
    assert len(ramp) >= max(map(abs, ramp[0].um.values())) / (200 * 2 * PERIOD_S) - 1


def test_enable_back_on_during_the_ramp_resumes_from_there(plc, running):
    plc.control &= ~ENABLE
    ramping = plc.wait_mode(RAMP)
    plc.control |= ENABLE
    back = plc.wait_mode(ACTIVE)
    assert not at_zero(back)
    plc.wait(at_wanted)
    assert {ACTIVE, RAMP} == {w.mode for w in plc.writes[plc.writes.index(ramping):]}


def test_referenced_off_ramps_to_zero(plc, running):
    plc.control &= ~REFERENCED
    write = plc.wait_mode(STANDBY)
    assert write.reason == 3 and at_zero(write)


def last_good(steps, before, good):
    """out: stamp of the last reading before this step that is good."""
    return max(step.read_us for step in steps[:before] if step.read_ok and good(step))


def test_a_heartbeat_that_stops_holds_then_ramps(plc, running):
    plc.heartbeat_alive = False
    plc.wait_mode(RAMP)
    plc.wait_writes(8)
    plc.heartbeat_alive = True
    plc.wait_mode(ACTIVE)       # permit resume is set
    running.stop()
    steps = running.steps
    stopped = next(s for s in reversed(steps) if s.mode == RAMP and s.reason == 4).registers[machine.PLC_HEARTBEAT]
    changed = index_of(steps, lambda s: s.read_ok and s.registers[machine.PLC_HEARTBEAT] == stopped)
    hold = index_of(steps, lambda s: s.mode == HOLD, changed)
    assert steps[hold].reason == 4
    check_after(steps, hold, steps[changed].read_us, 0.2)                       # heartbeat_timeout_ms
    ramp = index_of(steps, lambda s: s.mode == RAMP, hold)
    check_after(steps, ramp, steps[hold].now_us, 0.3)                           # hold_ms
    assert all(s.um == steps[hold].um for s in steps[hold:ramp])
    check_ramp(stretch(steps, RAMP, 4))


def test_without_permit_resume_a_new_edge_of_enable_is_needed(plc, running):
    plc.control &= ~PERMIT_RESUME
    plc.heartbeat_alive = False
    plc.wait_mode(HOLD)
    plc.heartbeat_alive = True
    standby = plc.wait_mode(STANDBY)
    assert standby.reason == 7
    seen = len(plc.writes)
    plc.wait_writes(10)
    assert {w.mode for w in plc.writes[seen:]} == {STANDBY}
    plc.control &= ~ENABLE
    plc.wait_writes(10)
    plc.control |= ENABLE
    plc.wait_mode(ACTIVE)


# fc23 has no write without a read.
only_fc3 = pytest.mark.parametrize("exchange", ["fc3+fc16"], indirect=True)


@only_fc3
def test_a_reading_too_old_is_not_used(plc, running):
    """Reads are refused, writes go on: three periods after the last good reading the box holds."""
    plc.refuse_reads = True
    plc.wait_mode(HOLD)
    plc.refuse_reads = False
    plc.wait_mode(ACTIVE)
    plc.wait(at_wanted)
    running.stop()
    steps = running.steps
    hold = index_of(steps, lambda s: s.mode == HOLD)
    assert steps[hold].reason in (1, 5)
    check_after(steps, hold, last_good(steps, hold, lambda s: True), 3 * PERIOD_S)


@only_fc3
def test_no_value_comes_from_a_reading_older_than_its_age(plc, running):
    """The axis moves on while reads are refused: what is written stays what it was."""
    plc.refuse_reads = True
    plc.values = dict(AT_REST, X=9000)
    until(lambda: RAMP in running.modes)
    plc.refuse_reads = False
    plc.wait(lambda w: w.values["X"] == 9000 and at_wanted(w))
    running.stop()
    steps = running.steps
    ramp = index_of(steps, lambda step: step.mode == RAMP)
    hold = max(i for i, step in enumerate(steps[:ramp]) if step.mode != HOLD) + 1
    assert hold < ramp and all(step.um == steps[hold].um for step in steps[hold:ramp])


def test_a_stale_thermometer_degrades_only_its_term(plc, running):
    plc.values = dict(AT_REST, T1=2000)      # beyond its range: not accepted
    plc.wait(lambda w: w.reason == 8 and w.mode == ACTIVE)
    without = dict(AT_REST, T1=20)           # GROW is -40 + 2 * 20 = 0 there
    wanted = machine.wanted_um(without)
    plc.wait(lambda w: all(abs(w.um[n] - wanted[n]) < 0.06 for n in w.um))
    plc.values = dict(AT_REST)
    plc.wait(lambda w: w.mode == ACTIVE and w.reason == 0 and at_wanted(w))
    running.stop()
    steps = running.steps
    stale = index_of(steps, lambda s: s.reason == 8)
    check_after(steps, stale, last_good(steps, stale, lambda s: s.registers[14] == 350), 0.4)  # max_age_ms


def test_an_implausible_position_holds(plc, running):
    plc.values = dict(AT_REST, X=15000)      # beyond its max
    plc.wait(lambda w: w.mode == HOLD and w.reason == 5)
    plc.values = dict(AT_REST)
    plc.wait_mode(ACTIVE)
    assert running.runs
    running.stop()
    held = [h["cause"] for h in running.stats["history"] if h["mode"] == "HOLD"]
    assert held.count("signal X reads 15000 mm and its max is 14300") == 1
    counts = running.stats["signals"]
    assert [name for name in counts if counts[name]["implausible"]] == ["X"]


def test_a_demand_beyond_the_error_limit_is_a_latched_fault(plc, port, start_box):
    def narrow(data):
        data["channels"][2].update(limit_um=150, error_um=160)
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(change=narrow) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(at_wanted)
        plc.values = dict(AT_REST, T1=90)       # GROW 140: Z wants -177
        fault = plc.wait_mode(FAULT)
        assert fault.reason == 16
        plc.values = dict(AT_REST)
        plc.wait(at_zero)
        plc.wait_writes(7)
        assert plc.last().mode == FAULT         # latched, although the cause is gone
        plc.control |= RESET
        plc.wait(lambda w: w.mode != FAULT)
        plc.wait_mode(ACTIVE)                   # permit resume is set
        box.stop()
    assert box.code == 0, box.log
    assert box.stats["box"]["faults"] == 1
    assert set(box.stats["channels"]) == {"Z"} and box.stats["channels"]["Z"]["excessive"] >= 1
    causes = [h["cause"] for h in box.stats["history"] if h["mode"] == "FAULT"]
    assert len(causes) == 1 and causes[0].startswith("channel Z wants -17")
    assert causes[0].endswith(" um and its error_um is 160") and causes[0] in box.log
    laws.check_writes(plc.writes, limit_um=150.001)


@only_fc3
def test_writes_refused_for_long_are_a_fault(plc, running):
    plc.refuse_writes = True
    until(lambda: FAULT in running.modes)
    plc.refuse_writes = False
    assert plc.wait_mode(FAULT).reason == 18
    plc.wait(at_zero)
    plc.control |= RESET
    plc.wait_mode(STANDBY)
    plc.control &= ~RESET
    plc.wait_mode(ACTIVE)
