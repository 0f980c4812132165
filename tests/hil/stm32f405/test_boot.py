# SPDX-License-Identifier: MIT
"""Start, console, slots and restarts, without a PLC."""
import re

import pytest

from emulator import Box, packed


def fault_lines(box, since):
    line = box.console.wait(r"processor fault \d+: exception", since)
    return dict(re.findall(r"(\w+) ([0-9a-f]{8})\b", line)), line


def test_no_file_is_standby_with_the_reason(tmp_path):
    with Box(tmp_path) as box:
        box.console.wait("started: power-on")
        box.console.wait("slot A: empty")
        box.console.wait("slot B: empty")
        box.console.wait("STANDBY: no valid coefficient file")
        box.console.say("nonsense")
        box.console.wait("no such command")


@pytest.mark.parametrize("wrong, said", [
    (packed("{}", 3, text_sum=1), "BROKEN"), (packed("{}", 3, header_sum=1), "BROKEN"),
    (packed("{}", 3)[:20], "BROKEN"), (packed('{"format": 1}', 3), "REFUSED.*line 1"),
], ids=["text", "header", "cut", "refused"])
def test_a_bad_slot_is_reported(tmp_path, wrong, said):
    with Box(tmp_path, {"B": wrong}) as box:
        box.console.wait("slot A: empty")
        box.console.wait(f"slot B: {said}")
        box.console.wait("STANDBY: no valid coefficient file")


@pytest.mark.parametrize("how, exception, status", [
    ("undefined", 6, 0x00010000), ("address", 5, 0x00008200), ("stack", 4, 0x00000092)])
def test_a_fault_is_recorded_and_the_box_restarts_into_standby(tmp_path, how, exception, status):
    with Box(tmp_path) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.say(f"crash {how}")
        box.console.wait("started: processor fault.*restarts by faults 1", since)
        registers, line = fault_lines(box, since)
        assert f"exception {exception} " in line
        assert int(registers["cfsr"], 16) == status, line
        if how == "address":
            assert registers["bfar"] == "70000000"
        if how != "stack":
            assert 0x08000000 <= int(registers["pc"], 16) < 0x08020000, line
        box.console.wait("STANDBY", since)
        box.console.say("fault")
        assert fault_lines(box, since)[0] == registers


def test_again_and_again_ends_in_standby_without_the_file(tmp_path):
    with Box(tmp_path) as box:
        since = 0
        for _ in range(6):
            box.console.wait("STANDBY", since)
            since = box.console.mark()
            box.console.say("crash address")
            box.console.wait("started: processor fault", since)
        box.console.wait("too many restarts by faults", since)
