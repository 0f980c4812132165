# SPDX-License-Identifier: MIT
"""A PLC that misbehaves: each fault costs the exchanges it overlaps and nothing else."""
import time

import pytest

import laws
import machine
from conftest import fc23
from machine import ACTIVE, HOLD, PERIOD_S, RAMP, STANDBY
from raw_plc import RawPlc, frame_of

UNCONFIRMED = "the PLC answers readings but confirms no write"
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}
FIRST, EVERY, LAST = 15, 5, 52       # cycles with a fault: the first, one in so many, the last


# Each fault takes a request and its right reply, and returns what the PLC does instead.

def late(_, reply):
    return [0.033, reply]


def dribble(_, reply):
    steps = []
    for byte in reply:
        steps += [bytes([byte]), 0.033 / len(reply)]
    return steps


def wrong_id(request, reply):
    return [frame_of(request, reply[7:], transaction=request.transaction ^ 0x5500)]


def wrong_unit(request, reply):
    return [reply[:6] + bytes([request.unit ^ 5]) + reply[7:]]


def exception(request, _):
    return [frame_of(request, bytes([request.function | 0x80, 6]))]


def other_length(request, reply):
    return [frame_of(request, reply[7:-2])]


def stops_short(_, reply):
    return [reply[:9]]


def closes(_, __):
    return ["close"]


def closes_in_mid_reply(_, reply):
    return [reply[:9], "close"]


def garbage(_, __):
    return [b"\x15\x03\x03\x00\x02\x02\x28"]


def twice(_, reply):
    return [reply + reply]


# What each costs, in exchanges of its cycle (reads, writes) and in connections.
COSTS = {late: (1, 1, 0), dribble: (1, 1, 0), wrong_id: (1, 0, 0), exception: (1, 0, 0),
         wrong_unit: (1, 0, 0), other_length: (1, 0, 0), stops_short: (1, 1, 1),
         closes: (1, 1, 1), closes_in_mid_reply: (1, 1, 1), garbage: (1, 1, 1),
         twice: (0, 0, 0)}


def quick_ramp(data):
    data["safety"]["ramp_um_per_s"] = 500


def run(plc, port, start_box, fault, change=lambda data: None):
    """Runs the box with `fault` in some of the cycles; out: box, server, number of faults."""
    def quick(data):
        change(data)
        quick_ramp(data)
    plc.values = dict(AT_REST)
    cyclic = [0]
    at = []

    def now_and_then(request, reply):
        if not request.is_cyclic_read:
            return None
        cyclic[0] += 1
        if cyclic[0] not in range(FIRST, LAST, EVERY):
            return None
        at.append(cyclic[0])
        return fault(request, reply)

    with RawPlc(plc, port, now_and_then) as server:
        with start_box(change=quick) as box:
            plc.wait_mode(ACTIVE)
            until = time.monotonic() + 10
            while cyclic[0] < LAST + 5 and time.monotonic() < until:
                time.sleep(0.02)
            box.stop()
    assert box.code == 0, box.log
    return box, server, len(at)


@pytest.mark.parametrize("fault", COSTS, ids=lambda f: f.__name__)
def test_a_fault_costs_only_what_it_overlaps(plc, port, start_box, fault):
    box, server, faults = run(plc, port, start_box, fault)
    assert faults >= 7
    stats = laws.check_period(box, faults)
    reads, writes, connections = COSTS[fault]
    counts = stats["box"]
    lost_writes = counts["writes_failed"] + counts["writes_unknown"]
    slack = 1 + laws.stalls(box) + server.overran    # what the test machine itself costs
    assert reads * faults <= counts["reads_failed"] <= reads * faults + slack, counts
    assert lost_writes <= writes * faults + slack, counts
    assert server.connections <= 1 + connections * faults + slack
    assert server.connections >= 1 + connections * (faults - 1)
    assert counts["holds"] == 0, "one lost exchange is no reason to hold"
    assert {w.mode for w in plc.writes[15:40]} == {ACTIVE}
    laws.check_writes(plc.writes)


@pytest.mark.parametrize("fault", [late, wrong_id, wrong_unit, exception, stops_short,
                                   closes_in_mid_reply],
                         ids=lambda f: f.__name__)
