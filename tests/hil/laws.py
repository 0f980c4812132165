# SPDX-License-Identifier: MIT
"""What must hold in every run, whatever the test does to the box."""
import machine
from machine import PERIOD_S

DEADLINE_US = 29000  # of an exchange in the usual period


def check_writes(writes, limit_um=300, slew_um_per_s=500):
    """Limits of value and slope, as the PLC sees them; heartbeats that count up."""
    for write in writes:
        for name, um in write.um.items():
            assert abs(um) <= limit_um + 1e-3, f"{name} = {um} µm is beyond its limit"
    for before, after in zip(writes, writes[1:]):
        for name in after.um:
            step = abs(after.um[name] - before.um[name])
            most = slew_um_per_s * 2 * PERIOD_S + 2 * machine.resolution_um(machine.CHANNELS[name])
            assert step <= most, f"{name} moved {step} µm between two writes"
    # Over a longer stretch the mean slope counts; 30 ms for a server that is late itself.
    for first, last in zip(writes, writes[4:]):
        for name in last.um:
            moved = abs(last.um[name] - first.um[name])
            most = slew_um_per_s * (last.time_s - first.time_s + 0.03)
            assert moved <= most, f"{name} moved {moved} µm in {last.time_s - first.time_s} s"


def stalls(box):
    """How often the loop missed its tick, one for each row of ticks missed together."""
    times = [row["time_s"] for row in box.rows]
    return sum(after - before > 1.5 * PERIOD_S for before, after in zip(times, times[1:]))


def check_period(box, faults=0):
    """The loop counted every tick: it ran or it is an overrun. A fault that made the loop late would do so each time;
    without faults nothing is concluded from ticks that the machine took. out: the statistics"""
    stats, times = box.stats, [row["time_s"] for row in box.rows]
    assert stats["overruns"] == stats["box"]["missed_ticks"], stats
    if stats["records_lost"] == 0:
        ticks = len(times) - 1 + stats["overruns"]
        assert abs((times[-1] - times[0]) / PERIOD_S - ticks) < 2, (ticks, times[-1])
    if faults:
        assert stalls(box) <= max(2, faults // 3), stats
    return stats
