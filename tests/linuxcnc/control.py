# SPDX-License-Identifier: MIT
"""LinuxCNC with simulated joints, compbox.hal and compbox_plc.py of compbox export, as processes."""
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import time

HERE = pathlib.Path(__file__).resolve().parent
COMPBOX = os.environ.get("COMPBOX", str(HERE.parents[1] / "build/host/bin/compbox"))
FILES = ("sim.ini", "core.hal", "driver.hal", "display.py")
# LinuxCNC refuses root, and wants the system's own PATH.
USER = ["setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups"] if os.getuid() == 0 else []


def until(condition, what, timeout_s=30):
    """Waits for the condition; out: its value."""
    end = time.monotonic() + timeout_s
    while not (value := condition()):
        assert time.monotonic() < end, f"never came: {what}"
        time.sleep(0.02)
    return value


class LinuxCnc:
    """One instance on a host. machine: a machine file, whose program it runs."""

    def __init__(self, folder, machine):
        self.folder = folder
        subprocess.run([COMPBOX, "export", machine, "--format", "plc-program", "-o", folder], check=True,
                       capture_output=True)
        for name in FILES:
            shutil.copy(HERE / name, folder)
        for name in ("sim.tbl", "sim.var"):
            (folder / name).touch()
        if USER:
            for path in (folder, *folder.iterdir()):
                shutil.chown(path, "nobody", "nogroup")
        self.environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin:/usr/sbin:/sbin"}

    def process_of(self, *words, **how):
        """A program in LinuxCNC's folder; out: words and keywords of subprocess."""
        return [*USER, *words], dict(cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, **how)

    def __enter__(self):
        words, how = self.process_of("linuxcnc", "sim.ini", stdout=open(self.folder / "log", "w"),
                                     stderr=subprocess.STDOUT, start_new_session=True)
        self.process = subprocess.Popen(words, **how)
        until((self.folder / "display.sock").exists, "LinuxCNC's start: " + self.log())
        self.display = socket.socket(socket.AF_UNIX)
        until(self.connect, "the display")
        self.lines = self.display.makefile("rw")
        return self

    def connect(self):
        return self.display.connect_ex(str(self.folder / "display.sock")) == 0

    def __exit__(self, *_):
        self.lines.write("quit\n")
        self.lines.flush()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self.lines.close(), self.display.close()

    def log(self):
        return (self.folder / "log").read_text()

    def command(self, text):
        """A line of Python in the display: c commands, s is the status."""
        self.lines.write(text + "\n")
        self.lines.flush()
        answer = self.lines.readline().strip()
        assert not answer.startswith("error"), f"{text}: {answer}"
        return answer

    def on(self):
        for state in ("ESTOP_RESET", "ON"):
            self.command(f"c.state(linuxcnc.STATE_{state})")
            self.command("c.wait_complete()")

    def home(self):
        self.command("c.mode(linuxcnc.MODE_MANUAL)")
        self.command("c.wait_complete()")
        self.command("c.home(-1)")
        until(lambda: self.command("s.homed[:3]") == "(1, 1, 1)", "homing")

    def move(self, words):
        self.command("c.mode(linuxcnc.MODE_MDI)")
        self.command("c.wait_complete()")
        self.command(f"c.mdi({words!r})")

    def at_rest(self):
        until(lambda: self.command("s.interp_state == linuxcnc.INTERP_IDLE and s.inpos") == "True", "rest", 60)

    def hal(self, *words):
        """halcmd; out: what it prints."""
        words, how = self.process_of("halcmd", *words, capture_output=True, text=True, check=True)
        return subprocess.run(words, **how).stdout.strip()

    def applied_um(self, joint=0):
        return 1e3 * float(self.hal("getp", f"compbox-limit-{joint}.out"))

    def samples(self, count, doing):
        """(planned, applied, commanded position in mm, permission) of servo periods while doing()."""
        words, how = self.process_of("halsampler", "-n", str(count), stdout=subprocess.PIPE, text=True)
        with subprocess.Popen(words, **how) as sampler:
            self.hal("setp", "sampler.0.enable", "1")
            doing()
            text = sampler.communicate(timeout=60)[0]
        self.hal("setp", "sampler.0.enable", "0")
        assert "overrun" not in text
        return [tuple(map(float, line.split())) for line in text.splitlines()]


class Client:
    """Any Modbus client in the control's network."""

    def __init__(self, port):
        self.socket, self.count = socket.create_connection(("127.0.0.1", port), timeout=10), 0

    def exchange(self, pdu):
        """A request; out: the reply's PDU."""
        self.count += 1
        self.socket.sendall(struct.pack(">HHHB", self.count, 0, len(pdu) + 1, 1) + pdu)
        head = self.exactly(7)
        assert head[:4] == struct.pack(">HH", self.count, 0)
        return self.exactly(struct.unpack(">H", head[4:6])[0] - 1)

    def exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            assert more, "the server closed the connection"
            data += more
        return data

    def write(self, start, words):
        assert self.exchange(struct.pack(f">BHHB{len(words)}H", 16, start, len(words), 2 * len(words), *words))[0] == 16

    def read(self, start, count):
        return struct.unpack(f">{count}H", self.exchange(struct.pack(">BHH", 3, start, count))[2:])
