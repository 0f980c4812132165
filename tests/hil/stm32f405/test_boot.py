# SPDX-License-Identifier: MIT
"""Start, console, slots and restarts, without a PLC."""
import re
import zlib

import pytest

import machine
from emulator import TEST_IMAGE, Box, packed
from following import wait_for


def fault_lines(box, since):
    line = box.console.wait(r"processor fault \d+: exception", since)
    return dict(re.findall(r"(\w+) ([0-9a-f]{8})\b", line)), line


def test_no_file_is_standby_with_the_reason(tmp_path):
    with Box(tmp_path) as box:
        box.console.wait(r"compbox-stm32f405 \d+\.\d+\.\d+ started: no reset flag is set")
        box.console.wait("chip 0{24}; brown-out reset unknown, emulated$")
        box.console.wait("slot A: empty")
        box.console.wait("slot B: empty")
        box.console.wait("STANDBY: there is no coefficient file")
        box.console.command("nonsense")
        box.console.wait("no such command")


@pytest.mark.parametrize("wrong, printed", [
    (packed("{}", 3, text_sum=1), "BROKEN"), (packed("{}", 3, header_sum=1), "BROKEN"),
    (packed("{}", 3)[:20], "BROKEN"), (packed('{"format": 1}', 3), "REFUSED.*line 1"),
], ids=["text", "header", "cut", "refused"])
def test_a_bad_slot_is_reported(tmp_path, wrong, printed):
    with Box(tmp_path, {"B": wrong}) as box:
        box.console.wait("slot A: empty")
        box.console.wait(f"slot B: {printed}")
        box.console.wait("STANDBY: there is no coefficient file")


def needs_can(data):
    data["signals"].append({"name": "T9", "unit": "degC", "can": "0x181", "offset": 0, "type": "int16",
                            "min": 0, "max": 90})


@pytest.mark.parametrize("a, b, loaded, printed", [
    ((7, None, None), (8, None, None), 8, "slot B: revision 8"),
    ((9, None, None), (8, None, None), 9, "slot B: revision 8"),
    ((9, None, 1), (8, None, None), 8, "slot A: BROKEN"),
    ((9, needs_can, None), (8, None, None), 8, "slot A: REFUSED.*signals\\[4\\]"),
], ids=["B-is-newer", "A-is-newer", "newest-broken", "newest-refused"])
def test_the_newest_good_slot_runs(tmp_path, text_of, a, b, loaded, printed):
    slots = {name: packed(text_of(revision, change), revision, text_sum)
             for name, (revision, change, text_sum) in {"A": a, "B": b}.items()}
    with Box(tmp_path, slots) as box:
        box.console.wait(printed)
        name = "A" if loaded == a[0] else "B"
        text = text_of(loaded, None)
        box.console.wait(f"runs revision {loaded} of slot {name}: .*, CRC-32 {zlib.crc32(text.encode()):08x}$")
        box.console.wait("STANDBY: the PLC does not reply")


@pytest.mark.parametrize("text, text_sum", [("{}", 1), ('{"format": 7}', None)], ids=["broken", "refused"])
def test_without_a_file_the_plc_is_informed_in_its_status_register(tmp_path, plc, rtu, text, text_sum):
    slot = packed(text, 3, text_sum, report=(machine.STATUS, 1, 0x11, 115200))
    plc.registers[machine.STATUS - 1:machine.STATUS + 2] = [7, 7, 7]
    with rtu(), Box(tmp_path, {"B": slot}, plc=tmp_path / "plc.sock"):
        wait_for(lambda: plc.registers[machine.STATUS] != 7)
    assert plc.registers[machine.STATUS - 1:machine.STATUS + 2] == [7, 15 << 8 | machine.STANDBY, 7]


# The guard below the stack is met by a push (DACCVIOL, MSTKERR, MMARVALID) or, if one comes just then, by an interrupt,
# which has no address (MSTKERR).
@pytest.mark.parametrize("how, exception, statuses", [
    ("undefined", 6, {0x00010000}), ("address", 5, {0x00008200}), ("stack", 4, {0x00000092, 0x00000010})])
def test_a_fault_is_recorded_and_the_box_restarts_into_standby(tmp_path, how, exception, statuses):
    with Box(tmp_path, image=TEST_IMAGE) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.command(f"crash {how}")
        box.console.wait("started: processor fault.*restarts by faults 1", since)
        registers, line = fault_lines(box, since)
        assert f"exception {exception} " in line
        assert int(registers["cfsr"], 16) in statuses, line
        if how == "address":
            assert registers["bfar"] == "70000000"
        if how != "stack":
            assert 0x08000000 <= int(registers["pc"], 16) < 0x08020000, line
        box.console.wait("STANDBY", since)
        box.console.command("fault")
        assert fault_lines(box, since)[0] == registers


def test_a_failed_assertion_restarts_the_box_like_a_fault_and_names_its_place(tmp_path):
    with Box(tmp_path, image=TEST_IMAGE) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.command("crash assertion")
        box.console.wait(r"started: assertion failed: .*, hal/stm32f405/variant/test\.c:\d+; .*"
                         "restarts by faults 1", since)
        box.console.wait("STANDBY", since)


def test_a_stack_at_its_end_is_seen_in_the_next_cycle(tmp_path):
    with Box(tmp_path, image=TEST_IMAGE) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        box.console.command("crash canary")
        box.console.wait("started: stack overflow.*restarts by faults 1", since)


def test_again_and_again_ends_in_standby_without_the_file(tmp_path):
    with Box(tmp_path, image=TEST_IMAGE) as box:
        since = 0
        for _ in range(6):
            box.console.wait("STANDBY", since)
            since = box.console.mark()
            box.console.command("crash address")
            box.console.wait("started: processor fault", since)
        box.console.wait("too many restarts by faults", since)


def test_the_product_has_no_command_that_makes_it_fail(tmp_path):
    with Box(tmp_path) as box:
        box.console.wait("STANDBY")
        since = box.console.mark()
        for how in ("undefined", "address", "stack", "canary", "hang"):
            box.console.command(f"crash {how}")
        box.console.command("start")
        box.console.wait("started: no reset flag is set", since)
        assert sum("no such command" in line for line in box.console.lines[since:]) == 5
