# SPDX-License-Identifier: MIT
"""A system call that fails costs what it was for. The box stays in its cycle and ends with its exit code."""
import errno
import signal

import pytest

import machine
from box import until
from machine import ACTIVE, AT_REST, HOLD, PERIOD_S
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
# Calls at the start; those about its own files: test_refused_files.py.
STARTING = [("fdopen", errno.ENOMEM, ""), ("socket", errno.EMFILE, ""), ("read", errno.EIO, "coefficients"),
            ("fstat", errno.EIO, "coefficients"), ("getaddrinfo", errno.ENOMEM, "")]


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


def test_a_disk_that_becomes_read_only_stops_no_loop_and_all_files_come_back(stage, plc, port, start_box, tmp_path):
    plc.values = dict(AT_REST)
    (tmp_path / "blackbox").mkdir()
    files = {name: tmp_path / name for name in ("snapshot", "events", "state")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    with RawPlc(plc, port), start_box(*options, "--blackbox", tmp_path / "blackbox", "--state-every", "1",
                                      "--record-most", "1") as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(5)
        held = stage.held()
        for call in ("open", "write", "rename", "unlink", "ftruncate", "fsync"):
            stage.fail(call, errno.EROFS, str(tmp_path))
        first = plc.last().heartbeat
        plc.heartbeat_alive = False
        plc.wait_mode(HOLD)
        plc.heartbeat_alive = True
        plc.wait_mode(ACTIVE)
        stage.run_for(60)
        assert plc.last().heartbeat - first >= 60 / PERIOD_S, "no cycle is missing"
        stage.heal()
        healed_s = stage.now_s
        stage.run_for(60)
        for path in (*files.values(), box.record_file):
            assert path.modified_ns > 0 and path.read_bytes(), path
            assert f"{path}: is written again" in box.log, path
        assert stage.held()[0] <= held[0] + 1, "descriptors"
        assert plc.last().mode == ACTIVE and stage.now_s > healed_s
        box.stop()
    assert box.stats["overruns"] == 0 and box.log.count("Read-only file system") < 20, box.log


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
def test_a_start_that_fails_ends_with_a_sentence_or_goes_on(stage, plc, port, start_box, case):
    plc.values = dict(AT_REST)
    stage.fail(*case, times=1)
    with RawPlc(plc, port), start_box() as box:
        until(lambda: not box.runs or (plc.writes and plc.last().mode == ACTIVE))
        assert stage.failed
        if box.runs:
            box.stop()
        else:
            box.wait()
    assert box.code == 0 or "compboxd: " in box.log, box.log
    assert box.code in (0, 1), box.log


def test_a_gap_ends_the_record_of_inputs(stage, plc, port, start_box):
    """Rows behind it could not be replayed."""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(3)                                    # until some rows are on the disk
        stage.fail("write", errno.ENOSPC, "inputs", times=1)
        until(lambda: stage.failed)
        stage.run_for(20)
        box.stop()
    assert box.code == 1 and "inputs.csv: cannot be written: No space left on device" in box.log, box.log
    rows = box.inputs_file.read_text().split("written\n")[1].split("\n")
    numbers = [int(row.split(",")[0]) for row in rows[:-2]]     # the last one may be cut off
    assert numbers == list(range(len(numbers))) and numbers


def test_rows_lost_at_the_start_do_not_move_the_time_of_the_others(stage, plc, port, start_box):
    plc.values = dict(AT_REST)
    stage.fail("write", errno.ENOSPC, "record", times=5, skipped=1)     # the header is written
    with RawPlc(plc, port), start_box() as box:
        until(lambda: len(stage.failed) == 5)
        stage.run_for(2)
        box.stop()
    assert box.code == 1, box.log
    assert 0.2 < box.rows[0]["time_s"] < 1, "by the first cycle, which is lost"
    assert box.stats["records_lost"] > 0


@pytest.mark.parametrize("call, error, words", [("rename", errno.EACCES, "Permission denied"),
                                                ("open", errno.EMFILE, "Too many open files")])
def test_a_record_that_cannot_follow_another_file_ends_and_is_reported(stage, plc, port, start_box, tmp_path, call,
                                                                       error, words):
    def grown(data):
        data["revision"] += 1
        data["terms"].append(dict(data["terms"][0], name="MORE"))
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.fail(call, error, "record")
        machine.write_coefficients(tmp_path / "coefficients.json", port, grown)
        until(lambda: "revision 8 is running now" in box.log)
        stage.run_for(3)
        assert plc.last().mode == ACTIVE
        box.stop()
    assert f"record.csv: cannot be written: {words}" in box.log
    assert box.code == 1 and box.stats["records_lost"] > 50, "rows are missing"


# Two calls of one end fail: the first is the cause, and is the one that is reported.
@pytest.mark.parametrize("first, second, path", [("write", "close", "record"), ("fsync", "close", "stats"),
                                                 ("write", "close", "stats")])
def test_the_first_failure_of_an_end_is_reported(stage, plc, port, start_box, first, second, path):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.fail(first, errno.ENOSPC, path)
        stage.fail(second, errno.EIO, path)
        box.stop()
    assert box.code == 1, box.log
    assert "No space left on device" in box.log and "Input/output error" not in box.log, box.log


def test_the_first_failure_of_the_state_file_is_reported(stage, plc, port, start_box, tmp_path):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--state", tmp_path / "lags", "--state-every", "1") as box:
        plc.wait_mode(ACTIVE)
        stage.fail("fsync", errno.ENOSPC, "lags")
        stage.fail("close", errno.EIO, "lags")
        until(lambda: "lags: cannot be written: No space left on device" in box.log)
        stage.heal()
        until(lambda: "lags: is written again" in box.log)
        box.stop()
    assert box.code == 0, box.log


# The stream is longer than its buffer, so a part of it is written before its end.
def test_statistics_with_a_gap_do_not_replace_the_ones_before(stage, plc, port, start_box):
    def wordy(data):
        data["machine"]["name"] = "m" * 39
    plc.values = dict(AT_REST)
    with RawPlc(plc, port) as server, start_box(change=wordy) as box:
        for _ in range(20):                                 # changes of mode make them long
            plc.wait_mode(ACTIVE)
            server.answering = False
            stage.run_for(0.6)
            server.answering = True
        plc.wait_mode(ACTIVE)
        stage.run_for(6)
        assert len(box.stats_file.read_text()) > 4096
        stage.fail("write", errno.ENOSPC, "stats", times=1)
        until(lambda: "stats.json: cannot be written: No space left on device" in box.log)
        assert box.stats["mode"] == "ACTIVE"
        box.stop()
    assert box.code == 0, box.log


CANNOT = "compboxd: cannot start the loop: "


@pytest.mark.parametrize("call, error, words, sentence", [
    ("pthread_create", errno.EINVAL, ["--cpu", "1"], "--cpu 1: this processor is not available to this program"),
    ("pthread_create", errno.EINVAL, [], CANNOT + "Invalid argument"),
    ("pthread_create", errno.EAGAIN, ["--cpu", "1"], CANNOT + "Resource temporarily unavailable"),
    ("pthread_attr_setaffinity_np", errno.ENOMEM, ["--cpu", "1", "--priority", "50"],
     CANNOT + "Cannot allocate memory")])
def test_a_loop_that_cannot_be_started_names_the_cause(stage, start_box, call, error, words, sentence):
    stage.fail(call, error, skipped=2 if call == "pthread_create" else 0)   # two threads are started before it
    with start_box(*words) as box:
        box.wait()
    assert box.code == 1 and sentence in box.log, box.log


@pytest.mark.parametrize("stream, error, journal", [("0:0", 0, True), ("1:0", 0, False), ("0:1", 0, False),
                                                    ("none", 0, False), ("0:0", errno.EIO, False)])
def test_only_the_journal_gets_lines_without_time_and_name(stage, start_box, stream, error, journal):
    if error:
        stage.fail("fstat", error, "stderr")
    with start_box(env={"JOURNAL_STREAM": stream}) as box:
        until(lambda: "revision 7" in box.log)
        box.stop()
    line = next(line for line in box.log.split("\n") if "revision 7" in line)
    assert line.startswith("compboxd: ") != journal, line


def test_an_interrupted_call_does_not_end_the_wait_for_a_connection_that_is_left(stage, plc, port, start_box):
    """A PLC that became too slow: the box closes behind its last write, and waits until the PLC does so too."""
    left, meanwhile = [], []

    class Watching(RawPlc):
        def closed(self, link):
            if not left and link.open:          # by its end of the stream
                left.append(link)
                stage.fail("recv", errno.EINTR, times=1)
                stage.after(0.1, lambda: meanwhile.append("behind its last write" in box.log))
                stage.after(0.3, self._serve)
            super().closed(link)

        def _leave(self):
            if meanwhile or not left:
                super()._leave()
    plc.values = dict(AT_REST)
    with Watching(plc, port, lambda request, reply: [0.020, reply] if request.number > 20 else None) as server, \
            start_box() as box:
        until(lambda: len(meanwhile) == 1)
        until(lambda: "behind its last write" in box.log and server.connections > 1)
        box.stop()
    assert ["recv", "tcp"] in [list(one) for one in stage.failed]
    assert meanwhile == [False], box.log


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
