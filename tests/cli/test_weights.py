# SPDX-License-Identifier: MIT
"""compbox identify with instruments that are not equally exact, in boxes of any shape, against weighted least
squares as one dense system (tests/oracle/nine_line_weights.py), which gives the errors, their scatter under the
true noise, and that of the best weights."""

import json
import sys

import numpy
import pytest

from conftest import LONG, ROOT

sys.path.insert(0, str(ROOT / "tests/oracle"))
from nine_line import moved  # noqa: E402
from nine_line_weights import Lines, random_points, rms  # noqa: E402

KINDS = "XYZABC"


def write_table(compbox, x, readings, name="m.csv"):
    names = [f"d{d}{p + 1}_um" for p in range(readings.shape[1] // 3) for d in "xyz"]
    rows = [",".join(map(repr, [float(at), *map(float, row)])) for at, row in zip(x, readings)]
    compbox.write(name, "\n".join([",".join(["position_mm", *names]), *rows]) + "\n")


def write_runs(compbox, x, runs, prefix=""):
    """A file for each line; runs x positions x lines."""
    names = []
    for line in range(runs.shape[2]):
        names.append(f"{prefix}P{line // 3 + 1}{'xyz'[line % 3]}.csv")
        rows = [f"{float(at)!r},{float(value)!r},{r + 1}\n" for r, run in enumerate(runs[:, :, line])
                for at, value in zip(x, run)]
        compbox.write(names[-1], "position_mm,error_um,run\n" + "".join(rows))
    return names


def identified(compbox, lines, axis, *options):
    """out: errors, stated sigma, and the sigma of each line behind it"""
    compbox.good("identify", "m.csv", "--axis", axis, "--points", "p.json", *options, "-o", "d")
    tables = [compbox.table(f"d/E{kind}{axis}.csv") for kind in KINDS]
    columns = [numpy.array([list(table.values())[k] for table in tables]).T for k in (1, 2)]
    report = compbox.read("d/report.json")
    return (*columns, numpy.broadcast_to(report["line_sigma_um"], lines), report)


class Case:
    """A random machine, its points, instruments and readings without noise."""

    def __init__(self, compbox, dice, equal=False):
        self.axis, self.points = dice.choice(list("XYZ")), int(dice.choice([3, 3, 3, 4, 5]))
        self.x = numpy.linspace(0, dice.uniform(300, 4000), int(dice.integers(7, 26)))
        places, count = random_points(dice, self.axis, self.points), 3 * self.points
        self.along = numpy.arange(count) % 3 == "XYZ".index(self.axis)
        self.instruments = numpy.exp(dice.uniform(numpy.log(0.1), numpy.log(3), 2))
        self.sigma = numpy.where(self.along, *self.instruments)
        if dice.random() < 0.3 and not equal:  # an instrument for each line
            self.sigma = numpy.exp(dice.uniform(numpy.log(0.1), numpy.log(3), count))
        u = self.x / self.x[-1]
        errors = numpy.array([dice.uniform(2, 20) * numpy.sin(dice.uniform(2, 9) * u + dice.uniform(0, 6))
                              + dice.uniform(-10, 10) * u for _ in KINDS]).T
        slopes = numpy.where(self.along, 0, dice.uniform(-60, 60, count))
        self.clean = moved(places, errors) + dice.uniform(-50, 50, count) + numpy.outer(self.x * 1e-3, slopes)
        self.errors, self.places = errors, places
        compbox.write("p.json", {"points_mm": places})

    def lines(self, runs=1):
        return Lines(self.places, self.axis, self.x, self.sigma / runs ** 0.5)

    def not_worse_than_traditional(self, lines, scatter):
        sequence = lines.A[lines.used("traditional")] * [1, 1, 1, 0.01, 0.01, 0.01]
        if numpy.linalg.matrix_rank(sequence, 1e-9) == 6:
            assert (scatter <= 1.02 * rms(lines.scatter("traditional"))).all()


@pytest.mark.parametrize("seed", range(80 if LONG else 16))
def test_given_sigma_is_weighted_least_squares(compbox, seed):
    dice = numpy.random.default_rng(seed)
    case = Case(compbox, dice, equal=seed % 2 == 0)
    lines = case.lines()
    readings = case.clean + dice.normal(0, 1, case.clean.shape) * case.sigma
    write_table(compbox, case.x, readings)
    numbers = case.instruments if seed % 2 == 0 else case.sigma
    found, stated, sigma, _ = identified(compbox, len(case.sigma), case.axis, "--sigma-um",
                                         ",".join(map(str, numbers)))
    assert sigma == pytest.approx(case.sigma)
    best = lines.solve(readings)
    assert found == pytest.approx(best, abs=1e-6 * abs(best).max())
    scatter = lines.scatter()
    assert stated == pytest.approx(scatter, rel=1e-6, abs=1e-9)
    assert rms(found - lines.gauged(case.errors)).max() < 5 * rms(scatter).max()
    case.not_worse_than_traditional(lines, rms(scatter))


@pytest.mark.parametrize("seed", range(80 if LONG else 16))
def test_sigma_by_the_runs_is_as_good(compbox, seed):
    """At most 1.1 times the scatter of the best weights, and a stated sigma within 25 % of the scatter."""
    dice = numpy.random.default_rng(1000 + seed)
    case = Case(compbox, dice)
    runs = int(dice.integers(3, 7))
    lines = case.lines(runs)
    shape = (runs, *case.clean.shape)
    names = write_runs(compbox, case.x, case.clean + dice.normal(0, 1, shape) * case.sigma)
    compbox.good("assemble", *names, "-o", "m.csv")
    found, stated, sigma, _ = identified(compbox, len(case.sigma), case.axis)
    table = compbox.table("m.csv")
    readings = numpy.array(list(table.values())[1:1 + len(case.sigma)]).T
    expected = lines.solve(readings, weights_by=sigma)
    assert found == pytest.approx(expected, abs=1e-6 * abs(expected).max())
    scatter = rms(lines.scatter(weights_by=sigma))
    assert (scatter <= 1.1 * rms(lines.scatter())).all()
    assert rms(stated) == pytest.approx(scatter, rel=0.25)
    case.not_worse_than_traditional(lines, scatter)


@pytest.mark.parametrize("seed", range(40 if LONG else 8))
@pytest.mark.parametrize("correlation", [0.5, 0.9])
def test_noise_that_is_correlated_along_a_run(compbox, correlation, seed):
    """The slopes of the runs show it. Independent readings would make the sigma of pitch and yaw less than half
    of their scatter at 0.9, and twice that of straightness."""
    dice = numpy.random.default_rng(2000 + seed)
    case = Case(compbox, dice, equal=True)
    case.x = numpy.linspace(0, case.x[-1], 21)
    runs, lines = 6, case.lines(6)
    noise = dice.normal(0, 1, (runs, 21, len(case.sigma)))
    for i in range(1, 21):
        noise[:, i] = correlation * noise[:, i - 1] + (1 - correlation ** 2) ** 0.5 * noise[:, i]
    names = write_runs(compbox, case.x, noise * case.sigma)
    text = compbox.good("assemble", *names, "-o", "m.csv")
    assert ("are correlated along a run" in text) or correlation < 0.9
    found, stated, sigma, _ = identified(compbox, len(case.sigma), case.axis)
    scatter = rms(lines.scatter(weights_by=sigma, correlation=correlation))
    assert rms(stated) == pytest.approx(scatter, rel=0.4)


def ordinary_optics(compbox):
    """Positioning 0.2 um, straightness 1.5 um, at points that show all six errors."""
    dice = numpy.random.default_rng(5)
    case = Case(compbox, dice, equal=True)
    case.axis, case.x = "X", numpy.linspace(0, 2000, 21)
    case.places = [[-300, -150, -100], [300, -150, 100], [0, 150, -100]]
    case.sigma = numpy.where(numpy.arange(9) % 3 == 0, 0.2, 1.5)
    case.errors = numpy.array([5 * numpy.sin(5 * case.x / 2000 + k) for k in range(6)]).T
    case.clean = moved(case.places, case.errors)
    compbox.write("p.json", {"points_mm": case.places})
    return case, dice


def test_ordinary_optics(compbox):
    """Repeated measurements: without weights pitch was worse than by the traditional method."""
    case, dice = ordinary_optics(compbox)
    lines = case.lines()
    off = {"improved": [], "traditional": [], "alike": []}
    states = []
    for _ in range(40):
        readings = case.clean + dice.normal(0, 1, case.clean.shape) * case.sigma
        write_table(compbox, case.x, readings)
        for method, options in (("improved", ("--sigma-um", "0.2,1.5")), ("alike", ()),
                                ("traditional", ("--method", "traditional"))):
            found, stated, *_ = identified(compbox, 9, "X", *options)
            off[method].append(found - lines.gauged(case.errors))
            if method == "improved":
                states.append(stated)
    seen = {method: rms(numpy.concatenate(errors)) for method, errors in off.items()}
    pitch = 4
    assert seen["alike"][pitch] > 1.5 * seen["traditional"][pitch]
    assert (seen["improved"] < 1.05 * seen["traditional"]).all()
    assert (seen["improved"] < 1.1 * rms(lines.scatter())).all()
    assert rms(numpy.concatenate(states)) == pytest.approx(seen["improved"], rel=0.1)


def test_traditional_has_a_sigma_where_the_instruments_do(compbox):
    case, dice = ordinary_optics(compbox)
    write_table(compbox, case.x, case.clean + dice.normal(0, 1, case.clean.shape) * case.sigma)
    stated = identified(compbox, 9, "X", "--method", "traditional", "--sigma-um", "0.2,1.5")[1]
    assert stated == pytest.approx(case.lines().scatter("traditional"), rel=1e-6, abs=1e-9)


def test_monte_carlo_has_the_weights(compbox):
    case, dice = ordinary_optics(compbox)
    write_table(compbox, case.x, case.clean + dice.normal(0, 1, case.clean.shape) * case.sigma)
    compbox.good("identify", "m.csv", "--axis", "X", "--points", "p.json", "--sigma-um", "0.2,1.5", "--monte-carlo",
                 10000, "-o", "d")
    report = compbox.read("d/report.json")["monte_carlo"]
    assert report["reading_sigma_um"] == [0.2, 1.5, 1.5] * 3
    weighted = case.lines().A / case.sigma[:, None]
    closed = numpy.sqrt(numpy.diag(numpy.linalg.inv(weighted.T @ weighted)))
    for k, kind in enumerate(KINDS):
        one = report["errors"][f"E{kind}X"]["improved"]
        assert one["sigma_closed_form"] == pytest.approx(closed[k], rel=1e-9)
        assert one["sigma"] == pytest.approx(closed[k], rel=0.03)


def test_contradictions_are_reported(compbox):
    case, dice = ordinary_optics(compbox)
    write_table(compbox, case.x, case.clean + 4 * dice.normal(0, 1, case.clean.shape) * case.sigma)
    sigma, report = identified(compbox, 9, "X", "--sigma-um", "0.2,1.5")[2:]
    assert report["contradiction"] == pytest.approx(4, rel=0.3)
    assert sigma == pytest.approx(case.sigma * report["contradiction"], rel=1e-6)
    assert any("times as much as their sigma explains" in remark for remark in report["remarks"])
    report = identified(compbox, 9, "X", "--sigma-um", "2,15")[3]
    assert any("is it too large?" in remark for remark in report["remarks"])
    report = identified(compbox, 9, "X")[3]
    assert any("all of them count alike" in remark for remark in report["remarks"])


def test_assemble_keeps_the_sigma(compbox):
    case, dice = ordinary_optics(compbox)
    names = write_runs(compbox, case.x, case.clean + dice.normal(0, 1, (5, *case.clean.shape)) * case.sigma)
    out = json.loads(compbox.good("assemble", *names, "--json", "-o", "m.csv"))
    assert out["sigma_um"] == pytest.approx(case.sigma / 5 ** 0.5, rel=0.1)
    table = compbox.table("m.csv")
    assert list(table)[10:12] == ["sigma_dx1_um", "sigma_dy1_um"]
    assert set(table["sigma_dy2_um"]) == {out["sigma_um"][4]}
    given = json.loads(compbox.good("assemble", *names, "--sigma-um", "0.2,1.5", "--axis", "X", "--json", "-o",
                                    "m.csv"))
    assert given["sigma_um"] == pytest.approx(case.sigma / 5 ** 0.5)
    each = ",".join(str(k + 1) for k in range(9))
    given = json.loads(compbox.good("assemble", *names, "--sigma-um", each, "--json", "-o", "m.csv"))
    assert given["sigma_um"] == pytest.approx(numpy.arange(1, 10) / 5 ** 0.5)
    single = write_runs(compbox, case.x, case.clean[None], "single-")
    assert "sigma of the lines is unknown" in compbox.good("assemble", *single, "-o", "s.csv")
    assert len(compbox.table("s.csv")) == 10


def test_a_file_that_states_its_sigma(compbox):
    """The column sigma_um of a file is that of a reading; one run is enough."""
    case, dice = ordinary_optics(compbox)
    for line in range(9):
        rows = [f"{float(at)!r},{float(value)!r},{case.sigma[line]}\n"
                for at, value in zip(case.x, case.clean[:, line])]
        compbox.write(f"P{line}.csv", "position_mm,error_um,sigma_um\n" + "".join(rows))
    out = json.loads(compbox.good("assemble", *[f"P{line}.csv" for line in range(9)], "--json", "-o", "m.csv"))
    assert out["sigma_um"] == pytest.approx(case.sigma)


def test_more_than_three_points(compbox):
    """Twelve files and the plan of four points; the traditional method takes the first three."""
    case, dice = ordinary_optics(compbox)
    case.places.append([100, -20, 60])
    case.clean = moved(case.places, case.errors)
    case.sigma = numpy.where(numpy.arange(12) % 3 == 0, 0.2, 1.5)
    compbox.write("p.json", {"points_mm": case.places})
    names = write_runs(compbox, case.x, case.clean + dice.normal(0, 1, (5, *case.clean.shape)) * case.sigma)
    compbox.good("assemble", *names, "-o", "m.csv")
    lines = case.lines(5)
    found, stated, *_ = identified(compbox, 12, "X")
    assert rms(stated) == pytest.approx(rms(lines.scatter()), rel=0.25)
    assert (abs(found - lines.gauged(case.errors)) < 6 * lines.scatter() + 1e-9).all()
    found = identified(compbox, 9, "X", "--method", "traditional")[0]
    readings = numpy.array(list(compbox.table("m.csv").values())[1:13]).T
    lines.used = lambda method: [0, 3, 6, 1, 4, 2]
    assert found == pytest.approx(lines.solve(readings), abs=1e-6)
    compbox.write("p.json", {"points_mm": case.places[:3]})
    assert compbox.refused("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d") == (
        "m.csv:1: has lines of point 4, but the plan has 3 points")


@pytest.mark.parametrize("command", [
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--sigma-um", "1,2,3"),
    ("plan", "--box=0:100:2,0:100:2,0:100:2", "-o", "q.json", "--sigma-um", "1,2,3"),
    ("assemble", *[f"P{k}.csv" for k in range(9)], "-o", "q.csv", "--sigma-um", "1,2"),
    ("assemble", *[f"P{k}.csv" for k in range(10)], "-o", "q.csv")])
def test_wrong_usage(compbox, command):
    case, _ = ordinary_optics(compbox)
    write_table(compbox, case.x, case.clean)
    done = compbox(*command)
    assert done.returncode == 2 and done.stderr.startswith(
        "compbox: FILE: needs three files" if len(command) == 13 else "compbox: --sigma-um: "), done.stderr
