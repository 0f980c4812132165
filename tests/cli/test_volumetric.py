# SPDX-License-Identifier: MIT
"""compbox volumetric: from the folders of identify to the box's compensation, against full
homogeneous matrices (tests/oracle/volumetric.py, exact rational arithmetic), which knows no levers."""

import json
import random
import sys
from fractions import Fraction

import numpy
import pytest

from conftest import LONG, PLC, ROOT

sys.path.insert(0, str(ROOT / "tests/oracle"))
from volumetric import Machine  # noqa: E402

KINDS = "XYZABC"
TRAVEL = {"X": 1000.0, "Y": 800.0, "Z": 600.0}
REFERENCE = {"X": [100, -50, 300], "Y": [-200, 40, 150], "Z": [10, 20, -400]}
SQUARENESS = {"C0Y": 12.5, "B0Z": -4.0, "A0Z": 7.25}
TOOL_OFFSET = [30.0, -10.0, 250.0]


def curve(dice, unit, count=21, smooth=False):
    """Values at equidistant positions; float32 numbers, so that the file holds them exactly."""
    size = 40 if unit == "um" else 25
    if smooth:
        a, b, phase = dice.uniform(-size, size), dice.uniform(-size, size), dice.uniform(0, 6)
        u = numpy.linspace(0, 1, count)
        return a * numpy.sin(4 * u + phase) + b * u**2
    return numpy.float32([dice.uniform(-size, size) for _ in range(count)]).astype(float)


def write_axis(compbox, axis, curves, count=21, noise=0.0, dice=None):
    folder = compbox.folder / axis
    folder.mkdir()
    positions = numpy.linspace(0, TRAVEL[axis], count)
    for k, kind in enumerate(KINDS):
        unit = "um" if k < 3 else "urad"
        rows = [f"position_mm,error_{unit},sigma_{unit}"]
        for p, e in zip(positions, curves[axis][k]):
            e += dice.gauss(0, noise) if noise else 0
            rows.append(f"{float(p)!r},{float(e)!r},{noise or 0.1}")
        (folder / f"E{kind}{axis}.csv").write_text("\n".join(rows) + "\n")
    return positions


def machine_file(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel",
                 "X=1000,Y=800,Z=600", "-o", "machine.json")


def geometry(chain):
    return ["--chain", chain, "--squareness", "C0Y=12.5,B0Z=-4", "--squareness", "A0Z=7.25",
            "--tool-offset-mm=30,-10,250",
            *[f"--reference-point={axis}=" + ",".join(map(str, REFERENCE[axis])) for axis in "XYZ"]]


def matrices(chain, curves, positions, place, tool_mm, squareness=SQUARENESS):
    """E at a place by full homogeneous matrices, and what small angles may miss there."""
    levers = [[Fraction(t) - Fraction(r) for t, r in zip(TOOL_OFFSET, REFERENCE[axis])]
              for axis in "XYZ"]
    oracle = Machine(chain, levers, [Fraction(0), Fraction(0), Fraction(-1)],
                     [Fraction(squareness[n]) for n in ("C0Y", "B0Z", "A0Z")])
    errors = [[Fraction(float(numpy.interp(place[a], positions[axis], c)))
               for c in curves[axis]] for a, axis in enumerate("XYZ")]
    at = [Fraction(float(p)) for p in place]
    e = oracle.deviation_um(at, Fraction(tool_mm), errors)
    return [float(x) for x in e], float(oracle.neglected_bound(at, Fraction(tool_mm), errors))


def evaluate(compbox, places, more=""):
    names = "time_s,X,Y,Z" + (",L" if more else "")
    rows = [names] + [",".join(map(repr, [10.0 * i, *map(float, p)])) + more
                      for i, p in enumerate(places)]
    compbox.write("s.csv", "\n".join(rows) + "\n")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
    table = compbox.table("out.csv")
    return numpy.array([[table[f"vol_{d}"][i] for d in "xyz"] +
                        [table[f"comp_{d}_um"][i] for d in "XYZ"] for i in range(len(places))])


