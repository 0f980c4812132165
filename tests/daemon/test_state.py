# SPDX-License-Identifier: MIT
"""The memory of the lags across a restart: killed without warning, or without power, and started again."""
import errno
import math

import pytest
from box import until
from machine import ACTIVE, PERIOD_S
from raw_plc import RawPlc

TAU_S = 40


def with_lag(tau_s=TAU_S):
    def change(data):
        data["signals"].append({"name": "T1_slow", "unit": "degC", "lag_of": "T1", "tau_s": tau_s})
    return change


def run_for(seconds, start_box, state, change, plc, value):
    """A box that runs so long by its own stamps and kept its lags since; out: it, its T1_slow, row by row, and the
    stamps of its first and last step."""
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": value}
    with start_box("--state", state, "--state-every", "1", change=change) as box:
        until(lambda: len(box.steps) > 1 and box.steps[-1].now_us - box.steps[0].now_us > seconds * 1e6)
        kept_ns = state.modified_ns if state.exists() else 0
        box.stage.run_until(lambda: state.exists() and state.modified_ns > kept_ns)
        box.kill()
    steps = box.steps
    slow = [row["T1_slow"] for row in box.rows if row["T1_slow"] is not None]
    return slow, box.log, (steps[0].now_us * 1e-6, steps[-1].now_us * 1e-6)


def warmed(from_degC, seconds):
    """out: where the lag comes from there in that time, with 40 degC before it"""
    return 40 - (40 - from_degC) * math.exp(-seconds / TAU_S)


def test_a_lag_goes_on_after_a_kill(plc, port, start_box, tmp_path):
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        first, log, (begin_s, _) = run_for(1.5, start_box, state, with_lag(), plc, 20)
        assert "is not there yet" in log
        assert first[0] == 20
        warm, log, (warm_s, end_s) = run_for(4, start_box, state, with_lag(), plc, 40)
        assert "1 of 1 lags go on" in log
        assert 20 <= warm[0] <= warmed(20, warm_s - begin_s) + 0.1
        assert warmed(warm[0], (len(warm) - 1) * PERIOD_S) - 0.1 <= warm[-1] <= warmed(20, end_s - begin_s) + 0.1
        again, log, (again_s, _) = run_for(1.5, start_box, state, with_lag(), plc, 40)
        assert warm[-1] - 1 < again[0] <= warmed(warm[-1], again_s - end_s) + 1, "neither 20 nor 40"


@pytest.mark.parametrize("then, now, words", [
    (False, True, "is unknown, because the wall clock was not synchronised"),
    (True, False, "is unknown, because the wall clock is not synchronised"),
    (True, True, "1 of 1 lags go on")])
def test_across_a_boot_only_a_synchronised_clock_knows_the_pause(stage, plc, port, start_box, tmp_path, then, now,
                                                                 words):
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        stage.set_clock(0, then)
        first, _, (_, end_s) = run_for(2.5, start_box, state, with_lag(), plc, 20)
        stage.cut_power(off_s=5)
        stage.set_clock(0, now)
        again, log, (again_s, _) = run_for(1.5, start_box, state, with_lag(), plc, 40)
    assert words in log
    if then and now:
        assert 20.5 < again[0] < warmed(20, again_s - end_s + 1), "as far as it warms in the pause"
    else:
        assert again[0] == 40


def test_a_clock_that_cannot_be_asked_counts_as_not_synchronised(stage, plc, port, start_box, tmp_path):
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        stage.fail("adjtimex", errno.EPERM)
        run_for(2.5, start_box, state, with_lag(), plc, 20)
        stage.heal()
        stage.cut_power(off_s=5)
        again, log, _ = run_for(1.5, start_box, state, with_lag(), plc, 40)
    assert "is unknown, because the wall clock was not synchronised" in log
    assert again[0] == 40


def test_a_clock_restored_from_a_file_hides_no_weekend(stage, plc, port, start_box, tmp_path):
    """A board without a clock: a stop of 60 h looks like 12 s, and its lags start steady."""
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        run_for(2.5, start_box, state, with_lag(), plc, 20)
        stage.cut_power(off_s=60 * 3600)
        stage.set_clock(12 - 60 * 3600, synchronised=False)
        again, log, _ = run_for(1.5, start_box, state, with_lag(), plc, 40)
    assert "is unknown, because the wall clock is not synchronised" in log
    assert again[0] == 40


def test_a_long_pause_starts_steady(stage, plc, port, start_box, tmp_path):
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        run_for(2.5, start_box, state, with_lag(1), plc, 20)
        stage.run_for(1)
        again, log, _ = run_for(1, start_box, state, with_lag(1), plc, 40)
    assert "0 of 1 lags go on" in log
    assert again[0] == 40


def test_a_damaged_file_is_reported_and_replaced(plc, port, start_box, tmp_path):
    state = tmp_path / "lags.state"
    with RawPlc(plc, port):
        run_for(2.5, start_box, state, with_lag(), plc, 20)
        good = state.read_bytes()
        state.write_bytes(good[:-5] + bytes([good[-5] ^ 1]) + good[-4:])
        again, log, _ = run_for(2.5, start_box, state, with_lag(), plc, 40)
        assert "is damaged and is not used" in log
        assert again[0] == 40
        assert state.read_bytes() != good[:-5] + bytes([good[-5] ^ 1]) + good[-4:]


def test_a_clean_stop_saves_the_last_state(plc, port, start_box, tmp_path):
    state = tmp_path / "lags.state"
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 20}
    with RawPlc(plc, port), start_box("--state", state, change=with_lag()) as box:
        plc.wait(lambda w: w.mode == ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    assert state.exists()


def test_a_start_that_fails_leaves_how_the_run_before_it_ended(stage, plc, port, start_box, tmp_path):
    words = "--state", tmp_path / "lags"
    with RawPlc(plc, port):
        with start_box(*words) as box:
            plc.wait_mode(ACTIVE)
            box.stop()
        stage.fail("pthread_create", errno.EPERM, skipped=2)    # two threads are started before the loop
        with start_box(*words) as box:
            box.wait()
        assert box.code == 1, box.log
        stage.heal()
        with start_box(*words) as box:
            until(lambda: "the previous run ended STOPPED" in box.log)


def test_a_path_that_cannot_be_written_is_reported_at_once(start_box, tmp_path):
    pipe = tmp_path / "pipe"
    pipe.mkfifo()
    for path, words in ((tmp_path / "no" / "lags.state", "No such file or directory"),
                        (tmp_path, "it is not a regular file"), (pipe, "it is not a regular file")):
        with start_box("--state", path) as box:
            box.wait()
        assert box.code == 1
        assert f"{path}: cannot be written: {words}" in box.log
    for seconds in ("0", "x", "3601"):
        with start_box("--state", tmp_path / "s", "--state-every", seconds) as box:
            box.wait()
        assert box.code == 2 and "--state-every" in box.log
