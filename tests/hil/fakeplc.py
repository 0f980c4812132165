# SPDX-License-Identifier: MIT
"""fakeplc as a process, with its console."""
import os
import subprocess
import threading
import time

from realtime import run_before_others

PROGRAM = os.environ.get("FAKEPLC", os.path.join(
    os.path.dirname(__file__), "../../build/host/bin/fakeplc"))


class FakePlc:
    """Runs fakeplc with these arguments on a free port while the context is open."""

    def __init__(self, *arguments):
        self.arguments = [PROGRAM, "--listen", "127.0.0.1:0", *map(str, arguments)]
        self.lock = threading.Lock()

    def __enter__(self):
        self.process = subprocess.Popen(
            self.arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1,
            preexec_fn=run_before_others)
        line = self.process.stdout.readline()
        assert line.startswith("fakeplc: listening on "), line
        self.port = int(line.rsplit(":", 1)[1])
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(60)
        self.process.stdin.close()
        self.process.stdout.close()

    def command(self, line):
        """A command; its answer has to be ok, and comes back without it."""
        with self.lock:
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline().rstrip("\n")
        assert answer == "ok" or answer.startswith("ok "), f"{line}: {answer}"
        return answer[3:]

    def status(self):
        """{key: number} of the status line."""
        return {key: float(value) for key, value in
                (word.split("=") for word in self.command("status").split())}

    def wait(self, condition, timeout_s=300):
        """Waits for a status that meets the condition; fails with the last one."""
        until = time.monotonic() + timeout_s
        while True:
            status = self.status()
            if condition(status):
                return status
            assert time.monotonic() < until, f"never came within {timeout_s} s: {status}"
            time.sleep(0.01)
