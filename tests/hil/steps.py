# SPDX-License-Identifier: MIT
"""The facts of a run, of `--record-inputs`: what each step read, when the box stamped that, what it answered. A test
that asks these does not depend on when the machine let a process run."""
import csv
from dataclasses import dataclass

import machine

PERIOD_US = machine.PERIOD_S * 1e6
LOST = {2, 3, 4}             # last_write: failed, refused, unknown (firmware/box/box.h)


def words(text):
    return [int(text[i:i + 4], 16) for i in range(0, len(text), 4)]


@dataclass
class Step:
    now_us: int
    read_us: int
    read_ok: bool
    last_write: int          # how the write before this step ended
    missed_ticks: int
    registers: list
    written: list

    @property
    def mode(self):
        return self.written[machine.STATUS - machine.WRITE[0]] & 0xFF

    @property
    def reason(self):
        return self.written[machine.STATUS - machine.WRITE[0]] >> 8

    @property
    def heartbeat(self):
        return self.written[machine.BOX_HEARTBEAT - machine.WRITE[0]]

    @property
    def reading(self):
        """The number of the reading, modulo 65536."""
        return self.registers[machine.READING]

    @property
    def x_mm(self):
        return machine.unpack("int32", self.registers[8:10]) * 0.0001

    @property
    def um(self):
        return machine.written_um(self.written)


def steps_of(path, begin_us=0):
    """in : begin_us: when the box's clock began, by another one
    out: the steps of the recording so far, complete when the box has ended; the last line may still be written"""
    if not path.exists():
        return []
    whole = path.read_text().rpartition("\n")[0]
    table = whole.splitlines()[2:]  # the first two lines have what the box had beside its file
    return [Step(int(row["now_us"]) + begin_us, int(row["read_us"]) + begin_us, row["read_ok"] == "1",
                 int(row["last_write"]), int(row["missed_ticks"]), words(row["registers"]), words(row["written"]))
            for row in csv.DictReader(table)]


def check_after(steps, first, since_us, wait_s):
    """The step at index `first` is the first one that came wait_s after since_us."""
    assert steps[first - 1].now_us - since_us <= wait_s * 1e6 < steps[first].now_us - since_us


def index_of(steps, condition, start=0):
    """out: index of the first step from start on that meets the condition."""
    return next(i for i in range(start, len(steps)) if condition(steps[i]))


def requests_of(steps, server):
    """What the PLC received from the first of these steps up to the last."""
    return [r for r in server.requests if steps[0].read_us <= r.time_s * 1e6 < steps[-1].now_us]


def around(steps, reading):
    """out: the steps around the reading with this number, which may have been spoilt: from the one that has the reading
    before it to the next one that has a later one; one step more on either side"""
    good = [i for i, step in enumerate(steps) if step.read_ok]
    before = next(i for i in good if steps[i].reading == (reading - 1) & 0xFFFF)
    behind = next(i for i in good if i > before and steps[i].reading != steps[before].reading)
    return steps[before - 1:behind + 2]