@pytest.mark.parametrize("chain", ["fXYZ", "YfXZ", "XYfZ", "ZYXf"])
def test_agrees_with_full_matrices(compbox, chain):
    dice = random.Random(chain)
    curves = {axis: [curve(dice, "um" if k < 3 else "urad") for k in range(6)] for axis in "XYZ"}
    positions = {axis: write_axis(compbox, axis, curves) for axis in "XYZ"}
    machine_file(compbox)
    out = compbox.good("volumetric", "X", "Y", "Z", *geometry(chain), "--tool-length-mm", 175,
                       "--method", "polyline", "--name", "vol", "-o", "vol.json")
    assert "not measured" not in out
    assert "channel X = -(vol_x)" in compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
    places = [[dice.uniform(0, TRAVEL[axis]) for axis in "XYZ"] for _ in range(40)]
    places += [[0, 0, 0], [1000, 800, 600]]
    got = evaluate(compbox, places)
    for place, row in zip(places, got):
        want, bound = matrices(chain, curves, positions, place, 175)
        assert row[:3] == pytest.approx(want, abs=bound + 1e-3)
        assert row[3:] == pytest.approx(-row[:3], abs=1e-4)
        assert bound < 0.2 < max(map(abs, want))  # the bound would not hide a wrong lever


def test_smooth_curves_with_noise_and_the_default_method(compbox):
    dice = random.Random(3)
    count, noise = 41, 0.2
    curves = {axis: [curve(dice, "um" if k < 3 else "urad", count, smooth=True) for k in range(6)]
              for axis in "XYZ"}
    positions = {axis: write_axis(compbox, axis, curves, count, noise, dice) for axis in "XYZ"}
    machine_file(compbox)
    compbox.good("volumetric", "X", "Y", "Z", *geometry("fXYZ"), "--tool-length-mm", 100, "--name",
                 "vol", "-o", "vol.json")
    compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
    places = [[dice.uniform(0, TRAVEL[axis]) for axis in "XYZ"] for _ in range(40)]
    got = evaluate(compbox, places)
    worst = max(max(abs(numpy.array(matrices("fXYZ", curves, positions, p, 100)[0]) - row[:3]))
                for p, row in zip(places, got))
    # 18 curves of 0.2 um (urad) noise, halved by the fit, on levers up to 1.4 m
    assert worst < 1.0


def test_the_tool_length_may_be_a_signal(compbox):
    dice = random.Random(9)
    curves = {axis: [curve(dice, "um" if k < 3 else "urad") for k in range(6)] for axis in "XYZ"}
    positions = {axis: write_axis(compbox, axis, curves) for axis in "XYZ"}
    machine_file(compbox)
    machine = compbox.read("machine.json")
    machine["signals"].append({"name": "L", "unit": "mm", "plc": 14, "min": 0, "max": 500})
    compbox.write("machine.json", machine)
    compbox.good("volumetric", "X", "Y", "Z", *geometry("fXYZ"), "--tool-length", "L", "--method",
                 "polyline", "--name", "vol", "-o", "vol.json")
    compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
    place = [321.0, 456.0, 123.0]
    want, bound = matrices("fXYZ", curves, positions, place, 240)
    assert evaluate(compbox, [place], ",240")[0][:3] == pytest.approx(want, abs=bound + 1e-3)


def test_what_is_missing_is_zero_and_reported(compbox):
    dice = random.Random(1)
    curves = {axis: [curve(dice, "um") for _ in range(6)] for axis in "XYZ"}
    write_axis(compbox, "X", curves)
    (compbox.folder / "X/EAX.csv").unlink()
    out = compbox.good("volumetric", "X", "--chain", "fXYZ", "--name", "vol", "-o", "vol.json")
    assert "not measured, zero: EAX, EXY, EYY, EZY, EAY, EBY, ECY, EXZ, EYZ, EZZ, EAZ, EBZ, ECZ" in out
    assert "squareness C0Y, B0Z, A0Z not given: zero" in out
    term = compbox.read("vol.json")["terms"][-1]
    assert term["errors"] == ["EXX", "EYX", "EZX", "EBX", "ECX"]
    assert term["squareness_urad"] == {"C0Y": 0.0, "B0Z": 0.0, "A0Z": 0.0}


