# SPDX-License-Identifier: MIT
"""A new coefficient file while the box runs: taken over without a step, or refused with a sentence."""
import errno
import json
import signal

import pytest

import laws
import machine
from box import run, until
from machine import ACTIVE, AT_REST, PERIOD_S, STOPPED
from raw_plc import RawPlc
from steps import index_of



def grown(by_um):
    """GROW gives so much more than in the usual file: channel Z goes so much lower."""
    def change(data):
        data["revision"] += 1
        next(t for t in data["terms"] if t["name"] == "GROW")["coefficients"][0] += by_um
    return change


def replace(path, port, change=None):
    """As whoever brings a new file should: written beside it and renamed over it."""
    new = path.with_name("new.json")
    machine.write_coefficients(new, port, change)
    new.rename(path)


@pytest.fixture
def running(plc, port, start_box, tmp_path):
    """A box that compensates at rest, its file, and its writes so far settled."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: abs(w.um["Z"] - machine.wanted_um(AT_REST)["Z"]) < 0.1)
        yield box, tmp_path / "coefficients.json"
        if box.code is None:
            box.stop()
        assert box.code == 0, box.log


def hup(box, path, port, change):
    machine.write_coefficients(path, port, change)
    box.send_signal(signal.SIGHUP)


def test_a_new_curve_is_gone_to_at_the_slew_rate(plc, port, running):
    box, path = running
    before = plc.last()
    hup(box, path, port, grown(90))
    there = plc.wait(lambda w: abs(w.um["Z"] - before.um["Z"] + 90) < 0.1)
    box.stop()
    assert box.code == 0, box.log
    steps = box.steps
    first = index_of(steps, lambda s: s.heartbeat == before.heartbeat)
    last = index_of(steps, lambda s: s.heartbeat == there.heartbeat)
    way = steps[first:last + 1]
    laws.check_slew(way)
    assert all((b.heartbeat - a.heartbeat) % 65536 == 1 for a, b in zip(way, way[1:])), "a step for every cycle"
    assert max(abs(b.um["Z"] - a.um["Z"]) for a, b in zip(way, way[1:])) > 1
    laws.check_writes(plc.writes)
    laws.check_period(box)
    stats = box.stats
    assert stats["reloads"]["taken"] == 1 and stats["reloads"]["refused"] == 0
    assert stats["revision"] == machine.FILE["revision"] + 1
    assert "revision 8 is running now" in box.log


def test_a_file_that_is_replaced_is_noticed(plc, port, running):
    box, path = running
    z = plc.last().um["Z"]
    replace(path, port, grown(20))
    plc.wait(lambda w: abs(w.um["Z"] - z + 20) < 0.1)


def test_a_bad_file_is_refused_and_the_old_one_goes_on(plc, port, running):
    box, path = running
    def falling(data):
        data["terms"][2]["positions"] = [-1500, 300, -200, 1500]
    def other_port(data):
        data["plc"]["transport"]["tcp"]["port"] += 1
    sentences = []
    for change in (falling, other_port):
        refused = len(sentences) + 1
        hup(box, path, port, change)
        until(lambda: box.stats["reloads"]["refused"] >= refused)
        sentences.append(box.stats["reloads"]["last"])
    plc.wait(lambda w: w.mode == ACTIVE and abs(w.um["Z"] - machine.wanted_um(AT_REST)["Z"]) < 0.1)
    box.stop()
    assert box.stats["reloads"]["taken"] == 0 and box.stats["reloads"]["refused"] == 2
    assert "terms[2].positions[2]: -200 is" in sentences[0] and "line" in sentences[0]
    assert "plc.transport differs from the running file's, which takes a restart" in sentences[1]
    for sentence in sentences:
        assert f"{sentence}; revision 7 goes on" in box.log


def test_half_a_file_is_refused_and_the_whole_one_then_taken(plc, port, running):
    """An editor that writes in place: what it has written so far is no JSON."""
    box, path = running
    z = plc.last().um["Z"]
    whole = json.dumps(machine.coefficients(port, grown(15)))
    path.write_text(whole[:len(whole) // 2])
    until(lambda: box.stats["reloads"]["refused"] >= 1)
    assert abs(plc.last().um["Z"] - z) < 0.1
    path.write_text(whole)
    plc.wait(lambda w: abs(w.um["Z"] - z + 15) < 0.1)
    box.stop()
    assert box.stats["reloads"]["taken"] == 1 and box.stats["reloads"]["refused"] >= 1


def test_a_file_that_is_gone_for_a_while_changes_nothing(plc, port, running):
    box, path = running
    kept = path.read_text()
    path.unlink()
    plc.wait_writes(70)                 # it looks once a second
    assert box.stats["reloads"]["taken"] == 0
    box.send_signal(signal.SIGHUP)
    until(lambda: box.stats["reloads"]["refused"])
    path.write_text(kept)
    plc.wait_mode(ACTIVE)
    box.stop()
    assert "cannot be read: No such file or directory; revision 7 goes on" in box.log


def test_a_lag_keeps_its_memory(plc, port, running):
    box, path = running
    def lagged(data):
        grown(0)(data)
        data["signals"].append({"name": "slow", "unit": "degC", "lag_of": "T1", "tau_s": 1000})
    hup(box, path, port, lagged)
    until(lambda: box.stats["reloads"]["taken"] == 1)
    plc.values = dict(AT_REST, T1=60)
    plc.wait_writes(30)
    hup(box, path, port, lambda data: (lagged(data), lagged(data), data["signals"].pop()))
    until(lambda: box.stats["reloads"]["taken"] == 2)
    plc.wait_writes(15)
    box.stop()
    slow = [row["slow"] for row in box.rows if row["slow"] is not None]
    assert 35 <= slow[0] < slow[-1] < 45, "neither forgotten (60) nor standing still"
    assert all(0 <= b - a < 0.1 for a, b in zip(slow, slow[1:]))


def test_other_columns_begin_another_record(plc, port, running):
    box, path = running
    def renamed(data):
        grown(0)(data)
        data["signals"].append({"name": "T9", "unit": "degC", "plc": 14, "type": "int16",
                                "scale": 0.1, "min": -10, "max": 90, "max_age_ms": 400})
    hup(box, path, port, renamed)
    until(box.record_file.with_name("record.csv.1").exists)
    plc.wait_writes(10)
    box.stop()
    old = box.record_file.with_name("record.csv.1").read_text().splitlines()
    new = box.record_file.read_text().splitlines()
    assert "T9" not in old[0] and "T9" in new[0]
    assert all(line.count(",") == old[0].count(",") for line in old)
    assert all(line.count(",") == new[0].count(",") for line in new)
    assert len(old) - 1 + len(new) - 1 == box.stats["cycles"], "no cycle is missing in between"


def test_fifty_reloads_in_a_row(stage, plc, port, running):
    """Up and down; what is written stays within the slew rate and comes to the last file's value."""
    box, path = running
    z = plc.last().um["Z"]
    seen = len(plc.writes)
    for k in range(50):
        replace(path, port, grown(60 if k % 2 else 0))
        box.send_signal(signal.SIGHUP)
        stage.run_for(0.1)
        if k == 5:
            held = stage.held()
    assert stage.held() == held, "nothing is lost at a reload"
    plc.wait(lambda w: abs(w.um["Z"] - z + 60) < 0.1)
    box.stop()
    assert box.stats["reloads"]["taken"] >= 40
    assert box.stats["reloads"]["refused"] == 0, box.log
    steps = [abs(b.um["Z"] - a.um["Z"]) for a, b in zip(plc.writes[seen:], plc.writes[seen + 1:])
             if b.mode == ACTIVE]
    assert max(steps) <= machine.CHANNELS["Z"]["slew_um_per_s"] * 1.02 * PERIOD_S


