# SPDX-License-Identifier: MIT
"""compbox commission: the comparison of registers with the control's display, as a script, at a terminal
with the live table, on a serial line, with function 23, and the motors of a pair."""

import json
import pathlib
import re
import signal
import subprocess
import tempfile
import threading

import pytest

import still_clock
from conftest import BIN, PLC
from commissioning import FakePlc, Person, Terminal, commission, is_at_rest, refusal


def script(compbox, fake, *arguments, jogs=("X", "Y", "Z")):
    """Nobody answers: the display is in the options, and axes are jogged when the command prints it."""
    run = subprocess.Popen([BIN / "compbox", "commission", "machine.json", "--steps", "6", *arguments],
                           cwd=compbox.folder, env=still_clock.shared_in(compbox.folder), stdin=subprocess.DEVNULL,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    out = ""
    for line in run.stdout:
        out += line
        asked = re.match(r"   (\S+): jog this axis alone by 10 mm or more and stop", line)
        if asked and asked[1] in jogs:
            fake.jog(asked[1], 12.5)
    err = run.stderr.read()
    return run.wait(60), out, err


SHOWS = [word for axis in "XYZ" for word in ("--shows", f"{axis}=0:12,5")]


def test_a_script_states_what_the_display_shows(compbox, plc):
    fake = plc()
    code, out, err = script(compbox, fake, *SHOWS, "--registers")
    assert code == 0, err
    assert "X: 0.0000 to 12.5000 mm, as the control shows" in out and "Sign" not in out
    done = compbox.read("machine.json")["provenance"]["commissioning"]
    assert done["positions"]["Y"] == {"plc": 10, "type": "int32", "scale": 0.0001, "zero": 0, "from": 0,
                                      "to": 12.5}
    assert "sign" not in out and done["signs"] == {}
    # a sign test of one axis needs no second jog of the same registers
    code, out, err = script(compbox, fake, "--axis", "Y", "--measured", "Y=19,8", jogs="")
    assert code == 0, err
    again = compbox.read("machine.json")["provenance"]["commissioning"]
    assert again["positions"] == done["positions"]
    assert again["signs"]["Y"]["measured_um"] == 19.8
    # but other registers do, and so does a walk over all axes
    machine = compbox.read("machine.json")
    compbox.write("machine.json", {**machine, "signals": [dict(s, zero=1) if s["name"] == "X" else s
                                                          for s in machine["signals"]]})
    for arguments in (["--axis", "Y", "--measured", "Y=20"], ["--measured", "Y=20"]):
        code, _, err = script(compbox, fake, *arguments, jogs="")
        assert code == 1 and "standard input has ended; give --shows X=… instead" in err


def test_a_script_whose_axis_nobody_jogs(compbox, plc):
    fake = plc()
    before = compbox.files()
    code, _, err = script(compbox, fake, *SHOWS, "--wait-s", "1", jogs="")
    assert code == 1 and compbox.files() == before
    assert "signals.X: the control shows 12.5 mm, registers 8 and 9 give (int32) 0; " in err
    is_at_rest(fake)


@pytest.mark.parametrize("arguments, sentence", [
    (["--shows", "Q=1:2"], "--shows: no signal Q to test; there is X, Y, Z"),
    (["--shows", "X=1"], "--shows: two values of a position, before and after the jog: X=0:12.5"),
    (["--shows", "X=1:2:3"], "--shows: two values of a position"),
    (["--shows", "X=a:b"], "--shows: 'X=a:b' must read NAME=number or NAME=from:to"),
    (["--shows", "X"], "--shows: 'X' must read"),
    (["--shows", "X=1:2", "--shows", "X=1:2"], "--shows: once for each signal"),
    (["--together", "X+Q"], "--together: no signal Q to test")])
def test_wrong_statements(compbox, plc, arguments, sentence):
    plc()
    done = compbox("commission", "machine.json", *arguments)
    assert done.returncode == 2 and sentence in done.stderr.splitlines()[0], done.stderr


class Absent(Person):
    """Answers without having jogged anything."""

    def jog(self, name):
        return self.plc.position_mm(name[0])


def test_who_jogs_nothing_gets_no_file(compbox, plc):
    fake = plc()
    sentence = refusal(compbox, fake, person=Absent(fake))
    assert sentence == ("signals.X: X moved by 0.0000 mm where 10 or more are needed; if the control's display "
                        "moved further, look at plc, type and scale")
    is_at_rest(fake)


class Both(Person):
    """Jogs two axes for one."""

    def jog(self, name):
        self.plc.jog("Z", 1)
        return super().jog(name)


def test_a_second_axis_that_is_jogged_too(compbox, plc):
    fake = plc()
    assert refusal(compbox, fake, person=Both(fake)).startswith(
        "signals.X: the jog moved X by 12.5000 mm, but also Z by 1.0000 mm; either both read one register")


def test_function_23_and_the_read_back(compbox, plc):
    fake = plc(change=lambda machine: machine["plc"].update(exchange="fc23"))
    code, out, err = commission(compbox, fake, "--axis", "Y", "--json")
    assert code == 0, err
    figures = json.loads(out)
    assert figures["registers"]["read_back"] == "answered" and figures["registers"]["exchange"] == "fc23"
    assert figures["signs"]["Y"]["measured_um"] == pytest.approx(20, abs=1)
    assert set(figures["positions"]) == set("XYZ") and figures["times"]["exchange_ms"]["count"] > 5
    is_at_rest(fake)


@pytest.fixture
def line():
    """The path of a serial line: below /dev, at most 63 characters."""
    with tempfile.TemporaryDirectory(prefix="compbox-", dir="/dev/shm") as folder:
        yield str(pathlib.Path(folder) / "line")


class SerialPlc(FakePlc):
    def __init__(self, folder, device):
        self.folder = folder
        self.process = subprocess.Popen(
            [BIN / "fakeplc", "--map", "map.json", "--listen", "rtu:" + device], cwd=folder,
            env=still_clock.shared_in(folder), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.lock = threading.Lock()
        self.process.stdout.readline()


@pytest.fixture
def serial_plc(compbox, line):
    compbox.good("init", *PLC, "--axes", "XY", "--profile", "generic", "--travel", "X=500,Y=500",
                 "--period-ms", "60", "-o", "machine.json")
    machine = compbox.read("machine.json")
    compbox.write("map.json", machine)
    machine["plc"]["transport"] = {"rtu": {"device": line, "baud": 115200, "parity": "none"}}
    compbox.write("machine.json", machine)
    fake = SerialPlc(compbox.folder, line)
    yield fake
    fake.end()


@pytest.mark.parametrize("exchange", ["fc3+fc16", "fc23"])
def test_a_serial_line(compbox, serial_plc, exchange):
    machine = compbox.read("machine.json")
    machine["plc"]["exchange"] = exchange
    compbox.write("machine.json", machine)
    code, out, err = commission(compbox, serial_plc, "--axis", "Y", "--json")
    assert code == 0, err
    figures = json.loads(out)
    assert figures["signs"]["Y"]["measured_um"] == pytest.approx(20, abs=1)
    assert figures["positions"]["X"]["to"] == 12.5
    assert figures["times"]["exchange_ms"]["p50"] > 5, "11 bits at 115200 baud for each character"
    is_at_rest(serial_plc, "XY")


def test_a_serial_line_without_a_plc(compbox, serial_plc):
    serial_plc.command("fault drop 100000")
    sentence = refusal(compbox, serial_plc)
    device = compbox.read("machine.json")["plc"]["transport"]["rtu"]["device"]
    assert sentence == (f"plc.transport.rtu: no reply on {device}: the device is open, but no valid reply came; "
                        "check device, unit, baud, parity, wires and the PLC's Modbus server")
    machine = compbox.read("machine.json")
    machine["plc"]["transport"]["rtu"]["device"] = "/dev/shm/none"
    compbox.write("machine.json", machine)
    assert refusal(compbox, serial_plc).startswith("plc.transport.rtu: no reply on /dev/shm/none: No such file")


class AtMotors(Person):
    """The indicator is at the motor, or between both. A reversed motor moves the other way."""

    def __init__(self, plc, reversed_motors=()):
        super().__init__(plc, self.indicator_um)
        self.reversed = reversed_motors

    def indicator_um(self, name):
        status = self.plc.status()
        ways = [float(status["applied_" + motor]) * (-1 if motor in self.reversed else 1)
                for motor in name.split("+")]
        return sum(ways) / len(ways)


def narrow(machine):
    machine["pairs"][0]["max_difference_um"] = 12


def test_each_motor_of_a_pair_by_itself_within_the_pairs_difference(compbox, plc):
    fake = plc(axes="X,Y1+Y2", change=narrow)
    code, out, err = commission(compbox, fake, "--axis", "Y1+Y2", person=AtMotors(fake, ("Y1", "Y2")))
    assert code == 0, err
    assert [line for line in out.splitlines() if line.startswith("2.")] == [
        "2. Sign of Y1: 12 µm", "2. Sign of Y2: 12 µm", "2. Sign of Y1+Y2: 20 µm"]
    machine = compbox.read("machine.json")
    assert [channel["sign"] for channel in machine["channels"]] == [1, -1, -1]
    signs = machine["provenance"]["commissioning"]["signs"]
    assert signs["Y2"] == {"offset_um": 20, "measured_um": pytest.approx(-20, abs=1), "sign": -1,
                           "measured_alone_um": pytest.approx(-12, abs=1)}
    is_at_rest(fake, ("X", "Y1", "Y2"))


def test_motors_of_a_pair_that_move_against_each_other(compbox, plc):
    fake = plc(axes="X,Y1+Y2")
    assert refusal(compbox, fake, "--axis", "Y1+Y2", person=AtMotors(fake, ("Y2",))) == (
        "axis Y1+Y2: Y2 moves the tool the other way than its partner; invert channels.Y2.sign in the file and "
        "begin again")
    is_at_rest(fake, ("X", "Y1", "Y2"))


def test_the_live_table_at_a_terminal(compbox, plc):
    fake = plc(axes="X")
    terminal = Terminal(compbox.folder, "--watch", "--registers")
    first = terminal.until("X > ")
    for piece in ("box ACTIVE: all is well", "control word", "enable referenced permit", "from the box:",
                  "> 8-9", "0000 0000", "compare", "machine position (MCS)",
                  "X: Enter if the control shows this value, else type what it shows"):
        assert piece in first, piece
    terminal.type("\n")
    terminal.until("jog this axis alone by 10 mm or more and stop. Enter if")
    terminal.type("\n")  # too early
    terminal.until("where 10 or more are needed", "X > ")
    fake.jog("X", 12.5)
    redrawn = terminal.until("0001 e848")
    assert "\0337\033[" in redrawn and redrawn.count("X > ") == 0, "in its place, around what is typed"
    terminal.until("0.0000 … 12.5000")
    terminal.type("15,2\n")  # a slip of the finger
    terminal.until("the control shows 15.2 mm, registers 8 and 9 give (int32) 12.5", "X > ")
    terminal.type("\n")
    terminal.until("X: 0.0000 to 12.5000 mm, as the control shows")
    assert terminal.end() == 0, terminal.text
    assert compbox.read("machine.json")["provenance"]["commissioning"]["positions"]["X"]["to"] == 12.5


def test_a_reading_that_is_no_sign_is_asked_for_again_at_a_terminal(compbox, plc):
    fake = plc(axes="X")
    terminal = Terminal(compbox.folder, "--shows", "X=0:12.5", "--steps", "6")
    terminal.until("jog this axis")
    fake.jog("X", 12.5)
    terminal.until("then Enter: ")
    terminal.type("\n")
    terminal.until("in µm? ")
    terminal.type("198\n")
    terminal.until("measured 198 µm: wrong by a factor of 10", "in µm? ")
    terminal.type("19,8\n")
    terminal.until("sign 1, as in the file")
    assert terminal.end() == 0, terminal.text
    assert compbox.read("machine.json")["provenance"]["commissioning"]["signs"]["X"]["measured_um"] == 19.8


def test_a_small_terminal_keeps_the_question(compbox, plc):
    plc(axes="X")
    terminal = Terminal(compbox.folder, "--watch", "--registers", size=(10, 60))
    lines = terminal.until("X > ").split("reads", 1)[-1].split("\r\n")
    table = lines[next(i for i, line in enumerate(lines) if "last reply" in line):]
    assert len(table) <= 10 and all(len(line.replace("\033[K", "")) < 60 for line in table), table
    assert table[-2].startswith("X: Enter if the control shows this value"), table
    terminal.run.send_signal(signal.SIGINT)
    assert terminal.end() == 1


def test_ctrl_c_at_the_table_leaves_calmly(compbox, plc):
    fake = plc(axes="X")
    before = compbox.files()
    terminal = Terminal(compbox.folder, "--watch")
    terminal.until("X > ")
    terminal.type("\x03")
    assert terminal.end() == 1
    assert terminal.text.replace("\r", "").endswith(
        "\ncompbox: machine.json: interrupted; nothing was written to the file\n")
    assert compbox.files() == before
    is_at_rest(fake, "X")


def test_the_table_without_a_terminal_is_plain_lines(compbox, plc):
    fake = plc(axes="X")
    code, _, err = commission(compbox, fake, "--watch", "--registers")
    assert code == 0 and "\033" not in err
    assert re.search(r"^> 8-9 +int32 +X +0000 0000 +0.0000 mm", err, re.M)
    assert len(re.findall("last reply", err)) == 2, "once for each question"


def test_a_plc_that_vanishes_during_the_comparison(compbox, plc):
    fake = plc(axes="X")
    sentence = refusal(compbox, fake, at=("jog this axis", lambda run: fake.command("fault away 600000")))
    assert sentence.startswith(f"plc.transport.tcp: no reply from 127.0.0.1:{fake.port}: ")


@pytest.mark.parametrize("options, sentence", [
    (("--together", "X"), "--together: two positions of one stage, please: Y1+Y2"),
    (("--registers", "--measured", "X=20"), "--measured: --registers ends before the signs are tested"),
    (("-o", "missing/m.json"), "missing/m.json: cannot create a file there (No such file or directory)"),
])
def test_what_would_fail_at_the_end_is_refused_before_the_walk(compbox, options, sentence):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    done = compbox("commission", "machine.json", *options)
    assert done.returncode != 0 and done.stderr.splitlines()[0] == "compbox: " + sentence
    assert done.stdout == ""
