# SPDX-License-Identifier: MIT
"""fakeplc on the stage, with the program's console: the control, its PLC and the machine, in virtual time."""
from stage import Stage

PORT = 1502


class FakePlc:
    """Runs fakeplc with these options while the context is open; its files are on the real disk. line: the device of
    the box, instead of a TCP port."""

    def __init__(self, *arguments, line=None):
        self.options = dict(zip(arguments[::2], map(str, arguments[1::2])))
        self.port, self.line = PORT, line

    def __enter__(self):
        self.stage = Stage.current
        self.stage.ask("control", self.options, self.line or self.port)
        return self

    def __exit__(self, *_):
        self.stage.ask("control_end")

    def command(self, line):
        """A command; its answer has to be ok, and comes back without it."""
        answer = self.stage.ask("control_say", line)["answer"]
        assert answer == "ok" or answer.startswith("ok "), f"{line}: {answer}"
        return answer[3:]

    def request(self, pdu):
        """Of another client than the box; out: the reply, both without a header."""
        return bytes.fromhex(self.stage.ask("control_ask", pdu.hex())["reply"])

    def status(self):
        """{key: number} of the status line."""
        return {key: float(value) for key, value in
                (word.split("=") for word in self.command("status").split())}

    def wait(self, condition, timeout_s=60):
        """Lets time pass until a status meets the condition; fails with the last one."""
        end_s = self.stage.now_s + timeout_s
        while True:
            status = self.status()
            if condition(status):
                return status
            assert self.stage.now_s < end_s, f"never came within {timeout_s} s: {status}"
            self.stage.run_for(0.01)
