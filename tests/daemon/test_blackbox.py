# SPDX-License-Identifier: MIT
"""--blackbox: full rate around HOLD and FAULT and on request, bounded, and without harm to the cycle."""
import csv
import errno
import io
import re
import signal

import pytest

from box import until
from machine import ACTIVE, AT_REST, HOLD, RAMP
from raw_plc import RawPlc


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "blackbox"
    made.mkdir()
    return made


@pytest.fixture
def served(plc, port):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port):
        yield plc


def files_of(box, folder):
    """Rows of each file that the log names, by its word."""
    names = re.findall(r"black box: /box/blackbox/(\S+)", box.log)
    return [(name, list(csv.DictReader(io.StringIO((folder / name).read_text())))) for name in names]


def test_a_hold_leaves_every_row_around_it(stage, served, start_box, folder):
    with start_box("--blackbox", folder) as box:
        served.wait_mode(ACTIVE)
        stage.run_for(20)
        served.heartbeat_alive = False
        served.wait_mode(RAMP)
        stage.run_for(15)
        box.stop()
    (name, rows), = files_of(box, folder)
    assert re.fullmatch(r"000001-\d{8}T\d{6}Z-HOLD\.csv", name)
    held = [k for k, row in enumerate(rows) if float(row["mode"]) == HOLD]
    assert held and held[0] > 600, "20 s before it"
    recorded = {row["unix_s"]: row for row in csv.DictReader(io.StringIO(box.record_file.read_text()))}
    common = [(row, recorded[row["unix_s"]]) for row in rows if row["unix_s"] in recorded]
    assert len(common) > 0.99 * len(rows)
    assert all({**row, "time_s": ""} == {**other, "time_s": ""} for row, other in common), "columns of the record"
    assert float(rows[-1]["time_s"]) - float(rows[held[0]]["time_s"]) == pytest.approx(10, abs=0.1)
    assert box.code == 0


def test_a_disk_that_holds_the_thread_costs_no_row(stage, served, start_box, folder):
    """From before the end of the file to behind it."""
    with start_box("--blackbox", folder) as box:
        served.wait_mode(ACTIVE)
        served.heartbeat_alive = False
        served.wait_mode(HOLD)
        stage.run_for(9)
        stage.hang("write", "record", 2.5, times=1)
        stage.run_for(6)
        box.stop()
    (_, rows), = files_of(box, folder)
    held = next(row for row in rows if float(row["mode"]) == HOLD)
    assert float(rows[-1]["time_s"]) - float(held["time_s"]) == pytest.approx(10, abs=0.1)


def test_a_request_by_a_signal_and_an_end(stage, served, start_box, folder):
    with start_box("--blackbox", folder) as box:
        served.wait_mode(ACTIVE)
        box.send_signal(signal.SIGUSR1)
        until(lambda: "REQUEST.csv" in box.log)
        box.send_signal(signal.SIGUSR1)
        stage.run_for(1)
        box.stop()
    assert box.code == 0 and (folder / files_of(box, folder)[0][0]).exists()


def test_without_a_black_box_the_signal_is_harmless(stage, served, start_box):
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.send_signal(signal.SIGUSR1)
        stage.run_for(1)
        assert box.runs
        box.stop()
    assert box.code == 0


def test_a_folder_that_is_not_there_ends_the_start(start_box, tmp_path):
    with start_box("--blackbox", tmp_path / "nowhere") as box:
        box.wait()
    assert box.code == 1 and "nowhere: cannot be written: No such file or directory" in box.log


@pytest.mark.parametrize("call", ["open", "write", "fsync", "close", "rename", "opendir"])
def test_a_file_that_cannot_be_written_is_reported_and_the_next_one_is(stage, served, start_box, folder, call):
    with start_box("--blackbox", folder) as box:
        served.wait_mode(ACTIVE)
        stage.fail(call, errno.EIO, "blackbox")
        box.send_signal(signal.SIGUSR1)
        until(lambda: "blackbox: cannot be written: Input/output error" in box.log)
        stage.heal()
        stage.run_for(15)
        box.send_signal(signal.SIGUSR1)
        until(lambda: "REQUEST.csv" in box.log)
        assert {step.mode for step in box.steps[-100:]} == {ACTIVE}
        box.stop()
    assert box.code == 0 and "blackbox: is written again" in box.log
    assert len(files_of(box, folder)[0][1]) > 700, "rows from before the failure"
