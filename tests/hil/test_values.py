# SPDX-License-Identifier: MIT
"""Right values in the registers of a PLC that is not ours, over real sockets; more of them in tests/daemon."""
import types

import laws
import machine
import pytest
from box import until
from in_motion import is_of, judged, program
from pymodbus_plc import PymodbusPlc


def test_values_are_those_of_the_models_while_the_axes_move(plc, port, start_box, way):
    """Of the reading that the step before each write had."""
    plc.motion = program
    with PymodbusPlc(plc, port), start_box(change=way) as box:
        until(lambda: len(judged(box.steps, plc.readings)) > 40, every_s=0.3)
        box.stop()
    assert box.code == 0, box.log
    found = judged(box.steps, plc.readings)
    for before, (step, values) in zip([None] + [step for step, _ in found], found):
        # Slewing on behind a gap in which the axes went further than the slew rate.
        late = before is None or step.now_us - before.now_us > 2.5 * machine.PERIOD_S * 1e6 or \
            step.last_write != laws.CONFIRMED
        was_right = late or is_of(before.um, plc.readings[before.reading - 1])
        assert late or is_of(step.um, values) or not was_right, (step.um, values)
    right = [step for step, values in found if is_of(step.um, values)]
    assert len(right) > 30
    written = {tuple(w.block) for w in plc.writes}
    assert sum(tuple(step.written) in written for step in right) > 20, "they reached the PLC"
    blocks = {tuple(step.written) for step in box.steps}
    assert all(tuple(w.block) in blocks for w in plc.writes)
    # The test would see a sign, byte order or scale mistake: the values are far from zero.
    assert all(max(abs(step.um[name]) for step in right) > 5 for name in machine.CHANNELS)
    laws.check_writes(plc.writes)
    laws.check_slew(box.steps)
    laws.check_period(box)


def values_at(plc, step):
    return plc.readings[step.reading - 1]


def steps_with(gap, counted):
    """Twenty steps of a client beside the loop, each a hundredth of a period behind its tick, its reading a cycle old;
    before the fifth the machine stands still for `gap` ticks, of which so many are counted."""
    period_us, steps = machine.PERIOD_S * 1e6, []
    for k in range(20):
        now_us = (k + (gap if k >= 4 else 0) + 0.01) * period_us
        read_us = now_us - (1 + (gap if k == 4 else 0)) * period_us
        steps.append(types.SimpleNamespace(now_us=now_us, read_us=read_us, missed_ticks=counted if k == 4 else 0))
    return steps


def test_the_grid_of_ticks_takes_a_reading_from_before_a_gap_but_no_uncounted_tick():
    laws.check_grid(steps_with(gap=2, counted=2))
    with pytest.raises(AssertionError):
        laws.check_grid(steps_with(gap=2, counted=1))
