# SPDX-License-Identifier: MIT
"""The end: outputs at zero, STOPPED written, in bounded time; also when nobody listens."""
import signal

import pytest

import laws
import machine
from box import until
from machine import ACTIVE, PERIOD_S, RAMP, STANDBY, STOPPED
from raw_plc import RawPlc
from steps import index_of

AT_REST = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}     # Z wants -124 µm
LATE_S = machine.FILE["plc"]["heartbeat_timeout_ms"] / 1000 + 2 * PERIOD_S
BOUND_S = 300 / 200 + 4 * LATE_S + 1                     # limit / ramp, two turns of late writes, 1 s


def check_ramp(steps):
    """From the step before the stop on: to zero and not back, at the ramp rate by the box's own stamps. A write that
    was not confirmed may have taken effect or not; the box then begins again from what the PLC has."""
    full = []
    assert all(step.reason == 10 for step in steps[1:])
    assert {RAMP, STOPPED} <= {step.mode for step in steps[1:]} <= {RAMP, STANDBY, STOPPED}
    assert steps[-1].mode == STOPPED
    for before, after in zip(steps, steps[1:]):
        elapsed_s = min((after.now_us - before.now_us) * 1e-6, 2 * PERIOD_S)
        for name, um in after.um.items() if after.last_write == laws.CONFIRMED else ():
            assert abs(um) <= abs(before.um[name])
            slack_um = 2 * machine.resolution_um(machine.CHANNELS[name])
            assert abs(um - before.um[name]) <= 200 * elapsed_s + slack_um
            full.append(abs(um - before.um[name]) >= 200 * elapsed_s - slack_um)
    assert any(full), "as fast as the rate permits"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ramps_to_zero_and_says_stopped(plc, port, start_box, exchange, number):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(change=exchange) as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        box.stop(number)
    assert box.code == 0, box.log
    last = plc.writes[-1]
    assert last.mode == STOPPED and last.um == {"X": 0, "Y": 0, "Z": 0}
    steps = box.steps
    begin = index_of(steps, lambda step: step.reason == 10)
    check_ramp(steps[begin - 1:])
    laws.check_writes(plc.writes)
    assert box.stats["finished"] and box.stats["stopped"]
    assert box.stats["mode"] == "STOPPED"


def test_a_slew_below_the_ramp_rate_is_waited_for(plc, port, start_box):
    """At 30 µm/s the way from -90 µm takes longer than limit / ramp and a second."""
    def slow(config):
        for channel in config["channels"]:
            channel["slew_um_per_s"] = 30
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(change=slow) as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -90)
        box.stop()
    assert box.code == 0, box.log
    assert plc.writes[-1].mode == STOPPED and plc.writes[-1].um["Z"] == 0


def test_cycles_end_by_the_same_clean_stop(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--cycles", "40") as box:
        box.wait()
    assert box.code == 0, box.log
    assert plc.writes[-1].mode == STOPPED
    steps = box.steps
    assert index_of(steps, lambda step: step.reason == 10) == 40
    check_ramp(steps[39:])


def test_a_plc_that_was_never_there_is_reported_at_once(start_box):
    """There is nothing to take back."""
    with start_box() as box:
        until(lambda: len(box.steps) > 5)
        box.stop()
    assert box.code == 1
    assert sum(step.reason == 10 for step in box.steps) <= 1
    assert "ended without any reply of the PLC" in box.log
    assert box.stats["finished"]


def test_a_plc_that_dies_before_the_stop_is_reported_after_the_bound(plc, port, start_box):
    plc.values = dict(AT_REST)
    with start_box() as box:
        with RawPlc(plc, port):
            plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        box.stop()
    assert box.code == 1
    steps = box.steps
    begin = index_of(steps, lambda step: step.reason == 10)
    behind = [step for step in steps[begin:] if (step.now_us - steps[begin].now_us) * 1e-6 > BOUND_S]
    assert len(behind) <= 1
    assert (steps[-1].now_us - steps[begin - 1].now_us) * 1e-6 >= BOUND_S - PERIOD_S, "the ramp has its time"
    assert "without the PLC's confirmation" in box.log
    assert box.stats["finished"] and not box.stats["stopped"]


def test_a_second_signal_changes_nothing(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        box.send_signal(signal.SIGTERM)
        plc.wait_mode(RAMP)
        box.stop()
    assert box.code == 0, box.log
    assert plc.writes[-1].mode == STOPPED


def test_a_terminal_that_is_closed_does_not_end_the_compensation(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        box.send_signal(signal.SIGHUP)
        plc.wait_writes(7)
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0


def test_files_are_whole_at_any_moment(plc, port, start_box):
    """Killed without warning, the record has whole lines only."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        for _ in range(200):
            plc.wait_writes(1)
            header, *lines = box.record_file.read_text().split("\n")
            assert lines.pop() == ""
            assert {line.count(",") for line in lines} <= {header.count(",")}
            assert box.stats["format"] == "compboxd-stats/1"
        box.kill()
        text = box.record_file.read_text()
        assert text.endswith("\n") and text.count("\n") > 200


def test_a_pipe_in_the_files_place_is_refused_and_a_stop_ramps_to_zero(plc, port, start_box, tmp_path):
    plc.values = dict(AT_REST)
    path = tmp_path / "coefficients.json"
    with RawPlc(plc, port), start_box() as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        path.unlink()
        path.mkfifo()
        box.send_signal(signal.SIGHUP)
        until(lambda: box.stats["reloads"]["refused"])
        box.stop()
    assert box.code == 0, box.log
    assert "it is not a regular file" in box.log and "revision 7 goes on" in box.log
    assert plc.writes[-1].mode == STOPPED and plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}


def test_a_file_that_hangs_at_the_start_keeps_no_stop_waiting(stage, start_box, tmp_path):
    """There is no loop yet that could end."""
    stage.hang("fsync", "lags")
    with start_box("--state", tmp_path / "lags") as box:
        until(lambda: stage.failed)
        box.stop()
    assert box.code == 1 and "a file blocks the end of the program" in box.log, box.log


@pytest.mark.parametrize("call", ["open", "stat", "fsync"])
def test_a_file_that_hangs_keeps_no_stop_from_the_ramp(stage, plc, port, start_box, call):
    """A mount that is stuck: the call of the normal thread never returns. The loop ramps to zero and ends in good
    order, then the program ends without its files."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        stage.hang(call)
        box.send_signal(signal.SIGHUP)
        until(lambda: stage.failed)
        plc.wait_writes(5)
        plc.wait_mode(ACTIVE)
        box.send_signal(signal.SIGTERM)
        plc.wait_mode(STOPPED)
        box.wait()
    assert plc.writes[-1].mode == STOPPED and plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}
    assert box.code == 1
    assert "a file blocks the end of the program" in box.log


def test_a_flood_of_hangups_keeps_no_stop_from_the_ramp(stage, plc, port, start_box):
    """The normal thread is kept by a file, and cannot even take the signals that come."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait(lambda w: w.mode == ACTIVE and w.um["Z"] < -124)
        stage.hang("open")
        for _ in range(200):
            box.send_signal(signal.SIGHUP)
        box.send_signal(signal.SIGINT)
        plc.wait_mode(STOPPED)
        box.wait()
    assert plc.writes[-1].um == {"X": 0, "Y": 0, "Z": 0}
