# SPDX-License-Identifier: MIT
"""compbox squareness against the box itself: a machine with nothing but squareness is evaluated, its
rectangle or its straightness measured, and the squareness must come back with its sign."""

import math

import pytest

from conftest import PLC

AXES = {"C0Y": "XY", "B0Z": "XZ", "A0Z": "YZ"}
TRUTH = {"C0Y": 23.0, "B0Z": -17.0, "A0Z": 31.0}


@pytest.fixture
def tool_error(compbox):
    """E(place) of that machine, in um, as `volumetric` and the box have it."""
    (compbox.folder / "X").mkdir()
    compbox.write("X/EXX.csv", "position_mm,error_um\n" + "".join(f"{x},{0.01 * x}\n"
                                                                 for x in range(0, 1001, 100)))
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel",
                 "X=1000,Y=1000,Z=1000", "-o", "m.json")
    compbox.good("volumetric", "X", "--chain", "fXYZ", "--squareness", "C0Y=23,B0Z=-17,A0Z=31",
                 "--method", "polyline", "--name", "vol", "-o", "v.json")
    compbox.good("build", "m.json", "v.json", "-o", "c.json")

    def evaluate(places):
        rows = "".join(f"{10 * i},{p['X']},{p['Y']},{p['Z']}\n" for i, p in enumerate(places))
        compbox.write("s.csv", "time_s,X,Y,Z\n" + rows)
        compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "o.csv")
        out = compbox.table("o.csv")
        return [{a: out[f"vol_{a.lower()}"][i] for a in "XYZ"} for i in range(len(places))]

    return evaluate


def place(**at):
    return {"X": 0.0, "Y": 0.0, "Z": 0.0, **at}


def length_error_um(a, b, ea, eb):
    """Measured less nominal distance of two places."""
    nominal = math.dist(list(a.values()), list(b.values()))
    real = math.dist([a[k] + 1e-3 * ea[k] for k in "XYZ"], [b[k] + 1e-3 * eb[k] for k in "XYZ"])
    return 1e3 * (real - nominal)


def result(compbox, name, *options):
    compbox.good("squareness", "--name", name, *options, "-o", "q.json")
    found = compbox.read("q.json")
    return found["squareness_urad"][name], found["sigma_urad"][name]


@pytest.mark.parametrize("name", AXES)
def test_diagonals_and_ball_bar(compbox, tool_error, name):
    one, two = AXES[name]
    a, b = 800.0, 500.0
    corners = [place(), place(**{one: a, two: b}), place(**{one: a}), place(**{two: b})]
    e = tool_error(corners)
    rising = length_error_um(corners[0], corners[1], e[0], e[1])
    falling = length_error_um(corners[2], corners[3], e[2], e[3])
    value, sigma = result(compbox, name, f"--diagonals={a},{b},{rising},{falling}", "--sigma-um", 0.5)
    assert value == pytest.approx(TRUTH[name], abs=0.05)
    assert sigma == pytest.approx(1e3 * math.sqrt(2) * 0.5 * math.hypot(a, b) / (2 * a * b))
    r = 300 / math.sqrt(2)
    ends = [place(**{one: 400 + s * r, two: 400 + t * r}) for s, t in
            ((-1, -1), (1, 1), (1, -1), (-1, 1))]
    e = tool_error(ends)
    at45 = length_error_um(ends[0], ends[1], e[0], e[1])
    at135 = length_error_um(ends[2], ends[3], e[2], e[3])
    assert result(compbox, name, f"--ball-bar=600,{at45},{at135}")[0] == pytest.approx(TRUTH[name],
                                                                                      abs=0.05)


def test_a_squareness_that_cannot_be_says_which(compbox):
    printed = compbox.refused("squareness", "--name", "C0Y", "--ball-bar=1,1e6,0", "-o", "q.json")
    assert printed == ("ball bar: C0Y comes out as -1000000000 urad, which cannot be: check the order "
                    "of the numbers")


