# SPDX-License-Identifier: MIT
"""compbox plan, assemble and identify as a user calls them: the options, and what is refused. The
readings come from S2's formula written out in tests/oracle/nine_line.py."""

import json
import sys

import numpy
import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests/oracle"))
from nine_line import closed_form, closed_form_traditional, moved  # noqa: E402

KINDS = "XYZABC"
POINTS = [[125, 300, 75], [250, -300, 325], [-250, -300, 75]]
X = numpy.arange(0, 2001, 100.0)


def errors(dice):
    """Six smooth errors: no constants; no slope where separate set-ups hide it (axis X)."""
    u = X / 2000
    rows = []
    for k in range(6):
        v = dice.uniform(5, 30) * numpy.sin(dice.uniform(3, 9) * u + dice.uniform(0, 6)) + 10 * u
        rows.append(v - numpy.polyval(numpy.polyfit(u, v, 0 if k in (0, 4, 5) else 1), u))
    return numpy.array(rows).T


def write_table(compbox, readings, name="m.csv"):
    header = "position_mm," + ",".join(f"d{d}{p}_um" for p in "123" for d in "xyz")
    rows = [",".join(map(repr, [float(x), *map(float, r)])) for x, r in zip(X, readings)]
    compbox.write(name, "\n".join([header, *rows]) + "\n")


def found(compbox, folder, axis="X"):
    return numpy.array([[float(line.split(",")[1]) for line in
                         (compbox.folder / folder / f"E{k}{axis}.csv").read_text().splitlines()[1:]]
                        for k in KINDS]).T


@pytest.fixture
def points(compbox):
    return compbox.write("p.json", {"points_mm": POINTS})


@pytest.mark.parametrize("method", ["improved", "traditional"])
def test_gives_the_errors_back(compbox, points, method):
    e = errors(numpy.random.default_rng(1))
    write_table(compbox, moved(POINTS, e))
    compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "--method", method, "-o", "d")
    assert found(compbox, "d") == pytest.approx(e, abs=1e-6)


def test_a_table_on_the_workpiece_side(compbox, points):
    e = errors(numpy.random.default_rng(2))
    write_table(compbox, -moved(POINTS, e))  # the table moved; e is tool relative to workpiece
    compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "--side", "workpiece", "-o",
                 "d")
    assert found(compbox, "d") == pytest.approx(e, abs=1e-6)
    report = compbox.read("d/report.json")
    assert (report["axis"], report["side"]) == ("X", "workpiece")


def test_scale_correction_frame_offset_and_reference_point(compbox, points):
    e = errors(numpy.random.default_rng(3))
    offset = numpy.array([40.0, -25.0, 60.0])
    readings = moved(numpy.array(POINTS) - offset, e)
    readings[:, [0, 3, 6]] += 11.0 * 2.5 * 1e-3 * X[:, None]  # 2.5 degrees too warm
    write_table(compbox, readings)
    compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "--frame-offset-mm=40,-25,60",
                 "--scale-ppm-per-degC", 11, "--temperature-degC", 22.5, "--reference-point=1,2,3",
                 "-o", "d")
    assert found(compbox, "d") == pytest.approx(e, abs=1e-6)
    assert compbox.read("d/report.json")["reference_point_mm"] == [1, 2, 3]


def test_monte_carlo_is_the_closed_form_and_the_same_for_a_seed(compbox, points):
    dice = numpy.random.default_rng(4)
    write_table(compbox, moved(POINTS, errors(dice)) + dice.normal(0, 0.5, (len(X), 9)))
    call = ("identify", "m.csv", "--axis", "X", "--points", points, "--monte-carlo", 10000, "--seed",
            7, "--sigma-um", 2, "--preset", "1,2,3,4,5,6", "--json", "-o", "d")
    out = compbox.good(*call)
    assert out == compbox.good(*call)
    run = json.loads(out)["monte_carlo"]
    assert (run["runs"], run["seed"], run["reading_sigma_um"]) == (10000, 7, 2)
    improved, traditional = closed_form(POINTS), closed_form_traditional(POINTS, "X")
    for k, kind in enumerate(KINDS):
        one = run["errors"][f"E{kind}X"]
        assert one["preset"] == k + 1
        for method, closed in (("improved", improved[k]), ("traditional", traditional[k])):
            assert one[method]["sigma_closed_form"] == pytest.approx(2 * closed, rel=1e-9)
            assert one[method]["sigma"] == pytest.approx(2 * closed, rel=0.03)
            assert one[method]["mean"] == pytest.approx(k + 1, abs=0.1 * closed)
        assert one["sigma_lower_percent"] == pytest.approx(
            100 * (1 - improved[k] / traditional[k]), abs=2.5)
    other = compbox.good(*call[:9], 8, *call[10:])
    assert json.loads(other)["monte_carlo"]["errors"] != run["errors"]
    text = compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "--monte-carlo", 100,
                        "-o", "d")
    assert "Monte Carlo, 100 runs, seed 1, sigma of a reading" in text


def test_plan_checks_itself_by_runs(compbox):
    out = json.loads(compbox.good("plan", "--box=-250:250:4,-300:300:4,75:325:4", "--sigma-um", 0.8,
                                  "--monte-carlo", 10000, "--json", "-o", "p.json"))
    closed = closed_form(out["points_mm"])
    seen = out["monte_carlo"]["errors"]
    for k, kind in enumerate(KINDS):
        assert seen[f"E{kind}X"]["improved"]["sigma"] == pytest.approx(0.8 * closed[k], rel=0.03)
    assert compbox.read("p.json")["monte_carlo"] == out["monte_carlo"]


