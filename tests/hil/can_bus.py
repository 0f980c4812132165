# SPDX-License-Identifier: MIT
"""A CAN interface for a box on a machine without CAN: kernel_shim.c is preloaded into the box, and its
sockets are local ones that end here. Frames are written by hand from linux/can.h and CiA 301."""
import errno
import os
import pathlib
import socket
import struct
import threading
import time

SHIM = os.environ.get("KERNEL_SHIM", str(pathlib.Path(__file__).resolve().parents[2] /
                                      "build/host/tests/hil/libhil_kernel_shim.so"))
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000


class Interface:
    """One interface: what the box binds to, with which filters, what it sends, what it is sent."""

    def __init__(self, folder, name="can0"):
        self.path = folder / name
        self.box = None             # address of the box's socket
        self.binds = []             # filters of each: {(id, mask)}
        self.sent = []              # (id, bytes) from the box
        self.every = {}             # id: bytes that the sensors send every 20 ms
        self.up = True

    def __enter__(self):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(self.path))
        self.socket.settimeout(0.02)
        self.ends = False
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ends = True
        self.thread.join()
        self.socket.close()
        self.path.unlink(missing_ok=True)
        self._mark(True)

    def _run(self):
        while not self.ends:
            self._hear()
            if self.up:
                for identifier, data in list(self.every.items()):
                    self.frame(identifier, data)

    def _hear(self):
        until = time.monotonic() + 0.02
        while time.monotonic() < until:
            try:
                data, sender = self.socket.recvfrom(4096)
            except (TimeoutError, BlockingIOError):
                return
            if len(data) == 16 and sender == self.box:
                identifier, length = struct.unpack("<IB", data[:5])
                self.sent.append((identifier, data[8:8 + length]))
            else:
                self.box = sender
                self.binds.append(set(struct.iter_unpack("<II", data)))
                if not self.up:
                    self._put(struct.pack("<ii", errno.ENETDOWN, errno.ENETDOWN))

    def _put(self, data):
        try:
            if self.box:
                self.socket.sendto(data, socket.MSG_DONTWAIT, self.box)
        except OSError:
            pass                    # its queue is full, or it is no longer there

    def frame(self, identifier, data):
        """Through the filters, as the kernel applies them."""
        flags = EXTENDED | REMOTE | ERROR
        passed = identifier & ERROR or (self.binds and any(
            (identifier & mask) == (wanted & mask) for wanted, mask in self.binds[-1]))
        assert identifier & ~flags < 1 << 29
        if passed:
            self._put(struct.pack("<IB3x8s", identifier, len(data), bytes(data)))

    def _mark(self, up):
        mark = self.path.with_name(self.path.name + ".down")
        mark.unlink(missing_ok=True) if up else mark.touch()

    def go(self, up):
        """ip link set up or down."""
        self.up = up
        self._mark(up)
        self._put(struct.pack("<ii", 0, 0) if up else struct.pack("<ii", errno.ENETDOWN, errno.ENETDOWN))

    def unplug(self):
        """The adapter is gone."""
        self._put(struct.pack("<ii", errno.ENODEV, errno.ENODEV))

    def starts(self, node):
        """How often the box commanded this node to start."""
        return self.sent.count((0, bytes([1, node])))


def wait(condition, timeout_s=60):
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until, "it did not come"
        time.sleep(0.01)
