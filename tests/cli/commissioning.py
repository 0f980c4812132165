# SPDX-License-Identifier: MIT
"""What the tests of compbox commission share: fakeplc with its console, a person at the machine, a terminal. All run on
one clock that a busy machine does not move (still_clock.py)."""

import codecs
import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import termios
import threading
import time

import still_clock
from conftest import BIN, PLC

TWIN = {
    "format": "compbox-twin/1", "machine": "mill", "seed": 3,
    "axes": {axis: {"travel_mm": [0, 500], "max_velocity_mm_per_min": 20000,
                    "acceleration_mm_per_s2": 2000, "measure_every_mm": 50, "cutoff_mm": 400}
             for axis in "XYZ"},
    "errors": {"EZX": {"amplitude_um": 50}},
    "nc": {"compensation_sign": {"X": -1, "Y": 1, "Z": -1}},
}


class FakePlc:
    """fakeplc on a free port, with its console."""

    def __init__(self, folder, *arguments, profile="generic"):
        self.folder = folder
        self.process = subprocess.Popen(
            [BIN / "fakeplc", "--profile", profile, "--listen", "127.0.0.1:0", *arguments], cwd=folder,
            env=still_clock.shared_in(folder), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.lock = threading.Lock()
        self.port = int(re.search(r":(\d+)\s*$", self.process.stdout.readline()).group(1))

    def command(self, line):
        with self.lock:
            self.process.stdin.write(line + "\n")
            still_clock.wait_for_more(self.process.stdout)
            answer = self.process.stdout.readline().strip()
        assert answer.startswith("ok"), (line, answer)
        return answer

    def jog(self, axis, way_mm):
        """out: what the control shows after the move"""
        there_mm = self.position_mm(axis) + way_mm
        self.command(f"move {axis}={there_mm} feed=20000")
        while abs(self.position_mm(axis) - there_mm) > 0.0005:  # the display follows the program's end
            still_clock.sleep(0.02)
        return self.position_mm(axis)

    def position_mm(self, axis):
        return float(re.search(axis + r"=(\S+)", self.command("position")).group(1))

    def displacement_um(self, axis):
        """What the compensation does to the tool, as an indicator shows it."""
        before, after = self.command("error").split(" after ")
        number = lambda text: float(re.search(axis + r"=(\S+)", text).group(1))
        return number(after) - number(before)

    def status(self):
        return dict(re.findall(r"(\w+)=(\S+)", self.command("status")))

    def end(self):
        self.process.stdin.close()
        self.process.terminate()
        self.process.wait(10)


def start_plc(compbox, twin=None, profile="generic", change=None, axes="XYZ", served=None):
    """fakeplc with the map of init, changed by `served`, and a machine.json for it that `change` edits."""
    letters = dict.fromkeys(letter for letter in axes if letter in "XYZ")
    compbox.good("init", *PLC, "--axes", axes, "--profile", profile, "--travel",
                 ",".join(f"{axis}=500" for axis in letters), "-o", "machine.json")
    machine = compbox.read("machine.json")
    if served:
        served(machine)
    compbox.write("map.json", machine)
    arguments = ["--map", "map.json"]
    if twin:
        compbox.write("twin.json", twin)
        arguments += ["--machine", "twin.json"]
    started = FakePlc(compbox.folder, *arguments, profile=profile)
    machine["plc"]["transport"]["tcp"]["port"] = started.port
    if change:
        change(machine)
    compbox.write("machine.json", machine)
    return started


def behind(compbox, refuser):
    machine = compbox.read("machine.json")
    machine["plc"]["transport"]["tcp"]["port"] = refuser.port
    compbox.write("machine.json", machine)


JOG_MM = 12.5  # of an axis, by the test's person


class Person:
    """Looks at the control's display, jogs, reads the indicator."""

    def __init__(self, plc, indicator=None):
        self.plc, self.indicator = plc, indicator or (lambda name: plc.displacement_um(name[0]))

    def answer(self, question):
        name = question.strip().split(":")[0]
        if "set the indicator to zero" in question:
            return ""
        if "what does the indicator show" in question:
            return f"{self.indicator(name):+.2f}"
        if "jog this axis alone" in question:
            return f"{self.jog(name):.4f}"
        assert "what does the control" in question, question
        return self.display(name)

    def jog(self, name):
        return self.plc.jog(name[0], JOG_MM)

    def display(self, name):
        return f"{self.plc.position_mm(name[0]):.4f}" if name[0] in "XYZ" else ""


def letters_of(stream):
    """What a program writes, while its clock goes on."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    while True:
        still_clock.wait_for_more(stream)
        piece = os.read(stream.fileno(), 65536)
        if not piece:
            return
        yield from decoder.decode(piece)


def commission(compbox, plc, *arguments, answer=None, at=None, person=None):
    """Runs it; a person answers each question. Returns code, stdout, stderr.
    at: (text in a question, what to do then)."""
    person = person or Person(plc, answer)
    run = subprocess.Popen([BIN / "compbox", "commission", "machine.json", "--steps", "6", *arguments],
                           cwd=compbox.folder, env=still_clock.shared_in(compbox.folder), stdin=subprocess.PIPE,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0)
    out = []
    reader = threading.Thread(target=lambda: out.append(run.stdout.read().decode()))
    reader.start()
    heard, question = "", ""
    with still_clock.entered(compbox.folder):
        for letter in letters_of(run.stderr):
            heard += letter
            question = "" if letter == "\n" else question + letter
            if not question.endswith(("Enter: ", "? ")):
                continue
            if at and at[0] in question:
                at[1](run)
                at = None
            else:
                run.stdin.write((person.answer(question) + "\n").encode())
    code = run.wait(60)
    reader.join()
    return code, out[0], heard


def refusal(compbox, plc, *arguments, **how):
    """It must refuse, leave the file as it was and the PLC at zero; returns the sentence."""
    before = compbox.files()
    code, _, printed = commission(compbox, plc, *arguments, **how)
    assert code == 1, printed
    assert compbox.files() == before
    return printed.rstrip("\n").split("compbox: machine.json: ")[1]


def is_at_rest(plc, axes="XYZ"):
    status = plc.status()
    for _ in range(6000):  # the PLC takes the last block in its next scan
        if status["mode"] == "5":
            break
        time.sleep(0.01)
        status = plc.status()
    assert status["mode"] == "5", status
    assert all(float(status["commanded_" + axis]) == 0 for axis in axes), status


class Terminal:
    """A command at a pseudo-terminal. .text is all that it has written, with its control codes."""

    def __init__(self, folder, *arguments, size=(40, 150), command=None, environment=None):
        environment = environment or still_clock.shared_in(folder)
        command = command or [BIN / "compbox", "commission", "machine.json"]
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
        self.run = subprocess.Popen([*command, *arguments], cwd=folder, env=environment,
                                    stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
                                    preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        os.close(slave)
        self.text = ""

    def until(self, *pieces, seconds=60):
        """Reads until the pieces come, in this order, after all that was read before. out: the text up to their end"""
        end = time.monotonic() + seconds
        start = len(self.text)
        order = re.compile(".*?".join(map(re.escape, pieces)), re.S)
        while not order.search(self.text, start):
            if not select.select([self.master], [], [], max(0, end - time.monotonic()))[0]:
                raise AssertionError(f"{pieces} did not come in\n{self.text[start:]}")
            try:
                self.text += os.read(self.master, 65536).decode(errors="replace")
            except OSError:  # the program has ended
                assert order.search(self.text, start), self.text[start:]
        return self.text[start:order.search(self.text, start).end()]

    def type(self, text):
        os.write(self.master, text.encode())

    def end(self):
        while True:
            try:
                self.text += os.read(self.master, 65536).decode(errors="replace")
            except OSError:
                break
        os.close(self.master)
        return self.run.wait(60)
