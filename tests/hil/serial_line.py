# SPDX-License-Identifier: MIT
"""Two pseudo-terminals, end to end: what one side writes the other reads, as on a null-modem cable."""
import os
import pty
import select
import threading
import tty


class NullModem:
    """.a and .b are the paths of its ends."""

    def __init__(self):
        self._masters, self._slaves = [], []
        for _ in range(2):
            master, slave = pty.openpty()
            tty.setraw(slave)
            self._masters.append(master)
            self._slaves.append(slave)  # kept open, so that nobody's leaving hangs the line up
        self.a, self.b = map(os.ttyname, self._slaves)
        self._over = False

    def __enter__(self):
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over = True
        self._thread.join()
        for fd in self._masters + self._slaves:
            os.close(fd)

    def _carry(self):
        first, second = self._masters
        while not self._over:
            for fd in select.select(self._masters, [], [], 0.05)[0]:
                os.write(second if fd == first else first, os.read(fd, 4096))


def on_line(device, change=lambda data: None, **rtu):
    """An edit of the coefficient file: the PLC is at this device."""
    def edit(data):
        data["plc"]["transport"] = {"rtu": {"device": device, "baud": 115200, "parity": "none", **rtu}}
        change(data)
    return edit
