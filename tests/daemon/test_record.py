# SPDX-License-Identifier: MIT
"""--record: kept across restarts, power cuts, wrong clocks and full disks."""
import errno
import gzip
import math
import pathlib
import re

import pytest

from box import until
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc


@pytest.fixture
def served(plc, port):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port):
        yield plc


def rows_of(text):
    """Rows of a record, each as {column: text}; all are whole."""
    names, *rows = [line.split(",") for line in text.splitlines()]
    assert text.endswith("\n") and all(len(row) == len(names) for row in rows)
    return [dict(zip(names, row)) for row in rows]


def times_of(text):
    return [float(row["time_s"]) for row in rows_of(text)]


def test_a_restart_goes_on_in_the_file(stage, served, start_box):
    with start_box() as box:
        served.wait_mode(ACTIVE)
        stage.run_for(3)
        box.kill()
    before = box.record_file.read_text()
    stage.run_for(20)
    with start_box() as box:
        served.wait_mode(ACTIVE)
        stage.run_for(3)
        box.stop()
    text = box.record_file.read_text()
    assert text.startswith(before) and not box.record_file.with_name("record.csv.1").exists()
    times = times_of(text)
    assert times == sorted(set(times)), "no time twice, and none goes back"
    pause = max(b - a for a, b in zip(times, times[1:]))
    assert 20 <= pause < 22, "the pause is in the times"
    rows = rows_of(text)
    assert {round(float(row["unix_s"]) - float(row["time_s"]), 2) for row in rows[5:]} == \
        {round(float(rows[0]["unix_s"]) - times[0], 2)}


