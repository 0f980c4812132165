# SPDX-License-Identifier: MIT
"""The facts of a run, of `--record-inputs`: what each step read, when the box stamped that, what it answered. A test
that asks these does not depend on when the machine let a process run.

Times of the recording and of time.monotonic() are of one clock. A fault of the PLC is judged by the exchanges around it
(`around`), and only where they were on time (`on_time`): a machine that stands still makes a test longer, not red."""
import csv
from dataclasses import dataclass

import machine

PERIOD_US = machine.PERIOD_S * 1e6
ON_TIME_US = 6000            # what a process may be late where nothing stood still
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


def steps_of(path):
    """out: the steps of the recording so far, complete when the box has ended; the last line may still be written"""
    if not path.exists():
        return []
    whole = path.read_text().rpartition("\n")[0]
    _, *table = whole.splitlines() or [""]  # the first line has what the box had beside its file
    return [Step(int(row["now_us"]), int(row["read_us"]), row["read_ok"] == "1", int(row["last_write"]),
                 int(row["missed_ticks"]), words(row["registers"]), words(row["written"]))
            for row in csv.DictReader(table)]


def check_after(steps, first, since_us, wait_s):
    """The step at index `first` is the one that came wait_s after since_us, to a period: itself not before, the one
    before it not after. How late either of them ran does not count."""
    assert steps[first].now_us - since_us >= wait_s * 1e6 - PERIOD_US
    assert steps[first - 1].now_us - since_us <= wait_s * 1e6 + PERIOD_US


def index_of(steps, condition, start=0):
    """out: index of the first step from start on that meets the condition."""
    return next(i for i in range(start, len(steps)) if condition(steps[i]))


def box_on_time(steps):
    """Each began and ended its reading at its tick, none is missing."""
    gaps = [b.read_us - a.read_us - PERIOD_US for a, b in zip(steps, steps[1:])]
    prompt = all(step.now_us - step.read_us < 2 * ON_TIME_US for step in steps if step.read_ok)
    return prompt and all(step.missed_ticks == 0 for step in steps[1:]) and all(abs(gap) < ON_TIME_US for gap in gaps)


def ran(steps, server):
    """Box and PLC ran all the time; how long the PLC's replies took does not count."""
    begin_s, end_s = steps[0].read_us * 1e-6, steps[-1].now_us * 1e-6
    return all(step.missed_ticks == 0 for step in steps[1:]) and \
        not any(a < end_s and begin_s < b for a, b in server.gaps)


def plc_on_time(steps, server):
    """What was read came when the box asked for it, and was answered when that was meant."""
    sent_us = {step.reading: step.read_us for step in steps if step.read_ok}
    return all(request.late_s * 1e6 < ON_TIME_US and
               request.time_s * 1e6 - sent_us.get(request.reading, request.time_s * 1e6) < ON_TIME_US
               for request in requests_of(steps, server))


def requests_of(steps, server):
    """What the PLC received from the first of these steps up to the last."""
    return [r for r in server.requests if steps[0].read_us <= r.time_s * 1e6 < steps[-1].now_us]


def on_time(steps, server):
    return ran(steps, server) and box_on_time(steps) and plc_on_time(steps, server)


def around(steps, reading):
    """The steps around the reading with this number, which may have been spoilt: from the one that has the reading
    before it to the next one that has a later one; one step more on either side. out: them, or [] where the machine
    lost one of its neighbours too, or where they are not in the recording yet"""
    good = [i for i, step in enumerate(steps) if step.read_ok]
    before = [i for i in good if steps[i].reading == (reading - 1) & 0xFFFF]
    behind = [i for i in good if before and i > before[0] and steps[i].reading != steps[before[0]].reading]
    if not behind or before[0] == 0 or behind[0] + 1 >= len(steps):
        return []
    return steps[before[0] - 1:behind[0] + 2]
