# SPDX-License-Identifier: MIT
"""Bounds at the seams: a second writer, a crash while permission is pending, a PLC that restarted or
refuses the read-back, values that are not numbers. Only what was exchanged is judged."""
import itertools
import math
import signal
from dataclasses import dataclass, field

import pytest

import machine
from box import Box, until
from frames import frame_of
from machine import ACTIVE, AT_REST, ENABLE, FAULT, PERMIT_RESUME, RAMP, REFERENCED, STOPPED
from plc import Plc
from raw_plc import RawPlc

APPLIED = {"X": 16, "Y": 18, "Z": 20}           # of the read block, type and scale of the channel
LIMIT_UM, ERROR_UM, STEP_UM = 300, 400, 500 * 2 * machine.PERIOD_S
INFINITE = machine.pack("float32", math.inf)
EVEN_WITHOUT_PERMISSION = ENABLE | REFERENCED


def size_of(channel):
    return 1 if channel["type"] == "int16" else 2


def raw(name, um):
    channel = machine.CHANNELS[name]
    value = channel.get("sign", 1) * um / channel["scale"]
    return machine.pack(channel["type"], value if channel["type"] == "float32" else round(value))


@dataclass
class Follower(Plc):
    """Applies what its write registers hold at each reading."""
    applied: dict = field(default_factory=dict)   # name: words that it shows instead
    foreign: object = None                        # called behind each write: a second writer

    def _refresh(self, now):
        super()._refresh(now)
        for name, channel in machine.CHANNELS.items():
            held = self.registers[channel["plc"]:channel["plc"] + size_of(channel)]
            self.set(APPLIED[name], self.applied.get(name, held))

    def write(self, start, words):
        super().write(start, words)
        if self.foreign:
            self.foreign()

    def writes_to(self, name, um):
        self.set(machine.CHANNELS[name]["plc"], raw(name, um))


@pytest.fixture
def plc():
    return Follower(values=dict(AT_REST))


def with_applied(data):
    for channel in data["channels"]:
        channel["applied"] = APPLIED[channel["name"]]


def lines(box, words):
    return [line for line in box.log.splitlines() if words in line]


def reason_is(reason):
    return lambda write: write.reason == reason


def largest(writes):
    return max(abs(um) for write in writes for um in write.um.values())


def kill_and_settle(box, server):
    """Nothing that the killed box sent is still waiting for the PLC."""
    box.kill()
    box.stage.run_until(lambda: server.link is None)


def refused_read_back(request, _):
    if request.function == 3 and request.start == machine.WRITE[0]:
        return [frame_of(request, bytes([0x83, 2]))]
    return None


# ---- a second writer


def test_a_foreign_value_beyond_error_um_is_a_fault(plc, port, start_box):
    with RawPlc(plc, port), start_box(change=with_applied) as box:
        plc.wait_mode(ACTIVE)
        plc.foreign = lambda: plc.writes_to("Y", 2 * ERROR_UM)
        plc.wait(lambda w: w.mode == FAULT and w.reason == 21)
        plc.foreign = None
        box.stop()
    assert len(lines(box, "FAULT")) == 1 and "channel Y" in lines(box, "FAULT")[0], box.log
    assert box.stats["box"]["applied_foreign"] >= 2
    assert largest(plc.writes) <= LIMIT_UM


@pytest.mark.parametrize("flickers", [False, True])
def test_a_smaller_foreign_value_is_reason_13(plc, port, start_box, flickers):
    turns = itertools.count()

    def foreign():
        if not flickers or next(turns) % 2:
            plc.writes_to("Z", 390)

    with RawPlc(plc, port), start_box(change=with_applied) as box:
        plc.wait_mode(ACTIVE)
        plc.foreign = foreign
        assert plc.wait(reason_is(13)).mode == ACTIVE
        plc.foreign = None
        plc.wait(reason_is(0))
        box.stop()
    assert "channel Z" in lines(box, "ACTIVE: the PLC applies")[0], box.log
    assert box.stats["box"]["applied_foreign"] > 0
    assert not any(w.mode == FAULT for w in plc.writes)


