# SPDX-License-Identifier: MIT
"""What the command-line tests share: run compbox in a fresh folder, make small inputs."""

import json
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("COMPBOX_BIN", ROOT / "build/host/bin"))
LONG = "COMPBOX_LONG_TESTS" in os.environ  # scripts/test --long
GANTRY = ROOT / "examples/gantry-straightness"
PLC = ("--host", "127.0.0.1", "--port", "1502")  # of init: fakeplc


class Compbox:
    """compbox in one folder. A call returns what it printed and its exit code."""

    def __init__(self, folder):
        self.folder, self.environment = folder, None

    def __call__(self, *arguments):
        return subprocess.run([BIN / "compbox", *map(str, arguments)], cwd=self.folder, env=self.environment,
                              capture_output=True, text=True, timeout=120)

    def good(self, *arguments):
        """Runs it; it must exit 0. Returns stdout."""
        done = self(*arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def refused(self, *arguments):
        """Runs it on bad input: exit 1, one sentence on stderr, no new or changed file.
        Returns the sentence without 'compbox: '."""
        before = self.files()
        done = self(*arguments)
        assert done.returncode == 1, (done.returncode, done.stdout, done.stderr)
        assert self.files() == before
        assert done.stderr.startswith("compbox: ") and done.stderr.count("\n") == 1, done.stderr
        return done.stderr[len("compbox: "):-1]

    def files(self):
        return {path.name: path.read_bytes() for path in self.folder.iterdir() if path.is_file()}

    def write(self, name, content):
        text = content if isinstance(content, str) else json.dumps(content, indent=2)
        (self.folder / name).write_text(text)
        return name

    def read(self, name):
        return json.loads((self.folder / name).read_text())

    def table(self, name):
        """A CSV as {column: [numbers]}."""
        lines = (self.folder / name).read_text().splitlines()
        rows = [list(map(float, line.split(","))) for line in lines[1:]]
        return {key: [row[i] for row in rows] for i, key in enumerate(lines[0].split(","))}


@pytest.fixture
def compbox(tmp_path):
    return Compbox(tmp_path)


def term(name="EZX", signal="X", values=(0, 10, 0), travel=(0, 1000), **more):
    """A fragment with a polyline, equally spaced."""
    step = (travel[1] - travel[0]) / (len(values) - 1)
    positions = [travel[0] + i * step for i in range(len(values))]
    curve = {"name": name, "type": "polyline", "signal": signal, "positions": positions,
             "values": list(values)}
    return {"terms": [{**curve, **more}]}


@pytest.fixture
def machine(compbox):
    """machine.json of an X-Y-Z machine with 1000 mm of travel in each axis."""
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel",
                 "X=1000,Y=1000,Z=1000", "-o", "machine.json")
    return compbox.read("machine.json")


@pytest.fixture
def plc(compbox):
    """Starts fakeplc and a machine file for it; returns the former."""
    from commissioning import start_plc  # which imports this module
    started = []

    def start(*arguments, **how):
        started.append(start_plc(compbox, *arguments, **how))
        return started[-1]

    yield start
    for one in started:
        one.end()
