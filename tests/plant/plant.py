# SPDX-License-Identifier: MIT
"""A running box with its view, a broker and subscribers, for the tests of this folder."""

import contextlib
import ctypes
import errno
import json
import os
import pathlib
import socket
import struct
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("COMPBOX_BIN", ROOT / "build/host/bin"))
sys.path.insert(0, str(ROOT / "tests/cli"))

from conftest import PLC, Compbox, term  # noqa: E402
from test_first_steps import FakePlc  # noqa: E402


def wait_for(condition, every_s=0.02):
    """out: what the condition returned; a test that hangs ends by the runner's own limit"""
    for _ in range(int(120 / every_s)):
        found = condition()
        if found:
            return found
        time.sleep(every_s)
    raise AssertionError("it never came")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Broker:
    """mosquitto at a free port of this computer; settings as in mosquitto.conf."""

    def __init__(self, folder, users=None, host="127.0.0.1", **settings):
        self.port, self.host = free_port(), host
        self.at = f"127.0.0.1:{self.port}"
        rows = [f"listener {self.port} {host}", f"allow_anonymous {'false' if users else 'true'}", "user root"]
        rows += [f"password_file {folder / users}"] if users else []
        rows += [f"{key} {folder / name}" for key, name in settings.items()]
        self.file, self.folder, self.process = folder / "mosquitto.conf", folder, None
        self.file.write_text("\n".join(rows) + "\n")
        self.start()

    def start(self):
        self.process = subprocess.Popen(["/usr/sbin/mosquitto", "-c", self.file], cwd=self.folder,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def listens():
            with socket.socket(socket.AF_INET6 if ":" in self.host else socket.AF_INET) as probe:
                return probe.connect_ex((self.host, self.port)) == 0
        wait_for(listens)

    def stop(self):
        self.process.kill()
        self.process.wait(60)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


class Subscriber:
    """mosquitto_sub to all topics; each message as (topic, text)."""

    def __init__(self, broker):
        self.process = subprocess.Popen(
            ["stdbuf", "-oL", "mosquitto_sub", "-p", str(broker.port), "-t", "#", "-q", "1", "-F", "%t\t%p", "-d"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, bufsize=1)
        self.all, self.ready = [], threading.Event()
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()
        assert self.ready.wait(60), "mosquitto_sub has not subscribed"

    def _read(self):
        for line in self.process.stdout:
            if "\t" in line:
                self.all.append(tuple(line.rstrip("\n").split("\t", 1)))
            elif "Subscribed" in line:
                self.ready.set()

    def messages(self, topic):
        return [text for name, text in list(self.all) if name == topic]

    def last(self, topic):
        found = self.messages(topic)
        return found[-1] if found else None

    def json(self, topic):
        return [json.loads(text) for text in self.messages(topic)]

    def stop(self):
        self.process.kill()
        self.process.wait(60)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


@contextlib.contextmanager
def running_box(folder):
    """compboxd before fakeplc, ACTIVE at X=500 with 12.5 µm; out: the PLC"""
    compbox = Compbox(folder)
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=1000,Y=1000,Z=1000", "-o",
                 "machine.json")
    compbox.write("EZX.json", term(values=(0, 12.5, 0)))
    compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
    with FakePlc(folder, "--map", "coefficients.json") as plc:
        text = (folder / "coefficients.json").read_text()
        (folder / "box.json").write_text(text.replace('"port": 1502', f'"port": {plc.port}'))
        plc.command("move X=500 feed=20000")
        box = subprocess.Popen([BIN / "compboxd", "--config", "box.json", "--snapshot", "snapshot.json", "--events",
                                "events.jsonl"], cwd=folder, stderr=subprocess.DEVNULL)
        try:
            yield plc
        finally:
            box.terminate()
            assert box.wait(60) in (0, 1)


def only_families(names):
    """Lets this process make sockets of these families alone, as systemd's RestrictAddressFamilies= does."""
    libc = ctypes.CDLL(None, use_errno=True)
    numbers = [int(getattr(socket, name)) for name in names]
    socket_call = {"x86_64": 41, "aarch64": 198}[os.uname().machine]
    load, equal, give = 0x20, 0x15, 0x06  # BPF_LD|W|ABS, BPF_JMP|JEQ|K, BPF_RET|K
    allow, refuse = 0x7FFF0000, 0x00050000 | errno.EAFNOSUPPORT
    rows = [(load, 0, 0, 0), (equal, 0, len(numbers) + 2, socket_call), (load, 0, 0, 16)]
    rows += [(equal, len(numbers) - i, 0, number) for i, number in enumerate(numbers)]
    rows += [(give, 0, 0, refuse), (give, 0, 0, allow)]
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *row) for row in rows))
    program = ctypes.create_string_buffer(struct.pack("@HP", len(rows), ctypes.addressof(code)))
    no_new_privileges, set_seccomp, by_filter = 38, 22, 2
    assert libc.prctl(no_new_privileges, 1, 0, 0, 0) == 0
    assert libc.prctl(set_seccomp, by_filter, ctypes.byref(program), 0, 0) == 0


@contextlib.contextmanager
def view(folder, *arguments, families=None):
    """compbox-view at a free port; out: its process"""
    words = [BIN / "compbox-view", "--snapshot", "snapshot.json", "--events", "events.jsonl", "--listen", "127.0.0.1:0",
             *map(str, arguments)]
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               preexec_fn=families and (lambda: only_families(families)))
    try:
        yield process
    finally:
        process.terminate()
        process.wait(60)
