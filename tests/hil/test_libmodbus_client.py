# SPDX-License-Identifier: MIT
"""compboxd with the client "libmodbus": whatever the PLC does, the loop keeps its period, outputs keep their laws, and
the box comes back."""
import laws
import machine
import plc_faults as faults
from box import run, until
from conftest import libmodbus
from machine import ACTIVE, AT_REST, STANDBY, at_wanted
from raw_plc import RawPlc

# The times of a loss are those of the box, with any client.
FAULTS = [faults.late, faults.dribble, faults.wrong_id, faults.exception, faults.other_length, faults.stops_short,
          faults.closes, faults.closes_in_mid_reply, faults.garbage, faults.twice]


def test_after_each_fault_the_box_reads_and_writes_again(plc, port, start_box):
    """One fault after the other, each in the first reading behind ten writes of the wanted values."""
    plc.values = dict(AT_REST)
    left, since = list(FAULTS), [0]

    def now_and_then(request, reply):
        calm = plc.writes[since[0]:][-10:]
        if not left or not request.is_cyclic_read or len(calm) < 10 or \
                not all(write.mode == ACTIVE and at_wanted(write) for write in calm):
            return None
        since[0] = len(plc.writes)
        return left.pop(0)(request, reply)

    with RawPlc(plc, port, now_and_then), start_box(change=libmodbus) as box:
        until(lambda: not left, every_s=0.1)
        plc.wait(lambda write: write.mode == ACTIVE and at_wanted(write))
        box.stop()
    assert box.code == 0, box.log
    laws.check_slew(box.steps)
    laws.check_writes(plc.writes)
    assert box.stats["plc"]["requests"] > 0 and box.stats["plc"]["connects"] >= 1


def test_the_loop_waits_for_no_call_of_libmodbus(plc, port, start_box):
    """A PLC that does not reply costs the loop nothing: it steps while the call is pending, and its outputs ramp to
    zero."""
    plc.values = dict(AT_REST)
    mute = []
    with RawPlc(plc, port, lambda request, reply: [] if mute else None), start_box(change=libmodbus) as box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: at_wanted(w))
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
