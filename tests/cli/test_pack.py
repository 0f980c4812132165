# SPDX-License-Identifier: MIT
"""compbox pack: the slot's bytes by struct and zlib, and what is refused."""

import json
import os
import struct
import threading
import zlib

from conftest import term


def built(compbox, machine):
    compbox.write("t.json", term())
    compbox.good("build", "machine.json", "t.json", "--revision", 41, "-o", "c.json")


def test_header_and_text(compbox, machine):
    built(compbox, machine)
    out = compbox.good("pack", "c.json", "-o", "slot.bin")
    slot = (compbox.folder / "slot.bin").read_bytes()
    text = (compbox.folder / "c.json").read_bytes()
    magic, revision, length, crc, a, b, c, own = struct.unpack("<4s7I", slot[:32])
    assert (magic, revision, length, crc) == (b"CBX1", 41, len(text), zlib.crc32(text))
    assert (a, b, c, own) == (0, 0, 0, zlib.crc32(slot[:28]))
    assert slot[32:] == text
    assert out == f"revision 41, {len(slot)} of 131072 bytes: slot.bin\n"


def test_the_slot_has_what_was_checked(compbox, machine):
    """A pipe gives its text once; so does a file that changes after it was read."""
    built(compbox, machine)
    compbox.good("pack", "c.json", "-o", "slot.bin")
    os.mkfifo(compbox.folder / "pipe")
    text = (compbox.folder / "c.json").read_bytes()
    writer = threading.Thread(target=(compbox.folder / "pipe").write_bytes, args=[text])
    writer.start()
    compbox.good("pack", "pipe", "-o", "of_pipe.bin")
    writer.join()
    assert (compbox.folder / "of_pipe.bin").read_bytes() == (compbox.folder / "slot.bin").read_bytes()


def test_the_header_says_where_the_status_register_is(compbox, machine):
    built(compbox, machine)
    file = compbox.folder / "c.json"
    data = json.loads(file.read_text())
    data["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200, "unit": 9, "parity": "odd"}}
    file.write_text(json.dumps(data))
    compbox.good("pack", "c.json", "-o", "slot.bin")
    slot = (compbox.folder / "slot.bin").read_bytes()
    register, unit, line, baud, rest, own = struct.unpack("<HBBIII", slot[16:32])
    assert (register, unit, line, baud, rest) == (data["plc"]["status"], 9, 0x12, 115200, 0)
    assert own == zlib.crc32(slot[:28])


def test_what_the_box_would_refuse_is_not_packed(compbox, machine):
    built(compbox, machine)
    (compbox.folder / "c.json").write_text(
        (compbox.folder / "c.json").read_text().replace('"period_ms": 30', '"period_ms": 0'))
    assert compbox.refused("pack", "c.json", "-o", "slot.bin").startswith("c.json: cycle.period_ms: ")
    assert compbox.refused("pack", "none.json", "-o", "slot.bin").startswith("none.json: cannot open")
    compbox.write("big.json", " " * 131041)
    assert "has 131041 bytes, more than the 131040" in compbox.refused("pack", "big.json", "-o", "slot.bin")
    assert compbox("pack", "c.json").returncode == 2


def test_help(compbox):
    assert "compbox pack " in compbox.good("pack", "--help").split("Example:")[1]


def test_what_the_microcontroller_will_not_run_is_reported(compbox, machine):
    """A file for compboxd is a sound slot, but nobody should learn at the machine that it is not run."""
    built(compbox, machine)
    done = compbox("pack", "c.json", "-o", "slot.bin")
    assert done.returncode == 0 and done.stderr.count("\n") == 1
    sentence = "c.json: the STM32F405 will not run this file: plc.transport.tcp: the STM32F405 has no network, line "
    assert done.stderr.startswith("compbox: " + sentence)
    remarks = json.loads(compbox.good("pack", "c.json", "-o", "slot.bin", "--json"))["remarks"]
    assert len(remarks) == 1 and remarks[0].startswith(sentence)
    data = compbox.read("c.json")
    data["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200}}
    compbox.write("c.json", data)
    done = compbox("pack", "c.json", "-o", "slot.bin")
    assert (done.returncode, done.stderr) == (0, "")
    data["signals"].append({"name": "T1", "unit": "degC", "can": "0x181", "min": 0, "max": 90})
    compbox.write("c.json", data)
    assert "signals[3].can: " in compbox("pack", "c.json", "-o", "slot.bin").stderr
