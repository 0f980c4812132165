# SPDX-License-Identifier: MIT
"""The whole job on the image: curves fitted from measurements, a file packed for the flash, fakeplc with
the simulated gantry behind it; the truth says whether the machine got better."""
import json
import re
import socket
import struct
import subprocess
import time

from conftest import HOST
from emulator import ROOT, Box
from following import counters_of, wait_for
from rtu_plc import RtuPlc, bytes_of, words_of

EXAMPLE = ROOT / "examples/gantry-straightness"
CURVES = ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY")


class TcpDevice:
    """What a Modbus/TCP server holds, for a server on a serial line."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=5)
        self.transaction = 0

    def _ask(self, pdu):
        self.transaction = (self.transaction + 1) & 0xFFFF
        self.socket.sendall(struct.pack(">HHHB", self.transaction, 0, len(pdu) + 1, 1) + pdu)
        got = b""
        while len(got) < 7 or len(got) < 6 + struct.unpack(">H", got[4:6])[0]:
            more = self.socket.recv(512)
            assert more, "fakeplc closed the connection"
            got += more
        assert got[7] == pdu[0], f"refused: {got.hex()}"
        return got[8:]

    def read(self, start, count):
        return words_of(self._ask(struct.pack(">BHH", 3, start, count))[1:])

    def write(self, start, words):
        self._ask(struct.pack(">BHHB", 16, start, len(words), 2 * len(words)) + bytes_of(words))


class FakePlc:
    """fakeplc as a process."""

    def __init__(self, folder):
        self.process = subprocess.Popen(
            [HOST / "fakeplc", "--profile", "sinumerik-840d", "--listen", "127.0.0.1:0", "--machine",
             EXAMPLE / "machine_twin.json", "--map", EXAMPLE / "machine.json", "--log", folder / "plc.csv"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.port = int(self.process.stdout.readline().rpartition(":")[2])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ask("quit")
        self.process.wait(10)

    def ask(self, command):
        self.process.stdin.write(command + "\n")
        return self.process.stdout.readline()

    def error_um(self):
        """((X, Y, Z) without, (X, Y, Z) with compensation), the truth."""
        numbers = [float(number) for number in re.findall(r"=(-?[\d.]+)", self.ask("error"))]
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


def test_the_machine_gets_better(tmp_path):
    slot = flashed(tmp_path)
    with FakePlc(tmp_path) as plc, RtuPlc(tmp_path / "plc.sock", {1: TcpDevice(plc.port)}), \
            Box(tmp_path, {"B": slot}, plc=tmp_path / "plc.sock") as box:
        box.console.wait("runs revision 1 of slot B: gantry")
        box.console.wait("now ACTIVE: all is well", timeout_s=30)
        wait_for(lambda: "moving=1" in plc.ask("status"))
        time.sleep(1)
        errors = []
        for _ in range(40):
            errors.append(plc.error_um())
            time.sleep(0.05)
        counters = counters_of(box)
    assert "faults" not in counters and counters["cycles"] > 30, counters
    for axis, name in enumerate("XYZ"):
        before, after = (sum(abs(one[when][axis]) for one in errors) / len(errors) for when in (0, 1))
        print(f"{name}: {before:.1f} um without compensation, {after:.1f} with")
        assert before > 2, f"{name}: the stretch shows nothing"
        assert after < 0.5 * before, f"{name}: {before} um without, {after} with"
