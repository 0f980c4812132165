# SPDX-License-Identifier: MIT
"""compboxd and fakeplc on a serial line: compensation arrives, and each fault of the line is survived."""
import csv
import json
import os
import pathlib
import shutil
import socket
import subprocess
import time

import pytest

import box as box_module
from box import until
from pt100 import with_crc
from steps import LOST, PERIOD_US

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPY = os.environ.get("SPY", ROOT / "build/host/tests/hil/libhil_spy.so")
FAKEPLC = os.environ.get("FAKEPLC", ROOT / "build/host/bin/fakeplc")
LIMITS = {"limit_um": 300, "error_um": 400, "slew_um_per_s": 2000}


def coefficients(device):
    """The usual registers of fakeplc for X; EXX is 20 µm at 500 mm, so the box writes -20."""
    return {
        "format": "compbox/1", "revision": 1, "machine": {"name": "serial"}, "cycle": {"period_ms": 30},
        "plc": {"profile": "generic", "exchange": "fc3+fc16",
                "transport": {"rtu": {"device": device, "baud": 115200, "slave_delay_ms": 1}},
                "read": {"start": 0, "count": 26}, "write": {"start": 100, "count": 6},
                "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,
                "heartbeat_timeout_ms": 200},
        "signals": [{"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001,
                     "min": 0, "max": 1000}],
        "terms": [{"name": "EXX", "type": "polyline", "signal": "X", "positions": [0, 1000],
                   "values": [20, 20]}],
        "channels": [{"name": "X", "sum": ["EXX"], "plc": 104, "type": "int32", "scale": 0.00001,
                      "applied": 24, **LIMITS}],
        "safety": {"hold_ms": 1000, "ramp_um_per_s": 500},
    }


class FakePlc:
    """fakeplc at an address; command() returns the reply."""

    def __init__(self, listen, *arguments):
        self._process = subprocess.Popen([FAKEPLC, "--listen", listen, *arguments], text=True,
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         preexec_fn=box_module.run_before_others)
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
    def applied_um(self):
        words = dict(word.split("=") for word in self.command("status").split()[1:] if "=" in word)
        return float(words["applied_X"])


def reaches(plc, um, timeout_s=60):
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        if abs(plc.applied_um - um) < 0.1:
            return True
        time.sleep(0.05)
    return False


@pytest.fixture(scope="module")
def rig(tmp_path_factory, lines):
    """A box that compensates over a pseudo-terminal."""
    map_file = tmp_path_factory.mktemp("serial") / "coefficients.json"
    device = lines + "/line"
    map_file.write_text(json.dumps(coefficients(device)))
    with FakePlc("rtu:" + device, "--map", str(map_file)) as plc:
        assert plc.printed == "fakeplc: listening on rtu:" + device
        with box_module.Box(map_file) as box:
            assert reaches(plc, -20), plc.command("status")
            yield plc, box
            box.stop()
            assert box.code == 0, box.log


@pytest.mark.parametrize("fault, counter", [
    ("crc 3", "crc_errors"), ("noise 3 5", "noise_bytes"), ("wrong-id 3", "wrong_units"),
    ("truncate 3", "crc_errors"), ("late 45 3", "timeouts"), ("drop 2", "timeouts"),
    ("short 3 read", None), ("long 3 read", None), ("exception 4 3 read", "exceptions"),
    ("dribble 2 2", None), ("away 700", "disconnects"), ("close", "disconnects")])
def test_fault_is_survived(rig, fault, counter):
    plc, box = rig
    assert plc.command("fault " + fault).startswith("ok")
    time.sleep(0.3)
    assert reaches(plc, -20), (fault, plc.command("status"))
    rig_counters.add(counter)


rig_counters = set()


def test_the_statistics_name_what_happened(rig):
    plc, box = rig
    until(lambda: all(box.stats["plc"][name] >= 1 for name in rig_counters - {None}))
    counted = box.stats["plc"]
    assert counted["replies"] > 0.5 * counted["requests"]


