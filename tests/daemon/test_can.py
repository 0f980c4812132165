# SPDX-License-Identifier: MIT
"""The whole daemon with temperatures over CAN. Real controllers and the real kernel's filters and errors:
scripts/test --system."""
import errno
import signal

import machine
import pytest
from box import until
from can_bus import EXTENDED, REMOTE, Interface
from machine import ACTIVE, term_value
from raw_plc import RawPlc

AT = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
GROW = next(t for t in machine.FILE["terms"] if t["name"] == "GROW")
WHOLE_UM = machine.wanted_um(AT)["Z"]
WITHOUT_UM = WHOLE_UM + term_value(GROW, AT["T1"])


def with_can(can=None, identifier="0x181"):
    """T1, on which GROW depends, comes from bytes 2 and 3 of a TPDO."""
    def edit(data):
        signals = [s for s in data["signals"] if s["name"] != "T1"]
        data["signals"] = signals + [{"name": "T1", "unit": "degC", "can": identifier, "offset": 2,
                                      "type": "int16le", "scale": 0.1, "min": -10, "max": 90,
                                      "max_age_ms": 300}]
        if can:
            data["can"] = can
    return edit


def at_um(um):
    return lambda write: abs(write.um["Z"] - um) < 0.05


@pytest.fixture
def can_box(plc, port, start_box):
    """Starts a box with this file; the PLC is there and stands still."""
    plc.values = dict(AT)
    with RawPlc(plc, port):
        yield lambda change: start_box(change=change)


def reload(box, port, change):
    machine.write_coefficients(box.folder / "coefficients.json", port, change)
    box.send_signal(signal.SIGHUP)


def ends_well(box):
    box.stop()
    assert box.code == 0, box.log


def test_filters_are_those_of_the_file_and_nothing_else_passes(plc, can_box):
    change = with_can({"nodes": [{"node": 5, "heartbeat_timeout_ms": 1000}]})
    with Interface() as can, can_box(change) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]       # 35.1 °C
        plc.wait(at_um(WHOLE_UM))
        exact = 0x7FF | EXTENDED | REMOTE
        assert can.binds == [{(0x181, exact), (0x705, exact)}]
        for wrong in (0x182, 0x181 | EXTENDED, 0x181 | REMOTE, 0x705 | EXTENDED):
            can.send(wrong, [9] * 8)
        count = len(can.every) + plc.last().heartbeat
        until(lambda: plc.last().heartbeat > count)
        assert plc.last().mode == ACTIVE and abs(plc.last().um["Z"] - WHOLE_UM) < 0.05
        ends_well(box)
        assert box.stats["can"]["short_frames"] == 0


def test_an_interface_that_comes_later_goes_and_comes_again(plc, can_box):
    with can_box(with_can()) as box:
        plc.wait(at_um(WITHOUT_UM))
        for _ in range(2):
            with Interface() as can:
                can.every[0x181] = [0, 0, 0x5F, 0x01]
                plc.wait(at_um(WHOLE_UM))
                can.every.clear()
                can.set("gone")
            plc.wait(at_um(WITHOUT_UM))
        ends_well(box)
    assert box.stats["can"]["went_away"] == 2
    assert box.log.count("can0: no CAN bus: No such device; trying again every second") == 2


def test_a_node_that_lost_its_power_with_the_interface_is_started_when_that_is_up(plc, can_box):
    """It has no heartbeat, and its boot-up message came while the box could not hear: nobody says
    anything until the box does."""
    with Interface() as can, can_box(with_can({"nodes": [{"node": 5, "start": True}]})) as box:
        until(lambda: can.starts(5) == 1)
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        can.every.clear()
        can.set("down")
        plc.wait(at_um(WITHOUT_UM))
        until(lambda: "can0: CAN bus is down" in box.log)
        starts_before = can.starts(5)
        can.set("up")
        until(lambda: can.starts(5) == starts_before + 1)
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        ends_well(box)
    assert box.stats["can"]["went_down"] == 1


def test_an_interface_that_is_down_at_the_start_is_waited_for(plc, can_box):
    with Interface() as can:
        can.set("down")
        with can_box(with_can({"nodes": [{"node": 5, "start": True}]})) as box:
            until(lambda: "can0: CAN bus is down" in box.log)
            plc.wait(at_um(WITHOUT_UM))
            can.set("up")
            until(lambda: can.starts(5) == 1)
            ends_well(box)
    assert "not_sent" not in box.log and box.stats["can"]["not_sent"] == 0


def test_a_bus_without_nodes_is_up_when_its_interface_is(plc, can_box):
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        can.every.clear()
        can.set("down")
        until(lambda: "can0: CAN bus is down" in box.log)
        can.set("up")
        until(lambda: box.log.count("can0: CAN bus is up") == 2)
        ends_well(box)
    assert "can0: CAN bus is down" in box.log and "can0: CAN bus is up" in box.log


