# SPDX-License-Identifier: MIT
"""Thermometers on the box's own serial line, while the PLC is served as ever."""
import errno

import laws
import machine
import pytest
from box import until
from machine import term_value
from pt100 import Modules
from raw_plc import RawPlc

LINE = "/dev/ttyUSB0"
UNITS = {5: {0: 351, 1: 222}, 6: {0: 203}}      # T1 = 35.1 °C, T2 22.2 °C, T3 20.3 °C


def with_bus(device, every_ms=100):
    """T1, on which GROW depends, and two more come from modules."""
    def edit(data):
        data["buses"] = [{"name": "pt100", "every_ms": every_ms, "rtu": {
            "device": device, "baud": 115200, "parity": "none", "slave_delay_ms": 20}}]
        for name, unit, register in (("T1", 5, 0), ("T2", 5, 1), ("T3", 6, 0)):
            signal = {"name": name, "unit": "degC", "bus": "pt100", "unit_id": unit, "register": register,
                      "type": "int16", "scale": 0.1, "min": -10, "max": 90, "max_age_ms": 600}
            data["signals"] = [s for s in data["signals"] if s["name"] != name] + [signal]
    return edit


def test_modules_lost_and_back(stage, plc, port, start_box):
    at = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    plc.values = dict(at)
    whole = machine.wanted_um(at)["Z"]
    without = whole + term_value(next(t for t in machine.FILE["terms"] if t["name"] == "GROW"), 35.1)
    at_um = lambda um: lambda write: abs(write.um["Z"] - um) < 0.05  # noqa: E731
    with Modules(LINE, UNITS) as modules, RawPlc(plc, port), start_box(change=with_bus(LINE)) as box:
        plc.wait(at_um(whole))
        modules.silent.add(5)                        # T1 fades out, the rest goes on
        plc.wait(at_um(without))
        asked = modules.asked.count(6)
        stage.run_for(1)
        assert modules.asked.count(6) - asked >= 8, "the other module is asked on"
        modules.silent.clear()
        plc.wait(at_um(whole))
        box.stop()
    assert box.code == 0, box.log
    assert "module 5 does not answer" in box.log and "module 5 answers" in box.log
    bus = box.stats["bus"]
    assert bus["timeouts"] >= 1 and bus["replies"] >= 10 and bus["samples_lost"] == 0
    assert all(write.mode in (machine.STANDBY, machine.ACTIVE, machine.RAMP, machine.STOPPED)
               for write in plc.writes), "the PLC's exchange does not notice"
    last = box.rows[-1]
    for name, value in (("T1", 35.1), ("T2", 22.2), ("T3", 20.3)):
        assert abs(last[name] - value) < 1e-4


def test_an_adapter_that_is_unplugged_is_reported_and_opened_again(stage, plc, port, start_box):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    with Modules(LINE, UNITS) as modules, RawPlc(plc, port), start_box(change=with_bus(LINE)) as box:
        until(lambda: modules.asked)
        stage.plug(LINE)
        until(lambda: "; trying again" in box.log)
        stage.plug(LINE, modules)
        until(lambda: box.log.count(f"bus pt100: {LINE} is open") == 2)
        box.stop()
    assert box.code == 0, box.log
    assert box.stats["bus"]["disconnects"] == 1


def test_behind_an_adapter_that_was_away_every_module_is_read_at_once(stage, plc, port, start_box):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    with Modules(LINE, UNITS) as modules, RawPlc(plc, port), \
            start_box(change=with_bus(LINE, every_ms=60000)) as box:
        until(lambda: sorted(modules.asked) == [5, 6])
        stage.plug(LINE)
        until(lambda: "; trying again" in box.log)
        stage.plug(LINE, modules)
        until(lambda: sorted(modules.asked) == [5, 5, 6, 6])
        until(lambda: box.log.count(f"bus pt100: {LINE} is open") == 2)
        box.stop()
    assert box.code == 0, box.log
    assert "answer" not in box.log


def test_a_late_answer_is_never_that_of_other_registers(stage, plc, port, start_box):
    """A module answers late, in the time of its next request."""
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    units = {5: {0: 351, 2: 222}, 6: {0: 203}}

    def change(data):
        with_bus(LINE)(data)
        next(s for s in data["signals"] if s["name"] == "T2")["register"] = 2
    with Modules(LINE, units) as modules, RawPlc(plc, port), start_box(change=change) as box:
        plc.wait_mode(machine.ACTIVE)
        for delay_s in [0.06, 0.002] * 5:
            modules.delay_s[5] = delay_s
            stage.run_for(0.5)
        box.stop()
    assert box.code == 0, box.log
    for name, value in (("T1", 35.1), ("T2", 22.2), ("T3", 20.3)):
        assert {round(row[name], 3) for row in box.rows if row[name] is not None} == {value}
    assert box.stats["bus"]["timeouts"] >= 10


def test_an_adapter_that_is_not_there_costs_nothing(plc, port, start_box):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    with RawPlc(plc, port), start_box(change=with_bus("/dev/nowhere/ttyUSB9")) as box:
        plc.wait_mode(machine.ACTIVE)
        box.stop()
    assert box.code == 0, box.log
    assert "bus pt100: " in box.log and "No such file or directory" in box.log
    assert box.stats["bus"]["connects"] == 0


# Signals, watchdogs and the loop have three threads; the opener of the device and the bus have one each.
@pytest.mark.parametrize("before", [3, 4], ids=["opener", "bus"])
def test_a_bus_whose_thread_cannot_be_started_is_read_once_it_can(stage, plc, port, start_box, before):
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    stage.fail("pthread_create", errno.EAGAIN, times=3, skipped=before)
    with Modules(LINE, UNITS), RawPlc(plc, port), start_box(change=with_bus(LINE)) as box:
        plc.wait_mode(machine.ACTIVE)
        until(lambda: f"bus pt100: {LINE} is open" in box.log)
        plc.wait_writes(50)
        box.stop()
    assert box.code == 0, box.log
    assert box.log.count("no thread for the bus: Resource temporarily unavailable") == 1
    assert abs(box.rows[-1]["T1"] - 35.1) < 1e-4
    assert len(stage.failed) == 3


def test_one_slow_module_delays_neither_the_plc_nor_the_others(plc, port, start_box):
    """It answers later than its slave delay again and again."""
    plc.values = {"X": 6500, "Y": 200, "Z": 1500, "T1": 35.1}
    units = {unit: dict(registers) for unit, registers in UNITS.items()}
    with Modules(LINE, units) as modules, RawPlc(plc, port), start_box(change=with_bus(LINE)) as box:
        plc.wait_mode(machine.ACTIVE)
        modules.delay_s[5] = 0.2
        plc.wait_writes(50)
        units[6][0] = 255
        plc.wait_writes(50)
        assert abs(box.rows[-1]["T3"] - 25.5) < 1e-4, "unit 6 is read while 5 is late"
        modules.delay_s.clear()
        plc.wait_writes(50)
        box.stop()
    assert box.code == 0, box.log
    assert abs(box.rows[-1]["T1"] - 35.1) < 1e-4
    assert {round(row["T1"], 3) for row in box.rows if row["T1"] is not None} == {35.1}, \
        "a late answer is never another module's value"
    assert {round(row["T3"], 3) for row in box.rows if row["T3"] is not None} == {20.3, 25.5}
    assert laws.check_period(box)["cycles"] > 150