def test_a_fault_in_fc23_costs_one_exchange(plc, port, start_box, fault):
    box, server, faults = run(plc, port, start_box, fault, fc23)
    assert faults >= 7
    counts = laws.check_period(box, faults)["box"]
    lost_writes = counts["writes_failed"] + counts["writes_refused"] + counts["writes_unknown"]
    slack = 1 + laws.stalls(box) + server.overran
    assert faults <= counts["reads_failed"] <= faults + slack, counts
    assert lost_writes <= faults + slack, counts
    assert server.connections <= 1 + COSTS[fault][2] * faults + 1
    assert counts["holds"] == 0
    laws.check_writes(plc.writes)


def test_each_fault_is_counted_under_its_name(plc, port, start_box):
    names = [(late, "late_replies"), (wrong_id, "wrong_ids"), (exception, "exceptions"),
             (other_length, "invalid_replies"), (stops_short, "incomplete_replies"),
             (closes, "closed_by_peer"), (garbage, "framing_errors"), (twice, "stray_replies")]
    expected = {"timeouts": 2, **{name: 1 for _, name in names}}  # the late one and the one that stopped short
    for _ in range(3):  # a box that the test machine stalls finds a late reply there in time; hardly thrice
        turn = iter([fault for fault, _ in names])
        box, server, faults = run(plc, port, start_box, lambda *a: next(turn, lambda *_: None)(*a))
        link = box.stats["plc"]
        assert faults >= len(names)
        counted = {name: link[name] for name in expected}
        stalled = laws.stalls(box) or server.overran or box.stats["exchange_us"]["max"] >= laws.DEADLINE_US
        if counted == expected or not stalled:
            break
    assert counted == expected, link
    assert link["exceptions_by_code"] == {"6": 1}
    assert "; exception 6 (server device busy)\n" in box.log


def test_a_late_reply_to_a_write_is_not_taken_for_the_next_reading(plc, port, start_box):
    plc.values = dict(AT_REST)
    count = [0]

    def late_write(request, reply):
        if request.function != 16:
            return None
        count[0] += 1
        return [0.033, reply] if count[0] % 10 == 0 else None

    with RawPlc(plc, port, late_write) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(1.5)
        box.stop()
    faults = count[0] // 10
    counts = laws.check_period(box, faults)["box"]
    assert faults - 1 <= counts["writes_unknown"] <= faults + 1
    assert counts["reads_failed"] <= 1
    assert server.connections == 1
    laws.check_writes(plc.writes)


def test_a_plc_that_accepts_and_never_answers_costs_no_time(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port, answering=False) as server, start_box() as box:
        time.sleep(1.2)
        server.answering = True
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    link = laws.check_period(box)["plc"]
    assert server.connections >= 3                       # it tried again and again …
    silent = [r for r in server.requests if r.number < server.connections]
    assert len(silent) <= server.connections + 1
    assert link["given_up"] >= 2 and link["blocked"] >= 4


def test_a_request_waits_for_the_reply_before_it(plc, port, start_box):
    """The PLC sees no second request while it owes a reply."""
    plc.values = dict(AT_REST)
    pending = []

    def slow_and_watching(request, reply):
        if request.number % 7 != 6:
            return None
        time.sleep(0.05)
        server.connection.setblocking(False)
        try:
            pending.append(server.connection.recv(300, 2))   # MSG_PEEK
        except BlockingIOError:
            pending.append(b"")
        server.connection.settimeout(0.02)
        return [reply]

    with RawPlc(plc, port, slow_and_watching) as server, start_box() as box:
        time.sleep(1.5)
        box.stop()
    assert len(pending) > 5
    assert set(pending) == {b""}


def test_a_plc_that_is_absent_at_the_start_is_found(plc, port, start_box):
    plc.values = dict(AT_REST)
    with start_box() as box:
        time.sleep(1)
        with RawPlc(plc, port):
            came = time.monotonic()
            first = plc.wait_mode(ACTIVE)
            assert first.time_s - came < 1.6
            box.stop()
    assert box.code == 0, box.log
    laws.check_period(box)
    laws.check_writes(plc.writes)
    history = [(h["mode"], h["time_s"]) for h in box.stats["history"]]
    assert history[0][0] == "STANDBY" and history[0][1] == 0
    assert "cannot connect" in box.log and "connected to" in box.log


