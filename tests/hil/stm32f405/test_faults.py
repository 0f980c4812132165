# SPDX-License-Identifier: MIT
"""What goes wrong on the wire: it costs the exchanges it overlaps, and the box goes on."""
import os

import pytest

import laws
import machine
from emulator import TEST_IMAGE
from following import active, best_of_five, counters_of, wait_for
from machine import ACTIVE, PERIOD_S
from rtu_plc import framed

# For each fault so many exchanges, and so many good writes after them. scripts/test --long: more.
LONG = bool(os.environ.get("COMPBOX_LONG_TESTS"))
EXCHANGES, GOOD = (200, 40) if LONG else (8, 4)


# Each fault takes a request and its right reply, and returns what is sent instead.

def silent(_, __):
    return []


def late(_, reply):
    return [1.5 * PERIOD_S, reply]


def crc_error(_, reply):
    return [reply[:-1] + bytes([reply[-1] ^ 0x10])]


def flipped_bit(_, reply):
    return [reply[:4] + bytes([reply[4] ^ 0x01]) + reply[5:]]


def noise_before(_, reply):
    return [b"\x00\xff\x5a", reply]


def noise_only(_, __):
    return [bytes(range(40, 80))]


def wrong_unit(frame, reply):
    return [framed(9, reply[1:-2])]


def other_function(_, reply):
    return [framed(1, bytes([4]) + reply[2:-2])]


def other_length(_, reply):
    return [framed(1, reply[1:-4])]


def stops_short(_, reply):
    return [reply[:5]]


def exception(frame, _):
    return [framed(1, bytes([frame[1] | 0x80, 6]))]


def illegal_function(frame, _):
    return [framed(1, bytes([frame[1] | 0x80, 1]))]


def twice(_, reply):
    return [reply + reply]


# What shows it on the console.
SHOWN = {silent: "timeouts", late: "timeouts", crc_error: "crc_errors", flipped_bit: "crc_errors",
         noise_before: "noise_bytes", noise_only: "crc_errors", wrong_unit: "wrong_units",
         other_function: "invalid_replies", other_length: "invalid_replies", stops_short: "crc_errors",
         exception: "exceptions", illegal_function: "illegal_functions", twice: "noise_bytes"}
SHORT = [late, crc_error, noise_before, wrong_unit, stops_short, exception]
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}


def quick(data):
    data["safety"]["ramp_um_per_s"] = 500


def sometimes(fault, every):
    """The fault in each `every`-th exchange; out: the server's hook and its count."""
    count = {"all": 0, "faulty": 0}

    def hook(frame, reply):
        count["all"] += 1
        if count["all"] % every:
            return [reply]
        count["faulty"] += 1
        return fault(frame, reply)
    return hook, count


def planted(server, box, fault):
    """The fault in every fourth of EXCHANGES, and longer until the box has counted half of them: where a
    busy machine lets the emulator stand still in the middle of a reply, that reply is something else."""
    def reported():
        return counters_of(box, "wires").get(SHOWN[fault], 0)
    before = reported()
    server.fault, count = sometimes(fault, 4)
    wait_for(lambda: count["all"] >= EXCHANGES and reported() - before >= (count["faulty"] + 1) // 2,
             or_say=lambda: f"{fault.__name__}: {reported() - before} of {count}")
    server.fault = None


@pytest.mark.parametrize("exchange", ["fc3+fc16", "fc23"] if LONG else ["fc3+fc16"])
def test_faults_now_and_then(plc, rtu, start_box, exchange):
    """One after the other, in every fourth exchange, and the values are right again behind each."""
    def change(data):
        quick(data)
        data["plc"]["exchange"] = exchange
    plc.values = AT_REST
    wanted = machine.wanted_um(AT_REST)
    with rtu() as server, start_box(change) as box:
        plc.wait_mode(ACTIVE, 20)
        for fault in SHOWN if LONG else SHORT:
            planted(server, box, fault)
            mark = len(plc.writes)
            wait_for(lambda: len([w for w in plc.writes[mark:] if w.mode == ACTIVE]) > GOOD)
        wait_for(lambda: all(abs(plc.last().um[name] - um) <= machine.resolution_um(machine.CHANNELS[name])
                             for name, um in wanted.items()))
        box.console.wait("now ACTIVE")
    laws.check_writes(plc.writes)


def lost_for_a_fault(box, count):
    """Cycles that the box loses for each faulty exchange, over a stretch of them."""
    before, faulty = counters_of(box), count["faulty"]
    wait_for(lambda: count["faulty"] >= faulty + EXCHANGES)
    after, faulty = counters_of(box), count["faulty"] - faulty
    return sum(after.get(name, 0) - before.get(name, 0)
               for name in ("reads_failed", "writes_failed", "writes_unknown")) / faulty


