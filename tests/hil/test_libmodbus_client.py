# SPDX-License-Identifier: MIT
"""compboxd with the client "libmodbus": whatever the PLC does, the loop keeps its period, outputs keep their laws, and
the box comes back."""
import pytest

import laws
import machine
import test_faults as faults
from box import run, until
from conftest import libmodbus
from machine import ACTIVE, STANDBY
from raw_plc import RawPlc

# The times of a loss are those of the box, with any client.
FAULTS = [faults.late, faults.dribble, faults.wrong_id, faults.exception, faults.other_length, faults.stops_short,
          faults.closes, faults.closes_in_mid_reply, faults.garbage, faults.twice]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.__name__)
def test_after_each_fault_the_box_reads_and_writes_again(plc, port, start_box, fault):
    plc.values = dict(faults.AT_REST)
    spoilt = []

    def now_and_then(request, reply):
        if not request.is_cyclic_read or len(plc.reads) < faults.FIRST or len(plc.reads) % 20 or len(spoilt) >= 4:
            return None
        spoilt.append(len(plc.reads))
        return fault(request, reply)

    with RawPlc(plc, port, now_and_then), start_box(change=libmodbus) as box:
        until(lambda: len(spoilt) >= 4, every_s=0.1)
        after = len(plc.writes)
        until(lambda: len(plc.writes) > after + 20 and plc.writes[-1].mode == ACTIVE, every_s=0.1)
        box.stop()
    assert box.code == 0, box.log
    assert faults.at_wanted(plc.writes[after + 20])
    laws.check_slew(box.steps)
    laws.check_writes(plc.writes)
    assert box.stats["plc"]["requests"] > 0 and box.stats["plc"]["connects"] >= 1


def test_the_loop_waits_for_no_call_of_libmodbus(plc, port, start_box):
    """A PLC that does not reply costs the loop nothing: it steps while the call is pending, and its outputs ramp to
    zero."""
    plc.values = dict(faults.AT_REST)
    mute = []
    with RawPlc(plc, port, lambda request, reply: [] if mute else None), start_box(change=libmodbus) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: faults.at_wanted(w))
        mute.append(True)
        until(lambda: box.steps and box.steps[-1].mode == STANDBY, every_s=0.3)
        mute.clear()
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    laws.check_slew(box.steps)
    counters = box.stats["plc"]
    assert counters["blocked"] >= 2, "cycles that ran while a call was pending; a loop that waits has none"
    assert counters["timeouts"] >= 2 and counters["disconnects"] >= 2


def test_a_reload_does_not_change_the_client(plc, port, start_box):
    with RawPlc(plc, port), start_box(change=libmodbus) as box:
        plc.wait_mode(ACTIVE)
        machine.write_coefficients(box.folder / "coefficients.json", port, lambda data: data.update(revision=99))
        box.process.send_signal(1)
        until(lambda: box.stats["reloads"]["refused"] == 1, every_s=0.1)
        assert "plc.transport differs" in box.stats["reloads"]["last"]
        box.stop()
    assert box.code == 0, box.log


def test_the_file_is_accepted(tmp_path, port):
    file = machine.write_coefficients(tmp_path / "c.json", port, libmodbus)
    assert run("--config", str(file), "--check")[0] == 0
