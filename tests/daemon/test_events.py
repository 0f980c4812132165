# SPDX-License-Identifier: MIT
"""--events: the log as lines of JSON, across restarts, kills and full disks."""
import errno
import json
import re

import pytest

import machine
from box import until
from machine import ACTIVE, AT_REST, RAMP
from raw_plc import RawPlc


@pytest.fixture
def events(tmp_path):
    return tmp_path / "events.jsonl"


def lines(events):
    return [json.loads(line) for line in events.read_text().splitlines()]


def texts_of(log):
    """Lines of the log without program and time."""
    return re.findall(r"^compboxd: +[0-9.]+ s: (.*)$", log, re.M)


def test_each_line_of_the_log_is_an_event(plc, port, start_box, events):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--events", events) as box:
        plc.wait_mode(ACTIVE)
        plc.heartbeat_alive = False
        plc.wait_mode(RAMP)
        box.stop()
    found = lines(events)
    assert [line["text"] for line in found] == texts_of(box.log)
    modes = [line["mode"] for line in found if line["kind"] == "mode"]
    assert modes == ["STANDBY", "ACTIVE", "HOLD", "RAMP", "RAMP", "STOPPED"], modes
    assert all(line["revision"] == 7 for line in found)
    assert [line["unix_s"] for line in found] == sorted(line["unix_s"] for line in found)
    assert all(len(line["crc"]) == 8 for line in found)


def test_a_kill_and_a_restart_append(stage, plc, port, start_box, events):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port):
        with start_box("--events", events) as box:
            plc.wait_mode(ACTIVE)
            stage.run_for(2)
            box.kill()
        before = lines(events)
        with start_box("--events", events):
            plc.wait_mode(ACTIVE)
            stage.run_for(2)
            assert lines(events)[:len(before)] == before
            assert len(lines(events)) > len(before)


def test_a_power_cut_keeps_what_is_older_than_two_seconds(stage, plc, port, start_box, events):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port):
        with start_box("--events", events):
            plc.wait_mode(ACTIVE)
            stage.run_for(2.5)
            before = lines(events)
            stage.cut_power(5)
        assert lines(events)[:len(before)] == before and len(before) >= 3


def test_a_reload_has_the_new_revision_and_check_sum(plc, port, start_box, events, tmp_path):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--events", events):
        plc.wait_mode(ACTIVE)
        machine.write_coefficients(tmp_path / "coefficients.json", port, lambda data: data.update(revision=8))
        until(lambda: any("is running now" in line["text"] for line in lines(events)))
        first, last = lines(events)[0], lines(events)[-1]
    assert (first["revision"], last["revision"]) == (7, 8) and first["crc"] != last["crc"]
    assert last["kind"] == "file"


def test_a_full_disk_is_reported_once_and_the_losses_counted(stage, plc, port, start_box, events):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--events", events) as box:
        plc.wait_mode(ACTIVE)
        stage.fail("write", errno.ENOSPC, "events")
        plc.heartbeat_alive = False
        plc.wait_mode(RAMP)
        stage.run_for(1)
        assert box.log.count("events.jsonl: cannot be written") == 1
        stage.heal()
        plc.heartbeat_alive = True
        until(lambda: "lost_before" in lines(events)[-1] or any("lost_before" in line for line in lines(events)))
        box.stop()
    assert box.code == 0, box.log
    assert sum(line.get("lost_before", 0) for line in lines(events)) >= 2
