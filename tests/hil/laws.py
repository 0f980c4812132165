# SPDX-License-Identifier: MIT
"""What must hold in every run, whatever the test does to the box and whenever the machine lets a process run."""
import machine
from machine import HOLD, PERIOD_S, STANDBY

CONFIRMED = 1       # last_write


def check_writes(writes, limit_um=300, slew_um_per_s=500):
    """Limits of value and step, as the PLC sees them."""
    for write in writes:
        for name, um in write.um.items():
            assert abs(um) <= limit_um + 1e-3, f"{name} = {um} µm is beyond its limit"
    for before, after in zip(writes, writes[1:]):
        for name in after.um:
            step = abs(after.um[name] - before.um[name])
            most = slew_um_per_s * 2 * PERIOD_S + 2 * machine.resolution_um(machine.CHANNELS[name])
            assert step <= most, f"{name} moved {step} µm between two writes"


def check_slew(steps, slew_um_per_s=500):
    """Nothing moves faster than its slew rate, by the box's own stamps; time beyond two periods gives no more way."""
    for before, after in zip(steps, steps[1:]):
        if before.mode in (STANDBY, HOLD) or after.last_write != CONFIRMED:
            continue            # it may go back to what the PLC has
        elapsed_s = min((after.now_us - before.now_us) * 1e-6, 2 * PERIOD_S)
        for name, um in after.um.items():
            moved = abs(um - before.um[name])
            most = slew_um_per_s * elapsed_s + 2 * machine.resolution_um(machine.CHANNELS[name])
            assert moved <= most, f"{name} moved {moved} µm in {elapsed_s} s"


def check_period(box):
    """The loop counted every tick: it ran or it is an overrun. out: the statistics"""
    stats, steps = box.stats, box.steps
    assert stats["overruns"] == stats["box"]["missed_ticks"], stats
    if stats["rows_lost"] == 0:
        assert stats["overruns"] == sum(step.missed_ticks for step in steps), stats
        assert stats["cycles"] == len(steps)
        check_grid(steps)
    return stats


def check_grid(steps):
    """The time since its tick of the promptest of the first half and of the second: the same, to a period. A tick that
    is missing in the count shifts all that come behind it by a whole one. Not the time of the reading: that of a client
    beside the loop is from before the tick, and where the machine stood still from long before."""
    tick, since_s = 0, []
    for step in steps:
        tick += step.missed_ticks
        since_s.append(step.now_us / 1e6 - tick * PERIOD_S)
        tick += 1
    half = len(steps) // 2
    assert half == 0 or abs(min(since_s[:half]) - min(since_s[half:])) < PERIOD_S, (tick, since_s)
