# SPDX-License-Identifier: MIT
"""compboxd on the stage."""
import csv
import io
import json
import signal

from stage import Stage
from steps import steps_of


class Box:
    """Runs compboxd with this coefficient file; stop(), kill() or the end of the context ends it."""

    def __init__(self, config, *arguments, env=None):
        self.folder = config.parent
        self.stats_file = self.folder / "stats.json"
        self.record_file = self.folder / "record.csv"
        self.inputs_file = self.folder / "inputs.csv"
        self.arguments = ["compboxd", "--config", str(config), "--stats", str(self.stats_file),
                          "--record", str(self.record_file), "--record-inputs", str(self.inputs_file),
                          *map(str, arguments)]
        self.env, self.code, self._log = dict(env or {}), None, None

    def __enter__(self):
        self.stage = Stage.current
        self._ends, self._log_begin, self._log = len(self.stage.ended), len(self.stage.log), None
        self.inputs_file.unlink()  # of a box before it
        self._recorded = self.record_file.read_text() if self.record_file.exists() else ""
        self.stage.ask("start", self.arguments, self.env)
        clocks = self.stage.ask("clocks")
        self._begin_ns = self.stage.now_ns - clocks["boottime"]
        return self

    def __exit__(self, *_):
        if self.code is None:
            self.kill()

    @property
    def runs(self):
        return len(self.stage.ended) == self._ends

    @property
    def log(self):
        return self.stage.log[self._log_begin:] if self._log is None else self._log

    def send_signal(self, number):
        self.stage.ask("signal", int(number))

    def stop(self, number=signal.SIGTERM):
        """Asks it to stop and waits for the end of the process."""
        self.send_signal(number)
        self.wait()

    def kill(self):
        self.stop(signal.SIGKILL)

    def wait(self, timeout_s=60):
        self.stage.run_until(lambda: not self.runs, timeout_s)
        assert not self.runs, f"it does not end within {timeout_s} s:\n{self.log}"
        self.code, self._log = self.stage.ended[self._ends], self.log

    @property
    def stats(self):
        return json.loads(self.stats_file.read_text())

    @property
    def rows(self):
        """Rows of this run in the record, as {column: number or None}."""
        text = self.record_file.read_text()
        before = max(0, self._recorded.count("\n") - 1) if text.startswith(self._recorded) else 0
        return [{key: float(text) if text else None for key, text in row.items()}
                for row in csv.DictReader(io.StringIO(text))][before:]

    @property
    def steps(self):
        """The facts of the run so far (steps.py), by the world's time; complete when the box has ended."""
        return steps_of(self.inputs_file, self._begin_ns / 1e3)

    @property
    def modes(self):
        """All modes so far, as far as they are recorded."""
        return {step.mode for step in self.steps}


def until(condition, timeout_s=60, every_s=0.1):
    """Lets time pass until the condition is true, which is asked that often; out: what it returned."""
    stage = Stage.current
    end_ns = stage.now_ns + timeout_s * 1e9
    while True:
        found = condition()
        if found:
            return found
        assert stage.now_ns < end_ns, f"not within {timeout_s} s; the log:\n{stage.log}"
        stage.run_for(every_s)


def run(*arguments, timeout_s=60):
    """compboxd with these arguments; out: exit code, what it printed"""
    stage = Stage.current
    ends, begin = len(stage.ended), len(stage.log)
    stage.ask("start", ["compboxd", *map(str, arguments)], {})
    stage.run_until(lambda: len(stage.ended) > ends, timeout_s)
    return stage.ended[ends], stage.log[begin:]