def test_a_foreign_value_in_a_register_is_counted_and_named(plc, port, start_box):
    with RawPlc(plc, port) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.foreign = lambda: plc.writes_to("X", 250)
        plc.wait_writes(100)
        plc.foreign = None
        box.stop()
        back = [r for r in server.requests if r.function == 3 and r.start == machine.WRITE[0]]
    named = lines(box, "another client writes to ")
    count = box.stats["box"]["registers_foreign"]
    assert named and all("the register of channel X holds 250" in line for line in named), box.log
    assert len(named) <= count < len(back)
    assert len(back) < len(plc.writes) / 10, "not in each cycle"


# ---- a crash


def crash_while_permission_is_pending(plc, server, start_box, change):
    """out: the last write of the killed box, its status RAMP, waiting for permission"""
    with start_box(change=change) as box:
        plc.wait_mode(ACTIVE)
        plc.control = EVEN_WITHOUT_PERMISSION
        plc.heartbeat_alive = False
        plc.wait(lambda w: w.mode == RAMP and largest([w]) > 30)
        plc.heartbeat_alive = True
        plc.wait(lambda w: w.mode == RAMP and w.reason == 7)
        kill_and_settle(box, server)
    left = plc.last()
    plc.writes.clear()
    assert left.mode == RAMP
    return left


def never_active(writes):
    return not any(write.mode == ACTIVE for write in writes)


@pytest.mark.parametrize("change", [None, with_applied])
def test_a_crash_is_no_permission(plc, port, start_box, change):
    def slow(data):
        data["safety"]["ramp_um_per_s"] = 20
        if change:
            change(data)

    with RawPlc(plc, port) as server:
        left = crash_while_permission_is_pending(plc, server, start_box, slow)
        with start_box(change=slow) as box:
            plc.wait(reason_is(7))
            plc.wait_writes(30)
            writes = list(plc.writes)
            assert never_active(writes)
            assert writes[0].um == left.um, "no step"
            plc.control |= PERMIT_RESUME
            plc.wait_mode(ACTIVE)
            box.kill()


# ---- a PLC that restarted and refuses the read-back


@pytest.mark.parametrize("change", [None, with_applied])
def test_a_refused_read_back_is_met_at_applied_or_zero(plc, port, start_box, change):
    """The PLC applies 40 µm on X; its registers hold something else."""
    plc.control = EVEN_WITHOUT_PERMISSION
    plc.applied = {"X": raw("X", 40)}
    for name in machine.CHANNELS:
        plc.writes_to(name, 200)
    with RawPlc(plc, port, refused_read_back), start_box(change=change) as box:
        plc.wait(reason_is(7))
        plc.wait_writes(30)
        box.kill()
    first = plc.writes[0]
    assert abs(first.um["X"] - (40 if change else 0)) <= STEP_UM
    assert change or first.um == {"X": 0, "Y": 0, "Z": 0}
    assert never_active(plc.writes)


def test_a_plc_that_restarts_and_then_refuses_the_read_back(stage, plc, port, start_box):
    """While the box is ACTIVE: its registers are zero again, its heartbeat begins anew."""
    with start_box() as box:
        with RawPlc(plc, port):
            plc.wait_mode(ACTIVE)
            plc.wait(lambda w: largest([w]) > 50)
        plc.control = EVEN_WITHOUT_PERMISSION
        plc.set(machine.WRITE[0], [0] * machine.WRITE[1])
        before = len(plc.writes)
        stage.run_for(0.5)              # no PLC restarts faster
        with RawPlc(plc, port, refused_read_back):
            plc.wait(reason_is(7))
            box.kill()
    assert plc.writes[before].um == {"X": 0, "Y": 0, "Z": 0}
    assert never_active(plc.writes[before:])


def run_with_state(plc, start_box, state, end):
    with start_box("--state", str(state), "--state-every", "1") as box:
        plc.wait_mode(ACTIVE)
        end(box)
    last = plc.last()
    plc.writes.clear()
    return last, box


