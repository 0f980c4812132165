# SPDX-License-Identifier: MIT
"""Pt100 modules on a serial line: FC3 answered from {unit: {register: word}}, by code of its own."""
import os
import select
import struct
import threading
import time
import tty


def with_crc(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return bytes(frame) + struct.pack("<H", crc)


class Modules:
    """The modules on a line's end; .silent units do not answer, .delay_s ones answer late."""

    def __init__(self, device, units):
        self.units, self.silent, self.delay_s, self.requests = units, set(), {}, []
        self._fd = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._fd)
        self._over = False

    def __enter__(self):
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over = True
        self._thread.join()
        os.close(self._fd)

    def count(self, unit):
        """Number of requests to this one so far."""
        return sum(other == unit for _, other in list(self.requests))

    def _serve(self):
        got = b""
        while not self._over:
            if not select.select([self._fd], [], [], 0.02)[0]:
                got = b""
                continue
            got += os.read(self._fd, 256)
            if len(got) == 8 and with_crc(got[:6]) == got:
                self._answer(*struct.unpack(">BBHH", got[:6]))
                got = b""

    def _answer(self, unit, function, start, count):
        self.requests.append((time.monotonic(), unit))
        if unit not in self.units or unit in self.silent:
            return
        time.sleep(self.delay_s.get(unit, 0.002))
        words = [self.units[unit].get(start + i) for i in range(count)]
        if function != 3 or None in words:
            os.write(self._fd, with_crc([unit, function | 0x80, 2]))
            return
        body = struct.pack(f">BBB{count}h", unit, 3, 2 * count, *words)
        os.write(self._fd, with_crc(body))
