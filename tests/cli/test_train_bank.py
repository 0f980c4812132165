# SPDX-License-Identifier: MIT
"""compbox train without --lags: a bank of lags, whose values the box computes as the trainer does."""

import random

import pytest

from test_train import machine_with, rows_of_a_machine, write_rows

BANK = ("train", "rows.csv", "--outputs", "ez_um,ey_um", "--run-column", "run", "--hidden", "0",
        "--name", "net", "-o", "net.json")


def test_the_box_computes_what_the_trainer_predicts(compbox, machine):
    table = rows_of_a_machine()
    write_rows(compbox, table)
    text = compbox.good(*BANK, "--predictions", "p.csv")
    assert "50 of the box's 256 lags" in text and "rpm to its cube" in text
    term, = compbox.read("net.json")["terms"]
    bank = term["bank"]
    assert (term["type"], term["outputs"]) == ("linear", ["ez_um", "ey_um"])
    assert (bank["inputs"], bank["powers"]) == (["t1_degC", "t2_degC", "rpm"], {"rpm": [1, 2, 3]})
    assert len(bank["tau_s"]) == 11 and [len(row) for row in bank["weights"]] == [55, 55]
    assert bank["input_max"][0] == pytest.approx(max(row[2] for row in table), rel=1e-6)
    assert bank["margin"][0] == pytest.approx(bank["input_max"][0] - bank["input_min"][0], rel=1e-5)
    machine_with(compbox, machine, {"Z": ["ez_um"], "Y": ["ey_um"]})
    compbox.good("build", "machine.json", "net.json", "-o", "c.json")
    predicted = compbox.table("p.csv")
    for run in (1, 4):
        rows = [i for i, row in enumerate(table) if row[1] == run]
        samples = [[table[i][0] - table[rows[0]][0], 0, 0, 0, *table[i][2:5]] for i in rows]
        write_rows(compbox, samples, ("time_s", "X", "Y", "Z", "t1_degC", "t2_degC", "rpm"), "s.csv")
        compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
        out = compbox.table("out.csv")
        for name in ("ez_um", "ey_um"):
            want = [predicted[name + "_predicted"][i] for i in rows]
            assert out[name] == pytest.approx(want, abs=2e-3)
            assert max(want) - min(want) > 5


def test_every_column_that_may_be_an_input_is_one(compbox):
    table = [[*row, 5.0, 1e9 + row[0], 2 * row[5], row[3]] for row in rows_of_a_machine()]
    names = ("time (s)", "run", "t1(degC)", "t2 (degC)", "rpm", "ez(um)", "ey(um)", "door", "unix",
             "ex(um)", "a_name_that_no_box_has_room_for")
    write_rows(compbox, table, names)
    words = ["ez(um)" if word == "ez_um,ey_um" else word for word in BANK]
    text = compbox.good(*words)
    assert ("note: no input: ey (an error), door (never changes), unix (only rises, as a clock), "
            "ex (an error), a_name_that_no_box_has_room_for (no name for the box)") in text
    assert compbox.read("net.json")["terms"][0]["bank"]["inputs"] == ["t1", "t2", "rpm"]


def test_runs_without_a_column(compbox):
    """Pauses end a run; the lags begin with it, as those of the named runs do."""
    table = rows_of_a_machine()
    write_rows(compbox, table)
    named = [word for word in BANK if word not in ("--run-column", "run")]
    compbox.good(*BANK, "--inputs", "t1_degC,t2_degC,rpm")
    weights = compbox.read("net.json")["terms"][0]["bank"]["weights"]
    text = compbox.good(*named, "--inputs", "t1_degC,t2_degC")
    assert "note: no column of runs is named, so the table is cut at its 3 pauses" in text
    text = compbox.good(*named, "--inputs", "t1_degC,t2_degC,rpm", "--speeds", "t1_degC")
    assert compbox.read("net.json")["terms"][0]["bank"]["powers"] == {"t1_degC": [1, 2, 3]}
    write_rows(compbox, [[row[0], row[1], *row[2:4], 1e-9 * i, *row[5:]] for i, row in enumerate(table)])
    compbox.good(*BANK, "--inputs", "t1_degC,t2_degC")
    assert len(weights[0]) == 55


def test_a_table_without_time_has_no_lags(compbox):
    rows = [row[1:] for row in rows_of_a_machine()]
    write_rows(compbox, rows, ("run", "t1_degC", "t2_degC", "rpm", "ez_um", "ey_um"))
    compbox.good(*BANK)
    assert compbox.read("net.json")["terms"][0]["bank"]["tau_s"] == [0]


def test_logs_that_begin_at_zero(compbox):
    """The shop is colder in each run; the logger begins at zero. Absolute temperatures would teach the
    season; with an offset for each run they teach the warm-up."""
    dice = random.Random(6)
    table = rows_of_a_machine(runs=8)
    for run in range(8):
        rows = [row for row in table if row[1] == run + 1]
        seasons, ez, ey = (dice.gauss(0, 6), dice.gauss(0, 6)), rows[0][5], rows[0][6]
        for row in rows:
            row[2] += seasons[0]
            row[3] += seasons[1]
            row[5] -= ez
            row[6] -= ey
    write_rows(compbox, table)
    left = {}
    for how in ((), ("--zero-at-start",)):
        compbox.good(*BANK, *how, "--hold-out", "7,8", "--accept-worse")
        left[how] = compbox.read("net.json")["provenance"]["net"]["written"]["held_out"]["ez_um"]["rms"]
    assert left["--zero-at-start",] < 0.5 and left["--zero-at-start",] < 0.7 * left[()]
    assert compbox.refused(*BANK, "--zero-at-start", "--hold-out", "1,2,3,4,5,6").startswith(
        "rows.csv: --zero-at-start needs at least three runs to train on")


def test_two_hundred_inputs_fit_the_box(compbox):
    dice = random.Random(4)
    share = [dice.uniform(0.2, 1) for _ in range(200)]
    table = []
    for row in rows_of_a_machine(rows=40):
        rise, slow = row[2] - 20, row[3] - 20
        sensors = [20 + s * rise + (1 - s) * slow + dice.gauss(0, 0.05) for s in share]
        table.append([*row[:2], *sensors, *row[4:]])
    names = ("time_s", "run", *(f"t{i}_degC" for i in range(200)), "rpm", "ez_um", "ey_um")
    write_rows(compbox, table, names)
    text = compbox.good(*BANK)
    bank = compbox.read("net.json")["terms"][0]["bank"]
    assert len(bank["inputs"]) <= 64
    assert (len(bank["inputs"]) + 2) * (len(bank["tau_s"]) - 1) <= 256
    assert "note: 201 inputs have no room for 4 lags each among the box's 256, so 61 that differ most" in text
    left = compbox.read("net.json")["provenance"]["net"]["written"]["left_out"]["ez_um"]
    assert left["worst_percent_of_largest"] < 15


@pytest.mark.parametrize("more, message", [
    (("--speeds", "t9"), "--speeds names 't9', which is not among the inputs"),
    (("--outputs", "ez_um,ey_um", "--inputs", "x*"), "rows.csv: no column matches x*"),
])
def test_refused(compbox, more, message):
    write_rows(compbox, rows_of_a_machine(rows=30))
    words = list(BANK)
    for name, value in zip(more[::2], more[1::2]):
        words = words[:words.index(name)] + words[words.index(name) + 2:] if name in words else words
        words += [name, value]
    assert compbox.refused(*words) == message
