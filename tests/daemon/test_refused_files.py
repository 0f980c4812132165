# SPDX-License-Identifier: MIT
"""A call about one of the box's own files fails: a start ends with a sentence, a run goes on, no old file is lost."""
import errno
import json
import signal

import pytest

import machine
from box import run, until
from machine import ACTIVE, AT_REST, RAMP
from raw_plc import RawPlc
from test_record import kept, rows_of

OPTIONS = {"--snapshot": "snapshot.json", "--events": "events.jsonl", "--blackbox": "blackbox"}


@pytest.fixture
def served(plc, port):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port):
        yield plc


@pytest.mark.parametrize("name", ["stats.json", "record.csv", "inputs.csv", *OPTIONS.values()])
def test_a_file_that_cannot_be_opened_ends_the_start(stage, served, start_box, tmp_path, name):
    (tmp_path / "blackbox").mkdir()
    stage.fail("access" if name == "blackbox" else "open", errno.EROFS, name)
    with start_box(*[word for option, file in OPTIONS.items() for word in (option, tmp_path / file)]) as box:
        box.wait()
    assert box.code == 1 and f"{name}: cannot be written: Read-only file system" in box.log, box.log
    assert not served.writes


def test_inputs_that_cannot_be_emptied_end_the_start(stage, port, tmp_path):
    config = machine.write_coefficients(tmp_path / "coefficients.json", port)
    inputs = tmp_path / "inputs.csv"
    inputs.write_text("of a box before it")
    stage.fail("ftruncate", errno.EIO, "inputs")
    code, log = run("--config", config, "--record-inputs", inputs)
    assert code == 1 and "inputs.csv: cannot be written: Input/output error" in log
    assert inputs.read_text() == "of a box before it"


# Two seeks and a read find the end of the last line.
@pytest.mark.parametrize("call, skipped", [("lseek", 0), ("lseek", 1), ("read", 0)])
def test_events_whose_last_line_cannot_be_read_end_the_start(stage, start_box, tmp_path, call, skipped):
    events = tmp_path / "events.jsonl"
    events.write_text('{"unix_s": 17')
    stage.fail(call, errno.EIO, "events", skipped=skipped)
    with start_box("--events", events) as box:
        box.wait()
    assert box.code == 1 and "events.jsonl: cannot be written: Input/output error" in box.log
    assert events.read_text() == '{"unix_s": 17'


def test_events_that_can_neither_be_written_nor_opened_again_are_counted(stage, served, start_box, tmp_path):
    events = tmp_path / "events.jsonl"
    with start_box("--events", events) as box:
        served.wait_mode(ACTIVE)
        before = events.read_text()
        for call, error in [("write", errno.ENOSPC), ("ftruncate", errno.EIO), ("open", errno.EMFILE)]:
            stage.fail(call, error, "events")
        served.heartbeat_alive = False
        served.wait_mode(RAMP)
        assert {call for call, _ in stage.failed} == {"write", "ftruncate", "open"}
        stage.heal()
        served.heartbeat_alive = True
        served.wait_mode(ACTIVE)
        box.stop()
    text = events.read_text()
    assert box.code == 0 and text.startswith(before)
    assert json.loads(text[len(before):].splitlines()[0])["lost_before"] >= 2, "HOLD and RAMP"


def test_an_interrupted_read_of_the_record_is_repeated(stage, served, start_box):
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    before = box.record_file.read_text()
    stage.fail("read", errno.EINTR, "record", times=2)
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    assert len(stage.failed) == 2 and list(kept(box)) == ["record.csv"]
    assert box.record_file.read_text().startswith(before)


@pytest.mark.parametrize("skipped", [0, 1])     # the header, the last rows
def test_a_record_that_cannot_be_read_is_kept_beside_another(stage, served, start_box, skipped):
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    before = box.record_file.read_text()
    stage.fail("read", errno.EIO, "record", times=1, skipped=skipped)
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0 and kept(box)["record.csv.1"].decode() == before
    assert len(rows_of(box.record_file.read_text())) == box.stats["cycles"]


def test_a_torn_row_that_cannot_be_cut_ends_the_start(stage, served, start_box):
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    torn = box.record_file.read_text() + "60.0,1,2"
    box.record_file.write_text(torn)
    stage.fail("ftruncate", errno.EIO, "record")
    with start_box() as box:
        box.wait()
    assert box.code == 1 and "record.csv: cannot be written: Input/output error" in box.log
    assert kept(box) == {"record.csv": torn.encode()}


def test_old_records_that_cannot_be_renamed_are_not_overwritten(stage, start_box):
    box = start_box()
    for end in ("", ".1"):
        box.record_file.with_name("record.csv" + end).write_text("notes" + end)
    stage.fail("rename", errno.EACCES, "record.csv.1")
    with box:
        box.wait()
    assert box.code == 1 and "record.csv: cannot be written: Permission denied" in box.log
    assert kept(box) == {"record.csv": b"notes", "record.csv.1": b"notes.1"}


def test_an_interrupted_read_does_not_end_a_compression(stage, served, start_box):
    with start_box("--record-most", "1") as box:
        served.wait_mode(ACTIVE)
        stage.fail("read", errno.EINTR, "record.csv.1", times=3)
        until(lambda: len(stage.failed) == 3)
        until(lambda: "record.csv.1.gz" in kept(box))
        box.stop()
    assert box.code == 0 and "cannot be written" not in box.log


def test_an_old_record_whose_size_cannot_be_read_does_not_cost_the_newer_ones(stage, served, start_box):
    box = start_box("--record-most", "1")
    box.record_file.write_text("of another file\n")     # put aside at the start, before eight others
    for number in range(1, 9):
        box.record_file.with_name(f"record.csv.{number}.gz").write_bytes(bytes(95000))
    stage.fail("lstat", errno.EIO, "record.csv.9.gz", times=1, skipped=2)   # that of the ninth, on its removal
    with box:
        served.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0 and len(stage.failed) == 1
    assert {f"record.csv.{number}.gz" for number in range(2, 10)} <= set(kept(box))


@pytest.mark.parametrize("call, path", [("lstat", "000007"), ("readdir", "")])
def test_a_black_box_that_cannot_read_its_folder_takes_no_number_twice(stage, served, start_box, tmp_path, call, path):
    folder = tmp_path / "blackbox"
    folder.mkdir()
    (folder / "000007-20260101T000000Z-HOLD.csv").write_text("an older file")
    with start_box("--blackbox", folder) as box:
        served.wait_mode(ACTIVE)
        stage.fail(call, errno.EIO, path, times=1)
        box.send_signal(signal.SIGUSR1)
        until(lambda: "blackbox: cannot be written: Input/output error" in box.log)
        box.send_signal(signal.SIGUSR1)
        until(lambda: "black box:" in box.log)
        box.stop()
    assert box.code == 0 and len(stage.failed) == 1 and f"black box: {folder}/000008-" in box.log