def test_after_a_clean_stop_the_state_file_is_the_permission(plc, port, start_box, tmp_path):
    state = tmp_path / "box.state"
    plc.control = EVEN_WITHOUT_PERMISSION
    with RawPlc(plc, port) as server:
        last, box = run_with_state(plc, start_box, state, Box.stop)
        assert last.mode == STOPPED and box.code == 0, box.log
        server.fault = refused_read_back
        _, box = run_with_state(plc, start_box, state, Box.kill)   # ACTIVE by the level of enable
        assert "; the previous run ended STOPPED" in box.log
        with start_box("--state", str(state)) as box:
            plc.wait(reason_is(7))
            plc.wait_writes(30)
            box.kill()
    assert "; the previous run did not end STOPPED" in box.log
    assert never_active(plc.writes)


# ---- a PLC without `applied` that restarted during the pause; its registers outlived that


@pytest.mark.parametrize("went_back", [False, True])
def test_a_heartbeat_that_went_back_starts_from_zero(plc, port, start_box, tmp_path, went_back):
    state = tmp_path / "box.state"

    def crash(box):
        plc.wait(lambda w: largest([w]) > 50)
        before_ns = state.modified_ns
        plc.wait(lambda w: state.modified_ns > before_ns)   # written with a heartbeat of now
        kill_and_settle(box, server)

    with RawPlc(plc, port) as server:
        left, _ = run_with_state(plc, start_box, state, crash)
        plc.beat_back = 30000 if went_back else 0
        with start_box("--state", str(state)) as box:
            first = plc.wait(lambda w: True)
            box.kill()
    assert first.um == ({"X": 0, "Y": 0, "Z": 0} if went_back else left.um)


# ---- what is not a number


@pytest.mark.parametrize("sign", [1, -1])
def test_an_infinite_applied_at_first_contact(plc, port, start_box, sign):
    plc.applied = {"X": machine.pack("float32", sign * math.inf)}
    with RawPlc(plc, port), start_box(change=with_applied) as box:
        plc.wait_writes(60)
        plc.applied = {}
        box.kill()
    assert largest(plc.writes) <= LIMIT_UM


def test_an_infinite_value_in_the_read_back_after_a_loss(plc, port, start_box):
    with RawPlc(plc, port) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: largest([w]) > 50)
        server.answering = False
        count = len(server.requests)
        until(lambda: len(server.requests) >= count + 8)
        plc.set(machine.CHANNELS["X"]["plc"], INFINITE)
        server.answering = True
        plc.wait_mode(ACTIVE)
        plc.wait_writes(30)
        box.stop()
    assert box.code == 0, box.log
    assert all(math.isfinite(um) for w in plc.writes for um in w.um.values())
    assert largest(plc.writes) <= LIMIT_UM


# ---- a configuration that changed in memory


def flip_a_bit(stage):
    """In the plc part of the configuration: the last byte before its host, in the first copy, which
    is that of the running box."""
    stage.ask("flip", b"127.0.0.1".ljust(16, b"\0").hex(), -1, 0x10)


def test_a_configuration_that_changes_while_a_file_is_offered_is_not_replaced(stage, plc, port, start_box, tmp_path):
    """The loop stands still while both happen; it takes over nothing from such a box."""
    with RawPlc(plc, port), start_box() as box:
        plc.wait_mode(ACTIVE)
        stage.stall(0.5, "compboxd-loop")
        machine.write_coefficients(tmp_path / "coefficients.json", port,
                                   lambda data: data.update(revision=data["revision"] + 1))
        box.send_signal(signal.SIGHUP)
        stage.run_for(0.3)
        flip_a_bit(stage)
        until(lambda: box.stats["mode"] == "FAULT")
        box.stop()
    assert box.code == 1 and "running now" not in box.log, box.log


def test_a_corrupt_configuration_writes_no_more_and_takes_no_file(stage, plc, port, start_box):
    with RawPlc(plc, port) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        flip_a_bit(stage)
        until(lambda: box.stats["mode"] == "FAULT")
        written, requests = len(plc.writes), len(server.requests)
        box.send_signal(signal.SIGHUP)
        until(lambda: "restart compboxd" in str(box.stats["reloads"]))
        assert (len(plc.writes), len(server.requests)) == (written, requests)
        box.stop()
    assert box.code == 1
    assert len(lines(box, "FAULT: the configuration in memory has changed")) == 1, box.log
    refused, = lines(box, "is not taken, because the running configuration has changed in memory")
    assert refused.endswith("; restart compboxd"), "no revision goes on"
