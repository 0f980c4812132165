# SPDX-License-Identifier: MIT
"""Pt100 modules on a serial line: FC3 answered from {unit: {register: word}}, by code of its own."""
import struct

from rtu_machine import with_crc
from stage import Stage


class Modules:
    """The modules on the line at a device; .silent units do not answer, .delay_s ones answer late."""

    def __init__(self, device, units):
        self.device, self.units, self.silent, self.delay_s, self.asked = device, units, set(), {}, []

    def __enter__(self):
        self.stage = Stage.current
        self.stage.plug(self.device, self)
        return self

    def __exit__(self, *_):
        self.stage.plug(self.device)

    def heard(self, request):
        if len(request) == 8 and with_crc(request[:6]) == request:
            self._answer(*struct.unpack(">BBHH", request[:6]))

    def _answer(self, unit, function, start, count):
        self.asked.append(unit)
        if unit not in self.units or unit in self.silent:
            return
        words = [self.units[unit].get(start + i) for i in range(count)]
        if function != 3 or None in words:
            reply = with_crc([unit, function | 0x80, 2])
        else:
            reply = with_crc(struct.pack(f">BBB{count}h", unit, 3, 2 * count, *words))
        self.stage.after(self.delay_s.get(unit, 0.002), lambda: self.stage.send_line(self.device, reply))
