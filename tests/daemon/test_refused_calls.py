# SPDX-License-Identifier: MIT
"""A system call that fails costs what it was for. The box stays in its cycle and ends with its exit code."""
import errno
import signal

import pytest

import machine
from box import until
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc

# Calls about a file that is written again and again, and what its first failure costs.
WRITING = [("fsync", errno.EIO, "lags"), ("close", errno.EIO, "lags"), ("rename", errno.EACCES, "lags"),
           ("open", errno.EMFILE, "lags"), ("fsync", errno.EIO, "stats"), ("write", errno.ENOSPC, "stats"),
           ("rename", errno.EACCES, "stats"), ("open", errno.EMFILE, "stats"),
           ("write", errno.EINTR, "record"), ("write", errno.ENOSPC, "record"), ("read", errno.EINTR, "coefficients"),
           ("read", errno.EIO, "coefficients"), ("fstat", errno.EIO, "coefficients"),
           ("open", errno.EACCES, "coefficients"), ("ftruncate", errno.EIO, ""), ("lseek", errno.EIO, ""),
           ("stat", errno.EIO, "")]
# Calls to the PLC: one exchange or one connection.
EXCHANGING = [("recv", errno.EINTR), ("recv", errno.EAGAIN), ("recv", errno.ECONNRESET), ("recv", errno.ENOMEM),
              ("send", errno.EINTR), ("send", errno.EPIPE), ("ppoll", errno.EINTR), ("ppoll", errno.ENOMEM),
              ("poll", errno.EINTR), ("poll", errno.ENOMEM)]
# Calls at the end of the process, about files that are complete only then.
ENDING = [("close", errno.EIO, "record"), ("close", errno.EIO, "inputs"), ("close", errno.EIO, "stats"),
          ("write", errno.EIO, "record"), ("write", errno.EIO, "inputs"),
          ("write", errno.EIO, "stats"), ("fsync", errno.EIO, "stats"), ("rename", errno.EIO, "stats"),
          ("open", errno.EIO, "stats")]
# Calls at the start.
STARTING = [("ftruncate", errno.EIO, "inputs"), ("ftruncate", errno.EIO, "record"), ("open", errno.EACCES, "record"),
            ("open", errno.EACCES, "inputs"), ("fdopen", errno.ENOMEM, ""), ("socket", errno.EMFILE, ""),
            ("read", errno.EIO, "coefficients"), ("fstat", errno.EIO, "coefficients")]


def names(case):
    return "-".join(errno.errorcode[part] if isinstance(part, int) else part for part in case if part != "")


@pytest.mark.parametrize("case", WRITING, ids=names)
def test_a_file_that_cannot_be_read_or_written_once(stage, plc, port, start_box, tmp_path, case):
    call, error, path = case
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--state", tmp_path / "lags", "--state-every", "1") as box:
        plc.wait_mode(ACTIVE)
        stage.fail(call, error, path, times=1)
        stage.run_for(2)
        box.send_signal(signal.SIGHUP)
        stage.run_for(10)
        stage.heal()
        assert {step.mode for step in box.steps[-100:]} == {ACTIVE}
        box.stop()
    assert box.code == int("could not be written" in box.log), box.log  # rows, which nothing brings back


@pytest.mark.parametrize("case", EXCHANGING, ids=names)
def test_a_call_to_the_plc_that_fails_once(stage, plc, port, start_box, case):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.fail(*case, times=1)
        stage.run_for(5)
        stage.heal()
        assert box.runs, box.log
        until(lambda: plc.last().mode == ACTIVE)
        box.stop()
    assert box.code == 0, box.log


@pytest.mark.parametrize("case", ENDING, ids=names)
def test_a_file_that_cannot_be_ended_is_reported(stage, plc, port, start_box, case):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.fail(*case)
        box.stop()
    assert stage.failed
    assert "Input/output error" in box.log, box.log
    assert box.code == 1, box.log


@pytest.mark.parametrize("case", STARTING, ids=names)
def test_a_start_that_fails_ends_with_a_sentence_or_goes_on(stage, plc, port, start_box, tmp_path, case):
    for name in ("record.csv", "inputs.csv"):
        (tmp_path / name).write_text("of a box before it")
    plc.values = dict(AT_REST)
    stage.fail(*case, times=1)
    with RawPlc(plc, port), start_box() as box:
        until(lambda: not box.runs or (plc.writes and plc.last().mode == ACTIVE))
        if box.runs:
            box.stop()
        else:
            box.wait()
    assert box.code == 0 or "compboxd: " in box.log, box.log
    assert box.code in (0, 1), box.log


def test_names_with_quotes_and_new_columns(stage, plc, port, start_box, tmp_path):
    """Statistics stay JSON; a reload with another number of columns begins another record."""
    def quoted(data):
        data["machine"]["name"] = 'a "gantry" of \\ 14 m'

    def grown(data):
        quoted(data)
        data["revision"] += 1
        data["terms"].append(dict(data["terms"][0], name="MORE"))
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(change=quoted) as box:
        plc.wait_mode(ACTIVE)
        assert until(lambda: box.stats_file.exists() and box.stats)
        machine.write_coefficients(tmp_path / "coefficients.json", port, grown)
        box.send_signal(signal.SIGHUP)
        until(lambda: "revision 8 is running now" in box.log)
        box.stop()
    assert box.code == 0, box.log
