# SPDX-License-Identifier: MIT
"""A PLC that misbehaves: each fault costs the exchanges it overlaps and nothing else."""
import time

import pytest

import laws
import machine
from box import until
from conftest import fc23
from machine import ACTIVE, HOLD, PERIOD_S, RAMP, STANDBY
from raw_plc import RawPlc, frame_of
from steps import LOST, around, check_after, index_of, on_time, requests_of

UNCONFIRMED = "the PLC answers readings but confirms no write"
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}
FIRST, EVERY = 15, 5                 # cycles with a fault: the first, one in so many
OK, UNKNOWN = 1, 4                   # how a write ended
STOPPING = 10                        # a reason


def at_wanted(write, values=None):
    wanted = machine.wanted_um(values or write.values)
    return all(abs(um - wanted[name]) < 0.06 for name, um in write.um.items())


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


ENOUGH = 7                           # faults that met nothing but themselves


def run(plc, port, start_box, fault, change=lambda data: None):
    """Runs the box with `fault` in one of five cycles until ENOUGH of them met exchanges that were on time and a box
    that was ACTIVE; out: box, [(steps around the fault, their requests)]"""
    def quick_ramp(data):
        change(data)
        data["safety"]["ramp_um_per_s"] = 500
    plc.values = dict(AT_REST)
    at, found = [], []

    def now_and_then(request, reply):
        if found or not request.is_cyclic_read or len(plc.reads) < FIRST or (len(plc.reads) - FIRST) % EVERY:
            return None
        steps = fault(request, reply)
        if steps is not None:
            at.append(len(plc.reads))
        return steps

    def judged():
        these, steps = [], box.steps
        for reading in list(at):
            some = around(steps, reading)
            if some and some[0].mode == some[1].mode == ACTIVE and on_time(some, server):
                these.append((some, requests_of(some, server)))
        return these if len(these) >= ENOUGH else None

    with RawPlc(plc, port, now_and_then) as server:
        with start_box(change=quick_ramp) as box:
            found += until(judged, every_s=0.3)
            box.stop()
    assert box.code == 0, box.log
    found = [(some, requests) for some, requests in found if on_time(some, server)]
    assert len(found) >= ENOUGH // 2
    return box, found


def check_costs(found, reads, writes, connections):
    """Each fault cost so many reads and connections, and at most so many writes; the box stayed ACTIVE."""
    for some, requests in found:
        assert sum(not step.read_ok for step in some) == reads, some
        assert sum(step.last_write in LOST for step in some[2:]) <= writes, some
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
             stops_short: "incomplete_replies", closes: "closed_by_peer", garbage: "framing_errors",
             twice: "stray_replies"}
    only_planted = (wrong_id, exception, other_length, garbage)     # no machine that stands still makes these
    met = dict.fromkeys(names, 0)

    def in_turn(request, reply):
        fault = list(names)[sum(met.values()) % len(names)]
        met[fault] += 1
        return fault(request, reply)

    def counted():
        before = dict(met)
        box, _ = run(plc, port, start_box, in_turn)
        link = box.stats["plc"]
        for fault in only_planted:
            assert link[names[fault]] <= met[fault] - before[fault], link
        assert link["exceptions"] == sum(link["exceptions_by_code"].values()) == link["exceptions_by_code"].get("6", 0)
        assert "; exception 6 (server device busy)\n" in box.log
        return all(link[name] >= 1 for name in (*names.values(), "timeouts"))

    until(counted)


def test_a_late_reply_to_a_write_is_not_taken_for_the_next_reading(plc, port, start_box):
    plc.values = dict(AT_REST)
    writes = [0]
    at = []                             # readings before a write whose reply was late

    def late_write(request, reply):
        if request.function != 16:
            return None
        writes[0] += 1
        if writes[0] % 10:
            return None
        at.append(len(plc.reads))
        return [0.033, reply]

    def judged():
        steps = box.steps
        found = []
        for reading in list(at):
            first = next((i for i, s in enumerate(steps) if s.read_ok and s.reading == reading), 0)
            some = steps[first - 1:first + 3] if first else []
            if len(some) == 4 and some[0].read_ok and some[1].mode == ACTIVE and on_time(some, server):
                found.append((some, requests_of(some, server)))
        return found if len(found) >= 4 else None

    with RawPlc(plc, port, late_write) as server, start_box() as box:
        found = until(judged, every_s=0.3)
        box.stop()
    found = [f for f in found if on_time(f[0], server)]
    assert found
    for some, requests in found:
        assert [step.last_write for step in some[2:]] == [UNKNOWN, OK]
        assert all(step.read_ok and step.mode == ACTIVE for step in some)
        assert len({request.connection for request in requests}) == 1
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
        until(lambda: RAMP in {step.mode for step in box.steps}, every_s=0.3)
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


def test_a_short_break_is_bridged_by_hold(plc, port, start_box):
    """A PLC that is back before hold_ms; where the machine was slower than that, once more."""
    plc.values = dict(AT_REST)

    def bridged():
        with start_box() as box:
            with RawPlc(plc, port):
                plc.wait(at_wanted)
            time.sleep(0.13)
            with RawPlc(plc, port):
                plc.wait_mode(ACTIVE)
                plc.wait_writes(10)
                box.stop()
        assert box.code == 0, box.log
        steps = box.steps
        begin = index_of(steps, lambda step: step.mode == ACTIVE)
        lost = index_of(steps, lambda step: step.mode != ACTIVE, begin)
        if steps[lost].reason == STOPPING:
            return False                # back before a reading was too old
        back = index_of(steps, lambda step: step.mode == ACTIVE, lost)
        if steps[back].now_us - steps[lost].now_us > 0.25e6:
            return False
        assert {step.mode for step in steps[lost:back]} == {HOLD}
        return True

    until(bridged)
    laws.check_writes(plc.writes)


def test_torn_blocks_are_not_used(plc, port, start_box):
    def counters(data):
        data["plc"]["read"]["counters"] = True
        data["plc"]["control"], data["plc"]["plc_heartbeat"] = 2, 3
    plc.values = dict(AT_REST)
    count = [0]
    at = []

    def torn(request, reply):
        if not request.is_cyclic_read:
            return None
        count[0] += 1
        if count[0] % 8 == 0:
            at.append(request.time_s * 1e6)
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

    def judged():
        """[steps] around each torn block, from one that has the wanted values on, where all was on time."""
        found, steps = [], box.steps
        for at_us in list(at):
            first = max((i for i, step in enumerate(steps) if step.read_us <= at_us), default=0)
            some = steps[first - 1:first + 3] if first else []
            if len(some) == 4 and some[0].mode == ACTIVE and at_wanted(some[0], AT_REST) and on_time(some, server):
                found.append(some)
        return found if len(found) >= 5 else None

    with RawPlc(plc, port, torn) as server, start_box(change=counters) as box:
        found = until(judged, every_s=0.3)
        box.stop()
    assert box.stats["box"]["reads_torn"] >= 5
    found = [some for some in found if on_time(some, server)]
    assert found
    for some in found:
        assert all(step.mode == ACTIVE and at_wanted(step, AT_REST) for step in some), some


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
    # Attempts are apart by a pause that grows to a second: by the steps in between, which no machine can speed up.
    begins = [min(r.time_s for r in server.requests if r.connection == c) * 1e6
              for c in range(first + 1, first + 7)]
    apart = [sum(a < step.read_us <= b for step in steps) + sum(s.missed_ticks for s in steps if a < s.read_us <= b)
             for a, b in zip(begins, begins[1:])]
    assert max(apart) >= 25, apart
    assert UNCONFIRMED in box.log
