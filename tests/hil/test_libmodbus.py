# SPDX-License-Identifier: MIT
"""The same values against libmodbus, whose codec shares nothing with pymodbus or the box."""
import os
import subprocess
import threading

import machine
from box import run_before_others

PROGRAM = os.environ.get("LIBMODBUS_PLC", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/libmodbus_plc"))
AT_REST = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35}


def test_values_and_stop_against_libmodbus(port, start_box, exchange):
    registers = machine.signal_registers(AT_REST)
    registers[machine.CONTROL] = machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME
    plc = subprocess.Popen([PROGRAM, str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                           text=True, preexec_fn=run_before_others)
    plc.stdin.write("".join(f"{a} {v}\n" for a, v in registers.items()))
    plc.stdin.close()
    blocks = []

    def collect():
        for line in plc.stdout:
            blocks.append([int(word) for word in line.split()])

    try:
        assert plc.stdout.readline() == "listening\n"
        threading.Thread(target=collect, daemon=True).start()
        with start_box("--cycles", "40", change=exchange) as box:
            box.wait(10)
        assert box.code == 0, box.log
    finally:
        plc.kill()
    wanted = machine.wanted_um(AT_REST)
    at_rest = [machine.written_um(b) for b in blocks[25:35]]
    for um in at_rest:
        for name in um:
            assert abs(um[name] - wanted[name]) <= machine.resolution_um(machine.CHANNELS[name])
    assert machine.written_um(blocks[-1]) == {"X": 0, "Y": 0, "Z": 0}
    assert blocks[-1][0] & 0xFF == machine.STOPPED
