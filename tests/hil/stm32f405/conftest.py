# SPDX-License-Identifier: MIT
import json
import os
import pathlib
import sys

import pytest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import emulator  # noqa: E402
import machine  # noqa: E402
import plc as plc_module  # noqa: E402
import rtu_plc  # noqa: E402

HOST = pathlib.Path(os.environ.get("HOST_BIN", HERE.parents[2] / "build/host/bin"))


def over_rtu(change=None):
    def edit(data):
        data["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200, "unit": 1}}
        if change:
            change(data)
    return edit


@pytest.fixture
def plc():
    return plc_module.Plc()


@pytest.fixture
def rtu(plc, tmp_path):
    """Makes the PLC's server; more of them one after the other are a PLC that restarts."""
    return lambda: rtu_plc.RtuPlc(tmp_path / "plc.sock", {1: plc})


@pytest.fixture
def start_box(tmp_path):
    """Makes a Box with the file of machine.py in slot A, its PLC on plc.sock."""
    def start(change=None, revision=7, **how):
        file = tmp_path / "coefficients.json"
        machine.write_coefficients(file, 0, over_rtu(change))
        text = file.read_text()
        slots = {"A": emulator.packed(text, json.loads(text)["revision"]), **how.pop("slots", {})}
        return emulator.Box(tmp_path, slots, plc=tmp_path / "plc.sock", **how)
    return start