ENOUGH = 8              # faults that met a box and a PLC on time
SCAN_LATE_S = 0.013     # between two scans of the PLC, 8 ms if it is on time
LATE_US = 2000


def met(command, log, steps):
    """out: the cycles around each of these commands, by the box's heartbeat, where box and PLC ran on time"""
    rows = list(csv.DictReader(log.read_text().rpartition("\n")[0].splitlines()))
    by_beat, found = {step.heartbeat: i for i, step in enumerate(steps)}, []
    for i, row in enumerate(rows):
        if "command " + command not in row["event"].split(" | "):
            continue
        begin_s = float(row["time_s"])
        some = [r for r in rows[max(0, i - 10):i + 60] if abs(float(r["time_s"]) - begin_s) < 0.2]
        times = [float(r["time_s"]) for r in some]
        first, last = (by_beat.get(int(r["box_heartbeat"])) for r in (some[0], some[-1]))
        if first is None or last is None or times[-1] - begin_s < 0.15 or max(
                b - a for a, b in zip(times, times[1:])) > SCAN_LATE_S:
            continue
        cycles = steps[first:last + 1]
        gaps = [b.read_us - a.read_us - 2 * PERIOD_US for a, b in zip(cycles, cycles[1:])]
        if all(abs(gap) < LATE_US for gap in gaps) and not any(step.missed_ticks for step in cycles):
            found.append(cycles)
    return found


@pytest.mark.parametrize("fault, counter", [("crc 1 read", "crc_errors"), ("crc 1 write", "crc_errors"),
                                            ("drop 1 read", "timeouts")])
def test_where_there_is_time_a_request_is_repeated_in_its_period(tmp_path, lines, fault, counter):
    """In 60 ms at 460 800 baud there is: what is spoilt or lost now and then costs no cycle. Without
    repetition each fault would cost one at least. Judged where box and PLC were on time around the fault."""
    device = lines + "/again"
    data = coefficients(device)
    data["cycle"]["period_ms"] = 60
    data["plc"]["transport"]["rtu"]["baud"] = 460800
    map_file, log = tmp_path / "coefficients.json", tmp_path / "plc.csv"
    map_file.write_text(json.dumps(data))
    arguments = ["--map", str(map_file), "--log", str(log)]
    with FakePlc("rtu:" + device, *arguments) as plc, box_module.Box(map_file) as box:
        assert reaches(plc, -20), plc.command("status")

        def judged():
            assert plc.command("fault " + fault).startswith("ok")
            time.sleep(0.25)
            found = met("fault " + fault, log, box.steps)
            return found if len(found) >= ENOUGH else None

        found = until(judged)
        assert reaches(plc, -20), plc.command("status")
        box.stop()
    assert box.code == 0, box.log
    counted = box.stats["plc"]
    assert min(sum(counted[name] for name in {counter, "timeouts"}), counted["retries"]) >= len(found) // 2, counted
    lost = [cycles for cycles in found if not all(step.read_ok and step.last_write not in LOST for step in cycles)]
    assert len(lost) <= len(found) // 2, (lost, counted)


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
    assert counts["cycles"] > 50 and counts["writes"] > 50, counts
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
                client.settimeout(5)
                client.connect(path)
                client.sendall(request)
                reply = b""
                while len(reply) < 9:
                    reply += client.recv(64)
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
            listener.settimeout(5)
            peer, _ = listener.accept()
            with peer:
                peer.sendall(request)
                peer.settimeout(5)
                assert peer.recv(64)[:2] == bytes([1, 3])


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll is not installed")
def test_libmodbus_as_client_reads_fakeplc(lines):
    """The other direction: libmodbus' own RTU client (mbpoll) takes fakeplc's replies."""
    device = lines + "/mbpoll"
    with FakePlc("rtu:" + device) as plc:
        assert plc.command("status").startswith("ok")
        done = subprocess.run(["mbpoll", "-m", "rtu", "-a", "1", "-b", "115200", "-P", "none", "-t", "4",
                               "-0", "-r", "0", "-c", "4", "-1", device], capture_output=True, text=True,
                              timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "[0]:" in done.stdout and "[3]:" in done.stdout
