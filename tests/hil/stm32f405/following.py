# SPDX-License-Identifier: MIT
"""What the tests of the image wait for. Counts, not times: the emulator's clock stands still while a busy
machine lets it wait."""
import re
import time

from machine import ACTIVE


def active(plc):
    return [w for w in plc.writes if w.mode == ACTIVE]


def wait_for(condition, timeout_s=60):
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until, "it never came to it"
        time.sleep(0.02)


def counters_of(box, command="counters"):
    """{name: count} as the console tells them now; the reply to `wires` too."""
    since = box.console.mark()
    box.console.say(command)
    line = box.console.wait(r"^\d+\.\d+ (counters|plc):", since)
    return {name: int(count) for name, count in re.findall(r"(\w+)=(\d+)", line)}
