# SPDX-License-Identifier: MIT
"""Priorities of real processes: a loop that misses many periods in a row goes to FAULT, as it has to (overruns)."""
import os


def _may_be_realtime():
    pid = os.fork()
    if pid == 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
            os._exit(0)
        except OSError:
            os._exit(1)
    return os.waitpid(pid, 0)[1] == 0


# Where it is permitted the loop runs before everything else, so that what is late is late because of the loop.
PRIORITY = ["--priority", "50"] if _may_be_realtime() else []


def run_before_others():
    """The calling thread runs before everything but the box, where it is permitted: a PLC does not
    wait for the test machine's other work either. What it starts runs as usual."""
    if PRIORITY:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(20))
