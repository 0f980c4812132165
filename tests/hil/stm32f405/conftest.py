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
def text_of():
    """Makes the text of machine.py's file, over RTU, with a revision and a change."""
    def make(revision=7, change=None):
        data = machine.coefficients(0, over_rtu(change))
        data["revision"] = revision
        return json.dumps(data, indent=1)
    return make


@pytest.fixture
def start_box(tmp_path, text_of):
    """Makes a Box with that file in slot A, its PLC on plc.sock."""
    def start(change=None, **how):
        text = text_of(change=change)
        (tmp_path / "coefficients.json").write_text(text)
        return emulator.Box(tmp_path, {"A": emulator.packed(text, 7)}, plc=tmp_path / "plc.sock", **how)
    return start
