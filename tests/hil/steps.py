# SPDX-License-Identifier: MIT
"""The facts of a run, of `--record-inputs`: what each step read, when the box stamped that, what it answered. A test
that asks these does not depend on when the machine let a process run."""
import csv
from dataclasses import dataclass

import machine


def words(text):
    return [int(text[i:i + 4], 16) for i in range(0, len(text), 4)]


@dataclass
class Step:
    now_us: int
    read_us: int
    read_ok: bool
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
    def x_mm(self):
        return machine.unpack("int32", self.registers[8:10]) * 0.0001


def steps_of(path):
    """out: the steps of the recording, complete when the box has ended."""
    with open(path, newline="") as file:
        return [Step(int(row["now_us"]), int(row["read_us"]), row["read_ok"] == "1", int(row["missed_ticks"]),
                     words(row["registers"]), words(row["written"])) for row in csv.DictReader(file)]


def check_after(steps, first, since_us, wait_s):
    """The step at index `first` is the one that came wait_s after since_us, to a period: itself not before, the one
    before it not after. How late either of them ran does not count."""
    slack_us = machine.PERIOD_S * 1e6
    assert steps[first].now_us - since_us >= wait_s * 1e6 - slack_us
    assert steps[first - 1].now_us - since_us <= wait_s * 1e6 + slack_us


def index_of(steps, condition, start=0):
    """out: index of the first step from start on that meets the condition."""
    return next(i for i in range(start, len(steps)) if condition(steps[i]))
