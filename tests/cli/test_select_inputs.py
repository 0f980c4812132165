# SPDX-License-Identifier: MIT
"""compbox select-inputs as a user calls it: report, JSON, and what it refuses."""

import math
import random

import pytest

COLUMNS = ("time_s", "run", "t1", "t2", "t3", "t4", "rpm", "ez_um")


@pytest.fixture
def rows(compbox):
    """t1 and t2 tell one story, t3 and t4 another; the error follows both."""
    lines = [",".join(COLUMNS)]
    for i in range(240):
        a, b = math.sin(0.05 * i), math.cos(0.083 * i)
        wobble = 0.05 * math.sin(7.3 * i)
        lines.append(",".join(map(repr, (10.0 * i, i // 60, 20 + a, 25 + 2 * a + wobble, 30 + b,
                                         31 - b + wobble, 1000 + 50 * math.sin(0.2 * i),
                                         5 * a + 3 * b))))
    return compbox.write("rows.csv", "\n".join(lines) + "\n")


SELECT = ("select-inputs", "rows.csv", "--outputs", "ez_um", "--candidates", "t*")


def candidates(*names):
    """SELECT with these candidates."""
    return SELECT[:-1] + (",".join(names),)


def test_chooses_one_of_each_cluster(compbox, rows):
    report = compbox.good(*candidates("t1", "t2", "t3", "t4"), "--count", 2, "-o", "c.json")
    choice = compbox.read("c.json")
    assert [c["cluster"] for c in choice["candidates"]] == [1, 1, 2, 2]
    grade = {c["name"]: c["grade"] for c in choice["candidates"]}
    best = [max(pair, key=grade.get) for pair in (("t1", "t2"), ("t3", "t4"))]
    assert choice["chosen"] == best and choice["clusters"] == 2
    assert report.splitlines()[-1] == "--inputs " + ",".join(best)
    assert report.count("<- chosen") == 2


def test_a_pattern_is_neither_time_nor_run_nor_output(compbox, rows):
    for pattern, names in (("t*", ["t1", "t2", "t3", "t4"]), ("*", ["t1", "t2", "t3", "t4", "rpm"])):
        compbox.good(*candidates(pattern), "--run-column", "run", "--count", 2, "-o", "c.json")
        assert [c["name"] for c in compbox.read("c.json")["candidates"]] == names
    compbox.good(*candidates("time_s", "t*"), "--count", 2, "-o", "c.json")  # named, it is one
    assert compbox.read("c.json")["candidates"][0]["name"] == "time_s"


def test_what_it_prints_trains(compbox, rows):
    report = compbox.good(*candidates("t1", "t2", "t3", "t4"), "--count", 2, "--keep", "rpm")
    option, inputs = report.splitlines()[-1].split()
    assert option == "--inputs" and inputs.endswith(",rpm") and inputs.count(",") == 2
    compbox.good("train", "rows.csv", "--outputs", "ez_um", option, inputs, "--run-column", "run",
                 "--hidden", 0, "--name", "net", "-o", "net.json")


def test_train_takes_the_choice_from_its_file(compbox, rows):
    compbox.good(*SELECT, "--count", 2, "--keep", "rpm", "-o", "c.json")
    chosen = compbox.read("c.json")["inputs"]
    assert chosen == compbox.read("c.json")["chosen"] + ["rpm"]
    train = ("train", "rows.csv", "--outputs", "ez_um", "--run-column", "run", "--hidden", 0, "--name", "net", "-o",
             "net.json")
    compbox.good(*train, "--inputs", ",".join(chosen))
    named = compbox.read("net.json")["terms"]
    compbox.good(*train, "--inputs-of", "c.json")
    assert compbox.read("net.json")["terms"] == named
    compbox.write("d.json", {"inputs": chosen[:1]})
    compbox.good(*train, "--inputs", "rpm", "--inputs-of", "d.json")
    assert compbox.read("net.json")["terms"][0]["bank"]["inputs"] == ["rpm", chosen[0]]
    compbox.write("d.json", {"chosen": ["t1"]})
    assert compbox.refused(*train, "--inputs-of", "d.json").startswith("d.json: ")


def test_a_pattern_leaves_out_what_is_kept(compbox, rows):
    """t* are four sensors; with t2 kept, three of them are candidates."""
    compbox.good(*SELECT, "--count", 2, "--keep", "t2,rpm", "-o", "c.json")
    choice = compbox.read("c.json")
    assert [c["name"] for c in choice["candidates"]] == ["t1", "t3", "t4"]
    assert choice["inputs"][-2:] == ["t2", "rpm"]