def test_a_power_cut_leaves_whole_rows_and_the_next_start_goes_on(stage, plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(3)
        stage.cut_power(5)
    left = box.record_file.read_text() if box.record_file.exists() else ""
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    text = box.record_file.read_text()
    whole = left[:left.rfind("\n") + 1]
    kept = box.record_file.with_name("record.csv.1")
    assert text.startswith(whole) or kept.read_text() == left
    assert times_of(text) == sorted(set(times_of(text)))


def test_a_clock_that_is_wrong_until_the_network_comes(stage, served, start_box):
    """A clock of the past at the start: another file. The clock is set in the run: the times go on evenly."""
    with start_box() as box:
        served.wait_mode(ACTIVE)
        box.stop()
    before = box.record_file.read_text()
    stage.set_clock(-86400, synchronised=False)
    with start_box() as box:
        served.wait_mode(ACTIVE)
        stage.set_clock(86400)
        stage.run_for(3)
        box.stop()
    assert box.record_file.with_name("record.csv.1").read_text() == before
    rows = rows_of(box.record_file.read_text())
    steps = [float(b["time_s"]) - float(a["time_s"]) for a, b in zip(rows, rows[1:])]
    walls = [float(b["unix_s"]) - float(a["unix_s"]) for a, b in zip(rows, rows[1:])]
    assert max(steps) < 1 and max(walls) > 86000
    assert float(rows[-1]["unix_s"]) > float(rows_of(before)[-1]["unix_s"])


def test_what_cannot_be_kept_is_not_overwritten(stage, served, start_box):
    box = start_box()
    box.record_file.write_text("an operator's notes")
    stage.fail("rename", errno.EACCES, "record")
    with box:
        box.wait()
    assert box.code == 1 and "record.csv: cannot be written: Permission denied" in box.log
    assert box.record_file.read_text() == "an operator's notes"


def test_old_and_new_files_follow_each_other(stage, served, start_box):
    box = start_box()
    box.record_file.write_text("an operator's notes")
    with box:
        until(lambda: box.record_file.with_name("record.csv.1").exists())
        box.stop()
    assert box.record_file.with_name("record.csv.1").read_text() == "an operator's notes"
    assert len(box.rows) == box.stats["cycles"]


def test_an_interval_of_rows(stage, served, start_box):
    with start_box("--record-every", "1000") as box:
        served.wait_mode(ACTIVE)
        stage.run_for(30)
        box.stop()
    rows = rows_of(box.record_file.read_text())
    modes = [row["mode"] for row in rows]
    assert 30 <= len(rows) <= 45 and box.stats["records_lost"] == 0
    assert {"0", "1", "3", "5"} <= set(modes), "each mode has its row"


def kept(box):
    """{name: bytes} of what is kept beside the record, and of it; the newest first."""
    found = {}
    for n in range(100):
        for name in (f"record.csv.{n}", f"record.csv.{n}.gz") if n else ("record.csv",):
            if box.record_file.with_name(name).exists():
                found[name] = box.record_file.with_name(name).read_bytes()
    return found


def all_rows(found):
    """Rows of all files, the oldest first."""
    pieces = [gzip.decompress(data) if name.endswith(".gz") else data for name, data in found.items()]
    return [row for piece in reversed(pieces) for row in rows_of(piece.decode())]


def test_all_records_together_have_a_limit_and_old_ones_are_compressed(stage, served, start_box):
    with start_box("--record-most", "1") as box:
        served.wait_mode(ACTIVE)
        most = 0
        for _ in range(20):
            stage.run_for(15)
            most = max(most, sum(map(len, kept(box).values())))
        box.stop()
    found = kept(box)
    assert most <= 1_000_000 and len(found["record.csv"]) <= 125_000
    assert len(found) > 5 and sum(name.endswith(".gz") for name in found) >= len(found) - 2
    times = [float(row["time_s"]) for row in all_rows(found)]
    assert times == sorted(set(times)) and len(times) == box.stats["cycles"], "no row is missing in between"
    assert box.code == 0 and box.stats["records_lost"] == 0


def test_a_full_disk_loses_no_old_record(stage, served, start_box):
    with start_box("--record-most", "1") as box:
        served.wait_mode(ACTIVE)
        stage.fail("write", errno.ENOSPC, ".gz.new")
        stage.run_for(60)
        assert "record.csv.gz.new: cannot be written: No space left on device" in box.log
        assert not any(name.endswith(".gz") for name in kept(box))
        stage.heal()
        stage.run_for(30)
        box.stop()
    assert "record.csv.gz.new: is written again" in box.log and box.code == 0
    found = kept(box)
    assert any(name.endswith(".gz") for name in found) and len(all_rows(found)) == box.stats["cycles"]


@pytest.mark.parametrize("call, path", [("rename", "record.csv"), ("open", "record.csv"), ("write", "record.csv")])
def test_a_rotation_that_failed_is_tried_again_calmly(stage, served, start_box, call, path):
    """Also a new file whose header does not fit: rows never begin without one."""
    with start_box("--record-most", "1") as box:
        served.wait_mode(ACTIVE)
        stage.run_for(10)
        stage.fail(call, errno.ENOSPC, path)
        stage.run_for(60)
        tries = len(stage.failed)
        stage.run_for(60)
        assert call == "write" or 5 <= len(stage.failed) - tries <= 14, "one or two calls in ten seconds"
        stage.heal()
        stage.run_for(60)
        box.stop()
    assert box.log.count("record.csv: rows are lost: No space left on device") == 1, box.log
    assert box.log.count("record.csv: is written again") == 1, box.log
    rows = all_rows(kept(box))
    assert len(rows) + box.stats["records_lost"] == box.stats["cycles"] and box.stats["records_lost"] > 0
    assert float(rows[-1]["time_s"]) > 180, "the record goes on, with the same zero of time"


@pytest.mark.parametrize("call", ["rename", "unlink", "fsync", "open", "read"])
def test_a_call_of_a_compression_that_fails(stage, served, start_box, call):
    with start_box("--record-most", "1") as box:
        served.wait_mode(ACTIVE)
        stage.fail(call, errno.EIO, "record.csv.1" if call in ("unlink", "open", "read") else ".gz.new", times=1)
        stage.run_for(60)
        assert stage.failed
        box.stop()
    rows = all_rows({name: data for name, data in kept(box).items() if name + ".gz" not in kept(box)})
    assert len(rows) == box.stats["cycles"] and box.code == 0, box.log


def test_a_power_cut_loses_no_kept_record(stage, plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box("--record-most", "1") as box:
        plc.wait_mode(ACTIVE)
        until(lambda: box.record_file.with_name("record.csv.gz.new").exists())
        stage.run_for(0.05)
        before = rows_of(kept(box)["record.csv.1"].decode())
        stage.cut_power(5)
    with RawPlc(plc, port), start_box("--record-most", "1") as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(10)
        box.stop()
    rows = all_rows(kept(box))
    assert [row for row in rows if row in before] == before
    assert not box.record_file.with_name("record.csv.gz.new").exists()


def test_the_page_states_what_the_packages_service_writes_a_day(stage, served, start_box):
    """A machine whose axes always move, as the unit records it."""
    root = pathlib.Path(__file__).resolve().parents[2]
    unit, page = (root / "packaging/compboxd.service").read_text(), (root / "docs/record.md").read_text()
    served.motion = lambda t: {"X": 3000 + 2900 * math.sin(t / 7), "Y": 200 + 190 * math.sin(t / 5),
                               "Z": 1500 + 400 * math.sin(t / 3), "T1": 350 + 20 * math.sin(t / 900)}
    every_ms = re.search(r"--record-every (\d+)", unit)[1]
    with start_box("--record-every", every_ms) as box:
        served.wait_mode(ACTIVE)
        stage.run_for(600)
        box.stop()
    text = box.record_file.read_text()
    span_s = times_of(text)[-1]
    day_mb = len(text) * 86400 / span_s / 1e6
    packed_mb = day_mb * len(gzip.compress(text.encode(), 6)) / len(text)
    stated = [float(number) for number in re.search(r"\| ([\d.]+) MB \| ([\d.]+) MB \|", page).groups()]
    assert stated == [pytest.approx(day_mb, rel=0.1), pytest.approx(packed_mb, rel=0.1)], (day_mb, packed_mb)
