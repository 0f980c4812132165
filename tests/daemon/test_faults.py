# SPDX-License-Identifier: MIT
"""A PLC that misbehaves: each fault costs the exchanges it overlaps and nothing else."""
import pytest

import laws
from box import until
from conftest import fc23
from machine import ACTIVE, AT_REST, HOLD, PERIOD_S, RAMP, STANDBY, at_wanted
from plc_faults import (closes, closes_in_mid_reply, dribble, exception, garbage, late, other_length, stops_short,
                        twice, wrong_id, wrong_unit)
from raw_plc import RawPlc
from steps import LOST, around, check_after, index_of, requests_of

UNCONFIRMED = "the PLC answers readings but confirms no write"
FIRST, EVERY = 15, 5                 # cycles with a fault: the first, one in so many
OK, UNKNOWN = 1, 4                   # how a write ended


# What each costs, in exchanges of its cycle (reads, writes) and in connections.
COSTS = {late: (1, 1, 0), dribble: (1, 1, 0), wrong_id: (1, 0, 0), exception: (1, 0, 0),
         wrong_unit: (1, 0, 0), other_length: (1, 0, 0), stops_short: (1, 1, 1),
         closes: (1, 1, 1), closes_in_mid_reply: (1, 1, 1), garbage: (1, 1, 1),
         twice: (0, 0, 0)}


FAULTS = 7


def run(plc, port, start_box, fault, change=lambda data: None):
    """Runs the box with `fault` in one of five cycles; out: box, [(steps around the fault, their requests)]"""
    def quick_ramp(data):
        change(data)
        data["safety"]["ramp_um_per_s"] = 500
    plc.values = dict(AT_REST)
    at = []                             # readings that were spoilt

    def now_and_then(request, reply):
        count = len(plc.reads) - FIRST
        if not request.is_cyclic_read or count < 0 or count % EVERY or len(at) >= FAULTS:
            return None
        at.append(len(plc.reads))
        return fault(request, reply)

    with RawPlc(plc, port, now_and_then) as server, start_box(change=quick_ramp) as box:
        until(lambda: len(at) == FAULTS)
        plc.wait_writes(2 * EVERY)
        box.stop()
    assert box.code == 0, box.log
    steps = box.steps
    found = [around(steps, reading) for reading in at]
    return box, [(some, requests_of(some, server)) for some in found]


def check_costs(found, reads, writes, connections):
    """Each fault cost so many reads, writes and connections; the box stayed ACTIVE."""
    for some, requests in found:
        assert sum(not step.read_ok for step in some) == reads, some
        assert sum(step.last_write in LOST for step in some[2:]) == writes, some
        assert requests[-1].connection - requests[0].connection == connections
        assert {step.mode for step in some} == {ACTIVE}, "one lost exchange is no reason to hold"


@pytest.mark.parametrize("fault", COSTS, ids=lambda f: f.__name__)
def test_a_fault_costs_only_what_it_overlaps(plc, port, start_box, fault):
    box, found = run(plc, port, start_box, fault)
    check_costs(found, *COSTS[fault])
    laws.check_period(box)
    laws.check_slew(box.steps)
    laws.check_writes(plc.writes)


@pytest.mark.parametrize("fault", [late, wrong_id, wrong_unit, exception, stops_short,
                                   closes_in_mid_reply],
                         ids=lambda f: f.__name__)
def test_a_fault_in_fc23_costs_one_exchange(plc, port, start_box, fault):
    box, found = run(plc, port, start_box, fault, fc23)
    check_costs(found, 1, 1, COSTS[fault][2])
    laws.check_period(box)
    laws.check_slew(box.steps)
    laws.check_writes(plc.writes)


def test_each_fault_is_counted_under_its_name(plc, port, start_box):
    names = {late: "late_replies", wrong_id: "wrong_ids", exception: "exceptions", other_length: "invalid_replies",
             stops_short: "incomplete_replies", closes: "closed_by_peer", garbage: "framing_errors"}
    turns = iter(names)
    box, _ = run(plc, port, start_box, lambda request, reply: next(turns)(request, reply))
    link = box.stats["plc"]
    assert {name: link[name] for name in names.values()} == dict.fromkeys(names.values(), 1)
    assert link["exceptions_by_code"] == {"6": 1}
    assert box.log.count("; exception 6 (server device busy)\n") == 1


def test_a_second_reply_is_counted_as_stray(plc, port, start_box):
    box, _ = run(plc, port, start_box, twice)
    assert box.stats["plc"]["stray_replies"] == FAULTS


def test_a_late_reply_to_a_write_is_not_taken_for_the_next_reading(plc, port, start_box):
    plc.values = dict(AT_REST)
    at = []                             # readings before a write whose reply was late

    def late_write(request, reply):
        if request.function != 16 or len(plc.writes) % 10:
            return None
        at.append(len(plc.reads))
        return [0.033, reply]

    with RawPlc(plc, port, late_write) as server, start_box() as box:
        plc.wait_writes(45)
        box.stop()
    steps = box.steps
    assert len(at) >= 4
    for reading in at[:4]:
        first = index_of(steps, lambda s: s.read_ok and s.reading == reading)
        some = steps[first - 1:first + 3]
        assert [step.last_write for step in some[2:]] == [UNKNOWN, OK]
        assert all(step.read_ok and step.mode == ACTIVE for step in some[1:])
        assert len({request.connection for request in requests_of(some, server)}) == 1
    laws.check_period(box)
    laws.check_slew(box.steps)
    laws.check_writes(plc.writes)


