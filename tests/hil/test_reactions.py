# SPDX-License-Identifier: MIT
"""What the box does when the PLC, the signals or a person change their mind (docs/faults.md)."""
import time

import pytest

import laws
import machine
from machine import (ACTIVE, ENABLE, FAULT, HOLD, PERMIT_RESUME, RAMP, REFERENCED, RESET, STANDBY,
                     PERIOD_S)
from pymodbus_plc import PymodbusPlc
from steps import check_after, index_of, steps_of

AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}   # all channels are far from zero


@pytest.fixture
def running(plc, port, start_box, exchange, tmp_path):
    """A box that compensates, at its wanted values; checked against the laws at the end."""
    plc.values = dict(AT_REST)
    with PymodbusPlc(plc, port), start_box("--record-inputs", tmp_path / "inputs.csv", change=exchange) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(at_wanted)
        yield box
        if box.code is None:
            box.stop()
        assert box.code == 0, box.log
        laws.check_writes(plc.writes)
        laws.check_period(box)


def at_wanted(write):
    wanted = machine.wanted_um(write.values)
    return all(abs(um - wanted[name]) < 0.06 for name, um in write.um.items())


def at_zero(write):
    return all(um == 0 for um in write.um.values())


def check_ramp(writes, um_per_s=200):
    """From the first RAMP on: every channel goes straight to zero at the ramp rate, together or
    one after the other, never faster and never back."""
    for before, after in zip(writes, writes[1:]):
        for name in after.um:
            assert abs(after.um[name]) <= abs(before.um[name]) + 1e-3
            step = abs(after.um[name] - before.um[name])
            assert step <= um_per_s * 2 * PERIOD_S + 2 * machine.resolution_um(machine.CHANNELS[name])


def since(plc, time_s, until_mode=None):
    writes = [w for w in plc.writes if w.time_s >= time_s]
    if until_mode is not None:
        ends = [i for i, w in enumerate(writes) if w.mode == until_mode]
        writes = writes[:ends[0] + 1]
    return writes


def test_enable_off_ramps_to_zero_and_on_comes_back(plc, running):
    begin = time.monotonic()
    plc.control &= ~ENABLE
    plc.wait_mode(STANDBY)
    writes = [w for w in since(plc, begin, STANDBY) if w.mode != ACTIVE]
    assert {w.mode for w in writes} == {RAMP, STANDBY}
    assert all(w.reason == 2 for w in writes)
    check_ramp(writes)
    assert at_zero(writes[-1])
    largest = max(abs(um) for um in writes[0].um.values())
    assert writes[-1].time_s - writes[0].time_s > 0.8 * largest / 200 - PERIOD_S
    plc.control |= ENABLE
    plc.wait_mode(ACTIVE)
    plc.wait(at_wanted)


def test_enable_back_on_during_the_ramp_resumes_from_there(plc, running):
    plc.control &= ~ENABLE
    plc.wait_mode(RAMP)
    time.sleep(0.1)
    middle = plc.last()
    assert not at_zero(middle)
    plc.control |= ENABLE
    plc.wait(at_wanted)
    assert STANDBY not in {w.mode for w in since(plc, middle.time_s)}


def test_referenced_off_ramps_to_zero(plc, running):
    plc.control &= ~REFERENCED
    write = plc.wait_mode(STANDBY)
    assert write.reason == 3 and at_zero(write)


def last_good(steps, before, good):
    """out: stamp of the last reading before this step that is good."""
    return max(step.read_us for step in steps[:before] if step.read_ok and good(step))


def test_a_heartbeat_that_stops_holds_then_ramps(plc, running, tmp_path):
    plc.heartbeat_alive = False
    held = plc.wait_mode(HOLD)
    assert held.reason == 4
    ramp = plc.wait_mode(RAMP)
    holding = [w for w in plc.writes if held.time_s <= w.time_s < ramp.time_s]
    assert all(w.um == held.um for w in holding)
    zero = plc.wait(at_zero)
    check_ramp([w for w in plc.writes if ramp.time_s <= w.time_s <= zero.time_s])
    plc.heartbeat_alive = True
    plc.wait_mode(ACTIVE)       # permit resume is set
    running.stop()
    steps = steps_of(tmp_path / "inputs.csv")
    hold = index_of(steps, lambda s: s.mode == HOLD)
    beat = lambda s: s.registers[machine.PLC_HEARTBEAT]  # noqa: E731
    stopped = beat(steps[hold])
    changed = min(s.read_us for s in steps[:hold] if s.read_ok and beat(s) == stopped)
    check_after(steps, hold, changed, 0.2)                                      # heartbeat_timeout_ms
    check_after(steps, index_of(steps, lambda s: s.mode == RAMP, hold), steps[hold].now_us, 0.3)  # hold_ms


