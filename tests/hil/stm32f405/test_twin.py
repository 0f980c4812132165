# SPDX-License-Identifier: MIT
"""The whole job on the image: curves fitted from measurements, a file packed for the flash, fakeplc with
the simulated gantry behind it; the truth says whether the machine got better."""
import json
import os
import re
import subprocess
import time

import pytest

from conftest import HOST
from emulator import ROOT, Box
from following import counters_of, wait_for
from simulator import Simulator

LONG = bool(os.environ.get("COMPBOX_LONG_TESTS"))
EXAMPLE = ROOT / "examples/gantry-straightness"
CURVES = ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY")
FAULTS = {"crc 3": "crc_errors", "noise 20 3": "noise_bytes", "late 60 2": "timeouts", "wrong-id 3": "wrong_units",
          "truncate 3": "crc_errors", "drop 2": "timeouts", "exception 6 2": "exceptions"}    # and what counts them


class FakePlc(Simulator):
    """fakeplc with the gantry's twin. Baud 0: bytes take no time, which the emulator's slow ways with a
    byte make up for."""

    def __init__(self, folder, baud=0):
        super().__init__("fakeplc", "--profile", "sinumerik-840d", "--listen", f"unix:{folder / 'plc.sock'}",
                         "--baud", baud, "--machine", EXAMPLE / "machine_twin.json", "--map",
                         EXAMPLE / "machine.json", "--log", folder / "plc.csv")

    def error_um(self):
        """((X, Y, Z) without, (X, Y, Z) with compensation), the truth."""
        numbers = [float(number) for number in re.findall(r"=(-?[\d.]+)", self.command("error"))]
        return numbers[:3], numbers[3:]


def run(*command):
    subprocess.run([str(word) for word in command], check=True, capture_output=True)


def flashed(folder):
    """The coefficient file of the example, over a serial line, as it is flashed."""
    machine = json.loads((EXAMPLE / "machine.json").read_text())
    machine["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200}}
    (folder / "machine.json").write_text(json.dumps(machine))
    for curve in CURVES:
        run(HOST / "compbox", "fit", EXAMPLE / f"measurements/{curve}.csv", "--name", curve, "--signal", curve[2],
            "--line", "least-squares", "-o", folder / f"{curve}.json")
    run(HOST / "compbox", "build", folder / "machine.json", *[folder / f"{curve}.json" for curve in CURVES],
        "-o", folder / "coefficients.json")
    run(HOST / "compbox", "pack", folder / "coefficients.json", "-o", folder / "slot.bin")
    return (folder / "slot.bin").read_bytes()


def errors_um(plc, count):
    """Mean of the true error's size over a stretch, (X, Y, Z) without and with compensation."""
    errors = []
    for _ in range(count):
        errors.append(plc.error_um())
        time.sleep(0.05)
    return [[sum(abs(one[when][axis]) for one in errors) / len(errors) for axis in range(3)] for when in (0, 1)]


def started(plc, box):
    """The axes drive their program, and the outputs have had the time to get where they belong."""
    box.console.wait("runs revision 1 of slot B: gantry")
    box.console.wait("now ACTIVE: all is well")
    wait_for(lambda: "moving=1" in plc.command("status"))
    time.sleep(1)


@pytest.mark.parametrize("baud", [0, 115200] if LONG else [0])
def test_the_machine_gets_better(tmp_path, baud):
    slot = flashed(tmp_path)
    with FakePlc(tmp_path, baud) as plc, Box(tmp_path, {"B": slot}, plc=tmp_path / "plc.sock") as box:
        started(plc, box)
        without, compensated = errors_um(plc, 40)
        counters = counters_of(box)
    assert "faults" not in counters and counters["cycles"] > 30, counters
    for name, before, after in zip("XYZ", without, compensated):
        print(f"{name}: {before:.1f} um without compensation, {after:.1f} with")
        assert before > 2, f"{name}: the stretch shows nothing"
        assert after < 0.5 * before, f"{name}: {before} um without, {after} with"


def until_counted(plc, box, fault, counter):
    """Orders the fault until the box has counted one: where a busy machine lets the emulator stand still in
    the middle of a reply, that reply is something else."""
    before = counters_of(box, "wires").get(counter, 0)

    def counted():
        plc.command(f"fault {fault}")
        time.sleep(0.2)  # some exchanges
        return counters_of(box, "wires").get(counter, 0) > before
    wait_for(counted)


def test_faults_of_the_plc_and_its_restart(tmp_path):
    """Whatever fakeplc does to the replies, it is compensated again behind it."""
    slot = flashed(tmp_path)
    with FakePlc(tmp_path) as plc, Box(tmp_path, {"B": slot}, plc=tmp_path / "plc.sock") as box:
        started(plc, box)
        for fault, counter in FAULTS.items():
            until_counted(plc, box, fault, counter)
        plc.command("fault torn 2")
        since = box.console.mark()
        plc.command("restart")
        box.console.wait("now (HOLD|RAMP|STANDBY)", since)
        wait_for(lambda: "mode=1" in plc.command("status") and "alive=1" in plc.command("status"))
