# SPDX-License-Identifier: MIT
"""Measurements by hand (--measured): signals that the file of `compbox measured` feeds."""
import machine
from box import until
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc
from steps import index_of


def with_hand(data):
    data["signals"] += [
        {"name": "probe_x", "unit": "um", "hand": "X", "min": -500, "max": 500},
        {"name": "probe_x_n", "unit": "1", "hand": "X", "part": "count", "min": 0, "max": 65535}]


def measured(box, path, um, count, age_s=0):
    """As compbox measured does: a file beside it, renamed over it."""
    new = path.with_name("measured.new")
    now_s = box.stage.ask("clocks")["wall"] // 10**9
    new.write_text(f"X {um} {count} {now_s - age_s}\n")
    new.rename(path)


def test_a_measurement_reaches_the_box_once(plc, port, start_box, tmp_path):
    plc.values, path = dict(AT_REST), tmp_path / "measured"
    with RawPlc(plc, port), start_box("--measured", path, change=with_hand) as box:
        plc.wait_mode(ACTIVE)
        measured(box, path, 4.25, 1)
        until(lambda: "measured by hand: X 4.25 um is taken" in box.log)
        box.stage.run_for(5)
        measured(box, path, -1.5, 2)
        until(lambda: "X -1.5 um is taken" in box.log)
        box.stage.run_for(5)
        box.stop()
    assert box.code == 0, box.log
    rows = [row for row in box.rows if row["probe_x_n"] is not None]
    found = sorted({(row["probe_x_n"], row["probe_x"]) for row in rows})
    assert found == [(0, 0), (1, 4.25), (2, -1.5)], "value and count come together"
    first = index_of(rows, lambda row: row["probe_x_n"] == 1)
    assert all(row["probe_x_n"] >= 1 for row in rows[first:]), "they stay fresh"
    assert box.stats["box"]["signals_stale"] == 0


def test_what_was_there_at_the_start_is_no_measurement(plc, port, start_box, tmp_path):
    plc.values, path = dict(AT_REST), tmp_path / "measured"
    path.write_text("X 40 7 1\n")
    with RawPlc(plc, port), start_box("--measured", path, change=with_hand) as box:
        plc.wait_mode(ACTIVE)
        box.stage.run_for(2)
        box.stop()
    assert box.code == 0 and "by hand" not in box.log
    assert {row["probe_x_n"] for row in box.rows} <= {0, None}


def test_an_old_one_and_a_wrong_file_are_refused_with_a_line(plc, port, start_box, tmp_path):
    plc.values, path = dict(AT_REST), tmp_path / "measured"
    with RawPlc(plc, port), start_box("--measured", path, change=with_hand) as box:
        plc.wait_mode(ACTIVE)
        measured(box, path, 4, 1, age_s=301)
        until(lambda: "is refused: it is older than 5 minutes; measure again" in box.log)
        path.write_text("X = 4\n")
        until(lambda: f"{path}: line 1 is not NAME UM COUNT TIME" in box.log)
        box.stage.fail("open", 13, str(path))
        measured(box, path, 4, 2)
        until(lambda: f"{path}: cannot be read, so no measurement is taken" in box.log)
        box.stage.heal()
        measured(box, path, 5, 3)
        until(lambda: "X 5 um is taken" in box.log)
        box.stop()
    assert box.code == 0, box.log
    assert {row["probe_x_n"] for row in box.rows} <= {0, 1, None}


def test_a_file_without_such_signals_is_left_alone(plc, port, start_box, tmp_path):
    plc.values, path = dict(AT_REST), tmp_path / "measured"
    with RawPlc(plc, port), start_box("--measured", path) as box:
        plc.wait_mode(ACTIVE)
        measured(box, path, 4, 1)
        box.stage.run_for(2)
        box.stop()
    assert box.code == 0 and "by hand" not in box.log
    assert not any(s["name"].startswith("probe") for s in machine.FILE["signals"])
