# SPDX-License-Identifier: MIT
"""The console: what the manual says of it, and the stop."""
import re

from emulator import ROOT, TEST_IMAGE, Box
from following import active, wait_for
from machine import ACTIVE, STOPPED

AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}


def test_help_and_manual_list_the_same_commands(tmp_path):
    manual = (ROOT / "docs/stm32f405.md").read_text()
    table = manual.partition("| command | |")[2].partition("\n\n")[0]
    rows = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    documented = {name for row in rows for name in re.findall(r"`([^`]+)`", row)}
    with Box(tmp_path, image=TEST_IMAGE) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.command("help")
        box.console.wait("crash hang", since)
        listed = {line[2:20].strip() for line in box.console.lines[since:] if line.startswith("  ")}
    assert listed == documented


def test_the_sites_ceiling_is_shown_at_the_start_and_by_slots(tmp_path):
    with Box(tmp_path) as box:
        box.console.wait("site's ceiling: size none, rate none")
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.command("slots")
        box.console.wait("site's ceiling: size none, rate none", since)


def test_a_command_too_long_and_strange_bytes_are_harmless(tmp_path):
    with Box(tmp_path) as box:
        box.console.wait("STANDBY")
        box.console.command("x" * 300)
        box.console.socket.sendall(bytes(range(256)) + b"\n")
        since = box.console.mark()
        box.console.command("start")
        box.console.wait("started: no reset flag is set", since)


def test_stop_goes_to_zero_and_restart_comes_back(plc, rtu, start_box):
    plc.values = AT_REST
    with rtu(), start_box(lambda data: data["safety"].update(ramp_um_per_s=500)) as box:
        wait_for(lambda: len(active(plc)) > 30)
        box.console.command("stop")
        wait_for(lambda: plc.last().mode == STOPPED)
        assert all(um == 0 for um in plc.last().um.values())
        mark = len(plc.writes)
        wait_for(lambda: len(plc.writes) > mark + 10)
        assert all(w.mode == STOPPED for w in plc.writes[mark:])
        box.console.command("restart")
        wait_for(lambda: plc.last().mode == ACTIVE)
