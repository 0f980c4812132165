# SPDX-License-Identifier: MIT
"""The PLC's memory and behaviour, whatever server stands before it and whatever clock it has."""
import time
from dataclasses import dataclass, field

import machine


@dataclass
class Write:
    """One write of the box, and what it could know then."""
    time_s: float
    block: list
    values: dict         # of the signals in the reading before it
    read_s: float        # when that reading was served
    readings: list       # the values of the last readings, this one the last

    @property
    def mode(self):
        return self.block[machine.STATUS - machine.WRITE[0]] & 0xFF

    @property
    def reason(self):
        return self.block[machine.STATUS - machine.WRITE[0]] >> 8

    @property
    def heartbeat(self):
        return self.block[machine.BOX_HEARTBEAT - machine.WRITE[0]]

    @property
    def um(self):
        return machine.written_um(self.block)


@dataclass
class PlcMemory:
    """Registers, a heartbeat that counts while it is alive, and axes that move."""
    control: int = machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME
    heartbeat_alive: bool = True
    beat_back: int = 0                       # counts since then are less by this
    refuse_reads: bool = False
    refuse_writes: bool = False
    motion: object = None                    # seconds -> {signal: value}
    registers: list = field(default_factory=lambda: [0] * 300)
    writes: list = field(default_factory=list)
    reads: list = field(default_factory=list)   # times of readings of the read block
    values: dict = field(default_factory=lambda: {"X": 0, "Y": 0, "Z": 0, "T1": 20})
    readings: list = field(default_factory=list)  # the values of each reading of the read block

    def __post_init__(self):
        self.start_s = self.now_s()

    def now_s(self):
        return time.monotonic()

    def set(self, start, words):
        self.registers[start:start + len(words)] = words

    def read(self, start, count):
        """Serves a reading; the axes are then where the motion says."""
        now = self.now_s()
        if start == machine.READ[0]:
            self._refresh(now)
            self.reads.append(now)
            self.readings.append(dict(self.values))
            self.registers[machine.READING] = len(self.readings) & 0xFFFF
        return list(self.registers[start:start + count])

    def _refresh(self, now):
        if self.motion:
            self.values = self.motion(now - self.start_s)
        for address, word in machine.signal_registers(self.values).items():
            self.registers[address] = word
        self.registers[machine.CONTROL] = self.control | self._pressed()
        if self.heartbeat_alive:
            self.registers[machine.PLC_HEARTBEAT] = (int(now * 100) - self.beat_back) & 0xFFFF

    def _pressed(self):
        """A box of a machine that stood still again and again is in FAULT; the operator presses reset each second."""
        last = self.last()
        stood_still = last is not None and (last.mode, last.reason) == machine.STOOD_STILL
        return machine.RESET if stood_still and int(2 * self.now_s()) % 2 else 0

    def write(self, start, words):
        self.registers[start:start + len(words)] = words
        if start == machine.WRITE[0] and len(words) == machine.WRITE[1]:
            read_s = self.reads[-1] if self.reads else 0
            self.writes.append(Write(self.now_s(), list(words), dict(self.values), read_s, self.readings[-4:]))

    def last(self):
        return self.writes[-1] if self.writes else None

    # What tests wait for: wait(condition, timeout_s) belongs to the clock, so each Plc has its own.

    def wait_mode(self, mode, timeout_s=300):
        return self.wait(lambda write: write.mode == mode, timeout_s)

    def wait_writes(self, count):
        """Waits until the box has written so often from now on."""
        seen = len(self.writes)
        return self.wait(lambda write: len(self.writes) >= seen + count)
