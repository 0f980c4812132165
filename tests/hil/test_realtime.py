# SPDX-License-Identifier: MIT
"""The loop thread: no allocation, no file, no lock, no missing page; ticks that do not drift."""
import os
import time

import pytest

import laws
from machine import ACTIVE, PERIOD_S
from pymodbus_plc import PymodbusPlc
from raw_plc import RawPlc
from steps import steps_of

SPY = os.environ.get("SPY", os.path.join(os.path.dirname(__file__),
                                         "../../build/host/tests/hil/libhil_spy.so"))
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}


def spied(start_box, tmp_path, scenario, **env):
    """Runs the scenario under the spy; out: what it counted, and the box."""
    told = tmp_path / "spy.txt"
    with start_box(env=dict(env, LD_PRELOAD=SPY, SPY_FILE=str(told))) as box:
        scenario(box)
    return {name: int(count) for name, count in map(str.split, told.read_text().splitlines())}, box


@pytest.fixture
def eventful(plc, port):
    """Connecting late, compensating, losing the PLC, finding it again, stopping."""
    def scenario(box):
        plc.values = dict(AT_REST)
        time.sleep(0.2)
        with PymodbusPlc(plc, port):
            plc.wait_mode(ACTIVE)
            time.sleep(0.3)
        time.sleep(0.4)
        with RawPlc(plc, port, lambda r, reply: [reply[:9]] if r.number == 20 else None):
            plc.wait_mode(ACTIVE)
            time.sleep(1)
            box.stop()
    return scenario


def test_the_loop_allocates_nothing_and_touches_no_file_or_lock(start_box, tmp_path, eventful):
    counts, box = spied(start_box, tmp_path, eventful)
    assert box.code == 0, box.log
    assert counts["cycles"] > 50, "the spy did not see the loop"
    for name in ("allocations", "frees", "files", "writes", "locks"):
        assert counts[name] == 0, counts
    if box.stats["realtime"]["memory_locked"]:
        assert counts["page_faults"] == 0, counts


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
    """Stamps of the requests, over three seconds, against the period."""
    plc.values = dict(AT_REST)
    with PymodbusPlc(plc, port), start_box("--record-inputs", tmp_path / "inputs.csv") as box:
        plc.wait(lambda w: len(plc.reads) > 100, 30)
        box.stop()
    laws.check_period(box)
    phases, tick = [], 0
    for step in steps_of(tmp_path / "inputs.csv"):
        tick += step.missed_ticks
        phases.append(step.read_us / 1e6 - tick * PERIOD_S)
        tick += 1
    # A request is late when the machine was busy, never early: the earliest of each ten is at its tick.
    earliest = [min(phases[i:i + 10]) for i in range(0, len(phases) - 9, 10)]
    assert max(earliest) - min(earliest) < 0.002, earliest


def test_a_loop_slowed_down_by_force_counts_and_skips_its_ticks(plc, port, start_box):
    """Stopped for 200 ms by SIGSTOP: the ticks in between are counted, not made up."""
    import signal
    plc.values = dict(AT_REST)
    with RawPlc(plc, port) as server, start_box() as box:
        plc.wait_mode(ACTIVE)
        time.sleep(0.5)
        box.process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        box.process.send_signal(signal.SIGCONT)
        time.sleep(0.5)
        box.stop()
    assert box.code == 0, box.log
    stats = box.stats
    assert 5 <= stats["overruns"] <= 9, stats["overruns"]
    assert stats["box"]["clock_jumps"] == 1       # more than five periods
    assert stats["jitter_us"]["max"] > 140000, "the first tick of the stop was 170 ms late"
    assert abs(stats["drift_us"]) < 20000
    times = [r.time_s for r in server.requests if r.is_cyclic_read]
    gaps = [b - a for a, b in zip(times, times[1:])]
    assert sum(gap < PERIOD_S / 2 for gap in gaps) <= 1, "ticks were made up in a burst"
