# SPDX-License-Identifier: MIT
"""The PLC of a test, by the world's clock, and what tests wait for."""
from plc_memory import PlcMemory
from stage import Stage


class Plc(PlcMemory):
    def now_s(self):
        return Stage.current.now_s

    def wait(self, condition, timeout_s=60):
        """Lets time pass until a write from now on meets the condition, and returns it; fails with the last one."""
        seen = [len(self.writes)]

        def found():
            fresh, seen[0] = self.writes[seen[0]:], len(self.writes)
            return next((write for write in fresh if condition(write)), None)

        write = Stage.current.run_until(found, timeout_s)
        assert write, f"never came within {timeout_s} s; last write {self.last()}; the log:\n{Stage.current.log}"
        return write