def test_one_bad_reading_is_one(compbox, points):
    dice = numpy.random.default_rng(6)
    readings = moved(POINTS, errors(dice)) + dice.normal(0, 0.5, (len(X), 9))
    readings[7, 4] += 40
    write_table(compbox, readings)
    text = compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "-o", "d")
    bad = compbox.read("d/report.json")["outliers"]
    assert len(bad) == 1 and bad[0]["position_mm"] == 700
    # at these points, two and two of which share a coordinate, the two cannot be distinguished
    assert {bad[0]["line"], *bad[0]["or_lines"]} == {"dy2_um", "dz1_um"}
    assert f"stands out: {bad[0]['line']} or {bad[0]['or_lines'][0]} at 700 mm" in text


def test_plot(compbox, points):
    dice = numpy.random.default_rng(5)
    write_table(compbox, moved(POINTS, errors(dice)) + dice.normal(0, 0.5, (len(X), 9)))
    compbox.good("identify", "m.csv", "--axis", "X", "--points", points, "--plot", "f.svg", "-o", "d")
    svg = (compbox.folder / "f.svg").read_text()
    assert all(f"E{k}X" in svg for k in KINDS)


def test_nine_laser_files_to_a_table(compbox):
    example = ROOT / "examples/nine-line/X"
    names = [example / f"P{p}{d}.rtl" for p in "123" for d in "xyz"]
    compbox.good("assemble", *names, "-o", "X.csv")
    assert compbox.refused("assemble", *names[:8], names[4], "-o", "Y.csv").endswith(
        "P2y.rtl: is given for P2y and for P3z; each of the nine lines has a file of its own")
    table = compbox.table("X.csv")
    assert list(table)[:4] == ["position_mm", "dx1_um", "dy1_um", "dz1_um"]
    text = names[5].read_text().splitlines()
    first = [float(line.split()[2]) for line in text[text.index("Run Target Data:") + 1:-1]
             if line.split()[1] == "1"]
    assert table["dz2_um"][0] == pytest.approx(sum(first) / len(first), abs=1e-9)
    compbox.good("identify", "X.csv", "--axis", "X", "--points",
                 ROOT / "examples/nine-line/X.plan.json", "-o", "d")
    assert compbox.read("d/report.json")["noise_um"] == pytest.approx(0.4 / 5**0.5, rel=0.25)


def test_refused(compbox, points):
    e = errors(numpy.random.default_rng(1))
    write_table(compbox, moved(POINTS, e))
    compbox.write("line.json", {"points_mm": [[0, 0, 0], [1, 1, 1], [2, 2, 2]]})
    call = ("identify", "m.csv", "--axis", "X", "-o", "d", "--points")
    assert compbox.refused(*call, "line.json") == (
        "line.json: the 3 points lie on one line, so a rotation about it cannot be measured: move one "
        "of them off the line, by 1 mm or more")
    compbox.write("near.json", {"points_mm": [[0, 0, 0], [300, 0, 0], [600, 0.8, 0]]})
    assert compbox.refused(*call, "near.json").startswith("near.json: the 3 points lie within 0.4 mm of")
    compbox.write("flat.json", {"points_mm": [[0, 0, 0], [10, 0, 0], [20, 50, 0]]})
    assert "cannot be solved at these points in this order" in compbox.refused(
        *call, "flat.json", "--method", "traditional")
    compbox.write("two.json", {"points_mm": [[0, 0, 0], [1, 1, 1]]})
    assert compbox.refused(*call, "two.json") == (
        "two.json: points_mm must hold three or more points (up to 100) of three numbers, [x, y, z] in mm")
    text = (compbox.folder / "m.csv").read_text()
    compbox.write("m.csv", text.replace("dy2_um", "dq2_um"))
    assert compbox.refused(*call, points).startswith("m.csv:1: there is no column 'dy2_um'")
    compbox.write("m.csv", "\n".join(text.splitlines()[:3]) + "\n")
    assert compbox.refused(*call, points) == (
        "m.csv: each line has its own slope, so at least 3 positions are needed")
    lines = text.splitlines()
    compbox.write("m.csv", "\n".join(lines[:3] + [lines[2]]) + "\n")
    assert compbox.refused(*call, points) == (
        "m.csv:4: positions must ascend, but 100 mm comes after 100 mm")


@pytest.mark.parametrize("wrong", [["--axis", "Q"], ["--axis", "X", "--side", "left"],
                                   ["--axis", "X", "--monte-carlo", "1"],
                                   ["--axis", "X", "--preset", "1,2"], []])
def test_wrong_usage(compbox, points, wrong):
    assert compbox("identify", "m.csv", "--points", points, *wrong, "-o", "d").returncode == 2


@pytest.mark.parametrize("command", ["plan", "assemble", "identify"])
def test_help(compbox, command):
    assert f"compbox {command} " in compbox.good(command, "--help").split("Example:")[1]


def test_a_box_that_is_a_line_says_its_option(compbox):
    assert compbox.refused("plan", "--box", "0:1:1,0:1:1,0:1:5", "-o", "p.json") == (
        "--box: every triple of its nodes lies on one line: give it more nodes")


def test_too_many_nodes_are_refused_before_they_are_made(compbox):
    message = compbox.refused("plan", "--box=0:1000:500,0:500:250,0:500:500", "-o", "p.json")
    assert message == (
        "--box has 500 x 250 x 500 = 62500000 nodes, and 3 to 4000 can be searched. The third number of each "
        "axis is its count of nodes, not a step: 15 for each axis are enough")
    assert "not a step" in compbox("plan", "--box=0:1:0,0:1:2,0:1:2", "-o", "p.json").stderr
    assert "how many nodes" in compbox.good("plan", "--help")
