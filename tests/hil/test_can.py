# SPDX-License-Identifier: MIT
"""The whole daemon with temperatures over CAN; the interface is a local socket (can_bus.py). Real
controllers and the real kernel's filters and errors: scripts/test --system."""
import signal

import machine
import pytest
from can_bus import EXTENDED, REMOTE, SHIM, Interface, wait
from machine import ACTIVE, term_value
from pymodbus_plc import PymodbusPlc

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
def can_box(plc, port, start_box, tmp_path):
    """Starts a box with this file, its interfaces in tmp_path; the PLC is there and stands still."""
    plc.values = dict(AT)
    with PymodbusPlc(plc, port), open(tmp_path / "log.txt", "w", encoding="utf-8") as log:
        yield lambda change: start_box(change=change, stderr=log,
                                       env={"LD_PRELOAD": SHIM, "CAN_BUS": str(tmp_path)})


def log_of(box):
    return (box.folder / "log.txt").read_text(encoding="utf-8")


def reload(box, port, change):
    machine.write_coefficients(box.folder / "coefficients.json", port, change)
    box.process.send_signal(signal.SIGHUP)


def ends_well(box):
    box.stop()
    assert box.code == 0, log_of(box)


def test_filters_are_those_of_the_file_and_nothing_else_passes(plc, can_box, tmp_path):
    change = with_can({"nodes": [{"node": 5, "heartbeat_timeout_ms": 1000}]})
    with Interface(tmp_path) as can, can_box(change) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]       # 35.1 °C
        plc.wait(at_um(WHOLE_UM))
        exact = 0x7FF | EXTENDED | REMOTE
        assert can.binds == [{(0x181, exact), (0x705, exact)}]
        for wrong in (0x182, 0x181 | EXTENDED, 0x181 | REMOTE, 0x705 | EXTENDED):
            can.frame(wrong, [9] * 8)
        count = len(can.every) + plc.last().heartbeat
        wait(lambda: plc.last().heartbeat > count)
        assert plc.last().mode == ACTIVE and abs(plc.last().um["Z"] - WHOLE_UM) < 0.05
        ends_well(box)
        assert box.stats["can"]["short_frames"] == 0


def test_an_interface_that_comes_later_goes_and_comes_again(plc, can_box, tmp_path):
    with can_box(with_can()) as box:
        plc.wait(at_um(WITHOUT_UM))
        for _ in range(2):
            with Interface(tmp_path) as can:
                can.every[0x181] = [0, 0, 0x5F, 0x01]
                plc.wait(at_um(WHOLE_UM))
                can.every.clear()
                can.unplug()
            plc.wait(at_um(WITHOUT_UM))
        ends_well(box)
    assert box.stats["can"]["went_away"] == 2
    assert log_of(box).count("can0: no CAN bus: No such device; trying again every second") == 2


def test_a_node_that_lost_its_power_with_the_interface_is_started_when_that_is_up(plc, can_box, tmp_path):
    """It has no heartbeat, and its boot-up message came while the box could not hear: nobody says
    anything until the box does."""
    with Interface(tmp_path) as can, can_box(with_can({"nodes": [{"node": 5, "start": True}]})) as box:
        wait(lambda: can.starts(5) == 1)
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        can.every.clear()
        can.go(up=False)
        plc.wait(at_um(WITHOUT_UM))
        wait(lambda: "can0: CAN bus is down" in log_of(box))
        starts_before = can.starts(5)
        can.go(up=True)
        wait(lambda: can.starts(5) == starts_before + 1)
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        ends_well(box)
    assert box.stats["can"]["went_down"] == 1


def test_an_interface_that_is_down_at_the_start_is_waited_for(plc, can_box, tmp_path):
    with Interface(tmp_path) as can:
        can.go(up=False)
        with can_box(with_can({"nodes": [{"node": 5, "start": True}]})) as box:
            wait(lambda: "can0: CAN bus is down" in log_of(box))
            plc.wait(at_um(WITHOUT_UM))
            can.go(up=True)
            wait(lambda: can.starts(5) == 1)
            ends_well(box)
    assert "not_sent" not in log_of(box) and box.stats["can"]["not_sent"] == 0