def test_without_permit_resume_a_new_edge_of_enable_is_needed(plc, running):
    plc.control &= ~PERMIT_RESUME
    plc.heartbeat_alive = False
    plc.wait_mode(HOLD)
    plc.heartbeat_alive = True
    standby = plc.wait_mode(STANDBY)
    assert standby.reason == 7
    time.sleep(0.3)
    assert plc.last().mode == STANDBY
    plc.control &= ~ENABLE
    time.sleep(0.1)
    plc.control |= ENABLE
    plc.wait_mode(ACTIVE)


# fc23 has no write without a read.
only_fc3 = pytest.mark.parametrize("exchange", ["fc3+fc16"], indirect=True)


@only_fc3
def test_a_reading_too_old_is_not_used(plc, running, tmp_path):
    """Reads are refused, writes go on: three periods after the last good reading the box holds."""
    plc.refuse_reads = True
    held = plc.wait_mode(HOLD)
    assert held.reason in (1, 5)
    plc.refuse_reads = False
    plc.wait_mode(ACTIVE)
    plc.wait(at_wanted)
    running.stop()
    steps = steps_of(tmp_path / "inputs.csv")
    hold = index_of(steps, lambda s: s.mode == HOLD)
    check_after(steps, hold, last_good(steps, hold, lambda s: True), 3 * PERIOD_S)


@only_fc3
def test_no_value_comes_from_a_reading_older_than_its_age(plc, running):
    """The axis moves on while reads are refused: what is written stays what it was."""
    plc.refuse_reads = True
    plc.values = dict(AT_REST, X=9000)
    plc.wait_mode(HOLD)
    before = plc.last().um
    time.sleep(0.1)
    assert plc.last().um == before
    plc.refuse_reads = False
    write = plc.wait(at_wanted)
    assert write.values["X"] == 9000


def test_a_stale_thermometer_degrades_only_its_term(plc, running, tmp_path):
    plc.values = dict(AT_REST, T1=2000)      # beyond its range: not accepted
    write = plc.wait(lambda w: w.reason == 8)
    assert write.mode == ACTIVE
    without = dict(AT_REST, T1=20)           # GROW is -40 + 2 * 20 = 0 there
    wanted = machine.wanted_um(without)
    plc.wait(lambda w: all(abs(w.um[n] - wanted[n]) < 0.06 for n in w.um))
    plc.values = dict(AT_REST)
    plc.wait(lambda w: w.mode == ACTIVE and w.reason == 0 and at_wanted(w))
    running.stop()
    steps = steps_of(tmp_path / "inputs.csv")
    stale = index_of(steps, lambda s: s.reason == 8)
    check_after(steps, stale, last_good(steps, stale, lambda s: s.registers[14] == 350), 0.4)  # max_age_ms


def test_an_implausible_position_holds(plc, running):
    plc.values = dict(AT_REST, X=15000)      # beyond its max
    held = plc.wait_mode(HOLD)
    assert held.reason == 5
    plc.values = dict(AT_REST)
    plc.wait_mode(ACTIVE)
    assert running.process.poll() is None
    running.stop()
    held = [h["cause"] for h in running.stats["history"] if h["mode"] == "HOLD"]
    assert held == ["signal X reads 15000 mm and its max is 14300"]
    assert set(running.stats["signals"]) == {"X"}


def test_a_demand_beyond_the_error_limit_is_a_latched_fault(plc, port, start_box):
    def narrow(data):
        data["channels"][2].update(limit_um=150, error_um=160)
    plc.values = dict(AT_REST)
    with PymodbusPlc(plc, port), start_box(change=narrow) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(at_wanted)
        plc.values = dict(AT_REST, T1=90)       # GROW 140: Z wants -177
        fault = plc.wait_mode(FAULT)
        assert fault.reason == 16
        plc.values = dict(AT_REST)
        plc.wait(at_zero)
        time.sleep(0.2)
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
    time.sleep(3.6)
    plc.refuse_writes = False
    fault = plc.wait_mode(FAULT)
    assert fault.reason == 18
    plc.wait(at_zero)
    plc.control |= RESET
    plc.wait_mode(STANDBY)
    plc.control &= ~RESET
    plc.wait_mode(ACTIVE)
