# SPDX-License-Identifier: MIT
"""A failed assertion in a running daemon (docs/faults.md): it aborts, the PLC takes the offset to zero, and the program
that the supervisor starts anew waits for permission."""
import os
import pathlib
import signal

import machine
from box import PROGRAM, Box
from fakeplc import FakePlc
from machine import ACTIVE, RAMP

PLANTED = os.environ.get("PLANTED_ASSERTION", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/compboxd_planted_assertion"))
UNIT = pathlib.Path(__file__).parents[2] / "packaging/compboxd.service"


def largest_um(status):
    return max(abs(um) for key, um in status.items() if key.startswith("applied_"))


def test_a_failed_assertion_ends_the_program_and_the_plc_takes_the_offset_back(tmp_path):
    registers = machine.write_coefficients(tmp_path / "map.json", 1502)
    with FakePlc("--map", registers) as plc:
        config = machine.write_coefficients(tmp_path / "coefficients.json", plc.port)
        for command in ("signal X 4000", "signal Y 200", "signal Z 1500", "enable 1", "reference 1", "permit 0"):
            plc.command(command)
        box = Box(config)
        box.arguments[:len(PROGRAM)] = [PLANTED]
        with box:
            plc.wait(lambda status: status["mode"] == ACTIVE and largest_um(status) > 10)
            box.wait()
        assert box.code == -signal.SIGABRT
        assert "compboxd_planted_assertion: assertion failed at firmware/box/mode.c:" in box.log, box.log
        plc.wait(lambda status: not status["alive"] and largest_um(status) == 0)
        assert "\nRestart=always\n" in UNIT.read_text()
        with Box(config) as again:
            plc.wait(lambda status: status["mode"] == RAMP and status["reason"] == 7)
            plc.wait(lambda status: status["mode"] == RAMP and largest_um(status) == 0)
            plc.command("permit 1")
            plc.wait(lambda status: status["mode"] == ACTIVE and largest_um(status) > 10)
            again.stop()
        assert again.code == 0, again.log