def test_a_plc_that_accepts_and_never_answers_costs_no_time(plc, port, start_box):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port, answering=False) as server, start_box() as box:
        until(lambda: server.connections >= 3)               # it tries again and again …
        server.answering = True
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    link = laws.check_period(box)["plc"]
    for connection in (1, 2):
        assert sum(r.connection == connection for r in server.requests) <= 1, "no second request before a reply"
    assert link["given_up"] >= 2 and link["blocked"] >= 4


def test_a_request_waits_for_the_reply_before_it(stage, plc, port, start_box):
    """The PLC sees no second request while it owes a reply."""
    plc.values = dict(AT_REST)
    pending = []

    def slow_and_watching(request, reply):
        if request.number % 7 != 6:
            return None
        stage.after(0.049, lambda: pending.append(server.link.received))
        return [0.05, reply]

    with RawPlc(plc, port, slow_and_watching) as server, start_box() as box:
        until(lambda: len(pending) > 5)
        box.stop()
    assert set(pending) == {b""}


def test_a_plc_that_is_absent_at_the_start_is_found(plc, port, start_box):
    plc.values = dict(AT_REST)
    with start_box() as box:
        until(lambda: len(box.steps) > 20)
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
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
            before = plc.wait(at_wanted)
        until(lambda: RAMP in box.modes)
        for start in range(0, 300):
            plc.registers[start] = 0                    # switched off: everything is forgotten
        restart = len(plc.writes)
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            plc.wait(lambda w: all(abs(w.um[n] - before.um[n]) < 0.06 for n in w.um))
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


def test_a_short_break_is_bridged_by_hold(stage, plc, port, start_box):
    """A PLC that is back before hold_ms."""
    plc.values = dict(AT_REST)
    with start_box() as box:
        with RawPlc(plc, port):
            plc.wait(at_wanted)
        stage.run_for(0.13)
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            plc.wait_writes(10)
            box.stop()
    assert box.code == 0, box.log
    steps = box.steps
    lost = index_of(steps, lambda step: step.mode == HOLD, index_of(steps, lambda step: step.mode == ACTIVE))
    back = index_of(steps, lambda step: step.mode == ACTIVE, lost)
    assert {step.mode for step in steps[lost:back]} == {HOLD}
    assert steps[back].now_us - steps[lost].now_us < 0.3e6
    laws.check_writes(plc.writes)


def test_torn_blocks_are_not_used(plc, port, start_box):
    def counters(data):
        data["plc"]["read"]["counters"] = True
        data["plc"]["control"], data["plc"]["plc_heartbeat"] = 2, 3
    plc.values = dict(AT_REST)
    count, at_us = [0], []

    def torn(request, reply):
        if not request.is_cyclic_read:
            return None
        count[0] += 1
        if count[0] % 8 == 0:
            at_us.append(request.time_s * 1e6)
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
        plc.wait(at_wanted)
        begin_us = plc.writes[-1].time_s * 1e6
        plc.wait_writes(50)
        box.stop()
    steps = box.steps
    found = [max(i for i, step in enumerate(steps) if step.read_us <= us) for us in at_us if us > begin_us]
    assert box.stats["box"]["reads_torn"] == len(at_us) and len(found) >= 5
    for i in found[:5]:
        assert all(step.mode == ACTIVE and at_wanted(step, AT_REST) for step in steps[i - 1:i + 3])


def test_writes_that_are_never_answered_are_a_loss_although_the_plc_is_read(plc, port, start_box):
    plc.values = dict(AT_REST)
    mute = [False]

    def no_answer_to_writes(request, _):
        return [] if mute[0] and request.function == 16 else None

    with RawPlc(plc, port, no_answer_to_writes) as server, start_box() as box:
        plc.wait(at_wanted)
        mute[0] = True
        reads, first = len(plc.reads), server.connections
        until(lambda: server.connections >= first + 6)
        reads = len(plc.reads) - reads
        mute[0] = False                  # permit resume is set: it goes on by itself
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    assert reads > 3
    laws.check_writes(plc.writes)
    steps = box.steps
    ramp = index_of(steps, lambda step: step.mode == RAMP)
    hold = max(i for i, step in enumerate(steps[:ramp]) if step.mode != HOLD) + 1
    assert steps[hold - 1].mode == ACTIVE
    check_after(steps, ramp, steps[hold].now_us, 0.3)       # hold_ms
    unconfirmed = {step.mode for step in steps[hold:] if step.reason == 12}
    assert STANDBY in unconfirmed and unconfirmed <= {HOLD, RAMP, STANDBY}
    # Attempts are apart by a pause that grows to a second.
    begins = [min(r.time_s for r in server.requests if r.connection == c) for c in range(first + 1, first + 7)]
    assert 1 < max(b - a for a, b in zip(begins, begins[1:])) < 1.2, begins
    assert UNCONFIRMED in box.log
