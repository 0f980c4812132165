# SPDX-License-Identifier: MIT
"""What the tests of the image wait for. Counts, not times: the emulator's clock stands still while a busy
machine lets it wait."""
import json
import re
import subprocess
import time

from conftest import HOST
from machine import ACTIVE


def active(plc):
    return [w for w in plc.writes if w.mode == ACTIVE]


def wait_for(condition, timeout_s=300, or_say=lambda: "it never came to it"):
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until, or_say()
        time.sleep(0.02)


def best_of_five(measure, enough):
    """The least of up to five measurements, one that is enough ends them: where a busy machine lets the
    emulator stand still, that makes one worse, and what the box does wrong makes all of them so."""
    least = measure()
    for _ in range(4):
        if least <= enough:
            break
        least = min(least, measure())
    return least


def counters_of(box, command="counters"):
    """{name: count} as the console tells them now; the reply to `wires` too."""
    since = box.console.mark()
    box.console.command(command)
    line = box.console.wait(r"^\d+\.\d+ (counters|plc):", since)
    return {name: int(count) for name, count in re.findall(r"(\w+)=(\d+)", line)}


def start_with_trace(box):
    box.console.wait("now ACTIVE")
    since = box.console.mark()
    box.console.command("trace start")
    box.console.wait("started: restart requested", since)


def replayed(box, folder):
    """The console's trace and dump, replayed by the host's core."""
    lines = [line for line in box.console.lines if line[:2] in ("T ", "D ")]
    reported = replay(lines, folder)
    assert reported.returncode == 0, reported.stdout + reported.stderr
    return json.loads(reported.stdout)


def replay(lines, folder):
    file = folder / "trace.txt"
    file.write_text("\n".join(lines) + "\n")
    return subprocess.run([HOST / "stm32f405_replay", folder / "coefficients.json", file],
                          capture_output=True, text=True)
