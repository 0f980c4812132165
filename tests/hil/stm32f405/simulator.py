# SPDX-License-Identifier: MIT
"""A simulator of host-tools/fakeplc as a process, on a socket to which the emulator connects."""
import subprocess

from conftest import HOST


class Simulator:
    """Runs while the context is open; commands in, answers out."""

    def __init__(self, program, *arguments):
        self.process = subprocess.Popen([HOST / program, *map(str, arguments)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, bufsize=1)
        assert "listening" in self.process.stdout.readline()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ask("quit")
        self.process.wait(10)

    def ask(self, command):
        """A command; its answer, which has to be ok."""
        self.process.stdin.write(command + "\n")
        answer = self.process.stdout.readline()
        assert answer.startswith("ok"), f"{command}: {answer}"
        return answer
