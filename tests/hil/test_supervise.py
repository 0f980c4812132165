# SPDX-License-Identifier: MIT
"""Only completed cycles feed the daemon's watchdogs: systemd and the hardware watchdog."""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import time

import pytest

from box import run, until
from can_bus import SHIM
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


def test_a_plc_that_is_not_there_is_no_reason_to_be_killed(start_box, systemd):
    with start_box(env=systemd.env) as box:
        received = []
        until(lambda: received.extend(systemd.received()) or received.count("WATCHDOG=1") >= 3)
        box.stop()


def test_a_loop_that_hangs_feeds_nobody(plc, port, start_box, systemd, tmp_path):
    """Only the loop's thread is stopped, as a debugger does it; the normal thread goes on."""
    fifo = tmp_path / "watchdog"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    with PymodbusPlc(plc, port), start_box("--watchdog", str(fifo), env=systemd.env) as box:
        plc.wait_mode(ACTIVE)
        until(lambda: drain(reader))
        with stopped_thread(box.process.pid, "compboxd-loop"):
            time.sleep(1)  # what was completed before still counts when it is time to feed
            systemd.received(), drain(reader)
            time.sleep(3 * WATCH_S)
            assert systemd.received() == []
            assert drain(reader) == b""
        until(lambda: "WATCHDOG=1" in systemd.received())
        until(lambda: drain(reader))
        box.stop()


def test_a_slow_disk_is_no_reason_to_be_killed(plc, port, start_box, systemd, tmp_path):
    """The normal thread writes files and the log; it is stopped, and the loop goes on."""
    fifo = tmp_path / "watchdog"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    with PymodbusPlc(plc, port), start_box("--watchdog", str(fifo), env=systemd.env) as box:
        plc.wait_mode(ACTIVE)
        with stopped_thread(box.process.pid, "compboxd"):
            systemd.received(), drain(reader)
            received, fed = [], []
            until(lambda: received.extend(systemd.received()) or received.count("WATCHDOG=1") >= 4)
            until(lambda: fed.extend(drain(reader)) or len(fed) >= 3)
            plc.wait_mode(ACTIVE)
        box.stop()
        assert box.code == 0, box.log


class stopped_thread:
    """PTRACE_SEIZE and PTRACE_INTERRUPT stop one thread and leave the others alone."""

    def __init__(self, pid, name):
        import ctypes
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        threads = pathlib.Path(f"/proc/{pid}/task").iterdir()
        self.tid = next(int(t.name) for t in threads if (t / "comm").read_text().strip() == name)

    def __enter__(self):
        if self.libc.ptrace(0x4206, self.tid, None, None) != 0:
            pytest.skip("this machine permits no ptrace")
        self.libc.ptrace(0x4207, self.tid, None, None)

    def __exit__(self, *_):
        os.waitpid(self.tid, 0x40000000)  # __WALL: the stop must have been seen
        self.libc.ptrace(17, self.tid, None, None)  # PTRACE_DETACH: it goes on


def drain(reader):
    try:
        return os.read(reader, 1000)
    except BlockingIOError:
        return b""


def test_a_clean_end_disarms_the_watchdog_and_a_kill_does_not(plc, port, start_box, tmp_path):
    fifo = tmp_path / "watchdog"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    for kill in (False, True):
        with PymodbusPlc(plc, port), start_box("--watchdog", str(fifo)) as box:
            plc.wait_mode(ACTIVE)
            fed = bytearray()
            until(lambda: fed.extend(drain(reader)) or len(fed) >= 2)
            if kill:
                box.process.send_signal(signal.SIGKILL)
                box.process.wait(60)
            else:
                box.stop()
        fed += drain(reader)
        assert fed.endswith(b"V") != kill
        assert set(fed[:-1]) == {0}


@pytest.mark.parametrize("words", [["--state", "/nowhere/lags"],
                                   pytest.param(["--priority", "99"], marks=pytest.mark.skipif(
                                       os.geteuid() == 0, reason="root may do that"))])
def test_a_start_that_fails_leaves_the_watchdog_disarmed(start_box, tmp_path, words):
    """A typing mistake must not reset the machine again and again."""
    fifo = tmp_path / "watchdog"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    with start_box("--watchdog", str(fifo), *words) as box:
        box.wait()
    assert box.code == 1
    assert drain(reader) == b"V"


@pytest.mark.parametrize("most_s, words", [(15, "/watchdog: resets the machine after 15 s, not 60"), (60, None)])
def test_what_the_watchdog_makes_of_its_timeout_is_reported(start_box, tmp_path, most_s, words):
    (tmp_path / "watchdog").touch()
    with start_box("--watchdog", str(tmp_path / "watchdog"), "--watchdog-timeout", "60",
                   env={"LD_PRELOAD": SHIM, "WATCHDOG_MOST_S": str(most_s)}) as box:
        until(lambda: len(box.steps) > 5)
        box.stop()
    assert (words in box.log) if words else ("resets the machine" not in box.log), box.log


def test_a_watchdog_that_is_not_there_is_reported(plc, port, start_box):
    with PymodbusPlc(plc, port), start_box("--watchdog", "/nowhere/watchdog") as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    assert "/nowhere/watchdog: no hardware watchdog: No such file or directory" in box.log


def test_the_loop_runs_where_it_is_configured_to(plc, port, start_box):
    with PymodbusPlc(plc, port), start_box("--cpu", "0", "--clock", "boottime") as box:
        plc.wait_mode(ACTIVE)
        threads = pathlib.Path(f"/proc/{box.process.pid}/task").iterdir()
        where = {(t / "comm").read_text().strip(): os.sched_getaffinity(int(t.name)) for t in threads}
        assert where["compboxd-loop"] == {0}
        assert where["compboxd"] == os.sched_getaffinity(0)
        box.stop()
        assert box.code == 0, box.log


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
            box.folder.joinpath("coefficients.json").touch()  # and a reload
            time.sleep(3)
            children = pathlib.Path(f"/proc/{traced.pid}/task/{traced.pid}/children").read_text().split()
            os.kill(int(children[0]), signal.SIGTERM)
            traced.communicate(timeout=60)
    made = set(re.findall(r"^\d+ +(?:<\.\.\. )?(\w+)[( ]", calls.read_text(), re.M))
    made -= {"execve", "resumed"}  # systemd's own
    assert {"recvfrom", "clock_nanosleep", "mlockall"} <= made
    assert made <= filtered(UNIT.read_text()), made - filtered(UNIT.read_text())
