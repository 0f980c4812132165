# SPDX-License-Identifier: MIT
"""Ticks and clocks: a loop that stood still, a suspended computer, a wall clock that is set."""
import laws
from machine import ACTIVE, AT_REST, PERIOD_S, at_wanted
from raw_plc import RawPlc
from steps import index_of


def test_ticks_are_a_period_apart(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_writes(100)
        box.stop()
    steps = box.steps
    assert box.stats["overruns"] == 0
    for i, step in enumerate(steps):
        assert abs(step.read_us - steps[0].read_us - i * PERIOD_S * 1e6) < 1000, "none is late, and they do not drift"
    laws.check_period(box)


def test_a_loop_that_stood_still_counts_and_skips_its_ticks(stage, plc, port, start_box):
    """As by SIGSTOP: the ticks in between are counted, not made up."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(at_wanted)
        stopped_us = stage.now_s * 1e6
        stage.stall(0.2)
        plc.wait_writes(10)
        box.stop()
    assert box.code == 0, box.log
    stats, steps = laws.check_period(box), box.steps
    behind = index_of(steps, lambda s: s.now_us >= stopped_us + 0.2e6)
    assert sum(s.missed_ticks for s in steps) == sum(s.missed_ticks for s in steps[behind:behind + 2]) == 6
    assert stats["box"]["clock_jumps"] == 1                   # more than five periods
    assert stats["jitter_us"]["max"] > 140000, "the first tick of the stop was 170 ms late"
    laws.check_writes(plc.writes)


def test_a_suspended_computer_goes_on_from_what_the_plc_has(stage, plc, port, start_box):
    """An hour, of which the monotonic clock knows nothing: ages do, so every input is stale at first."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(at_wanted)
        seen = len(plc.writes)
        stage.suspend(3600)
        plc.wait(lambda w: w.mode == ACTIVE and at_wanted(w))
        box.stop()
    assert box.code == 0, box.log
    laws.check_writes(plc.writes)
    assert box.stats["box"]["clock_jumps"] == 1
    assert plc.writes[seen].time_s - plc.writes[seen - 1].time_s > 3600


def test_a_wall_clock_that_is_set_moves_nothing(stage, plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(at_wanted)
        seen = len(plc.writes)
        for step_s in (3600, -86400, 10 * 365 * 86400):
            stage.set_clock(step_s)
            plc.wait_writes(20)
        assert all(w.mode == ACTIVE and at_wanted(w) for w in plc.writes[seen:])
        box.stop()
    assert box.code == 0, box.log
    assert box.stats["overruns"] == box.stats["box"]["clock_jumps"] == 0