def test_a_slope_and_its_squareness_count_twice_and_that_is_reported(compbox):
    folder = compbox.folder / "Y"
    folder.mkdir()
    rows = "".join(f"{y},{0.02 * y}\n" for y in range(0, 801, 100))
    (folder / "EXY.csv").write_text("position_mm,error_um\n" + rows)
    out = compbox.good("volumetric", "Y", "--chain", "fXYZ", "--squareness", "C0Y=3", "--name",
                       "vol", "-o", "vol.json")
    assert "C0Y is given, but the curve EXY keeps a slope of 20.0 urad" in out


def test_json_and_the_reference_point_of_identify(compbox):
    dice = random.Random(1)
    curves = {axis: [curve(dice, "um") for _ in range(6)] for axis in "XYZ"}
    write_axis(compbox, "Y", curves)
    compbox.write("Y/report.json", {"axis": "Y", "reference_point_mm": [1, 2, 3]})
    found = json.loads(compbox.good("volumetric", "Y", "--chain", "fXYZ", "--name", "vol", "--json",
                                    "-o", "vol.json"))
    assert found["reference_points_mm"] == {"X": [0, 0, 0], "Y": [1, 2, 3], "Z": [0, 0, 0]}
    assert compbox.read("vol.json")["terms"][-1]["reference_points_mm"]["Y"] == [1, 2, 3]


def test_bad_folders(compbox):
    call = ("--chain", "fXYZ", "--name", "vol", "-o", "vol.json")
    assert compbox.refused("volumetric", "X", *call) == "X: is not a folder"
    (compbox.folder / "X").mkdir()
    assert compbox.refused("volumetric", "X", *call).startswith("X: holds none of EXX.csv")
    (compbox.folder / "X/EXX.csv").write_text("position_mm,error_urad\n0,1\n1,2\n2,3\n3,4\n4,5\n")
    assert compbox.refused("volumetric", "X", *call) == (
        "X/EXX.csv: EXX is a displacement: its column must be error_um")
    (compbox.folder / "X/EXX.csv").write_text("position_mm,error_um\n0,1\n1,2\n2,x\n")
    assert compbox.refused("volumetric", "X", *call) == "X/EXX.csv:4:3: 'x' is not a finite number"
    (compbox.folder / "X/EXX.csv").write_text("position_mm,error_um\n0,1\n1,2\n2,3\n3,4\n4,5\n")
    assert compbox.refused("volumetric", "X", "X", *call).startswith(
        "X/EXX.csv: EXX is already in X/EXX.csv")
    compbox.write("X/report.json", {"axis": "Q", "reference_point_mm": [1, 2, 3]})
    assert compbox.refused("volumetric", "X", *call).startswith("X/report.json: axis must be")


@pytest.mark.parametrize("wrong", [
    ["--chain", "XYZ"], ["--chain", "fXXZ"], ["--chain", "fXYZ", "--squareness", "C0X=1"],
    ["--chain", "fXYZ", "--squareness", "C0Y=nan"],
    ["--chain", "fXYZ", "--squareness", "C0Y=1,2"], ["--chain", "fXYZ", "--squareness", "C0Y=1,"],
    ["--chain", "fXYZ", "--squareness", "C0Y=1,C0Y=2"],
    ["--chain", "fXYZ", "--reference-point", "X=1,2"],
    ["--chain", "fXYZ", "--tool-direction=0,0,2"],
    ["--chain", "fXYZ", "--tool-length-mm", "3", "--tool-length", "L"], []])
def test_wrong_usage(compbox, wrong):
    (compbox.folder / "X").mkdir()
    assert compbox("volumetric", "X", *wrong, "--name", "v", "-o", "v.json").returncode == 2


def test_help(compbox):
    assert "compbox volumetric " in compbox.good("volumetric", "--help").split("Example:")[1]


STRAIGHT = dict.fromkeys(SQUARENESS, 0.0)
ROLL = {"EAX": 30.0, "EBY": -24.0, "ECZ": 18.0}  # urad from end to end
# The last axis before the tool has one lever arm, so its linear roll is the same as squareness.
UNSEEN = {"fXYZ": "ECZ", "YfXZ": "ECZ", "XYfZ": "ECZ", "ZYXf": "EAX"}


