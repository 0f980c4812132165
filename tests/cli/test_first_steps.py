# SPDX-License-Identifier: MIT
"""A new user's first hour: one axis measured, everything else left as init wrote it, and the box
running against fakeplc as two processes."""

import json
import math
import pathlib
import random
import re
import subprocess
import tempfile
import time

import pytest

from conftest import BIN, PLC

FIRST, LAST, STEP = 0, 1000, 50
ACTIVE = "1"


def measured(compbox):
    """EZX.csv: a bow of the X guideway, three runs with 0.3 µm of noise."""
    dice = random.Random(3)
    lines = ["run,position_mm,error_um"]
    for run in (1, 2, 3):
        for x in range(FIRST, LAST + 1, STEP):
            lines.append(f"{run},{x},{40 * math.sin(x / 250) + dice.gauss(0, 0.3):.3f}")
    return compbox.write("EZX.csv", "\n".join(lines) + "\n")


class FakePlc:
    def __init__(self, folder, *arguments):
        self.process = subprocess.Popen(
            [BIN / "fakeplc", "--listen", "127.0.0.1:0", *arguments], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        line = self.process.stdout.readline()
        assert line.startswith("fakeplc: listening on "), self.process.communicate()[1]
        self.port = int(line.rsplit(":", 1)[1])

    def command(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        _, errors = self.process.communicate(timeout=60)
        assert self.process.returncode == 0 and errors == "", errors


def run_box(compbox, plc, condition):
    """compboxd against this PLC until its status is as wanted; out: its statistics."""
    text = (compbox.folder / "coefficients.json").read_text()
    assert text.count('"port": 1502') == 1
    compbox.write("box.json", text.replace('"port": 1502', f'"port": {plc.port}'))
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:  # compboxd does not wait for a disk that others use
        return run_until(compbox, plc, condition, pathlib.Path(folder) / "stats.json")


def run_until(compbox, plc, condition, stats):
    box = subprocess.Popen([BIN / "compboxd", "--config", "box.json", "--stats", stats], cwd=compbox.folder,
                           text=True, stderr=subprocess.PIPE)
    for _ in range(6000):
        status = plc.command("status")
        found = condition(dict(re.findall(r"(\w+)=(\S+)", status)))
        if found:
            break
        time.sleep(0.01)
    box.terminate()
    errors = box.communicate(timeout=60)[1]
    assert found and box.returncode == 0, (status, errors)
    return json.loads(stats.read_text())


@pytest.mark.parametrize("travel", [[], ["--travel", "X=1000,Y=600,Z=400"]],
                         ids=["no travel", "travel"])
def test_from_init_to_a_running_box(compbox, travel):
    measured(compbox)
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "sinumerik-840d", *travel, "-o",
                 "machine.json")
    compbox.good("fit", "EZX.csv", "--name", "EZX", "--signal", "X", "-o", "EZX.json")
    compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
    compbox.good("check", "coefficients.json")
    with FakePlc(compbox.folder, "--map", "coefficients.json") as plc:
        assert plc.command("move X=400 feed=20000").startswith("ok")
        stats = run_box(compbox, plc, lambda status: status["mode"] == ACTIVE)
        answer = plc.command("status")
    assert stats["mode"] == "STOPPED" and stats["plc"]["replies"] > 2, stats
    assert "ACTIVE" in [entry["mode"] for entry in stats["history"]]
    assert " mode=5 " in answer, answer


def test_against_the_usual_registers(compbox):
    """fakeplc without a map: what init laid out is what it serves."""
    measured(compbox)
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    compbox.good("fit", "EZX.csv", "--name", "EZX", "--signal", "X", "-o", "EZX.json")
    compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
    there_um = -40 * math.sin(400 / 250)
    with FakePlc(compbox.folder, "--profile", "generic", "--log", "plc.csv") as plc:
        plc.command("move X=400 feed=20000")
        run_box(compbox, plc, lambda status: status["moving"] == "0" and status["commanded_X"] == "0"
                and abs(float(status["commanded_Z"]) - there_um) < 1)
    header, *rows = [line.split(",") for line in
                     (compbox.folder / "plc.csv").read_text().splitlines()]
    at = {name: header.index(name) for name in ("X_mm", "commanded_Z_um", "commanded_X_um")}
    # run_box() saw the value there; the log of scans, of which a busy machine misses some, shows nothing beyond it.
    there = [row for row in rows if float(row[at["X_mm"]]) == 400.0]
    assert there and min(float(row[at["commanded_Z_um"]]) for row in there) > there_um - 1
    assert {float(row[at["commanded_X_um"]]) for row in rows} == {0.0}


def test_a_command_that_is_none_and_the_version():
    def printed(*arguments):
        done = subprocess.run(list(map(str, arguments)), capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr
    assert printed(BIN / "compbox", "biuld", "x.json") == (
        2, "", "compbox: there is no command 'biuld'; compbox --help lists them\n")
    project = (pathlib.Path(__file__).parents[2] / "CMakeLists.txt").read_text()
    version = re.search(r"^project\(compbox VERSION ([\d.]+)", project, re.M)[1]
    for name in ("compbox", "compbox-view", "compboxd", "fakeplc", "fakept100"):
        assert printed(BIN / name, "--version") == (0, f"{name} {version}\n", "")