def test_where_there_is_time_a_request_is_repeated_in_its_period(plc, rtu, start_box):
    """In 60 ms at 460 800 baud there is: check sums that are wrong now and then cost no cycle."""
    def change(data):
        quick(data)
        data["cycle"]["period_ms"] = 60
        data["plc"]["transport"]["rtu"]["baud"] = 460800
    plc.values = AT_REST
    with rtu() as server, start_box(change) as box:
        wait_for(lambda: len(active(plc)) > 10)
        server.fault, count = sometimes(crc_error, 4)
        lost = best_of_five(lambda: lost_for_a_fault(box, count), 2 / 3)
        assert lost <= 2 / 3, lost                               # without repetition: all of them
        assert counters_of(box, "wires")["retries"] >= count["faulty"] // 2


def test_a_line_that_is_never_silent(plc, rtu, start_box):
    """Somebody babbles: nothing can be sent, the outputs stay; then there is silence again."""
    plc.values = AT_REST
    with rtu() as server, start_box(quick) as box:
        wait_for(lambda: len(active(plc)) > 10)
        since = box.console.mark()
        server.client.sendall(b"\x55\xaa" * 5000)     # takes the emulator some time
        box.console.wait("now HOLD: the PLC does not reply", since)
        mark = len(plc.writes)
        wait_for(lambda: len(plc.writes) > mark and plc.last().mode == ACTIVE)


def test_a_plc_that_no_longer_answers(plc, rtu, start_box):
    """Longer than HOLD lasts: the outputs have gone to zero when it answers again. Until the PLC's heartbeat has
    changed the box may ramp what the registers still hold."""
    plc.values = AT_REST
    with rtu() as server, start_box(quick) as box:
        wait_for(lambda: len(active(plc)) > 30)
        mark, since = len(plc.writes), box.console.mark()
        server.fault = silent
        box.console.wait("now STANDBY: the PLC does not reply", since)
        server.fault = None
        wait_for(lambda: len(plc.writes) > mark and plc.last().mode == ACTIVE)
        box.console.wait("now ACTIVE", since)
        reported = [line.split()[2].rstrip(":") for line in box.console.lines[since:] if " now " in line]
    modes = [mode for mode, before in zip(reported, [None, *reported]) if mode != before]
    end = modes.index("ACTIVE")
    assert modes[:3] == ["HOLD", "RAMP", "STANDBY"] and modes[3:end] in ([], ["RAMP"]), reported
    laws.check_writes(plc.writes)


def test_a_plc_that_restarts(plc, rtu, start_box):
    """The cable is off, then a PLC with empty registers is there."""
    plc.values = AT_REST
    with start_box(quick) as box:
        with rtu():
            wait_for(lambda: len(active(plc)) > 30)
            since = box.console.mark()
        box.console.wait("now HOLD: the PLC does not reply", since)
        plc.set(machine.WRITE[0], [0] * machine.WRITE[1])
        mark = len(plc.writes)
        with rtu():
            wait_for(lambda: len(plc.writes) > mark and plc.last().mode == ACTIVE)
    laws.check_writes(plc.writes[mark:])


def test_a_processor_fault_while_active_ends_in_standby_until_permitted(plc, rtu, start_box):
    plc.values = AT_REST
    with rtu(), start_box(quick, image=TEST_IMAGE) as box:
        wait_for(lambda: len(active(plc)) > 60)
        plc.control &= ~machine.PERMIT_RESUME
        since = box.console.mark()
        box.console.command("crash address")
        box.console.wait("started: processor fault", since)
        box.console.wait("STANDBY: after a loss: waiting for permit resume or a new enable edge", since)
        mark = len(plc.writes)
        wait_for(lambda: len(plc.writes) > mark + 20)
        assert all(w.mode != ACTIVE for w in plc.writes[mark:])
        before = box.console.mark()
        box.console.command("dump before")  # the cycles before the fault, in the run after it
        box.console.wait("dump: end", before)
        cycles = [line.split() for line in box.console.lines[before:] if line.startswith("D ")]
        numbers = [int(fields[1]) for fields in cycles]
        assert len(numbers) == 40 and numbers == list(range(numbers[0], numbers[0] + 40)), numbers
        assert int(cycles[-1][3], 16) == ACTIVE and numbers[-1] > 30, cycles[-1]
        lines = box.console.lines[since:]
        restarted = next(i for i, line in enumerate(lines) if "started: processor fault" in line)
        assert not any("ACTIVE" in line for line in lines[restarted:])
        plc.control |= machine.PERMIT_RESUME
        wait_for(lambda: plc.last().mode == ACTIVE)
