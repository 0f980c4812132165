# SPDX-License-Identifier: MIT
"""--events: the log as lines of JSON, across restarts, kills and full disks."""
import errno
import hashlib
import json
import re
import signal

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


def line_with(text, events):
    return next((line for line in lines(events) if text in line["text"]), None)


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
    digest = hashlib.sha256((tmp_path / "coefficients.json").read_bytes()).hexdigest()
    assert last["file"].pop("modified_unix_s") <= last["unix_s"]
    assert last["file"] == {"revision": 8, "crc": last["crc"], "sha256": digest, "owner": 1000}
    assert first["file"]["revision"] == 7 and first["file"]["crc"] == first["crc"]


def test_a_refused_file_has_its_own_hash_and_the_sender_of_the_signal(plc, port, start_box, events, tmp_path):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--events", events) as box:
        plc.wait_mode(ACTIVE)
        machine.write_coefficients(tmp_path / "coefficients.json", port, lambda data: data.update(revision=6))
        box.send_signal(signal.SIGHUP)
        last = until(lambda: line_with("is older than the running one", events))
        (tmp_path / "coefficients.json").rename(tmp_path / "old.json")
        box.send_signal(signal.SIGHUP)
        unread = until(lambda: line_with("cannot be read", events))
    digest = hashlib.sha256((tmp_path / "old.json").read_bytes()).hexdigest()
    assert (last["file"]["sha256"], last["file"]["revision"], last["revision"]) == (digest, 6, 7)
    assert last["file"]["requested_by"] == {"user": 0, "pid": 1} and last["file"]["crc"] != last["crc"]
    assert "file" not in unread and all("file" not in line for line in lines(events) if line["kind"] == "mode")


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