def test_a_bus_without_nodes_is_up_when_its_interface_is(plc, can_box, tmp_path):
    with Interface(tmp_path) as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        can.every.clear()
        can.go(up=False)
        wait(lambda: "can0: CAN bus is down" in log_of(box))
        can.go(up=True)
        wait(lambda: log_of(box).count("can0: CAN bus is up") == 2)
        ends_well(box)
    assert "can0: CAN bus is down" in log_of(box) and "can0: CAN bus is up" in log_of(box)


def test_another_interface_takes_over_also_where_it_comes_later(plc, port, can_box, tmp_path):
    """What the old one still says is none of the new file's business."""
    with Interface(tmp_path) as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F, 0x01]
        plc.wait(at_um(WHOLE_UM))
        reload(box, port, with_can({"interface": "can1"}))
        plc.wait(at_um(WITHOUT_UM))
        with Interface(tmp_path, "can1") as other:
            other.every[0x181] = [0, 0, 0x5F, 0x01]
            plc.wait(at_um(WHOLE_UM))
            ends_well(box)
    assert "can1: no CAN bus: No such device; trying again every second" in log_of(box)


def test_a_new_file_has_its_own_filters(plc, port, can_box, tmp_path):
    with Interface(tmp_path) as can, can_box(with_can()) as box:
        can.every[0x18FEEE21 | EXTENDED] = [0, 0, 0x5F, 0x01]
        wait(lambda: len(can.binds) == 1)
        reload(box, port, with_can(identifier="0x18FEEE21"))
        plc.wait(at_um(WHOLE_UM))
        assert can.binds[-1] == {(0x18FEEE21 | EXTENDED, 0x1FFFFFFF | EXTENDED | REMOTE)}
        ends_well(box)


def test_a_byte_of_a_j1939_message_from_any_source(plc, can_box, tmp_path):
    def edit(data):
        with_can(identifier="0x18feeexx")(data)
        data["signals"][-1].update(offset=0, type="uint8", scale=0.5, zero=-40)
    with Interface(tmp_path) as can, can_box(edit) as box:
        can.every[0x18FEEE21 | EXTENDED] = [150]          # 35 °C
        plc.wait(at_um(WITHOUT_UM - term_value(GROW, 35)))
        assert can.binds == [{(0x18FEEE00 | EXTENDED, 0x1FFFFF00 | EXTENDED | REMOTE)}]
        ends_well(box)


def test_a_frame_that_is_too_short_is_named(plc, can_box, tmp_path):
    with Interface(tmp_path) as can, can_box(with_can()) as box:
        can.every[0x181] = [0, 0, 0x5F]
        wait(lambda: "short frames: " in log_of(box) and "(the last of 0x181)" in log_of(box))
        plc.wait(at_um(WITHOUT_UM))
        ends_well(box)
    assert box.stats["can"]["short_frames"] > 3


def test_the_log_says_of_nodes_what_is_so(plc, port, can_box, tmp_path):
    """Node 5 is never there, node 6 was there and goes; then the file names others."""
    watched = lambda *nodes: with_can({"nodes": [{"node": n, "heartbeat_timeout_ms": 300}  # noqa: E731
                                                for n in nodes]})
    lost = "can0: node {}: no heartbeat for 300 ms"
    with Interface(tmp_path) as can, can_box(watched(5, 6)) as box:
        can.every = {0x181: [0, 0, 0x5F, 0x01], 0x706: [5]}
        wait(lambda: lost.format(5) in log_of(box) and "can0: node 6 is operational" in log_of(box))
        del can.every[0x706]
        wait(lambda: lost.format(6) in log_of(box))
        can.every = {0x181: [0, 0, 0x5F, 0x01], 0x707: [5], 0x708: [127]}
        reload(box, port, watched(7, 8))
        wait(lambda: "can0: node 7 is operational" in log_of(box))
        wait(lambda: "can0: node 8 is pre-operational" in log_of(box))
        ends_well(box)
    assert [log_of(box).count(lost.format(node)) for node in (5, 6, 7, 8)] == [1, 1, 0, 0], log_of(box)
    assert [(n["node"], n["losses"]) for n in box.stats["can"]["nodes"]] == [(7, 0), (8, 0)]
