# SPDX-License-Identifier: MIT
"""compbox train: what it writes is what the box computes, and what it refuses."""

import csv
import json
import math
import random

import numpy
import pytest

COLUMNS = ("time_s", "run", "t1_degC", "t2_degC", "rpm", "ez_um", "ey_um")


def rows_of_a_machine(runs=4, rows=60, bend=0.0, seed=3):
    """Warm-ups at several speeds: temperatures that lag behind the speed, an error that lags behind
    the temperatures. Returns rows like COLUMNS; times are not evenly spaced."""
    dice = random.Random(seed)
    table = []
    for run in range(runs):
        rpm, t1, t2, slow, time = 0.0, 20.0, 20.0, 20.0, 100000.0 * run
        for row in range(rows):
            if row % 20 == 0:
                rpm = dice.uniform(0, 5000)
            step = dice.uniform(20, 60)
            t1 += (20 + 0.004 * rpm - t1) * step / 900 + dice.gauss(0, 0.01)
            t2 += (20 + 0.002 * rpm - t2) * step / 2500 + dice.gauss(0, 0.01)
            slow += (t1 - slow) * step / 600
            ez = 4 * (slow - 20) - 2 * (t2 - 20) + bend * math.tanh(t1 - 27) + dice.gauss(0, 0.05)
            table.append([round(time, 3), run + 1, t1, t2, rpm, ez, -0.5 * ez])
            time += step
    return table


def write_rows(compbox, table, names=COLUMNS, file="rows.csv"):
    lines = [",".join(names)] + [",".join(map(repr, row)) for row in table]
    return compbox.write(file, "\n".join(lines) + "\n")


def machine_with(compbox, machine, sums):
    for i, name in enumerate(("t1_degC", "t2_degC", "rpm")):
        machine["signals"].append({"name": name, "unit": name[-4:], "plc": 16 + 2 * i,
                                   "type": "float32", "min": -100, "max": 10000,
                                   "max_age_ms": 86400000})
    for channel in machine["channels"]:
        channel["sum"] = sums.get(channel["name"], [])
    machine["channels"] = [c for c in machine["channels"] if c["sum"]]
    machine["cycle"]["period_ms"] = 1000
    machine["plc"]["heartbeat_timeout_ms"] = 5000
    return compbox.write("machine.json", machine)


TRAIN = ("train", "rows.csv", "--outputs", "ez_um,ey_um", "--inputs", "t*_degC,rpm", "--lags",
         "600,1800", "--squares", "rpm", "--run-column", "run", "--name", "net", "--hidden", "4",
         "--starts", "2", "--iterations", "60", "-o", "net.json")


@pytest.mark.parametrize("more", [(), ("--keep-network",), ("--keep-network", "--no-linear-path"),
                                  ("--keep-network", "--activation", "logsig"), ("--hidden", "0"),
                                  ("--regularise", "evidence", "--keep-network"),
                                  ("--regularise", "evidence", "--keep-network", "--optimiser",
                                   "levenberg-marquardt")])