def test_a_flood_of_requests_fills_no_log_and_delays_no_stop(stage, plc, running):
    """Something sends SIGHUP a thousand times a second, for ever."""
    box, _ = running

    def hang_up():
        if box.runs:
            box.send_signal(signal.SIGHUP)
            stage.after(0.001, hang_up)

    hang_up()
    until(lambda: box.stats["reloads"]["taken"] > 60)
    box.stop()
    assert box.code == 0, box.log
    assert plc.last().mode == STOPPED
    lines = box.log.count("revision 7 is running now")
    whole_s = box.rows[-1]["time_s"]
    assert box.stats["reloads"]["taken"] > lines
    assert 20 <= lines <= 21 + 2 * whole_s, box.log
    assert "lines about files left out)" in box.log


def test_a_file_that_is_taken_just_before_the_end_is_reported(stage, plc, port, start_box, tmp_path):
    """The thread that reports it writes a file meanwhile, until the loop has ended."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", tmp_path / "snapshot") as box:
        plc.wait_mode(ACTIVE)
        stage.stall(1, "compboxd-loop")
        hup(box, tmp_path / "coefficients.json", port, grown(1))
        stage.run_for(0.2)
        stage.hang("write", "snapshot", 4, times=1)
        until(lambda: stage.failed)
        box.stop()
    assert box.log.count("revision 8 is running now") == 1 and box.code == 0, box.log
    assert box.stats["reloads"]["taken"] == 1


def test_a_disk_that_is_full_is_reported_once_and_when_it_is_not(stage, plc, port, start_box, tmp_path):
    plc.values = dict(AT_REST)
    state = tmp_path / "lags"
    with RawPlc(plc, port), start_box("--state", state, "--state-every", "1") as box:
        plc.wait_mode(ACTIVE)
        stage.fail("write", errno.ENOSPC, "lags")
        stage.run_for(3)               # it is written every second
        kept_ns = state.modified_ns
        stage.heal()
        until(lambda: state.modified_ns > kept_ns)
        box.stop()
    assert box.code == 0, box.log
    assert box.log.count("lags: cannot be written: No space left on device") == 1, box.log
    assert box.log.count("lags: is written again") == 1, box.log


def test_check_says_whether_a_file_is_good(tmp_path):
    path = machine.write_coefficients(tmp_path / "c.json", 1502)
    assert run("--config", path, "--check") == (0, "")
    machine.write_coefficients(path, 1502, lambda data: data["channels"][0].update(limit_um=-1))
    code, printed = run("--config", path, "--check")
    assert code == 1
    assert printed.startswith(f"compboxd: {path}: channels[0].limit_um: -1 is outside the range")
