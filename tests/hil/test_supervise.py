# SPDX-License-Identifier: MIT
"""What systemd and the kernel see of the daemon: its messages, its threads, its unit, its calls."""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess

import pytest

import machine
from box import run, until
from machine import ACTIVE
from pymodbus_plc import PymodbusPlc

UNIT = pathlib.Path(__file__).parents[2] / "packaging/compboxd.service"
WATCH_S = 0.5


class Systemd:
    """The other end of NOTIFY_SOCKET."""

    def __init__(self, folder):
        self.path = str(folder / "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)
        self.socket.setblocking(False)
        self.env = {"NOTIFY_SOCKET": self.path, "WATCHDOG_USEC": str(int(WATCH_S * 1e6))}

    def received(self):
        """What came since the last call."""
        messages = []
        while True:
            try:
                messages.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return messages


@pytest.fixture
def systemd(tmp_path):
    return Systemd(tmp_path)


def test_systemd_is_notified_ready_alive_and_stopping(plc, port, start_box, systemd):
    with PymodbusPlc(plc, port), start_box(env=systemd.env) as box:
        plc.wait_mode(ACTIVE)
        received = []
        until(lambda: received.extend(systemd.received()) or received.count("WATCHDOG=1") >= 3)
        assert received[0] == "READY=1"
        assert received.count("READY=1") == 1
        assert "STATUS=ACTIVE: all is well; revision 7" in received
        box.stop()
        assert box.code == 0, box.log
    end = "\n".join(systemd.received())
    assert "STOPPING=1" in end and re.search(r"EXTEND_TIMEOUT_USEC=\d{7}", end)


def test_the_loop_runs_where_it_is_configured_to(plc, port, start_box):
    with PymodbusPlc(plc, port), start_box("--cpu", "0", "--clock", "boottime") as box:
        plc.wait_mode(ACTIVE)
        threads = pathlib.Path(f"/proc/{box.process.pid}/task").iterdir()
        where = {(t / "comm").read_text().strip(): os.sched_getaffinity(int(t.name)) for t in threads}
        assert where["compboxd-loop"] == {0}
        assert where["compboxd"] == os.sched_getaffinity(0)
        box.stop()
        assert box.code == 0, box.log


def test_a_reader_of_stderr_that_stopped_reading_stops_nothing(plc, port, start_box):
    """The pipe is full before the start: every line would block for ever."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    try:
        while True:
            os.write(writer, b" " * 4096)
    except BlockingIOError:
        os.set_blocking(writer, True)
    with PymodbusPlc(plc, port), start_box(stderr=writer) as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    os.close(reader)
    os.close(writer)
    assert box.code == 0
    assert box.stats["cycles"] == len(box.rows) + box.stats["rows_lost"]


@pytest.mark.parametrize("words, sentence", [
    (["--cpu", "9999"], "--cpu must be a whole number from 0 to"),
    (["--clock", "realtime"], '--clock must be monotonic or boottime, not "realtime"'),
    (["--watchdog-timeout", "0"], "--watchdog-timeout must be a whole number from 1 to 60"),
])
def test_wrong_words(words, sentence):
    code, _, error = run("--config", "x.json", *words)
    assert code == 2 and sentence in error


def test_the_unit_is_one_and_is_hardened(tmp_path):
    if not shutil.which("systemd-analyze"):
        pytest.skip("no systemd-analyze here")
    unit = tmp_path / "compboxd.service"
    unit.write_text(UNIT.read_text().replace("/usr/sbin/compboxd", "/bin/true"))
    verify = subprocess.run(["systemd-analyze", "verify", "--man=no", str(unit)],
                            capture_output=True, text=True)
    assert verify.returncode == 0 and str(unit) not in verify.stderr, verify.stderr
    security = subprocess.run(["systemd-analyze", "security", "--offline=yes", str(unit)],
                              capture_output=True, text=True)
    exposure = float(re.search(r"exposure level for \S+: ([\d.]+)", security.stdout)[1])
    # "OK" begins at 5, 0 is fully closed; asking whether the clock is synchronised counts for 0.3
    assert exposure <= 2.5, security.stdout


def filtered(unit):
    """Names of the system calls that the unit's filter lets pass."""
    def members(name):
        if not name.startswith("@"):
            return {name}
        listed = subprocess.run(["systemd-analyze", "syscall-filter", name], capture_output=True, text=True)
        words = [line.strip() for line in listed.stdout.splitlines()[1:]]
        return set().union(*(members(word) for word in words if word and not word.startswith("#")))
    allowed = set()
    for line in unit.splitlines():
        if line.startswith("SystemCallFilter="):
            words = line.removeprefix("SystemCallFilter=")
            sets = set().union(*(members(word) for word in words.lstrip("~").split()))
            allowed = allowed - sets if words.startswith("~") else allowed | sets
    return allowed


def test_the_units_filter_lets_pass_what_the_daemon_calls(plc, port, start_box, tmp_path):
    if not shutil.which("systemd-analyze") or not shutil.which("strace"):
        pytest.skip("no systemd-analyze or strace here")
    calls = tmp_path / "calls"
    with PymodbusPlc(plc, port), start_box("--state", str(tmp_path / "state"), "--watchdog", "/dev/null") as box:
        box.process.kill()
        box.process.wait()
        command = ["strace", "-f", "-o", str(calls), *box.arguments]
        with subprocess.Popen(command, stderr=subprocess.PIPE) as traced:
            plc.wait_mode(ACTIVE)
            machine.write_coefficients(box.folder / "coefficients.json", port, lambda data: data.update(revision=8))
            until(lambda: box.stats["reloads"]["taken"] == 1)
            children = pathlib.Path(f"/proc/{traced.pid}/task/{traced.pid}/children").read_text().split()
            os.kill(int(children[0]), signal.SIGTERM)
            traced.communicate(timeout=60)
    made = set(re.findall(r"^\d+ +(?:<\.\.\. )?(\w+)[( ]", calls.read_text(), re.M))
    made -= {"execve", "resumed"}  # systemd's own
    assert {"recvfrom", "clock_nanosleep", "mlockall"} <= made
    assert made <= filtered(UNIT.read_text()), made - filtered(UNIT.read_text())