def test_a_plc_that_is_killed_and_restarted_gets_its_compensation_back(plc, port, start_box):
    plc.values = dict(AT_REST)
    with start_box() as box:
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            time.sleep(0.6)
            before = plc.last()
        gone_s = time.monotonic()
        time.sleep(1.2)
        for start in range(0, 300):
            plc.registers[start] = 0                    # switched off: everything is forgotten
        restart = len(plc.writes)
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            back = plc.wait(lambda w: all(abs(w.um[n] - before.um[n]) < 0.06 for n in w.um))
            assert back.time_s - gone_s < 4
            box.stop()
    assert box.code == 0, box.log
    laws.check_period(box)
    laws.check_writes(plc.writes[:restart])
    after = plc.writes[restart:]
    laws.check_writes(after)
    # The PLC has zero after its start: the box begins there and not where it was.
    for name, um in after[0].um.items():
        assert abs(um) <= 500 * 2 * PERIOD_S + 0.1, f"{name} starts at {um} µm"
    modes = [h["mode"] for h in box.stats["history"]]
    assert "HOLD" in modes and "RAMP" in modes


def test_a_short_break_is_bridged_by_hold(plc, port, start_box):
    plc.values = dict(AT_REST)
    with start_box() as box:
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            time.sleep(0.6)
        with RawPlc(plc, port):
            time.sleep(0.8)
            box.stop()
    assert box.code == 0, box.log
    assert all(w.mode in (ACTIVE, HOLD) for w in plc.writes[20:-20])
    laws.check_writes(plc.writes)


def test_torn_blocks_are_not_used(plc, port, start_box):
    def counters(data):
        data["plc"]["read"]["counters"] = True
        data["plc"]["control"], data["plc"]["plc_heartbeat"] = 2, 3
    plc.values = dict(AT_REST)
    count = [0]

    def torn(request, reply):
        if not request.is_cyclic_read:
            return None
        count[0] += 1
        words = bytearray(reply)
        last = len(words) - 2
        head = (count[0] & 0xFFFF).to_bytes(2, "big")
        words[9:11] = head
        words[last:] = head if count[0] % 8 else b"\xff\xfe"
        control = plc.control.to_bytes(2, "big")
        words[13:15], words[15:17] = control, (count[0] & 0xFFFF).to_bytes(2, "big")
        if count[0] % 8 == 0:
            words[17:27] = b"\x00" * 10                 # … and with nonsense inside
        return [bytes(words)]

    with RawPlc(plc, port, torn), start_box(change=counters) as box:
        plc.wait_mode(ACTIVE)
        time.sleep(1.5)
        box.stop()
    counts = box.stats["box"]
    assert counts["reads_torn"] >= 5
    assert counts["holds"] == 0
    settled = [w for w in plc.writes if w.mode == ACTIVE][20:]
    wanted = machine.wanted_um(AT_REST)
    assert all(abs(w.um["Z"] - wanted["Z"]) < 0.06 for w in settled)


def test_writes_that_are_never_answered_are_a_loss_although_the_plc_is_read(plc, port, start_box):
    plc.values = dict(AT_REST)
    mute = [False]

    def no_answer_to_writes(request, _):
        return [] if mute[0] and request.function == 16 else None

    with RawPlc(plc, port, no_answer_to_writes) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.5)
        mute[0] = True
        reads = len(plc.reads)
        time.sleep(2.5)
        reads = len(plc.reads) - reads
        mute[0] = False                  # permit resume is set: it goes on by itself
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    assert reads > 3
    assert 4 <= server.connections <= 10, "pauses up to a second between attempts"
    laws.check_writes(plc.writes)
    history = box.stats["history"]
    lost = [(h["mode"], h["reason"]) for h in history]
    begin = lost.index(("HOLD", UNCONFIRMED))
    assert lost[begin - 1] == ("ACTIVE", "all is well")
    assert lost[begin + 1] == ("RAMP", UNCONFIRMED)
    assert history[begin + 1]["time_s"] - history[begin]["time_s"] == pytest.approx(0.3, abs=0.07)
    silent = [row for row in box.rows if row["reason"] == 12]
    assert silent[-1]["time_s"] - silent[0]["time_s"] > 2
    assert {row["mode"] for row in silent} == {HOLD, RAMP, STANDBY}
    assert UNCONFIRMED in box.log
    assert box.stats["box"]["holds"] == 1