def test_another_interface_takes_over_also_where_it_comes_later(plc, port, can_box):
    """What the old one still says is none of the new file's business."""
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        reload(box, port, with_can({"interface": "can1"}))
        plc.wait(at_um(WITHOUT_UM))
        with Interface("can1") as other:
            other.every[0x181] = [0, 0, 0x5F, 0x01]
            plc.wait(at_um(WHOLE_UM))
            ends_well(box)
    assert "can1: no CAN bus: No such device; trying again every second" in box.log


def test_a_new_file_has_its_own_filters(plc, port, can_box):
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x18FEEE21 | EXTENDED] = [0, 0, 0x5F, 0x01]
        until(lambda: len(can.binds) == 1)
        reload(box, port, with_can(identifier="0x18FEEE21"))
        plc.wait(at_um(WHOLE_UM))
        assert can.binds[-1] == {(0x18FEEE21 | EXTENDED, 0x1FFFFFFF | EXTENDED | REMOTE)}
        ends_well(box)


def test_a_byte_of_a_j1939_message_from_any_source(plc, can_box):
    def edit(data):
        with_can(identifier="0x18feeexx")(data)
        data["signals"][-1].update(offset=0, type="uint8", scale=0.5, zero=-40)
    with Interface() as can, can_box(edit) as box:
        can.every[0x18FEEE21 | EXTENDED] = [150]          # 35 °C
        plc.wait(at_um(WITHOUT_UM - term_value(GROW, 35)))
        assert can.binds == [{(0x18FEEE00 | EXTENDED, 0x1FFFFF00 | EXTENDED | REMOTE)}]
        ends_well(box)


@pytest.mark.parametrize("option", [0, 2, 3, 4])     # filter, error frames, overflows, times; 1 is no condition
def test_a_socket_that_lacks_an_option_is_not_used(stage, plc, can_box, option):
    stage.fail("setsockopt", errno.ENOPROTOOPT, "can", times=1, skipped=option)
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        ends_well(box)
    assert box.log.count("can0: no CAN bus: Protocol not available; trying again every second") == 1, box.log
    assert len(can.binds) == 1


@pytest.mark.parametrize("error, counter", [(errno.ENXIO, "went_away"), (errno.ENODEV, "went_away"),
                                            (errno.ENOBUFS, "socket_errors")], ids=str)
def test_a_socket_that_fails_is_made_again(stage, plc, can_box, error, counter):
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        stage.fail("recvmsg", error, times=1)
        until(lambda: len(can.binds) == 2)
        plc.wait(at_um(WHOLE_UM))
        ends_well(box)
    assert {name: box.stats["can"][name] for name in ("went_away", "socket_errors")} == {
        "went_away": 0, "socket_errors": 0, counter: 1}


def test_an_interrupted_call_costs_no_socket(stage, plc, can_box):
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        stage.fail("recvmsg", errno.EINTR, times=1)
        until(lambda: stage.failed)
        stage.run_for(2)
        ends_well(box)
    assert len(can.binds) == 1 and box.stats["can"]["socket_errors"] == 0


def test_an_interface_whose_state_cannot_be_asked_counts_as_down(stage, plc, can_box):
    up = "can0: CAN bus is up"
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        can.every.clear()
        can.set("down")
        until(lambda: "can0: CAN bus is down" in box.log)
        stage.run_for(2)
        assert box.log.count(up) == 1
        stage.fail("socket", errno.EMFILE)
        can.set("up")
        until(lambda: stage.failed)
        stage.run_for(2)
        assert box.log.count(up) == 1
        stage.heal()
        until(lambda: box.log.count(up) == 2)
        ends_well(box)


def test_a_frame_that_is_too_short_is_named(plc, can_box):
    with Interface() as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F]
        until(lambda: "short frames: " in box.log and "(the last of 0x181)" in box.log)
        plc.wait(at_um(WITHOUT_UM))
        ends_well(box)
    assert box.stats["can"]["short_frames"] > 3


def test_the_log_says_of_nodes_what_is_so(plc, port, can_box):
    """Node 5 is never there, node 6 was there and goes; then the file names others."""
    watched = lambda *nodes: with_can({"nodes": [{"node": n, "heartbeat_timeout_ms": 300}  # noqa: E731
                                                for n in nodes]})
    lost = "can0: node {}: no heartbeat for 300 ms"
    with Interface() as can, can_box(watched(5, 6)) as box:
        can.every = {0x181: [0, 0, 0x5F, 0x01], 0x706: [5]}
        until(lambda: lost.format(5) in box.log and "can0: node 6 is operational" in box.log)
        del can.every[0x706]
        until(lambda: lost.format(6) in box.log)
        can.every = {0x181: [0, 0, 0x5F, 0x01], 0x707: [5], 0x708: [127]}
        reload(box, port, watched(7, 8))
        until(lambda: "can0: node 7 is operational" in box.log)
        until(lambda: "can0: node 8 is pre-operational" in box.log)
        ends_well(box)
    assert [box.log.count(lost.format(node)) for node in (5, 6, 7, 8)] == [1, 1, 0, 0], box.log
    assert [(n["node"], n["losses"]) for n in box.stats["can"]["nodes"]] == [(7, 0), (8, 0)]