def test_the_box_computes_what_the_trainer_predicts(compbox, machine, more):
    table = rows_of_a_machine(bend=8.0)
    write_rows(compbox, table)
    options = [o for o in TRAIN]
    if "--hidden" in more:
        options[options.index("--hidden") + 1] = "0"
        more = ()
    compbox.good(*options, *more, "--predictions", "p.csv")
    machine_with(compbox, machine, {"Z": ["ez_um"], "Y": ["ey_um"]})
    compbox.good("build", "machine.json", "net.json", "-o", "c.json")
    predicted = compbox.table("p.csv")
    for run in (1, 4):  # the box starts anew with each, as the lags do
        rows = [i for i, row in enumerate(table) if row[1] == run]
        samples = [[table[i][0] - table[rows[0]][0], 0, 0, 0, *table[i][2:5]] for i in rows]
        write_rows(compbox, samples, ("time_s", "X", "Y", "Z", "t1_degC", "t2_degC", "rpm"), "s.csv")
        done = compbox("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
        assert (done.returncode, done.stderr) == (0, "")
        out = compbox.table("out.csv")
        for name in ("ez_um", "ey_um"):
            want = [predicted[name + "_predicted"][i] for i in rows]
            assert out[name] == pytest.approx(want, abs=2e-4)
            assert max(want) - min(want) > 5
        assert out["comp_Z_um"] == pytest.approx([-v for v in out["ez_um"]], abs=1e-6)


def test_lagged_inputs_find_a_lagged_error(compbox):
    write_rows(compbox, rows_of_a_machine())
    left = {}
    for lags in ("600", ""):
        options = [o for o in TRAIN if o not in ("--lags", "600,1800", "--squares")]
        options.remove("rpm")
        more = ["--lags", lags] if lags else ["--keep-network"]  # without both it is a bank
        compbox.good(*options, *more)
        found = compbox.read("net.json")["provenance"]["net"]
        left[lags] = found["linear"]["left_out"]["ez_um"]["rms"]
    assert left["600"] < 0.2 * left[""]


def rows_of_a_screw(runs=8, rows=40, seed=5):
    """A screw that grows with t1 (tanβ), a column that bends behind rpm, a wall that yields by the
    cube of the height: one record over all runs, rows probed in the middle of each only. Returns
    record and probed rows."""
    dice = random.Random(seed)
    record, probed, slow, t1, time = [[0.0, 50.0, 0.0, 20.0, 0.0]], [], 0.0, 20.0, 0.0
    for run in range(runs):
        for rpm, steps in ((dice.uniform(0, 5000), 60), (dice.uniform(1000, 5000), rows), (0, 30)):
            for step in range(steps):
                dt = dice.uniform(20, 40)
                time += dt
                t1 += (20 + 0.003 * rpm - t1) * dt / 1200
                slow += (rpm - slow) * (1 - math.exp(-dt / 1800))
                x, z = 50.0 + 300.0 * (step % 10) / 9, 40.0 * dice.random()
                record.append([round(time, 3), x, z, t1 + dice.gauss(0, 0.005), rpm])
                if steps == rows:
                    e = 0.01 * slow + 11e-3 * (t1 - 20) * (x - 100) + 30 * (z / 40) ** 3
                    probed.append([round(time, 3), f"part {run + 1}", *record[-1][1:],
                                   round(e + dice.gauss(0, 0.05), 3)])
    return record, probed


SCREW_RANGES = (("X", 0, 400), ("Z", 0, 40), ("t1", 10, 60), ("rpm", 0, 5000))
SCREW = ("train", "probed.csv", "--outputs", "error_X_um", "--inputs", "X,Z,t1,rpm", "--lags",
         "1800", "--lag-only", "rpm", "--run-column", "run", "--name", "net", "--starts", "1",
         "--hidden", "6", "--iterations", "200", "-o", "net.json")
WITH_ALL = ("--record", "record.csv", "--slope", "X:t1", "--hidden-inputs", "Z*",
            "--keep-network")


def write_screw(compbox):
    record, probed = rows_of_a_screw()
    write_rows(compbox, record, ("time_s", "X", "Z", "t1", "rpm"), "record.csv")
    lines = ["time_s,run,X,Z,t1,rpm,error_X_um"] + [",".join(map(str, r)) for r in probed]
    compbox.write("probed.csv", "\n".join(lines) + "\n")
    return record, probed


def left_of_screw(compbox, *more):
    compbox.good(*SCREW, *more)
    return compbox.read("net.json")["provenance"]["net"]["network"]["left_out"]["error_X_um"]["rms"]


def test_record_slope_and_hidden_inputs_each_help(compbox):
    write_screw(compbox)
    everything = left_of_screw(compbox, *WITH_ALL)
    assert everything < 0.6
    assert everything < 0.5 * left_of_screw(compbox, *WITH_ALL[2:])  # lags from the rows alone
    assert everything < 0.5 * left_of_screw(compbox, *WITH_ALL[:2], *WITH_ALL[4:])  # no slope


def screw_machine(compbox, machine):
    """The machine file for the screw: its four inputs, channel X alone, a period of 1 s."""
    machine["signals"] = [{"name": n, "unit": "mm" if i < 2 else "1", "plc": 8 + 2 * i, "type": "float32",
                           "min": low, "max": high, "max_age_ms": 86400000}
                          for i, (n, low, high) in enumerate(SCREW_RANGES)]
    machine["channels"] = [c for c in machine["channels"] if c["name"] == "X"]
    machine["channels"][0]["sum"] = None
    machine["cycle"]["period_ms"] = 1000
    machine["plc"]["heartbeat_timeout_ms"] = 5000
    compbox.write("machine.json", machine)


def box_and_predictions(compbox, record, probed):
    """What the box computes at the probed rows, and what train predicted there (p.csv)."""
    compbox.good("eval", "c.json", "--inputs", "record.csv", "--raw", "-o", "out.csv")
    out, at = compbox.table("out.csv"), {row[0]: i for i, row in enumerate(record)}
    lines = (compbox.folder / "p.csv").read_text().splitlines()[1:]
    predicted = [float(line.split(",")[-1]) for line in lines]
    return [-out["comp_X_um"][at[row[0]]] for row in probed], predicted


def test_the_box_computes_slopes_and_the_memory_of_a_record(compbox, machine):
    record, probed = write_screw(compbox)
    compbox.good(*SCREW, *WITH_ALL, "--predictions", "p.csv")
    screw_machine(compbox, machine)
    printed = compbox.good("build", "machine.json", "net.json", "-o", "c.json")
    assert "channel X = -(error_X_um + error_X_um_by_X)" in printed
    computed, predicted = box_and_predictions(compbox, record, probed)
    assert computed == pytest.approx(predicted, abs=2e-3)
    assert max(computed) - min(computed) > 20
    fragment = compbox.read("net.json")
    net, slopes, product = fragment["terms"]
    assert slopes["inputs"] == ["t1"] and slopes["outputs"] == ["error_X_um_per_X"]
    assert (product["signal"], product["origin"]) == ("X", 200)
    seen = [i for i, name in enumerate(net["inputs"]) if name == "Z"]
    for row in net["hidden_weights"]:
        assert all((w != 0) == (i in seen) for i, w in enumerate(row))


def test_slopes_along_a_product_of_positions(compbox, machine):
    """The wall yields by the cube of the height times a load: linear along Z, Z*Z and Z*Z*Z."""
    record, probed = write_screw(compbox)
    for row in probed:
        row[-1] += 8e-3 * (row[5] - 2000) * (row[3] / 40) ** 3 * (row[2] / 350) ** 2
    lines = ["time_s,run,X,Z,t1,rpm,error_X_um"] + [",".join(map(str, r)) for r in probed]
    compbox.write("probed.csv", "\n".join(lines) + "\n")
    linear = ["0" if word == "6" else word for word in SCREW]
    more = ("--record", "record.csv", "--slope", "X:t1", "--predictions", "p.csv")
    rms = []
    for slopes in (("Z",), ("Z", "Z*Z", "Z*Z*Z", "X*Z", "X*Z*Z", "X*X*Z", "X*X*Z*Z")):
        words = [word for slope in slopes for word in ("--slope", slope + ":rpm,Z")]
        compbox.good(*linear, *more, *words)
        rms.append(compbox.read("net.json")["provenance"]["net"]["linear"]["left_out"]["error_X_um"]["rms"])
    assert rms[1] < 0.2 * rms[0]
    terms = {term["name"]: term for term in compbox.read("net.json")["terms"]}
    assert terms["net_per_XXZ"]["inputs"] == ["rpm", "Z", "X"]
    assert terms["error_X_um_XXZ_2"]["term"] == "error_X_um_XXZ_1"
    assert (terms["error_X_um_by_XXZ"]["term"], terms["error_X_um_by_XXZ"]["signal"]) == ("error_X_um_XXZ_2", "Z")
    screw_machine(compbox, machine)
    printed = compbox.good("build", "machine.json", "net.json", "--accept-range", "-o", "c.json")
    assert "error_X_um_by_XXZ" in printed and "error_X_um_XXZ_1" not in printed
    computed, predicted = box_and_predictions(compbox, record, probed)
    assert computed == pytest.approx(predicted, abs=1e-2)


SCREW_REFUSED = {
    "no such input": (("--slope", "X:t9"), "--slope names 't9', which is not among the inputs"),
    "no such factor": (("--slope", "X*Y:t1"), "--slope names 'Y', which is not among the inputs"),
    "no such position": (("--slope", "Y:t1"), "--slope names 'Y', which is not among the inputs"),
    "margin of nothing": (("--margin-of", "Q*:2"), "--margin-of: no input is called 'Q*'"),
    "unseen": (("--hidden-inputs", "Q*"), "--hidden-inputs: no input is called 'Q*'"),
    "other record": (("--record", "short.csv"), "short.csv: does not reach to time_s "),
    "record without input": (("--record", "bare.csv"), "bare.csv:1: there is no column 'X'"),
    "record goes back": (("--record", "back.csv"), "back.csv:3: time_s must rise from row to row"),
}


@pytest.mark.parametrize("case", SCREW_REFUSED)
def test_refused_beside_a_record(compbox, case):
    more, message = SCREW_REFUSED[case]
    write_screw(compbox)
    names = ("time_s", "X", "Z", "t1", "rpm")
    write_rows(compbox, [[1, 2, 3, 4, 5], [2, 2, 3, 4, 5]], names, "short.csv")
    write_rows(compbox, [[2, 2, 3, 4, 5], [1, 2, 3, 4, 5]], names, "back.csv")
    write_rows(compbox, [[1], [2]], ("time_s",), "bare.csv")
    assert compbox.refused(*SCREW, *more).startswith(message)


def test_margins_of_some_inputs(compbox):
    write_screw(compbox)
    compbox.good(*SCREW, "--margin", "0.5", "--margin-of", "t1,Z:3", "--margin-of", "Z:0")
    term = compbox.read("net.json")["terms"][0]
    parts = {name: m / (b - a) for name, a, b, m in zip(
        term["inputs"], term["input_min"], term["input_max"], term["margin"])}
    assert parts == pytest.approx({"X": 0.5, "Z": 0.0, "t1": 3.0, "rpm": 0.5, "rpm_lag1800": 0.5},
                                  abs=1e-5)


def test_a_pattern_names_the_inputs_of_a_slope(compbox):
    """Only t1 begins with t, so X:t* is X:t1."""
    write_screw(compbox)
    words = ["0" if word == "6" else word for word in SCREW]
    compbox.good(*words, "--slope", "X:t1")
    named = compbox.read("net.json")["terms"]
    compbox.good(*words, "--slope", "X:t*")
    assert compbox.read("net.json")["terms"] == named
    assert compbox.refused(*words, "--slope", "X:q*") == "--slope names 'q*', which is not among the inputs"


def test_slope_names_that_the_box_cannot_take(compbox):
    _, probed = write_screw(compbox)
    lines = ["time_s,run,X,Z,t1,rpm,deviation_of_the_tool"] + [",".join(map(str, r)) for r in probed]
    compbox.write("probed.csv", "\n".join(lines) + "\n")
    words = [w.replace("error_X_um", "deviation_of_the_tool") for w in SCREW]
    assert compbox.refused(*words, "--slope", "X:t1").startswith(
        "--slope: the box has no room for the name 'deviation_of_the_tool_per_X'")


def test_the_fragment(compbox):
    table = rows_of_a_machine()
    write_rows(compbox, table)
    text = compbox.good(*TRAIN, "--hold-out", "2,3", "--json")
    fragment = compbox.read("net.json")
    assert json.loads(text) == fragment
    assert [s["name"] for s in fragment["signals"]] == [
        "t1_degC_lag600", "t2_degC_lag600", "rpm_lag600", "t1_degC_lag1800", "t2_degC_lag1800",
        "rpm_lag1800", "rpm_sq", "rpm_sq_lag600", "rpm_sq_lag1800"]
    assert fragment["signals"][8] == {"name": "rpm_sq_lag1800", "unit": "1", "lag_of": "rpm",
                                      "tau_s": 1800.0, "power": 2}
    term, = fragment["terms"]
    assert term["outputs"] == ["ez_um", "ey_um"]
    assert term["inputs"][:3] == ["t1_degC", "t2_degC", "rpm"] and len(term["inputs"]) == 12
    learnt = numpy.array([row for row in table if row[1] in (1, 4)])
    assert term["input_min"][:3] == pytest.approx(learnt[:, 2:5].min(axis=0), rel=1e-6)
    assert term["input_max"][:3] == pytest.approx(learnt[:, 2:5].max(axis=0), rel=1e-6)
    found = fragment["provenance"]["net"]
    assert found["runs"] == ["1", "2", "3", "4"] and found["runs_held_out"] == ["2", "3"]
    assert found["linear"]["held_out"]["ez_um"]["rms"] > 0
    assert found["decay_by"] == "evidence"  # two runs are left to train on


def test_report_says_what_is_better(compbox):
    write_rows(compbox, rows_of_a_machine())
    text = compbox.good(*TRAIN)
    assert "linear map" in text and "network" in text
    assert "Residuals of each run when left out of training" in text
    write_rows(compbox, rows_of_a_machine(bend=60.0, rows=120))
    assert "the network is better" in compbox.good(*TRAIN)


def test_same_seed_same_file_whatever_the_threads(compbox):
    write_rows(compbox, rows_of_a_machine(bend=8.0))
    files = []
    for threads in (1, 2, 5):
        compbox.good(*TRAIN, "--threads", threads)
        files.append((compbox.folder / "net.json").read_bytes())
    assert files[0] == files[1] == files[2]


def test_words_name_runs(compbox):
    table = [[row[0], "warm" if row[1] % 2 else "cold", *row[2:]] for row in rows_of_a_machine()]
    lines = [",".join(COLUMNS)] + [",".join(map(str, row)) for row in table]
    compbox.write("rows.csv", "\n".join(lines) + "\n")
    compbox.good(*TRAIN)
    assert compbox.read("net.json")["provenance"]["net"]["runs"] == ["warm", "cold", "warm#2",
                                                                    "cold#2"]


def test_interleaved_runs_are_runs(compbox):
    """Six loggers that write into one table by turns: what the runs themselves say, in the order of
    the file; no run is a single row."""
    table = rows_of_a_machine(runs=6, rows=40)
    for i, row in enumerate(table):
        row[0] -= table[i - i % 40][0]
    write_rows(compbox, table)
    compbox.good(*TRAIN, "--predictions", "sorted.csv")
    apart = compbox.read("net.json")
    turns = sorted(range(240), key=lambda i: (i % 40, i))
    write_rows(compbox, [table[i] for i in turns])
    text = compbox.good(*TRAIN, "--predictions", "turns.csv")
    note = "run changes 239 times between 6 values, so all rows of a value are taken for one run"
    assert "6 runs" in text and "note: " + note in text
    mixed = compbox.read("net.json")
    assert mixed["provenance"]["net"]["warnings"].pop(0) == note
    apart["provenance"]["net"].setdefault("warnings", [])
    assert mixed == apart
    a, b = compbox.table("sorted.csv"), compbox.table("turns.csv")
    for name in ("run", "ez_um", "ez_um_predicted"):
        assert b[name] == [a[name][i] for i in turns]
    assert compbox.refused(*TRAIN, "--lags-start", "once") == (
        "rows.csv: rows of the runs stand between each other, so they are not one record: choose "
        "--lags-start run")


def test_short_stretches_of_one_record_stay_in_order(compbox):
    table = [[10.0 * i, 1 + i // 5 % 3, *row[2:]] for i, row in enumerate(rows_of_a_machine())]
    write_rows(compbox, table)
    text = compbox.good(*TRAIN, "--lags-start", "once")
    assert "run changes 47 times between 3 values" in text
    assert compbox.read("net.json")["provenance"]["net"]["runs"] == ["1", "2", "3"]


def test_predictions_name_the_runs(compbox):
    table = [[row[0], ("a,b", "cold")[row[1] % 2], *row[2:]] for row in rows_of_a_machine()]
    lines = [",".join(COLUMNS)] + [",".join([str(row[0]), f'"{row[1]}"', *map(str, row[2:])])
                                   for row in table]
    compbox.write("rows.csv", "\n".join(lines) + "\n")
    compbox.good(*TRAIN, "--predictions", "p.csv")
    with open(compbox.folder / "p.csv", newline="") as file:
        runs = [row["run"] for row in csv.DictReader(file)]
    assert runs[::60] == ["cold", "a,b", "cold#2", "a,b#2"] and len(runs) == 240


@pytest.mark.parametrize("value", [0.0, 3.5])
def test_a_standing_output_is_refused(compbox, value):
    table = rows_of_a_machine(rows=30)
    for row in table:
        row[6] = value
    write_rows(compbox, table)
    sentence = "rows.csv: the output 'ey_um' never changes, so nothing can be learnt from it: leave it out"
    assert compbox.refused(*TRAIN) == sentence
    assert compbox.refused("select-inputs", "rows.csv", "--outputs", "ey_um", "--candidates",
                           "t1_degC,t2_degC") == sentence
    table[0][6] = value + 1.0
    write_rows(compbox, table)
    assert compbox.refused(*TRAIN, "--hold-out", "1") == (
        "rows.csv: the output 'ey_um' does not change in the runs trained on: leave it out")


def test_plot(compbox):
    write_rows(compbox, rows_of_a_machine())
    compbox.good(*TRAIN, "--plot", "f.svg")
    picture = (compbox.folder / "f.svg").read_text()
    assert "ez_um" in picture and "model that never saw this run" in picture


def changed(row, column, value):
    def change(table):
        table[row][column] = value
    return change


REFUSED = {
    "no output": (None, ("--outputs", "dz"), "rows.csv:1: there is no column 'dz' (there are time_s, run, "
                  "t1_degC, t2_degC, rpm, ez_um, ey_um)"),
    "no match": (None, ("--inputs", "x*"), "rows.csv: no column matches x*"),
    "twice": (None, ("--inputs", "rp*,r*m"), "rows.csv: the column 'rpm' is named twice"),
    "both sides": (None, ("--inputs", "rpm,ez_um"),
                   "rows.csv: the column 'ez_um' is both input and output"),
    "no run column": (None, ("--run-column", "step"), "rows.csv:1: there is no column 'step'"),
    "no such run": (None, ("--hold-out", "9"),
                    "rows.csv: has no run '9' to hold out (it has 1, 2, 3, 4)"),
    "all held out": (None, ("--hold-out", "1,2,3,4"),
                     "rows.csv: has fewer than 10 rows left to train on: hold out less"),
    "no time column": (None, ("--time-column", "t"), "rows.csv:1: there is no column 't'"),
    "no square": (None, ("--squares", "t9"), "--squares names 't9', which is not among the inputs"),
    "no lag": (None, ("--lag-only", "t9"), "--lag-only names 't9', which is not among the inputs"),
    "too many inputs": (None, ("--lags", ",".join(map(str, range(1, 23)))),
                        "rows.csv: gives 92 inputs with their lags; the box takes 64: choose fewer "
                        "(compbox select-inputs) or fewer lags"),
    "time back": (changed(31, 0, -1.0), (), "rows.csv:33: time_s must rise from row to row; where "
                  "another run begins, name the column of runs with --run-column"),
    "text": (changed(5, 3, "warm"), (), "rows.csv:7:"),
    "nan": (changed(5, 3, math.nan), (), "rows.csv:7:"),
    "too few runs": (None, ("--hold-out", "1,2", "--regularise", "runs"), "rows.csv: "
                     "cross-validation needs at least three runs to train on: name the column of "
                     "runs with --run-column, or choose --regularise evidence"),
    "bad term name": (None, ("--name", "n e t"), "--name: the box cannot use the name 'n e t'"),
    "bad figure": (None, ("--plot", "f.txt"), "f.txt: a figure is written as .svg, .png or .pdf"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(compbox, case):
    change, more, message = REFUSED[case]
    table = rows_of_a_machine(rows=30)
    if change:
        change(table)
    write_rows(compbox, table)
    options = list(TRAIN)
    for name, value in zip(more[::2], more[1::2]):
        if name in options:
            options[options.index(name) + 1] = value
        else:
            options += [name, value]
    assert compbox.refused(*options).startswith(message)


def test_columns_with_units_in_brackets(compbox):
    """ "ez (mm)" is converted to um, and its term is called ez."""
    table = rows_of_a_machine()
    write_rows(compbox, table)
    compbox.good(*TRAIN)
    plain = compbox.read("net.json")["terms"][0]
    names = ("t (ms)", "run", "t1(degC)", "t2 [degC]", "spindle(1/min)", "ez (mm)", "ey(nm)")
    rows = [[row[0] * 1e3, *row[1:5], row[5] * 1e-3, row[6] * 1e3] for row in table]
    write_rows(compbox, rows, names)
    words = {"ez_um,ey_um": "ez (mm),ey(nm)", "t*_degC,rpm": "t1(degC),t2 [degC],spindle(1/min)",
             "rpm": "spindle(1/min)"}
    compbox.good(*[words.get(word, word) for word in TRAIN], "--time-column", "t (ms)")
    term = compbox.read("net.json")["terms"][0]
    assert term["outputs"] == ["ez", "ey"]
    assert term["inputs"][:4] == ["t1", "t2", "spindle", "t1_lag600"]
    assert numpy.array(term["linear_weights"]) == pytest.approx(
        numpy.array(plain["linear_weights"]), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("column", [2, 5])
def test_a_glitch_is_named_and_not_learnt(compbox, column):
    """A thermometer that reads 85 degC once, an error of 900 um once: what is learnt is what the rows
    without them teach."""
    table = rows_of_a_machine()
    write_rows(compbox, table)
    compbox.good(*TRAIN)
    right = compbox.read("net.json")["provenance"]["net"]["linear"]["left_out"]["ez_um"]
    wrong = [list(row) for row in table]
    wrong[100][column] = (85.0, 900.0)[column == 5]
    write_rows(compbox, wrong)
    text = compbox.good(*TRAIN)
    found = compbox.read("net.json")["provenance"]["net"]
    assert found["linear"]["left_out"]["ez_um"]["worst"] == pytest.approx(right["worst"], rel=0.02)
    assert found["rows"] == 239
    assert any(f"glitch: {COLUMNS[column]} jumps to {wrong[100][column]:.6g} at "
               f"{wrong[100][0]:.9g} s (line 102), from " in note for note in found["warnings"])
    assert "check the sensor and its cable" in text
    report = compbox.good("select-inputs", "rows.csv", "--outputs", "ez_um", "--candidates",
                          "t1_degC,t2_degC,rpm", "--run-column", "run")
    assert f"note: glitch: {COLUMNS[column]} jumps to" in report


def test_a_model_that_is_worse_than_nothing_is_refused(compbox):
    """The error of each run depends on another sensor, with another sign: no run predicts another."""
    dice = random.Random(8)
    table = [[60.0 * i, 1 + i // 40, 20 + dice.gauss(0, 1), 20 + dice.gauss(0, 1), 0, 0, 0]
             for i in range(160)]
    for row in table:
        row[4] = 100 * dice.random()
        row[5] = (3 if row[1] % 2 else -3) * (row[2] - 20) + (-1) ** row[1] * 2
        row[6] = 0.5 * (row[3] - 20)
    write_rows(compbox, table)
    words = ["0" if word == "4" else word for word in TRAIN]
    message = compbox.refused(*words)
    assert message.startswith("rows.csv: on runs left out the model is worse than no compensation for "
                              "ez_um (") and message.endswith("write it with --accept-worse")
    assert "ey_um" not in message and "net.json" not in compbox.files()
    assert "note: on runs left out the model is worse" in compbox.good(*words, "--accept-worse")
    assert compbox.read("net.json")["terms"][0]["outputs"] == ["ez_um", "ey_um"]
    words[words.index("ez_um,ey_um")] = "ey_um"
    compbox.good(*words)


def test_a_standing_input_is_refused(compbox):
    table = rows_of_a_machine(rows=30)
    for row in table:
        row[3] = 20.0
    write_rows(compbox, table)
    assert compbox.refused(*TRAIN) == ("rows.csv: the input 't2_degC' never changes, so nothing can "
                                       "be learnt from it: leave it out")


@pytest.mark.parametrize("more", [("--hidden", "65"), ("--lags", "0"), ("--lags", "a"),
                                  ("--activation", "relu"), ("--starts", "0"), ("--bogus",),
                                  ("--lag-only", "rpm"), ("--lags", "60", "--lags-start", "once"),
                                  ("--lags", "60", "--zero-at-start"),
                                  ("--squares", "rpm", "--speeds", "rpm"),
                                  ("--hidden", "0", "--no-linear-path"),
                                  ("--optimiser", "levenberg-marquardt"),
                                  ("--margin-of", "rpm"), ("--margin-of", "rpm:-1"),
                                  ("--record", "rows.csv", "--keep-network"), ("--slope", "rpm"),
                                  ("--slope", "rpm:rpm", "--no-linear-path")])
def test_wrong_usage(compbox, more):
    write_rows(compbox, rows_of_a_machine(rows=30))
    done = compbox("train", "rows.csv", "--outputs", "ez_um", "--inputs", "rpm", "--name", "net",
                   "-o", "net.json", *more)
    assert done.returncode == 2 and done.stderr
    assert "net.json" not in compbox.files()


WRONG = {
    ("train", "--activation", "relu"): "--activation: must be one of logsig, tansig, not relu",
    ("train", "--regularise", "x"): "--regularise: must be one of auto, evidence, runs, not x",
    ("train", "--lags-start", "0"): "--lags-start: must be one of both, once, run, not 0",
    ("train", "--seed", "-1"): "--seed: must be a whole number from 0 to 9223372036854775807, not -1",
    ("select-inputs", "--method", "k"): "--method: must be one of c-means, closure, not k",
    ("plan", "--criterion", "e"): "--criterion: must be one of a, d, mean-cv, not e",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_choice_lists_the_choices(compbox, words):
    done = compbox(*words)
    assert done.returncode == 2 and done.stderr.startswith("compbox: " + WRONG[words])


def test_help_has_an_example(compbox):
    assert "Example:\n  compbox train " in compbox.good("train", "--help")


def test_an_input_in_a_unit_too_large_says_so(compbox):
    """A strain in m/m: it changes, but by less than what a scale in the coefficient file can say."""
    table = rows_of_a_machine()
    write_rows(compbox, [[*row[:3], row[3] * 1e-9, *row[4:]] for row in table])
    assert compbox.refused(*TRAIN) == (
        "rows.csv: the input 't2_degC' changes by less than 4e-6 in the runs trained on: "
        "give it in a smaller unit, or leave it out")