@pytest.mark.parametrize("name", AXES)
def test_optical_square(compbox, tool_error, name):
    """The laser's beam is oblique by 40 urad, and the square has an error of 6 urad."""
    one, two = AXES[name]
    beam, square = 40.0, 6.0
    steps = [100.0 * i for i in range(10)]
    for file, moving, towards, slope in (("a.csv", one, two, -beam), ("b.csv", two, one, beam + square)):
        e = tool_error([place(**{moving: s}) for s in steps])
        rows = "".join(f"{s},{x[towards] + 1e-3 * slope * s + 5}\n" for s, x in zip(steps, e))
        compbox.write(file, "position_mm,error_um\n" + rows)
    value, _ = result(compbox, name, "--optical", "a.csv", "b.csv", "--square-error-urad", square)
    assert value == pytest.approx(TRUTH[name], abs=0.05)


def test_its_sigma_is_that_of_the_slopes(compbox):
    import random
    dice = random.Random(5)
    values = []
    for _ in range(60):
        for file in ("a.csv", "b.csv"):
            rows = "".join(f"{s},{dice.gauss(0, 1)}\n" for s in range(0, 1001, 100))
            compbox.write(file, "position_mm,error_um\n" + rows)
        value, sigma = result(compbox, "C0Y", "--optical", "a.csv", "b.csv")
        values.append((value, sigma))
    spread = math.sqrt(sum(v * v for v, _ in values) / len(values))
    assert sum(s for _, s in values) / len(values) == pytest.approx(spread, rel=0.25)


def test_volumetric_takes_the_file(compbox, tool_error):
    compbox.good("squareness", "--name", "A0Z", "--diagonals=500,500,-3,4", "-o", "a.json")
    compbox.good("volumetric", "X", "--chain", "fXYZ", "--squareness", "a.json", "--squareness",
                 "C0Y=2", "--name", "w", "-o", "w.json")
    term = compbox.read("w.json")["terms"][-1]
    assert term["squareness_urad"] == pytest.approx(
        {"C0Y": 2.0, "B0Z": 0.0, "A0Z": 1e3 * 7 * math.hypot(500, 500) / (2 * 500 * 500)})
    compbox.write("bad.json", {"squareness_urad": {"C0X": 1}})
    assert compbox.refused("volumetric", "X", "--chain", "fXYZ", "--squareness", "bad.json", "--name",
                           "w", "-o", "x.json").startswith("bad.json: squareness_urad.C0X must be")


def test_refused(compbox):
    compbox.write("a.csv", "position_mm,error_urad\n0,1\n1,2\n2,3\n")
    compbox.write("b.csv", "position_mm,error_um\n0,1\n1,2\n")
    call = ("squareness", "--name", "C0Y", "-o", "q.json", "--optical")
    assert compbox.refused(*call, "a.csv", "b.csv") == "a.csv: holds angles; a straightness is in um"
    assert compbox.refused(*call, "b.csv", "b.csv") == "b.csv: needs at least three positions"
    compbox.write("c.csv", "position_mm,error_um\n0,0\n1,1\n2,0\n")
    assert compbox.refused(*call, "c.csv", "c.csv") == (
        "c.csv: is given for both axes; each of the two has a file of its own")
    assert "cannot be" in compbox.refused("squareness", "--name", "C0Y", "-o", "q.json",
                                          "--diagonals=1,1,0,100000")


@pytest.mark.parametrize("wrong", [[], ["--diagonals=1,2,3"], ["--diagonals=0,2,3,4"],
                                   ["--ball-bar=-1,2,3"], ["--ball-bar=1,2,3", "--diagonals=1,2,3,4"]])
def test_wrong_usage(compbox, wrong):
    assert compbox("squareness", "--name", "C0Y", *wrong, "-o", "q.json").returncode == 2
    assert compbox("squareness", "--name", "C0Z", "--ball-bar=1,2,3", "-o", "q.json").returncode == 2


def test_help(compbox):
    assert "compbox squareness " in compbox.good("squareness", "--help").split("Example:")[1]
