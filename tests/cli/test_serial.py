# SPDX-License-Identifier: MIT
"""compbox check on files with serial lines: the table of baud rates, and lines that are too slow."""

import json

from conftest import term


def on_line(compbox, machine, **rtu):
    machine["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS0", "baud": 115200, **rtu}}
    compbox.write("m.json", machine)
    compbox.write("t.json", term())
    return compbox("build", "m.json", "t.json", "-o", "c.json")


def test_the_table_of_baud_rates(compbox, machine):
    assert on_line(compbox, machine, slave_delay_ms=1.5).returncode == 0
    text = compbox.good("check", "c.json")
    serial = json.loads(compbox.good("check", "--json", "c.json"))["serial"]
    assert (serial["baud"], serial["budget_ms"]) == (115200, 24)
    read, write = machine["plc"]["read"]["count"], machine["plc"]["write"]["count"]
    for row in serial["rates"]:
        silence_ms = 3.5 * 11e3 / row["baud"] if row["baud"] <= 19200 else 1.75
        character_ms = 11e3 / row["baud"]
        both = (8 + 5 + 2 * read + 9 + 2 * write + 8) * character_ms + 4 * silence_ms + 2 * 1.5
        one = (13 + 2 * write + 5 + 2 * read) * character_ms + 2 * silence_ms + 1.5
        assert abs(row["fc3_fc16_ms"] - both) < 0.01
        assert abs(row["fc23_ms"] - one) < 0.01
        assert row["fits"] == (both <= 24)
        line = next(one for one in text.splitlines() if one.split()[:1] == [str(row["baud"])])
        assert ("fits" in line) == row["fits"] and ("this file" in line) == (row["baud"] == 115200)


def test_a_line_that_is_too_slow(compbox, machine):
    done = on_line(compbox, machine, baud=19200)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "plc.transport.rtu.baud: at 19200 baud the exchange takes " in done.stderr
    assert " ms of 24.0 ms available; 115200 baud is fast enough" in done.stderr


def test_tcp_has_no_table(compbox, machine):
    compbox.write("t.json", term())
    compbox.good("build", "machine.json", "t.json", "-o", "c.json")
    assert "baud" not in compbox.good("check", "c.json")
    assert "serial" not in json.loads(compbox.good("check", "--json", "c.json"))
