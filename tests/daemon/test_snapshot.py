# SPDX-License-Identifier: MIT
"""--snapshot: what other programs learn about the box, and what the file costs when it cannot be written."""
import errno
import json
import zlib

import pytest

from box import until
from machine import ACTIVE, AT_REST, PERIOD_S, wanted_um
from raw_plc import RawPlc


@pytest.fixture
def snapshot(tmp_path):
    return tmp_path / "snapshot.json"


def now(snapshot):
    return json.loads(snapshot.read_text())


def by_name(entries):
    return {entry["name"]: entry for entry in entries}


def test_it_says_what_the_box_reads_wants_and_writes(stage, plc, port, start_box, snapshot, tmp_path):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", snapshot) as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(2)
        shown = now(snapshot)
        assert (shown["snapshot"], shown["machine"], shown["revision"]) == (1, "test gantry", 7)
        assert shown["crc"] == f"{zlib.crc32((tmp_path / 'coefficients.json').read_bytes()):08x}"
        assert (shown["mode"], shown["reason"], shown["cause"]) == ("ACTIVE", "all is well", None)
        signals = by_name(shown["signals"])
        for name, value in AT_REST.items():
            assert abs(signals[name]["value"] - value) < 1e-3
            assert signals[name]["state"] == "fresh" and 0 <= signals[name]["age_ms"] <= 1000 * PERIOD_S
        assert [signals[name]["unit"] for name in ("X", "T1")] == ["mm", "degC"]
        terms, z = by_name(shown["terms"]), by_name(shown["channels"])["Z"]
        assert abs(z["demand_um"] + sum(terms[name]["value"] for name in z["terms"])) < 1e-3
        assert z["terms"] == ["EZX", "EZY", "GROW"]
        assert abs(z["output_um"] - plc.last().um["Z"]) < 0.006 and abs(z["demand_um"] - wanted_um(AT_REST)["Z"]) < 0.01
        assert z["applied_um"] is None and z["limit_um"] == 300 and not z["slewed"]
        assert abs(z["limit_used"] - abs(z["output_um"]) / 300) < 1e-6
        assert shown["exchange_us"]["up_to"]["100000"] == shown["exchange_us"]["count"] > 50
        box.stop()
        assert now(snapshot)["finished"] and now(snapshot)["mode"] == "STOPPED"


@pytest.mark.parametrize("every_ms", [100, 200, 1000])
def test_it_is_written_as_often_as_asked(stage, plc, port, start_box, snapshot, every_ms):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", snapshot, "--snapshot-every", every_ms):
        plc.wait_mode(ACTIVE)
        cycles = []
        for _ in range(10):
            before = snapshot.modified_ns
            until(lambda: snapshot.modified_ns != before, every_s=0.01)
            cycles.append((snapshot.modified_ns - before) / 1e6)
        assert all(every_ms <= gap <= every_ms + 60 for gap in cycles[1:]), cycles


def test_a_heartbeat_that_stops_is_a_cause_within_a_second(stage, plc, port, start_box, snapshot):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", snapshot):
        plc.wait_mode(ACTIVE)
        plc.heartbeat_alive = False
        begin_s = stage.now_s
        until(lambda: now(snapshot)["mode"] in ("HOLD", "RAMP"), every_s=0.02)
        assert stage.now_s - begin_s <= 0.2 + 1
        assert now(snapshot)["reason"] == "the PLC's heartbeat does not change"


def test_a_signal_that_is_implausible_is_named(plc, port, start_box, snapshot):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", snapshot):
        plc.wait_mode(ACTIVE)
        plc.values["X"] = 20000
        until(lambda: now(snapshot)["cause"], every_s=0.02)
        shown = now(snapshot)
        assert shown["cause"] == {"text": "signal X reads 20000 mm and its max is 14300", "of": "signal", "name": "X",
                                  "value": 20000, "bound": 14300}
        x = by_name(shown["signals"])["X"]
        assert x["state"] in ("refused", "stale") and abs(x["value"] - AT_REST["X"]) < 1e-3 and x["implausible"] > 0


def test_before_the_first_contact_nothing_is_claimed(start_box, snapshot, stage):
    with start_box("--snapshot", snapshot):
        stage.run_for(1)
        shown = now(snapshot)
    assert shown["mode"] == "STANDBY" and shown["reason"] == "the PLC does not reply"
    assert all(signal["state"] == "never" and signal["value"] is None and signal["age_ms"] is None
               for signal in shown["signals"])
    assert all(channel["output_um"] == 0 for channel in shown["channels"])


def test_a_path_that_cannot_be_written_is_one_sentence_at_the_start(start_box):
    with start_box("--snapshot", "/nowhere/s.json") as box:
        box.wait()
    assert box.code == 1 and "/nowhere/s.json: cannot be written: No such file or directory" in box.log


@pytest.mark.parametrize("call", ["open", "write", "rename"])
def test_a_disk_that_refuses_keeps_the_old_one_and_the_box(stage, plc, port, start_box, snapshot, call):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--snapshot", snapshot) as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(1)
        before = now(snapshot)["counters"]["cycles"]
        stage.fail(call, errno.ENOSPC, "snapshot")
        stage.run_for(3)
        assert now(snapshot)["counters"]["cycles"] <= before + 10
        assert box.log.count("snapshot.json: cannot be written: No space left on device") == 1
        assert plc.last().mode == ACTIVE
        stage.heal()
        until(lambda: "snapshot.json: is written again" in box.log)
        assert now(snapshot)["counters"]["cycles"] > before + 50
        box.stop()
    assert box.code == 0, box.log
