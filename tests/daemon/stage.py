# SPDX-License-Identifier: MIT
"""The program `stage` (tests/world/stage/stage.h): compboxd on a simulated computer, in virtual time.

Time passes only while a test waits for something: in Stage.run_until() and what uses it. What the test does in between,
and whatever it computes, takes no time. Peers answer at the instant at which they are asked."""
import heapq
import itertools
import json
import os
import pathlib
import subprocess

PROGRAM = os.environ.get("STAGE", str(pathlib.Path(__file__).resolve().parents[2] / "build/host/bin/stage"))
SEED = os.environ.get("STAGE_SEED", "1")
SECOND = 10**9


class Link:
    """A TCP connection of the box, from the peer's end."""

    def __init__(self, stage, number):
        self.stage, self.number, self.received = stage, number, b""
        self.open, self.finished = True, False   # at this end; by the box, behind what was received

    def send(self, data):
        if self.open:
            self.stage.ask("send", self.number, data.hex())

    def hang_up(self, reset=True):
        """reset: as a process that is killed, without an orderly goodbye."""
        if self.open:
            self.open = False
            self.stage.ask("hang_up", self.number, reset)


class Stage:
    """The world of one test. There is one at a time."""
    current = None

    def __init__(self):
        self._program = subprocess.Popen([PROGRAM, SEED], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.now_ns, self.log, self.ended, self.failed = 0, "", [], []
        self.notified, self.written = [], {}      # by the box: to systemd; to devices, by their path
        self._events, self._timers, self._order = [], [], itertools.count()
        self._listeners, self._links, self._slaves, self._interfaces = {}, {}, {}, {}

    def __enter__(self):
        Stage.current = self
        self.ask("clocks")
        return self

    def __exit__(self, *_):
        Stage.current = None
        self._program.stdin.close()
        self._program.stdout.close()
        self._program.wait()

    def ask(self, *words):
        """A command to the program; out: its answer."""
        self._program.stdin.write(json.dumps(words).encode() + b"\n")
        self._program.stdin.flush()
        answer = json.loads(self._program.stdout.readline())
        assert "error" not in answer, (words, answer["error"])
        self.now_ns = answer["now"]
        self._events += answer.pop("events", [])
        self.log += bytes.fromhex(answer.pop("log", "")).decode(errors="replace")
        return answer

    # ---- time

    @property
    def now_s(self):
        return self.now_ns / SECOND

    def after(self, delay_s, what):
        """Calls what() at that time from now."""
        heapq.heappush(self._timers, (self.now_ns + round(delay_s * SECOND), next(self._order), what))

    def run_until(self, condition, timeout_s=60):
        """Lets time pass until an event after which the condition is true; out: what it returned."""
        end_ns = self.now_ns + round(timeout_s * SECOND)
        while True:
            self._tell()
            found = condition()
            if found or self.now_ns >= end_ns:
                return found
            due_ns = min(end_ns, self._timers[0][0]) if self._timers else end_ns
            if self.now_ns < due_ns:
                self.ask("run", due_ns)
            while self._timers and self._timers[0][0] <= self.now_ns and not self._events:
                heapq.heappop(self._timers)[2]()

    def run_for(self, duration_s):
        self.run_until(lambda: False, duration_s)

    def _tell(self):
        """Tells peers of what happened."""
        while self._events:
            event = self._events.pop(0)
            getattr(self, "_" + event.pop("event"))(**event)

    # ---- what is seen and done from outside

    def held(self):
        """out: what the process holds: descriptors, blocks of memory, threads"""
        answer = self.ask("held")
        return answer["descriptors"], answer["blocks"], answer["threads"]

    def watchdog(self, path="/dev/watchdog", most_s=60):
        """Makes a hardware watchdog; out: its path. What the box writes to it is in .written."""
        self.ask("make", "watchdog", str(path), most_s)
        self.written[str(path)] = bytearray()
        return str(path)

    def cut_power(self, off_s):
        """The process is gone, the disk keeps what is durable; then the computer boots."""
        self.ask("cut_power")
        self.run_for(off_s)
        self.ask("boot")

    def set_clock(self, step_s, synchronised=True):
        """Steps the wall clock."""
        self.ask("set_clock", round(step_s * SECOND), synchronised)

    def suspend(self, duration_s):
        """The computer sleeps so long; its monotonic clock does too."""
        self.ask("suspend", round(duration_s * SECOND))
        self.run_for(duration_s)

    def stall(self, duration_s, thread=""):
        """The process, or its thread of this name, stands still for so long, as if it were stopped."""
        self.ask("stall", round(duration_s * SECOND), thread)

    # ---- what fails

    def fail(self, call, error, path="", times=-1, skipped=0):
        """Calls of this name about such a path fail with this errno; so often, or until heal(); the first ones work."""
        self.ask("fail", call, path, error, 0, times, skipped)

    def hang(self, call, path="", duration_s=10**6, times=-1):
        """… last so long."""
        self.ask("fail", call, path, 0, round(duration_s * SECOND), times, 0)

    def heal(self):
        self.ask("heal")

    def _ended(self, code):
        self.ended.append(code)

    def _notified(self, text):
        self.notified.append(text)

    def _written(self, path, bytes):
        self.written.setdefault(path, bytearray()).extend(bytes_of(bytes))

    def _failed(self, call, path):
        self.failed.append((call, path))

    # ---- network

    def listen(self, port, server):
        """server.connected(link), .received(link), .closed(link) from now on; None: nobody listens."""
        self._listeners[port] = server
        self.ask("listen", port, server is not None)

    def _connected(self, link, port):
        server = self._listeners[port]
        self._links[link] = Link(self, link), server
        server.connected(self._links[link][0])

    def _received(self, link, bytes):
        of, server = self._links[link]
        if of.open:
            of.received += bytes_of(bytes)
            server.received(of)

    def _closed(self, link, reset):
        of, server = self._links[link]
        if of.open:
            of.open, of.finished = not reset, True
            server.closed(of)


    # ---- other wires

    def plug(self, device, slave=None):
        """A serial line with its adapter at this device: slave.heard(bytes) from now on; None: the adapter is gone."""
        self._slaves[device] = slave
        self.ask("line", device, slave is not None)

    def send_line(self, device, data):
        self.ask("line_send", device, data.hex())

    def _heard(self, device, bytes):
        if self._slaves.get(device):
            self._slaves[device].heard(bytes_of(bytes))

    def can(self, name, state, listener=None):
        """A CAN interface that is up, down or gone: listener.bound(filters) and .frame(id, bytes)."""
        if listener:
            self._interfaces[name] = listener
        self.ask("can", name, state)

    def send_frame(self, name, identifier, data):
        self.ask("frame", name, identifier, bytes(data).hex())

    def _bound(self, interface, filters):
        self._interfaces[interface].bound(filters)

    def _frame(self, interface, id, data):
        self._interfaces[interface].frame(id, bytes_of(data))


def bytes_of(text):
    return bytes.fromhex(text)


class File(pathlib.PurePosixPath):
    """A path on the simulated disk."""

    @staticmethod
    def _ask(*words):
        return Stage.current.ask(*words)

    def read_bytes(self):
        answer = self._ask("get", str(self))
        if "bytes" not in answer:
            raise FileNotFoundError(self)
        return bytes_of(answer["bytes"])

    def write_bytes(self, data):
        self._ask("put", str(self), data.hex())

    def read_text(self, **_):
        return self.read_bytes().decode()

    def write_text(self, text, **_):
        self.write_bytes(text.encode())

    def exists(self):
        return "bytes" in self._ask("get", str(self))

    @property
    def modified_ns(self):
        return self._ask("get", str(self))["modified"]

    def rename(self, to):
        self._ask("rename", str(self), str(to))

    def unlink(self, missing_ok=True):
        self._ask("remove", str(self))

    def mkdir(self):
        self._ask("make", "folder", str(self))

    def mkfifo(self):
        self._ask("make", "fifo", str(self))

    def symlink_to(self, target):
        self._ask("make", "link", str(self), str(target))