@pytest.mark.parametrize("method", ["c-means", "closure"])
@pytest.mark.parametrize("how", ["--check", "--by-runs"])
def test_check_on_runs_left_out(compbox, rows, method, how):
    import json
    choice = json.loads(compbox.good(*candidates("t1", "t2", "t3", "t4"), "--count", 2, how,
                                     "--run-column", "run", "--method", method, "--keep", "rpm",
                                     "--lags", 60, "--squares", "rpm", "--json"))
    assert len(choice["chosen"]) == 2
    last = choice["checks"][-1]
    assert last["inputs"][-1] == "rpm" and last["left_out"]["ez_um"]["rms"] < 0.5


@pytest.mark.parametrize("how", ["--check", "--by-runs"])
def test_two_hundred_candidates(compbox, how):
    """Four stories in 200 noisy sensors. The choice is as good as all of them, within their noise."""
    dice = random.Random(4)
    share = [[dice.gauss(0, 1) for _ in range(4)] for _ in range(200)]
    lines = ["run,ez_um," + ",".join(f"t{i}" for i in range(200))]
    for i in range(300):
        story = [math.sin((0.03 + 0.021 * k) * i + k) for k in range(4)]
        sensors = [sum(s * t for s, t in zip(row, story)) + dice.gauss(0, 0.05) for row in share]
        error = 6 * story[0] - 4 * story[2] + dice.gauss(0, 0.05)
        lines.append(",".join(f"{v:.4f}" for v in (i // 50, error, *sensors)))
    compbox.write("many.csv", "\n".join(lines) + "\n")
    report = compbox.good("select-inputs", "many.csv", "--outputs", "ez_um", "--candidates", "t*", how,
                          "--run-column", "run", "--count", 8, "-o", "c.json")
    choice = compbox.read("c.json")
    assert len(choice["candidates"]) == 200 and len(choice["chosen"]) == 8
    first, *_, last = [c["mean_rms_percent_of_largest"] for c in choice["checks"]]
    assert len(choice["checks"]) == (2 if how == "--check" else 193) and first < 1
    assert last < 3 * first if how == "--by-runs" else last > first
    assert ("without 192 of them" in report) == (how == "--check")


def test_columns_with_units_in_brackets(compbox):
    lines = ["time(s),run,t1(degC),t2(degC),ch1(um)"]
    for i in range(120):
        a, b = math.sin(0.05 * i), math.cos(0.083 * i)
        lines.append(f"{10 * i},{i // 30},{20 + a},{25 + b},{5 * a + b}")
    compbox.write("rows.csv", "\n".join(lines) + "\n")
    report = compbox.good("select-inputs", "rows.csv", "--outputs", "ch1(um)", "--candidates",
                          "t1(degC),t2(degC)", "--count", 1, "--check", "--run-column", "run",
                          "--lags", 60, "--squares", "t1(degC)", "--time-column", "time(s)")
    assert report.splitlines()[-1] == "--inputs t1"


def test_plot(compbox, rows):
    compbox.good(*candidates("t1", "t2", "t3", "t4"), "--count", 2, "--plot", "f.svg")
    picture = compbox.folder.joinpath("f.svg").read_text()
    assert all(f">{name}<" in picture.replace(" ", "") for name in ("t1", "t2", "t3", "t4", "chosen"))
    assert compbox.refused(*candidates("t1", "t2"), "--plot", "f.txt") == (
        "f.txt: a figure is written as .svg, .png or .pdf; give it such a name")


REFUSED = {
    "one": (candidates("t1"), "rows.csv: with fewer than two candidates there is no choice"),
    "more": (candidates("t1", "t2") + ("--count", 3),
             "rows.csv: has 2 candidates, fewer than --count 3"),
    "none": (candidates("q*"), "rows.csv: no column matches q*"),
    "output": (candidates("t1", "ez_um"),
               "rows.csv: the column 'ez_um' is both input and output"),
    "kept twice": (candidates("t1", "t2") + ("--keep", "t2"),
                   "rows.csv: the column 't2' is named twice"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(compbox, rows, case):
    arguments, message = REFUSED[case]
    assert compbox.refused(*arguments) == message


@pytest.mark.parametrize("more", [("--check",), ("--by-runs",), ("--count", "0"),
                                  ("--method", "k-means"), ("--keep", "r*"),
                                  ("--plot", "f.svg", "-o", "f.svg")])
def test_wrong_usage(compbox, rows, more):
    done = compbox(*candidates("t1", "t2"), *more)
    assert done.returncode == 2 and done.stderr


def test_help_has_an_example(compbox):
    assert "Example:\n  compbox select-inputs " in compbox.good("select-inputs", "--help")
