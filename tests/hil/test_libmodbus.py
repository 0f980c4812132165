# SPDX-License-Identifier: MIT
"""The same values against libmodbus, whose codec shares nothing with pymodbus or the box: over TCP, and
over a serial line."""
import os
import subprocess
import threading

import machine
from box import until
from realtime import run_before_others
from serial_line import NullModem, on_line

PROGRAM = os.environ.get("LIBMODBUS_PLC", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/libmodbus_plc"))
AT_REST = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}


class Libmodbus:
    """The program as a PLC at a port or a serial device; .blocks are what was written to it."""

    def __init__(self, where):
        self.blocks = []
        self._plc = subprocess.Popen([PROGRAM, str(where)], stdin=subprocess.PIPE,
                                     stdout=subprocess.PIPE, text=True, preexec_fn=run_before_others)
        registers = machine.signal_registers(AT_REST)
        registers[machine.CONTROL] = machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME
        self._plc.stdin.write("".join(f"{a} {v}\n" for a, v in registers.items()))
        self._plc.stdin.close()

    def __enter__(self):
        assert self._plc.stdout.readline() == "listening\n"
        threading.Thread(target=self._collect, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._plc.kill()
        self._plc.wait()

    def _collect(self):
        for line in self._plc.stdout:
            self.blocks.append([int(word) for word in line.split()])


def is_at_rest(block):
    um, wanted = machine.written_um(block), machine.wanted_um(AT_REST)
    return block[0] & 0xFF == machine.ACTIVE and all(
        abs(um[name] - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name]) for name in um)


def check(plc, box):
    """Until ten writes had the wanted values; then a clean stop."""
    until(lambda: sum(map(is_at_rest, list(plc.blocks))) >= 10)
    box.stop()
    assert box.code == 0, box.log
    until(lambda: plc.blocks[-1][0] & 0xFF == machine.STOPPED)
    assert machine.written_um(plc.blocks[-1]) == {"X": 0, "Y": 0, "Z": 0}


def test_values_and_stop_against_libmodbus(port, start_box, way):
    with Libmodbus(port) as plc, start_box(change=way) as box:
        check(plc, box)


def test_the_same_over_a_serial_line(start_box, exchange):
    with NullModem() as line, Libmodbus(line.a) as plc, start_box(change=on_line(line.b, exchange)) as box:
        check(plc, box)
        assert box.stats["plc"]["address"] == line.b
        assert box.stats["plc"]["crc_errors"] == box.stats["plc"]["wrong_units"] == 0