def diagonals_of(low, high, count=5):
    """Both diagonals of the six faces and the four of the body: names and targets."""
    made = []
    for axis in range(3):
        one, two = [a for a in range(3) if a != axis]
        for fixed in (low[axis], high[axis]):
            for falls in (False, True):
                start, end = list(low), list(high)
                start[axis] = end[axis] = fixed
                if falls:
                    start[two], end[two] = end[two], start[two]
                made.append((f"{'XYZ'[one]}{'XYZ'[two]} at {fixed:g}{' falling' if falls else ''}", start, end))
    for falls in ((), (1,), (2,), (1, 2)):
        start, end = list(low), list(high)
        for a in falls:
            start[a], end[a] = end[a], start[a]
        made.append(("body" + "".join(" falling " + "XYZ"[a] for a in falls), start, end))
    return [(name, [numpy.array(s) + (numpy.array(e) - numpy.array(s)) * k / (count - 1) for k in range(count)])
            for name, s, e in made]


def laser_along(compbox, error_at, dice, noise=0.0, keep=lambda name: True, count=5):
    """d.csv: what a laser shows along the diagonals, each run with a zero of its own, the air 3 ppm off."""
    rows = ["diagonal,run,X_mm,Y_mm,Z_mm,error_um"]
    for name, targets in diagonals_of((100, 80, 60), (900, 700, 500), count):
        if not keep(name):
            continue
        along = (targets[-1] - targets[0]) / numpy.linalg.norm(targets[-1] - targets[0])
        for run in (1, 2):
            zero = dice.uniform(-30, 30)
            for place in targets:
                shown = along @ (error_at(place) + 3e-3 * (place - targets[0])) + zero + dice.gauss(0, noise)
                rows.append(f"{name},{run}," + ",".join(repr(float(p)) for p in place) + f",{shown!r}")
    compbox.write("d.csv", "\n".join(rows) + "\n")


def aligned(places, errors):
    """Errors behind the best shift and turn of the workpiece, which no length shows."""
    unit = numpy.eye(3)
    columns = [numpy.tile(shift, (len(places), 1)) for shift in unit]
    columns += [numpy.cross(turn, numpy.array(places) / 1000) for turn in unit]
    motion = numpy.array([column.ravel() for column in columns]).T
    return errors - (motion @ numpy.linalg.lstsq(motion, errors.ravel(), rcond=None)[0]).reshape(errors.shape)


class RollingMachine:
    """Curves without linear roll, as identify writes them, and the machine that has it."""

    def __init__(self, compbox, chain, dice):
        self.chain, self.errors = chain, {}
        self.shown = {axis: [curve(dice, "um" if k < 3 else "urad", smooth=True) for k in range(6)] for axis in "XYZ"}
        self.positions = {axis: write_axis(compbox, axis, self.shown) for axis in "XYZ"}
        self.real = {axis: list(self.shown[axis]) for axis in "XYZ"}
        for k, (name, rise) in enumerate(ROLL.items()):
            p = self.positions[name[2]]
            self.real[name[2]][3 + k] = self.shown[name[2]][3 + k] + rise * (p - p.mean()) / (p[-1] - p[0])

    def error(self, place):
        at = tuple(place)
        if at not in self.errors:
            self.errors[at] = numpy.array(matrices(self.chain, self.real, self.positions, place, 175)[0])
        return self.errors[at]

    def error_by_curves(self, place):
        return numpy.array(matrices(self.chain, self.shown, self.positions, place, 175, STRAIGHT)[0])

    def options(self):
        return [option for option in geometry(self.chain) if "C0Y" not in option and "A0Z" not in option
                and option != "--squareness"] + ["--tool-length-mm", 175, "--method", "polyline", "--name", "vol"]


def adjusted(compbox, machine, *more):
    out = compbox.good("volumetric", "X", "Y", "Z", *machine.options(), "--diagonals", "d.csv", *more, "--json",
                       "-o", "vol.json")
    return json.loads(out)


@pytest.mark.parametrize("chain, compensated", [("fXYZ", False), ("fXYZ", True), ("YfXZ", False), ("XYfZ", True),
                                                ("ZYXf", False)])
