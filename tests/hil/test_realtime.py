# SPDX-License-Identifier: MIT
"""The loop thread: no allocation, no file, no lock, no missing page; ticks that do not drift."""
import os
import signal

import pytest

import laws
import machine
from box import until
from conftest import libmodbus
from machine import ACTIVE, AT_REST, RAMP
from pymodbus_plc import PymodbusPlc
from raw_plc import RawPlc

SPY = os.environ.get("SPY", os.path.join(os.path.dirname(__file__),
                                         "../../build/host/tests/hil/libhil_spy.so"))


def spied(start_box, tmp_path, scenario, change=None, **env):
    """Runs the scenario under the spy; out: what it counted, and the box."""
    counts = tmp_path / "spy.txt"
    with start_box(change=change, env=dict(env, LD_PRELOAD=SPY, SPY_FILE=str(counts))) as box:
        scenario(box)
    return {name: int(count) for name, count in map(str.split, counts.read_text().splitlines())}, box


@pytest.fixture
def eventful(plc, port):
    """Connecting late, compensating, losing the PLC, finding it again, stopping."""
    def scenario(box):
        plc.values = dict(AT_REST)
        until(lambda: box.steps)
        with PymodbusPlc(plc, port):
            plc.wait_mode(ACTIVE)
            plc.wait_writes(10)
        until(lambda: RAMP in {step.mode for step in box.steps})
        with RawPlc(plc, port, lambda r, reply: [reply[:9]] if r.number == 20 else None):
            plc.wait_mode(ACTIVE)
            plc.wait_writes(40)
            box.stop()
    return scenario


@pytest.mark.parametrize("change", [None, libmodbus], ids=["compbox", "libmodbus"])
def test_the_loop_allocates_nothing_and_touches_no_file_or_lock(start_box, tmp_path, eventful, change):
    counts, box = spied(start_box, tmp_path, eventful, change)
    assert box.code == 0, box.log
    assert counts["cycles"] > 50, "the spy did not see the loop"
    for name in ("allocations", "frees", "files", "writes", "locks"):
        assert counts[name] == 0, counts
    if box.stats["realtime"]["memory_locked"]:
        assert counts["page_faults"] == 0, counts


def test_the_loop_allocates_nothing_while_it_takes_over(plc, port, start_box, tmp_path):
    plc.values = dict(AT_REST)

    def scenario(box):
        with PymodbusPlc(plc, port):
            plc.wait_mode(ACTIVE)
            for revision in (8, 9, 10):
                machine.write_coefficients(tmp_path / "coefficients.json", port,
                                           lambda data: data.update(revision=revision))
                box.process.send_signal(signal.SIGHUP)
                until(lambda: box.stats["revision"] == revision)
            box.stop()
    counts, box = spied(start_box, tmp_path, scenario)
    assert box.code == 0, box.log
    assert box.stats["reloads"]["taken"] == 3
    for name in ("allocations", "frees", "files", "writes", "locks"):
        assert counts[name] == 0, counts


@pytest.mark.parametrize("plant, name", [("malloc", "allocations"), ("open", "files"),
                                         ("lock", "locks"), ("terminal", "terminals")])
def test_the_spy_sees_what_is_planted(plc, port, start_box, tmp_path, plant, name):
    def scenario(box):
        with PymodbusPlc(plc, port):
            plc.wait_mode(ACTIVE)
            box.stop()
    counts, _ = spied(start_box, tmp_path, scenario, SPY_PLANT=plant)
    assert counts[name] >= counts["cycles"] - 1 > 0


def test_ticks_do_not_drift(plc, port, start_box, tmp_path):
    """By what the loop asks the kernel for: each wake-up is a whole number of periods after the first one."""
    plc.values = dict(AT_REST)
    def scenario(box):
        with PymodbusPlc(plc, port):
            plc.wait_writes(60)
            box.stop()
    counts, box = spied(start_box, tmp_path, scenario)
    assert box.code == 0, box.log
    assert counts["cycles"] > 60 and counts["off_grid"] == 0, counts
    laws.check_period(box)


def test_the_spy_sees_wake_ups_of_another_period(plc, port, start_box, tmp_path):
    def scenario(box):
        with PymodbusPlc(plc, port):
            plc.wait_writes(10)
            box.stop()
    counts, _ = spied(start_box, tmp_path, scenario, SPY_PERIOD_NS="29999999")
    assert counts["off_grid"] >= 10
