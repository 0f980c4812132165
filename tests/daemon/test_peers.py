# SPDX-License-Identifier: MIT
"""PLCs that the box cannot work with: without a function, too slow, or that answer something else.
The box is calm, its status is true, and one line of the log says what to change."""
import machine
from box import until
from conftest import fc23
from frames import frame_of
from machine import ACTIVE, AT_REST, FAULT, PERIOD_S, STANDBY
from raw_plc import RawPlc



def run_against(plc, port, start_box, fault, enough, change=lambda data: None):
    """in : enough(box, server): whether what is judged has happened"""
    plc.values = dict(AT_REST)
    with RawPlc(plc, port, fault) as server, start_box(change=change) as box:
        until(lambda: enough(box, server))
        box.stage.run_for(1.2)                    # the log's lines come at most once a second
        box.kill()
    return box, server


def in_fault(box, _):
    return FAULT in box.modes


def many_requests(_, server):
    return len(server.requests) > 30


def without(function):
    def fault(request, _):
        if request.function == function:
            return [frame_of(request, bytes([function | 0x80, 1]))]
        return None
    return fault


def lines(box, words):
    return [line for line in box.log.splitlines() if words in line]


def check_refused(box, server, function, remedy):
    assert len(lines(box, f"the PLC does not have function {function} (exception 1, illegal function): "
                          f"{remedy}")) == 1, box.log
    assert not lines(box, "ACTIVE"), box.log
    assert len(lines(box, ": exception")) == 0 and len(lines(box, "exception")) == 1, box.log
    assert len(box.log.splitlines()) <= 9 + len(box.steps) * PERIOD_S, "at most one line a second"


def test_a_plc_without_fc23_is_one_sentence_and_never_active(plc, port, start_box):
    box, server = run_against(plc, port, start_box, without(23), in_fault, fc23)
    check_refused(box, server, 23, 'set plc.exchange to "fc3+fc16"')
    assert len(lines(box, "FAULT: the PLC refuses the writes")) == 1, box.log


def test_a_plc_without_fc16_is_one_sentence_and_never_active(plc, port, start_box):
    box, server = run_against(plc, port, start_box, without(16), in_fault)
    check_refused(box, server, 16, "permit writing in its Modbus server, or set plc.exchange")
    assert len(lines(box, "FAULT: the PLC refuses the writes")) == 1, box.log


def test_a_plc_without_fc3_is_one_sentence(plc, port, start_box, exchange):
    box, server = run_against(plc, port, start_box, without(3), many_requests, exchange)
    check_refused(box, server, 3, "let its Modbus server answer holding registers")


def test_a_plc_too_slow_for_two_requests_hears_of_it_in_a_last_write(plc, port, start_box):
    """20 ms for each request, after a quick start: writes take effect and are confirmed too late."""
    def closed_behind_it(_, server):
        writes = [r.connection for r in server.requests if r.is_write]
        return writes and server.connections > writes[-1] and plc.writes and plc.writes[-1].mode != ACTIVE

    def slow(request, reply):
        return [0.020, reply] if request.number > 20 else [reply]

    box, server = run_against(plc, port, start_box, slow, closed_behind_it)
    last, before = plc.writes[-1], plc.writes[-2]
    assert any(w.mode == ACTIVE for w in plc.writes), "else there is nothing to take back"
    assert last.mode != ACTIVE and last.reason == 12
    assert last.um == before.um
    printed = next(r for r in reversed(server.requests) if r.is_write)
    assert [r for r in server.requests if r.connection == printed.connection][-1] is printed, "nothing follows it"
    assert server.connections > printed.connection, "the client retries"
    assert lines(box, "closed by the box behind its last write"), box.log
    slow_lines = lines(box, 'plc.exchange "fc3+fc16" needs cycle.period_ms of ')
    assert len(slow_lines) == 1, box.log
    assert 'replies take up to 2' in slow_lines[0] and 'or "fc23" and ' in slow_lines[0]


def test_a_plc_too_slow_from_the_start_is_never_compensated(plc, port, start_box):
    """The write block is not returned in time, so nothing is written."""
    box, server = run_against(plc, port, start_box, lambda request, reply: [0.020, reply], many_requests)
    assert box.modes == {STANDBY}
    assert len(lines(box, 'plc.exchange "fc3+fc16" needs cycle.period_ms of ')) == 1, box.log


def test_replies_to_something_else_are_named_once(plc, port, start_box):
    def odd(request, reply):
        if not request.is_cyclic_read or request.number < 20:
            return None
        kind = request.number // 20 % 4
        if kind == 1:
            return [reply[:6] + bytes([7]) + reply[7:]]
        if kind == 2:
            return [reply[:7] + bytes([4]) + reply[8:]]
        return [frame_of(request, reply[7:-2])] if kind == 3 else None

    box, server = run_against(plc, port, start_box, odd, lambda _, server: len(server.requests) > 120)
    unit = server.requests[0].unit
    assert len(lines(box, f"a reply from unit 7 to a request for unit {unit}; it is not used")) == 1, box.log
    assert len(lines(box, "a reply of function 4 to a request for function 3")) == 1, box.log
    expected = 2 + 2 * machine.READ[1]
    assert len(lines(box, f"a reply of {expected - 2} bytes of function and data instead of {expected}")) == 1, box.log
