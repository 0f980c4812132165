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
        self.command("quit")
        self.process.wait(10)

    def command(self, line):
        """A command; its answer, which has to be ok."""
        self.process.stdin.write(line + "\n")
        answer = self.process.stdout.readline()
        assert answer.startswith("ok"), f"{line}: {answer}"
        return answer
