# SPDX-License-Identifier: MIT
"""The PLC of a test behind a real server, in a thread of its own."""
import threading
import time

from plc_memory import PlcMemory


class Plc(PlcMemory):
    def __init__(self, **how):
        self.lock = threading.RLock()
        super().__init__(**how)

    def set(self, start, words):
        with self.lock:
            super().set(start, words)

    def read(self, start, count):
        with self.lock:
            return super().read(start, count)

    def write(self, start, words):
        with self.lock:
            super().write(start, words)

    # What tests wait for.

    def wait(self, condition, timeout_s=300):
        """Waits for a write that meets the condition, from now on; fails with the last one."""
        with self.lock:
            seen = len(self.writes)
        until = time.monotonic() + timeout_s
        while time.monotonic() < until:
            with self.lock:
                fresh, seen = self.writes[seen:], len(self.writes)
            for write in fresh:
                if condition(write):
                    return write
            time.sleep(0.003)
        raise AssertionError(f"never came within {timeout_s} s; last write {self.last()}")
