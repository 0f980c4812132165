# SPDX-License-Identifier: MIT
"""fakept100 on a real serial device, beside the PLC; more of the bus in tests/daemon."""
import os
import pathlib
import subprocess

import machine
from box import until
from pymodbus_plc import PymodbusPlc

FAKEPT100 = os.environ.get("FAKEPT100", pathlib.Path(__file__).resolve().parents[2] /
                          "build/host/bin/fakept100")


def with_bus(device):
    """T1, on which GROW depends, and two more come from modules."""
    def edit(data):
        data["buses"] = [{"name": "pt100", "every_ms": 100, "rtu": {
            "device": device, "baud": 115200, "parity": "none", "slave_delay_ms": 20}}]
        for name, unit, register in (("T1", 5, 0), ("T2", 5, 1), ("T3", 6, 0)):
            signal = {"name": name, "unit": "degC", "bus": "pt100", "unit_id": unit, "register": register,
                      "type": "int16", "scale": 0.1, "min": -10, "max": 90, "max_age_ms": 600}
            data["signals"] = [s for s in data["signals"] if s["name"] != name] + [signal]
    return edit


def is_last(box, name, value):
    """The last whole row of the record has it; a signal that is unknown there has none."""
    rows = [row for row in box.rows if row.get("reason") is not None]
    return rows and rows[-1][name] is not None and abs(rows[-1][name] - value) < 1e-4


def test_one_slow_module_delays_neither_the_plc_nor_the_others(plc, port, start_box, lines):
    """fakept100's modules, one of which answers later than its slave delay again and again."""
    device = lines + "/bus"
    modules = subprocess.Popen([FAKEPT100, "--listen", "rtu:" + device, "--module", "5=35.1,22.2",
                                "--module", "6=20.3"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               text=True)
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}

    def command(words):
        modules.stdin.write(words + "\n")
        modules.stdin.flush()
        return modules.stdout.readline().strip()

    try:
        assert modules.stdout.readline() == f"fakept100: listening on rtu:{device}\n"
        with PymodbusPlc(plc, port), start_box(change=with_bus(device)) as box:
            plc.wait_mode(machine.ACTIVE)
            assert command("late 5 200") == "ok"
            plc.wait_writes(50)
            assert command("set 6 0 25.5") == "ok"
            until(lambda: is_last(box, "T3", 25.5))      # unit 6 is read while 5 is late
            assert command("late 5 0") == "ok"
            until(lambda: is_last(box, "T1", 35.1))
            box.stop()
        assert box.code == 0, box.log
        assert all(row["T1"] is None or abs(row["T1"] - 35.1) < 1e-4 for row in box.rows), \
            "a late answer is never another module's value"
        assert all(row["T3"] in (None, ) or abs(row["T3"] - 20.3) < 1e-4 or abs(row["T3"] - 25.5) < 1e-4
                   for row in box.rows)
        assert command("what") .startswith("error: usage") and command("silent 9 1") == "error: there is no unit 9"
        assert command("quit") == "ok" and modules.wait(60) == 0
    finally:
        modules.kill()
