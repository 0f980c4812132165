# SPDX-License-Identifier: MIT
"""The same files, options and seed give the same bytes: in any folder, at any time, in any locale and time zone, with
any number of threads, with any BLAS, and with the mathematics library of a processor without FMA."""

import os
import shutil
import signal
import subprocess

import pytest

from conftest import BIN, PLC, ROOT

EXAMPLES = ROOT / "examples"
NO_BLAS = os.environ.get("NO_BLAS_LIBRARY", str(ROOT / "build/host/tests/cli/libcli_no_blas.so"))
AXES = {"X": "0,1000,900", "Y": "0,0,700", "Z": "0,-150,400"}
HERE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "TZ": "UTC", "LC_ALL": "C", "LANG": "C"}
ELSEWHERE = {"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4", "TZ": "Pacific/Kiritimati", "LC_ALL": "de_DE.UTF-8",
             "LANG": "tr_TR.UTF-8", "LANGUAGE": "de",
             "LD_PRELOAD": f"{NO_BLAS}:/usr/$LIB/faketime/libfaketime.so.1", "FAKETIME": "@2031-02-28 23:59:58",
             "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"}
ROWS = ("steps.csv", "--outputs", "ch1_um,ch2_um", "--inputs", "t1_degC,t5_degC,spindle_rpm", "--run-column",
        "spindle_rpm")


class Place:
    """A folder with copies of the inputs, and the circumstances under which commands run there."""

    def __init__(self, folder, environment, threads):
        self.folder, self.threads = folder, threads
        self.environment = {**os.environ, **environment}
        folder.mkdir(parents=True)
        for file in (EXAMPLES / "lathe/measurements").glob("*.csv"):
            shutil.copy(file, folder)
        shutil.copy(EXAMPLES / "spindle-thermal/steps.csv", folder)
        shutil.copy(EXAMPLES / "nine-line/diagonals.csv", folder)
        for axis in AXES:
            shutil.copy(EXAMPLES / f"nine-line/{axis}.plan.json", folder)
            shutil.copytree(EXAMPLES / "nine-line" / axis, folder / f"lines{axis}")

    def run(self, *words):
        done = subprocess.run([str(BIN / "compbox"), *map(str, words)], cwd=self.folder,
                              env=self.environment, capture_output=True, timeout=300)
        assert done.returncode == 0, (words, done.returncode, done.stderr)
        with (self.folder / "printed").open("ab") as file:
            file.write(done.stdout + done.stderr)

    def made(self):
        return {str(path.relative_to(self.folder)): path.read_bytes() for path in sorted(self.folder.rglob("*"))
                if path.is_file()}


@pytest.fixture(name="places")
def two_places(tmp_path):
    return [Place(tmp_path / "a", HERE, 1),
            Place(tmp_path / "another folder" / "ü" / "b", ELSEWHERE, 8)]


def assert_same(places, *expected):
    """in: names of files that must have been made"""
    here, there = (place.made() for place in places)
    assert set(expected) | {"printed"} <= here.keys() and here.keys() == there.keys()
    assert [name for name in here if here[name] != there[name]] == []


def test_fit(places):
    for place in places:
        for method in ("bspline", "bspline-lmc", "polynomial", "polyline"):
            place.run("fit", "EXX.csv", "--name", "EXX", "--signal", "X", "--zero-at", 0, "--method", method,
                      "-o", f"{method}.json")
        place.run("fit", "EZZ.csv", "--name", "EZZ", "--signal", "Z", "--band", "band.csv", "--plot", "EZZ.svg",
                  "-o", "EZZ.json")
    assert_same(places, "bspline-lmc.json", "band.csv", "EZZ.svg")


def test_identify_volumetric_and_build(places):
    for place in places:
        for axis, point in AXES.items():
            lines = [f"lines{axis}/P{number}{along}.rtl" for number in "123" for along in "xyz"]
            place.run("assemble", *lines, "-o", f"{axis}.csv")
            place.run("identify", f"{axis}.csv", "--axis", axis, "--points", f"{axis}.plan.json",
                      f"--reference-point={point}", "-o", f"identified/{axis}")
        place.run("volumetric", *(f"identified/{axis}" for axis in AXES), "--chain", "fXYZ", "--diagonals",
                  "diagonals.csv", "--tool-length-mm", 120, "--name", "vol", "-o", "vol.json")
        place.run("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=4000,Y=2000,Z=1000", "-o",
                  "machine.json")
        place.run("build", "machine.json", "vol.json", "-o", "coefficients.json")
    assert_same(places, "identified/X/EAX.csv", "vol.json", "coefficients.json")


def test_identify_by_many_runs_of_a_seed(places):
    for place in places:
        place.run("assemble", *(f"linesX/P{number}{along}.rtl" for number in "123" for along in "xyz"), "-o", "X.csv")
        place.run("identify", "X.csv", "--axis", "X", "--points", "X.plan.json", "--monte-carlo", 200, "--seed", 3,
                  "-o", "identified/X")
    assert_same(places, "identified/X/EAX.csv")


def test_train_a_bank(places):
    for place in places:
        place.run("train", *ROWS, "--name", "bank", "--threads", place.threads, "-o", "bank.json")
    assert_same(places, "bank.json")


def test_train_a_network(places):
    for place in places:
        place.run("train", *ROWS, "--name", "net", "--lags", 600, "--hidden", 2, "--rows", 200, "--starts", 4, "--seed",
                  7, "--keep-network", "--threads", place.threads, "--predictions", "predictions.csv", "-o", "net.json")
    assert_same(places, "net.json", "predictions.csv")


def test_select_inputs(places):
    for place in places:
        place.run("select-inputs", "steps.csv", "--outputs", "ch1_um", "--candidates", "t*", "-o", "chosen.json")
    assert_same(places, "chosen.json")
    chosen = (places[0].folder / "chosen.json").read_text()
    assert str(places[0].folder) not in chosen


def test_the_other_place_is_another_one(places):
    """It has another day, and a BLAS of which each call ends the program."""
    for code, expected in (("import time; print(time.gmtime().tm_year)", (0, "2031\n")),
                           ("import ctypes; ctypes.CDLL(None).dgemm_()", (-signal.SIGABRT, ""))):
        done = subprocess.run(["/usr/bin/python3", "-c", code], env=places[1].environment,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert (done.returncode, done.stdout) == expected
