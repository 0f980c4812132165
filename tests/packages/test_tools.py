# SPDX-License-Identifier: MIT
"""compbox for arm64, as its package installs it, under qemu-user: the figures of amd64. The box's own arithmetic
gives the same bits; what else is computed adds up in another order there and agrees as closely as stated here."""
import csv
import json
import math
import shutil
import subprocess

import pytest

from test_packages import PACKAGES, ROOT, VERSION, run

SYSROOT = ROOT / "build/debian/sysroot"
GANTRY, NINE_LINE = ROOT / "examples/gantry-straightness", ROOT / "examples/nine-line"
REFERENCE = {"X": "0,1000,900", "Y": "0,0,700", "Z": "0,-150,400"}
RELATIVE = 1e-6      # of what is written as float32
LINEAR_UM = 1e-9
AS_GOOD = 0.01


class Tools:
    """The tools of one architecture, in a folder of their own."""

    def __init__(self, folder, architecture):
        self.folder = folder / architecture
        run("dpkg-deb", "-x", PACKAGES / f"compbox_{VERSION}-1_{architecture}.deb", self.folder)
        self.emulator = ["qemu-aarch64", "-L", SYSROOT] if architecture == "arm64" else []

    def run(self, program, *words):
        return run(*self.emulator, self.folder / "usr/bin" / program, *words, cwd=self.folder)

    def compbox(self, *words):
        return self.run("compbox", *words)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tools")
    return Tools(folder, "amd64"), Tools(folder, "arm64")


def assert_close(a, b, where=""):
    """The same JSON but for the last digits of its numbers."""
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            assert_close(a[key], b[key], f"{where}/{key}")
    elif isinstance(a, list):
        assert len(a) == len(b), where
        for i, pair in enumerate(zip(a, b)):
            assert_close(*pair, f"{where}/{i}")
    elif isinstance(a, float) or isinstance(b, float):
        assert math.isclose(a, b, rel_tol=RELATIVE, abs_tol=1e-6), (where, a, b)
    else:
        assert a == b, where


def fit(tools):
    """The gantry's six curves; out: what was written."""
    terms = {}
    for curve in ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY"):
        tools.compbox("fit", GANTRY / "measurements" / f"{curve}.csv", "--name", curve, "--signal", curve[2],
                      "--line", "least-squares", "-o", f"{curve}.json")
        terms[curve] = json.loads((tools.folder / f"{curve}.json").read_text())
    return terms


def test_fits_find_the_same_curves(both):
    here, there = map(fit, both)
    assert_close(here, there)
    assert all(len(there[curve]["terms"][0]["control_points"]) > 4 for curve in there)


def identify(tools):
    """Nine lines an axis to a coefficient file. out: (numbers of the eighteen errors, the file)"""
    errors = []
    for axis, point in REFERENCE.items():
        lines = [NINE_LINE / axis / f"P{number}{along}.rtl" for number in "123" for along in "xyz"]
        tools.compbox("assemble", *lines, "-o", f"{axis}.csv")
        tools.compbox("identify", f"{axis}.csv", "--axis", axis, "--points", NINE_LINE / f"{axis}.plan.json",
                      f"--reference-point={point}", "-o", f"identified/{axis}")
        for file in sorted((tools.folder / "identified" / axis).glob("E*.csv")):
            errors += [float(cell) for line in file.read_text().splitlines()[1:] for cell in line.split(",")]
    tools.compbox("volumetric", *(f"identified/{axis}" for axis in REFERENCE), "--chain", "fXYZ", "--diagonals",
                  NINE_LINE / "diagonals.csv", "--tool-length-mm", "120", "--name", "vol", "-o", "vol.json")
    tools.compbox("init", "--axes", "XYZ", "--profile", "generic", "--host", "127.0.0.1", "--travel",
                  "X=4000,Y=2000,Z=1000", "-o", "machine.json")
    tools.compbox("build", "machine.json", "vol.json", "-o", "coefficients.json")
    return errors, json.loads((tools.folder / "coefficients.json").read_text())


