# SPDX-License-Identifier: MIT
"""compbox plan recommends only points at which identify will find all that it can, and refuses the others
before anything is measured. Sigmas against tests/oracle/nine_line_weights.py."""

import json
import sys

import numpy
import pytest

from conftest import LONG, ROOT

sys.path.insert(0, str(ROOT / "tests/oracle"))
from nine_line import moved  # noqa: E402
from nine_line_weights import Lines, random_points, rms  # noqa: E402

LONG_BOX = "-300:300:6,-150:150:6,-100:100:6"  # longer along X than across it
COINCIDE = [[-300, -150, -100], [300, -150, -100], [-60, 150, 100]]  # the first two, seen along X
X = numpy.linspace(0, 2000, 21)


def planned(compbox, *options):
    return json.loads(compbox.good("plan", *options, "--json", "-o", "p.json"))


def sigma_of(plan):
    return [*plan["sigma"]["delta_um"], *plan["sigma"]["epsilon_urad"]]


def seen_height(points, axis):
    """Smallest height of the triangle as seen along the axis."""
    a, b, c = numpy.delete(numpy.array(points), "XYZ".index(axis), axis=1)
    longest = max(numpy.linalg.norm(p - q) for p, q in ((a, b), (b, c), (c, a)))
    return abs(numpy.linalg.det([b - a, c - a])) / longest if longest else 0.0


@pytest.mark.parametrize("criterion", ["mean-cv", "a", "d"])
@pytest.mark.parametrize("axis", "XYZ")
def test_what_is_recommended_shows_pitch_and_yaw(compbox, criterion, axis):
    sizes = ["-300:300:6", "-150:150:6", "-100:100:6"]
    turned = ",".join(sizes[(k - "XYZ".index(axis)) % 3] for k in range(3))
    plan = planned(compbox, f"--box={turned}", "--axis", axis, "--criterion", criterion, "--best", 100)
    assert len(plan["best"]) == 100
    assert min(seen_height(one["points_mm"], axis) for one in plan["best"]) > 20


def left_of_yaw(compbox, points):
    """Largest distance of ECX from its truth; its size is 10 urad."""
    u = X / 2000
    errors = numpy.array([5 * numpy.sin(5 * u + k) for k in range(6)]).T
    errors[:, 5] = 10 * u
    dice = numpy.random.default_rng(1)
    readings = moved(points, errors) + dice.normal(0, 0.1, (len(X), 9))
    header = "position_mm," + ",".join(f"d{d}{p}_um" for p in "123" for d in "xyz")
    rows = [",".join(map(repr, [float(x), *map(float, r)])) for x, r in zip(X, readings)]
    compbox.write("m.csv", "\n".join([header, *rows]) + "\n")
    compbox.write("q.json", {"points_mm": points})
    compbox.good("identify", "m.csv", "--axis", "X", "--points", "q.json", "-o", "d")
    found = numpy.array(compbox.table("d/ECX.csv")["error_urad"])
    return abs(found - (errors[:, 5] - errors[:, 5].mean())).max()


def test_yaw_is_found_with_the_recommended_points_alone(compbox):
    """Points that coincide as seen along the axis keep half of a yaw that grows by 10 urad (and as much again
    at the other end)."""
    assert left_of_yaw(compbox, COINCIDE) > 4.5
    assert left_of_yaw(compbox, planned(compbox, f"--box={LONG_BOX}")["points_mm"]) < 0.5


def test_given_points_that_hide_pitch_and_yaw_are_refused(compbox):
    compbox.write("q.json", {"points_mm": COINCIDE})
    assert compbox.refused("plan", "--points", "q.json", "--axis", "X", "-o", "p.json") == (
        "q.json: seen along X, the 3 points lie on one line, so the lines along X cannot show pitch and yaw, whose "
        "slopes come from these lines alone: move one of them across X, off that line by 1 mm or more")
    assert planned(compbox, "--points", "q.json", "--axis", "Y")["points_mm"] == COINCIDE
    assert planned(compbox, "--points", "q.json", "--setups", "common")["points_mm"] == COINCIDE
    compbox.write("q.json", {"points_mm": [[0, 0, 0], [300, 0, 0], [600, 0.8, 0]]})
    assert "within 0.4 mm of one line, so a rotation" in compbox.refused(
        "plan", "--points", "q.json", "--setups", "common", "-o", "p.json")


@pytest.mark.parametrize("box", ["-300:300:6,-150:150:6,40:40:1", "-300:300:9,0:0.5:2,-100:100:4"])
def test_a_box_that_hides_pitch_and_yaw_is_refused(compbox, box):
    assert compbox.refused("plan", f"--box={box}", "--axis", "X", "-o", "p.json") == (
        "--box: seen along X, every triple of its nodes lies on one line, so the lines along X cannot show pitch "
        "and yaw: give it nodes at two places or more in both directions across X")
    compbox.good("plan", f"--box={box}", "--setups", "common", "-o", "p.json")


@pytest.mark.parametrize("seed", range(60 if LONG else 12))
def test_sigma_is_that_of_identify(compbox, seed):
    """Of three to five points, of either kind of instrument, against the dense system."""
    dice = numpy.random.default_rng(seed)
    axis, count = dice.choice(list("XYZ")), 3 + seed % 3
    points = random_points(dice, axis, count)
    positions, instruments = int(dice.integers(4, 20)), numpy.exp(dice.uniform(-2, 1, 2))
    compbox.write("q.json", {"points_mm": points})
    plan = planned(compbox, "--points", "q.json", "--axis", axis, "--positions", positions, "--sigma-um",
                   "{},{}".format(*instruments))
    assert plan["reading_sigma_um"] == pytest.approx(list(instruments))
    sigma = numpy.where(numpy.arange(3 * count) % 3 == "XYZ".index(axis), *instruments)
    lines = Lines(points, axis, numpy.linspace(0, 1000, positions), sigma)
    assert sigma_of(plan) == pytest.approx(rms(lines.scatter()), rel=1e-6)
    if plan["traditional_solvable"]:
        traditional = plan["traditional_sigma"]
        assert [*traditional["delta_um"], *traditional["epsilon_urad"]] == pytest.approx(
            rms(lines.scatter("traditional")), rel=1e-6)


def test_unequal_instruments_change_the_points(compbox):
    """With a coarse straightness the angles come from the lines along the axis: the triangle is larger across it."""
    alike = planned(compbox, f"--box={LONG_BOX}", "--preset", "1,1,1,5,5,5")
    plan = planned(compbox, f"--box={LONG_BOX}", "--preset", "1,1,1,5,5,5", "--sigma-um", "0.2,1.5")
    assert plan["points_mm"] != alike["points_mm"]
    compbox.write("q.json", {"points_mm": alike["points_mm"]})
    other = planned(compbox, "--points", "q.json", "--sigma-um", "0.2,1.5")
    weights = [1, 1, 1, 0.2, 0.2, 0.2]
    assert numpy.dot(sigma_of(plan), weights) <= numpy.dot(sigma_of(other), weights)


@pytest.mark.parametrize("wrong", [[], ["--box", LONG_BOX, "--points", "q.json"],
                                   ["--points", "q.json", "--forbid", "f.csv"],
                                   ["--box=0:1:2,0:1:2,0:1:2", "--positions", "2"]])
def test_wrong_usage(compbox, wrong):
    assert compbox("plan", *wrong, "-o", "p.json").returncode == 2
