# SPDX-License-Identifier: MIT
"""Real serial devices: unplugged while the loop runs, a socket as QEMU has it, libmodbus as a client."""
import json
import os
import pathlib
import shutil
import socket
import subprocess
import time

import pytest

import box as box_module
import machine
from realtime import run_before_others
from rtu_machine import coefficients, with_crc

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPY = os.environ.get("SPY", ROOT / "build/host/tests/hil/libhil_spy.so")
FAKEPLC = os.environ.get("FAKEPLC", ROOT / "build/host/bin/fakeplc")


class FakePlc:
    """fakeplc at an address; command() returns the reply."""

    def __init__(self, listen, *arguments):
        self._process = subprocess.Popen([FAKEPLC, "--listen", listen, *arguments], text=True,
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         preexec_fn=run_before_others)
        self.printed = self._process.stdout.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()

    def command(self, line):
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    @property
    def status(self):
        return dict(word.split("=") for word in self.command("status").split()[1:])


def reaches(plc, um, timeout_s=200):
    """Waits for an applied value, less long than ctest does for this file. As in plc_memory.py, the operator presses
    reset: only an edge ends a FAULT, so not before the bit is off."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        status = plc.status
        if abs(float(status["applied_X"]) - um) < 0.1:
            return True
        stood_still = (int(status["mode"]), int(status["reason"])) == machine.STOOD_STILL
        if stood_still and not int(status["control"]) & machine.RESET:
            plc.command("reset")
        time.sleep(0.05)
    return False


@pytest.mark.skipif(len(box_module.PROGRAM) > 1, reason="the spy is not of the emulated machine")
def test_a_device_that_is_unplugged_is_not_opened_by_the_loop(tmp_path, lines):
    """Unplugged and plugged in again, twice: survived, counted, and no call of opening or closing it
    is the loop's (counted by a library in between)."""
    device = lines + "/spied"
    map_file = tmp_path / "coefficients.json"
    map_file.write_text(json.dumps(coefficients(device)))
    calls = tmp_path / "spy.txt"
    with box_module.Box(map_file, env={"LD_PRELOAD": str(SPY), "SPY_FILE": str(calls)}) as box:
        for _ in range(3):                   # first it is not even there
            with FakePlc("rtu:" + device, "--map", str(map_file)) as plc:
                assert reaches(plc, -20), plc.command("status")
            os.unlink(device)
        with FakePlc("rtu:" + device, "--map", str(map_file)) as plc:
            assert reaches(plc, -20), plc.command("status")
            box.stop()
    assert box.code == 0, box.log
    assert box.stats["plc"]["connects"] == 4 and box.stats["plc"]["disconnects"] == 3, box.stats["plc"]
    counts = {name: int(count) for name, count in map(str.split, calls.read_text().splitlines())}
    assert counts["cycles"] > 0 and counts["writes"] > 0, counts
    for name in ("files", "terminals", "locks", "allocations", "frees"):
        assert counts[name] == 0, counts


def test_a_socket_serves_the_same_frames(tmp_path):
    """What QEMU's -serial connects to: fakeplc listens, and connects where somebody listens."""
    path = str(tmp_path / "line.sock")
    request = with_crc([1, 3, 0, 0, 0, 2])
    with FakePlc("unix:" + path) as plc:
        assert plc.printed == "fakeplc: listening on unix:" + path
        for _ in range(2):                    # a client may leave and another come
            with socket.socket(socket.AF_UNIX) as client:
                client.settimeout(60)
                client.connect(path)
                client.sendall(request)
                reply = b""
                while len(reply) < 9:
                    more = client.recv(64)
                    assert more, "fakeplc hung up"
                    reply += more
                assert reply[:3] == bytes([1, 3, 4]) and with_crc(reply[:7]) == reply
                client.sendall(with_crc([2, 3, 0, 0, 0, 2]))       # another unit: no answer
                client.settimeout(0.2)
                with pytest.raises(TimeoutError):
                    client.recv(64)
    with socket.socket(socket.AF_UNIX) as listener:
        if os.path.exists(path):
            os.unlink(path)
        listener.bind(path)
        listener.listen(1)
        with FakePlc("unix:" + path):
            listener.settimeout(60)
            peer, _ = listener.accept()
            with peer:
                peer.sendall(request)
                peer.settimeout(60)
                assert peer.recv(64)[:2] == bytes([1, 3])


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll is not installed")
def test_libmodbus_as_client_reads_fakeplc(lines):
    """The other direction: libmodbus' own RTU client (mbpoll) takes fakeplc's replies."""
    device = lines + "/mbpoll"
    with FakePlc("rtu:" + device) as plc:
        assert plc.command("status").startswith("ok")
        done = subprocess.run(["mbpoll", "-m", "rtu", "-a", "1", "-b", "115200", "-P", "none", "-t", "4",
                               "-0", "-r", "0", "-c", "4", "-o", "10", "-1", device], capture_output=True, text=True,
                              timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "[0]:" in done.stdout and "[3]:" in done.stdout