def test_diagonals_show_squareness_and_linear_roll(compbox, chain, compensated):
    dice = random.Random(chain)
    machine = RollingMachine(compbox, chain, dice)
    laser_along(compbox, lambda place: machine.error(place) - compensated * machine.error_by_curves(place), dice)
    report = adjusted(compbox, machine, *(["--compensated"] if compensated else []))
    found, hidden = report["diagonals"]["found_urad"], report["diagonals"]["hidden"]
    assert hidden == [UNSEEN[chain]]
    assert report["remarks"] == [f"the diagonals do not show the linear part of {hidden[0]}, or show it as "
                                 "squareness: zero"]
    for name in set(ROLL) - set(hidden):
        assert found[name]["value"] == pytest.approx(ROLL[name], abs=0.1)
    assert report["diagonals"]["scale_ppm"] == pytest.approx(3, abs=0.05)
    machine_file(compbox)
    compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
    places = [[dice.uniform(0, TRAVEL[axis]) for axis in "XYZ"] for _ in range(40)]
    left = evaluate(compbox, places)[:, :3] - numpy.array([machine.error(place) for place in places])
    before = numpy.array([machine.error_by_curves(place) - machine.error(place) for place in places])
    assert abs(aligned(places, left)).max() < 0.15 and abs(aligned(places, before)).max() > 5


def test_the_stated_sigma_is_the_scatter(compbox):
    dice = random.Random(21)
    machine = RollingMachine(compbox, "fXYZ", dice)
    shares = []
    for _ in range(25 if LONG else 12):
        laser_along(compbox, machine.error, dice, noise=0.5)
        found = adjusted(compbox, machine)["diagonals"]
        assert found["residual_um"] == pytest.approx(0.5, rel=0.3)
        shares += [(found["found_urad"][name]["value"] - ROLL[name]) / found["found_urad"][name]["sigma"]
                   for name in ("EAX", "EBY")]
        assert found["found_urad"]["C0Y"]["value"] == pytest.approx(12.5, abs=5 * found["found_urad"]["C0Y"]["sigma"])
    assert 0.75 < numpy.sqrt(numpy.mean(numpy.square(shares))) < 1.3  # 50 or 24 values


def test_what_diagonals_do_not_show_is_zero_and_named(compbox):
    dice = random.Random(4)
    machine = RollingMachine(compbox, "fXYZ", dice)
    laser_along(compbox, machine.error, dice, keep=lambda name: name.startswith("XY at 60"))
    report = adjusted(compbox, machine)
    assert report["diagonals"]["hidden"] == ["B0Z", "A0Z", "EAX", "EBY", "ECZ"]
    assert list(report["diagonals"]["found_urad"]) == ["C0Y"]
    assert report["squareness_urad"]["B0Z"] == 0
    assert "the diagonals do not show A0Z, which needs both diagonals of a face: zero" in report["remarks"]
    laser_along(compbox, machine.error, dice, keep=lambda name: name == "XY at 60")
    assert adjusted(compbox, machine)["diagonals"]["found_urad"] == {}, "a scale looks like squareness on one diagonal"


def test_squareness_that_is_given_is_not_solved(compbox):
    dice = random.Random(5)
    machine = RollingMachine(compbox, "fXYZ", dice)
    laser_along(compbox, machine.error, dice)
    report = adjusted(compbox, machine, "--squareness", "C0Y=12.5")
    assert "C0Y" not in report["diagonals"]["found_urad"] and report["squareness_urad"]["C0Y"] == 12.5
    assert report["diagonals"]["found_urad"]["EAX"]["value"] == pytest.approx(30, abs=0.1)


def test_a_table_of_diagonals_that_cannot_be(compbox):
    machine = RollingMachine(compbox, "fXYZ", random.Random(6))
    header = "diagonal,X_mm,Y_mm,Z_mm,error_um\n"
    good = "a,0,0,0,0\na,600,800,0,1\n"

    def refused(text, *options):
        compbox.write("d.csv", text)
        return compbox.refused("volumetric", "X", "Y", "Z", *machine.options(), "--diagonals", "d.csv", *options,
                           "-o", "vol.json")

    assert "d.csv:4: this target is not on the line" in refused(header + good + "a,300,410,0,2\n")
    assert "d.csv:4: the diagonal 'b' needs two targets or more" in refused(header + good + "b,1,2,3,0\n")
    assert "Z_mm" in refused("diagonal,X_mm,Y_mm,error_um\na,0,0,0\na,1,1,0\n")
    assert "d.csv:3:7: " in refused(header + "a,0,0,0,0\na,1,1,?,0\n")
