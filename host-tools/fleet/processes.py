# SPDX-License-Identifier: MIT
"""Programs and threads that live as long as this process, with their logs in one folder."""

import contextlib
import ctypes
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import threading
import time

from .errors import FleetError

PR_SET_PDEATHSIG = 1


def die_with_parent():
    """In a child: it gets SIGTERM if this process is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def program_of(name, package):
    """out: the path of a program beside compbox, or of the system. Throws FleetError that names its package"""
    beside = pathlib.Path(os.environ.get("COMPBOX_PROGRAM", "compbox")).parent
    found = shutil.which(name, path=f"{beside}:{os.environ.get('PATH', '')}:/usr/sbin")
    if not found:
        raise FleetError(f"{name} is missing; install the package {package}")
    return found


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


class Processes:
    """in: a folder for logs. close() ends all of them, the last one first; `ended` tells the threads."""

    def __init__(self, folder):
        self.folder, self.closing, self.ended = folder, contextlib.ExitStack(), threading.Event()
        self.ports = {}  # by name: on 127.0.0.1

    def close(self):
        self.ended.set()
        self.closing.close()

    def run(self, name, program, *arguments, **how):
        """Starts a program, which ends at close(). out: its process"""
        log = self.closing.enter_context(open(self.folder / f"{name}.log", "wb"))
        process = subprocess.Popen([program, *map(str, arguments)], cwd=self.folder, start_new_session=True,
                                   preexec_fn=die_with_parent,
                                   **{"stdout": log, "stderr": log, "stdin": subprocess.DEVNULL, **how})
        self.closing.callback(self.end, process)
        return process

    @staticmethod
    def end(process):
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe:
                pipe.close()

    def work(self, name, function, *arguments):
        """Runs a function of this package in a thread until close()."""
        thread = threading.Thread(target=function, args=arguments, name=name)
        thread.start()
        self.closing.callback(thread.join)

    def wait(self, *names):
        """Until these listen. Throws FleetError with the end of the log of one that does not."""
        for name in names:
            for _ in range(600):
                if listens(self.ports[name]):
                    break
                time.sleep(0.05)
            else:
                lines = (self.folder / f"{name}.log").read_text(errors="replace").strip().splitlines() or ["no log"]
                raise FleetError(f"{self.folder}/{name}.log: it does not start: {lines[-1]}")