def test_identification_finds_the_same_errors(both):
    here, there = map(identify, both)
    worst = max(abs(a - b) for a, b in zip(here[0], there[0], strict=True))
    print(f"nine lines, largest difference of an error: {worst:g} µm or µrad")
    assert len(here[0]) > 1000 and worst < LINEAR_UM
    assert_close(here[1], there[1])


def test_training_finds_the_same_bank(both):
    """What compbox fleet trains by default: a linear map over a bank of lags."""
    banks = []
    for tools in both:
        tools.compbox("train", ROOT / "examples/spindle-thermal/steps.csv", "--outputs", "ch1_um,ch2_um", "--inputs",
                      "t1_degC,t5_degC,spindle_rpm", "--run-column", "spindle_rpm", "--name", "bank", "-o", "bank.json")
        banks.append(json.loads((tools.folder / "bank.json").read_text()))
    assert_close(*banks)


def train(tools, *words):
    """A term for two columns of the spindle's rows; out: for each column (predictions, rms of what they leave)."""
    tools.compbox("train", ROOT / "examples/spindle-thermal/steps.csv", "--outputs", "ch1_um,ch2_um", "--inputs",
                  "t1_degC,t5_degC,spindle_rpm", "--lags", "600", "--run-column", "spindle_rpm", "--name", "net",
                  "--predictions", "predictions.csv", "-o", "net.json", *words)
    with (tools.folder / "predictions.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 8000
    found = []
    for name in ("ch1_um", "ch2_um"):
        predicted = [float(row[f"{name}_predicted"]) for row in rows]
        squares = [(p - float(row[name])) ** 2 for p, row in zip(predicted, rows)]
        found.append((predicted, math.sqrt(sum(squares) / len(squares))))
    return found


def test_training_finds_the_same_linear_map(both):
    here, there = (train(tools, "--hidden", "0") for tools in both)
    worst = max(abs(a - b) for i in range(2) for a, b in zip(here[i][0], there[i][0]))
    print(f"linear map, largest difference of a prediction: {worst:g} µm")
    assert worst < LINEAR_UM


def test_training_finds_a_network_as_good(both):
    """A search along a flat valley stops elsewhere when its sums are added up in another order."""
    here, there = (train(tools, "--hidden", "2", "--rows", "200", "--starts", "1", "--regularise", "evidence",
                         "--keep-network") for tools in both)
    for one, other in zip(here, there):
        print(f"network, rms of what is left: {one[1]:.4f}, {other[1]:.4f} µm")
        assert other[1] == pytest.approx(one[1], rel=AS_GOOD)


def test_the_box_computes_the_same_bits(both):
    """One coefficient file, by amd64's curves; built, checked and evaluated on both."""
    amd64, arm64 = both
    fit(amd64)
    names = [f"{curve}.json" for curve in ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY")]
    for name in names:
        shutil.copy(amd64.folder / name, arm64.folder / name)
    rows = [f"{k},{47.7 * k % 14300},{31.3 * k % 3000},{17.9 * k % 2500}" for k in range(400)]
    answers = []
    for tools in both:
        (tools.folder / "samples.csv").write_text("\n".join(["time_s,X,Y,Z", *rows]) + "\n")
        tools.compbox("build", GANTRY / "machine.json", *names, "-o", "coefficients.json")
        checked = tools.compbox("check", "--json", "coefficients.json")
        tools.compbox("eval", "coefficients.json", "--inputs", "samples.csv", "-o", "out.csv")
        written = [(tools.folder / name).read_text() for name in ("coefficients.json", "out.csv")]
        answers.append([checked, *written])
    assert len(answers[0][-1].splitlines()) == 401
    assert answers[0] == answers[1]


def test_mistakes_are_reported_the_same_way(both):
    printed = []
    for tools in both:
        (tools.folder / "broken.json").write_text('{"format": "compbox/1"')
        done = subprocess.run([*map(str, tools.emulator), tools.folder / "usr/bin/compbox", "check", "broken.json"],
                              cwd=tools.folder, capture_output=True, text=True)
        printed.append((done.returncode, done.stdout, done.stderr))
    assert printed[0] == printed[1] and printed[0][0] == 1
    assert subprocess.run([*map(str, both[1].emulator), both[1].folder / "usr/bin/fakeplc", "--help"],
                          capture_output=True, text=True).stdout.startswith("fakeplc")
