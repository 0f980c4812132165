# SPDX-License-Identifier: MIT
"""compboxd as a process."""
import csv
import json
import os
import random
import shlex
import signal
import socket
import subprocess
import time

from realtime import PRIORITY
from steps import steps_of

# A command: a cross-built program stands behind its emulator.
PROGRAM = shlex.split(os.environ.get("COMPBOXD", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/compboxd")))


def free_port():
    """A port nobody listens on, below those that the kernel gives to clients."""
    while True:
        port = random.randint(20000, 30000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                continue


class Box:
    """Runs compboxd with this coefficient file; stop() or the end of the context ends it."""

    def __init__(self, config, *arguments, env=None, stderr=subprocess.PIPE):
        self.folder = config.parent
        self.stats_file = self.folder / "stats.json"
        self.record_file = self.folder / "record.csv"
        self.inputs_file = self.folder / "inputs.csv"
        self.arguments = [*PROGRAM, "--config", str(config), "--stats", str(self.stats_file),
                          "--record", str(self.record_file), "--record-inputs", str(self.inputs_file),
                          *PRIORITY, *arguments]
        self.env = dict(os.environ, **(env or {}))
        self.stderr = stderr
        self.process, self.code, self.log = None, None, ""

    def __enter__(self):
        self.inputs_file.unlink(missing_ok=True)  # of a box before it
        self.process = subprocess.Popen(self.arguments, stderr=self.stderr, text=True,
                                        env=self.env)
        return self

    def __exit__(self, *_):
        if self.code is None:
            self.process.kill()
            self.process.communicate()

    def stop(self, signal_number=signal.SIGTERM):
        """Asks it to stop and waits for the end of the process."""
        self.process.send_signal(signal_number)
        self.wait()

    def wait(self, timeout_s=300):
        _, self.log = self.process.communicate(timeout=timeout_s)
        self.code = self.process.returncode

    @property
    def stats(self):
        return json.loads(self.stats_file.read_text())

    @property
    def rows(self):
        """Rows of the record as {column: number or None}."""
        with open(self.record_file, newline="") as file:
            return [{key: float(text) if text else None for key, text in row.items()}
                    for row in csv.DictReader(file)]

    @property
    def steps(self):
        """The facts of the run so far (steps.py); complete when the box has ended."""
        return steps_of(self.inputs_file)


def until(condition, timeout_s=300, every_s=0.02):
    """Waits for the condition; out: what it returned. The time bounds a hang, it judges nothing."""
    end = time.monotonic() + timeout_s
    while True:
        found = condition()
        if found:
            return found
        assert time.monotonic() < end, f"not within {timeout_s} s"
        time.sleep(every_s)


def run(*arguments, timeout_s=300):
    """compboxd with these arguments; out: exit code, stdout, stderr."""
    done = subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, timeout=timeout_s)
    return done.returncode, done.stdout, done.stderr
