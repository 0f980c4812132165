# SPDX-License-Identifier: MIT
"""compbox watch: a running box on a terminal and without one."""

import contextlib
import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time

from conftest import BIN, term
from test_first_steps import FakePlc

FAR_FUTURE_S = 4e9


@contextlib.contextmanager
def running_box(compbox, machine):
    """compboxd ACTIVE before fakeplc at X=500; out: the PLC and the end of the box."""
    compbox.write("EZX.json", term(values=(0, 12.5, 0)))
    compbox.write("machine.json", machine)
    compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
    with FakePlc(compbox.folder, "--map", "coefficients.json") as plc:
        text = (compbox.folder / "coefficients.json").read_text()
        compbox.write("box.json", text.replace('"port": 1502', f'"port": {plc.port}'))
        plc.command("move X=500 feed=20000")
        box = subprocess.Popen([BIN / "compboxd", "--config", "box.json", "--snapshot", "snapshot.json",
                                "--events", "events.jsonl"], cwd=compbox.folder, stderr=subprocess.PIPE, text=True)
        try:
            yield plc, box
        finally:
            box.terminate()
            box.communicate(timeout=60)


def shown(compbox):
    return compbox("watch", "--snapshot", "snapshot.json", "--events", "events.jsonl")


def wait_for(condition):
    """out: what the condition returned"""
    for _ in range(6000):
        found = condition()
        if found:
            return found
        time.sleep(0.01)
    raise AssertionError("it never came")


class Terminal:
    """compbox watch on a pseudo-terminal of a given size."""

    def __init__(self, folder, rows=30, columns=100, **environment):
        self.screen, inner = pty.openpty()
        fcntl.ioctl(inner, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(inner)
        self.process = subprocess.Popen(
            [BIN / "compbox", "watch", "--snapshot", "snapshot.json", "--events", "events.jsonl"], cwd=folder,
            stdin=inner, stdout=inner, stderr=inner, env={**os.environ, "TERM": "xterm", **environment})
        self.inner, self.text = inner, ""

    def read(self):
        while select.select([self.screen], [], [], 0)[0]:
            self.text += os.read(self.screen, 65536).decode()
        return self.text

    def last_frame(self):
        return self.read().split("\033[H")[-1]

    def end(self):
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(60) == 0
        text = self.read()
        assert termios.tcgetattr(self.inner) == self.before
        os.close(self.inner)
        os.close(self.screen)
        return text


def test_without_a_terminal_it_prints_the_box_once(compbox, machine):
    with running_box(compbox, machine) as (plc, _):
        wait_for(lambda: re.search(r"mode=1 .*commanded_Z=-12\.[45]", plc.command("status")))

        def settled():
            """On a busy machine a value is stale at times, and the line goes on with how often it was."""
            done = shown(compbox)
            parts = (r"^Z +-12\.50 +-12\.[45]\d", r"^X +500 mm +\d+ ms fresh\b", r"^ACTIVE +all is well$")
            return done if all(re.search(part, done.stdout, re.M) for part in parts) else None
        done = wait_for(settled)
    assert done.returncode == 0 and done.stderr == "" and "\033" not in done.stdout
    assert re.search(r"^Z +-12\.50 = -\( EZX \+12\.50 +\)$", done.stdout, re.M), done.stdout
    assert re.search(r" UTC  ACTIVE: all is well", done.stdout), done.stdout


def test_without_a_box_it_says_why(compbox):
    sentence = compbox.refused("watch", "--snapshot", "snapshot.json")
    assert sentence == ("the snapshot snapshot.json cannot be read (No such file or directory): is compboxd running "
                        "with --snapshot?")
    compbox.write("snapshot.json", "{")
    assert compbox.refused("watch", "--snapshot", "snapshot.json") == "the snapshot snapshot.json is not valid JSON"


def test_a_box_that_has_ended_is_shown_with_the_reason(compbox, machine):
    with running_box(compbox, machine) as (plc, _):
        wait_for(lambda: " mode=1 " in plc.command("status"))
    done = shown(compbox)
    assert done.returncode == 1 and done.stderr == "compbox: compboxd has ended; this is its last snapshot\n"
    assert "STOPPED" in done.stdout and "events, the newest first" in done.stdout


def test_on_a_terminal_it_follows_the_box_and_leaves_the_terminal_as_it_was(compbox, machine):
    with running_box(compbox, machine) as (plc, box):
        wait_for(lambda: " mode=1 " in plc.command("status"))
        terminal = Terminal(compbox.folder)
        wait_for(lambda: "\033[1;32mACTIVE" in terminal.last_frame())
        plc.command("freeze heartbeat 1")
        wait_for(lambda: re.search("HOLD|RAMP|STANDBY", terminal.last_frame()))
        box.terminate()
        wait_for(lambda: "compboxd has ended" in terminal.last_frame())
        text = terminal.end()
    assert text.startswith("\033[?1049h\033[?25l") and text.endswith("\033[?25h\033[?1049l")


def test_it_fits_any_terminal_and_respects_no_color(compbox, machine):
    with running_box(compbox, machine) as (plc, _):
        wait_for(lambda: " mode=1 " in plc.command("status"))
        for rows, columns in ((6, 40), (24, 80), (60, 200)):
            terminal = Terminal(compbox.folder, rows, columns, NO_COLOR="1")
            wait_for(lambda: "\033[J" in terminal.last_frame())
            lines = [re.sub("\033\\[[^a-zA-Z]*[a-zA-Z]", "", line) for line in terminal.last_frame().split("\r\n")]
            assert len(lines) <= rows and max(map(len, lines)) <= columns
            assert "\033[1" not in terminal.end().replace("\033[?1049", "")


def test_a_wrong_clock_does_not_hide_a_box(compbox):
    """A snapshot whose clock is in the future: its file is new, so the box runs."""
    lists = {"signals": [], "terms": [], "channels": []}
    compbox.write("snapshot.json", json.dumps({"snapshot": 1, "unix_s": FAR_FUTURE_S, "mode": "ACTIVE",
                                               "reason": "all is well", **lists}))
    assert "2096-10-02" in compbox.good("watch", "--snapshot", "snapshot.json")
