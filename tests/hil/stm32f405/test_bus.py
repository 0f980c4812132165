# SPDX-License-Identifier: MIT
"""Pt100 modules on their own line: they are polled in turn, and none of them delays the PLC's exchange."""
import re

import machine
from following import active, replayed, start_with_trace, wait_for
from machine import ACTIVE
from simulator import Simulator

AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 20}
DEGRADED = 8
REPLY_BYTES = 7                                                       # one register
NO_PLC, HEARTBEAT, WAIT_ENABLE, UNCONFIRMED = 1, 4, 7, 12


class Modules(Simulator):
    """fakept100: unit 3 and unit 4, one thermometer each."""

    def __init__(self, folder, baud=0):
        super().__init__("fakept100", "--listen", f"unix:{folder / 'bus.sock'}", "--module", "3=20", "--module",
                         "4=40", "--baud", baud)


def on_bus(data):
    """T1, which makes Z grow, and T2, which moves X, come from modules 3 and 4."""
    data["buses"] = [{"name": "pt100", "every_ms": 60,
                      "rtu": {"device": "/dev/ttyS2", "baud": 19200, "slave_delay_ms": 120}}]
    t1 = next(s for s in data["signals"] if s["name"] == "T1")
    del t1["plc"]
    t1.update({"bus": "pt100", "unit_id": 3, "register": 0, "max_age_ms": 2000})
    data["signals"].append({**t1, "name": "T2", "unit_id": 4})
    data["terms"].append({"name": "WARM", "type": "polynomial", "signal": "T2", "coefficients": [-30, 1.5]})
    data["channels"][0]["sum"].append("WARM")
    data["safety"]["ramp_um_per_s"] = 500


def wanted(t1, t2):
    um = machine.wanted_um({**AT_REST, "T1": t1})
    return {**um, "X": um["X"] - (1.5 * t2 - 30)}


def holds(write, um):
    return all(abs(write.um[name] - um[name]) <= machine.resolution_um(machine.CHANNELS[name]) for name in um)


def bus_counters(box):
    since = box.console.mark()
    box.console.command("wires")
    return {name: int(count) for name, count in re.findall(r"(\w+)=(\d+)", box.console.wait("bus:", since))}


def writes_beside_timeouts(box, plc):
    """A module that is silent costs 120 ms, four cycles. out: whether the PLC got more than two writes in each, over
    the next ten or more; it would get one if its exchange waited for them. An emulator that stands still makes it
    fewer."""
    before, mark = bus_counters(box)["timeouts"], len(plc.writes)
    wait_for(lambda: bus_counters(box)["timeouts"] >= before + 10)
    writes = len(plc.writes) - mark
    return writes > 2 * (bus_counters(box)["timeouts"] - before)


def test_temperatures_arrive_and_a_lost_module_costs_its_term_alone(plc, rtu, start_box, tmp_path):
    plc.values = AT_REST
    with rtu(), Modules(tmp_path) as modules, start_box(on_bus, bus=tmp_path / "bus.sock") as box:
        start_with_trace(box)
        wait_for(lambda: plc.writes and holds(plc.last(), wanted(20, 40)))
        modules.command("set 3 0 26")
        wait_for(lambda: holds(plc.last(), wanted(26, 40)))

        modules.command("silent 4 1")                                # the module is lost
        wait_for(lambda: plc.last().reason == DEGRADED)          # too old: its term fades out
        wait_for(lambda: holds(plc.last(), wanted(26, 20)))      # 20 degC is where WARM is zero
        modules.command("set 3 0 23")                                # the other one goes on
        wait_for(lambda: holds(plc.last(), wanted(23, 20)))
        modules.command("silent 4 0")
        wait_for(lambda: holds(plc.last(), wanted(23, 40)))

        for unit in (3, 4):
            modules.command(f"silent {unit} 1")
        wait_for(lambda: writes_beside_timeouts(box, plc), or_say=lambda: "the PLC's exchange waits for them")
        # Slower than they may be. A late reply may come in time for the next request and then counts as its reply,
        # turn after turn: no count of one kind has to grow, only the last value has to arrive.
        for unit in (3, 4):
            modules.command(f"silent {unit} 0")
            modules.command(f"late {unit} 400")
        came = bus_counters(box)["bytes_received"]
        wait_for(lambda: bus_counters(box)["bytes_received"] > came + 10 * REPLY_BYTES)
        modules.command("set 3 0 25")
        modules.command("late 3 0")
        modules.command("late 4 0")
        wait_for(lambda: holds(plc.last(), wanted(25, 40)))
        assert bus_counters(box)["replies"] > 20
    since_s = active(plc)[0].time_s
    others = [w for w in plc.writes if w.time_s > since_s and w.mode != ACTIVE]
    # A busy machine lets the emulator stand still in the middle of the PLC's replies, which then are none: a loss, and
    # behind a long one the wait for permit resume.
    assert {w.reason for w in others} <= {NO_PLC, HEARTBEAT, WAIT_ENABLE, UNCONFIRMED}, others
    assert replayed(box, tmp_path)["active"] > 100
