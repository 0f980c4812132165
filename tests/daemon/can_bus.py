# SPDX-License-Identifier: MIT
"""A CAN interface of the box. Frames are written by hand from linux/can.h and CiA 301."""
from stage import Stage

EXTENDED, REMOTE = 0x80000000, 0x40000000


class Interface:
    """One interface: what the box binds to, with which filters, what it sends, what it is sent."""

    def __init__(self, name="can0"):
        self.name = name
        self.binds = []             # filters of each: {(id, mask)}
        self.sent = []              # (id, bytes) from the box
        self.every = {}             # id: bytes that the sensors send every 20 ms
        self.state = "gone"

    def __enter__(self):
        self.stage = Stage.current
        self.set("up")
        self._send_all()
        return self

    def __exit__(self, *_):
        self.set("gone")

    def set(self, state):
        """up or down: by ip link; gone: the adapter is unplugged."""
        self.state = state
        self.stage.can(self.name, state, self)

    def _send_all(self):
        if self.state == "gone":
            return
        for identifier, data in self.every.items():
            self.send(identifier, data)
        self.stage.after(0.02, self._send_all)

    def send(self, identifier, data):
        self.stage.send_frame(self.name, identifier, data)

    # ---- of the stage

    def bound(self, filters):
        self.binds.append(set(map(tuple, filters)))

    def frame(self, identifier, data):
        self.sent.append((identifier, data))

    def starts(self, node):
        """How often the box commanded this node to start."""
        return self.sent.count((0, bytes([1, node])))
