# SPDX-License-Identifier: MIT
"""compbox commission against fakeplc: two processes, a real socket, one clock that a busy machine does not move
(still_clock.py). The indicator is fakeplc's own truth about the tool, read by its console and typed in as a person
would."""

import hashlib
import json
import os
import re
import signal
import socket
import threading

import pytest

import still_clock
from conftest import LONG
from commissioning import TWIN, behind, commission, is_at_rest, refusal

class Refuser:
    """Stands before fakeplc and answers requests for which exception(function, start) is not 0 by
    that exception. As fakeplc it serves one client after the other."""

    def __init__(self, fake, exception):
        self.to, self.exception, self.clock = fake.port, exception, still_clock.Member(fake.folder)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        while client := self.clock.accepted(self.listener):
            with client, socket.create_connection(("127.0.0.1", self.to)) as server:
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                server.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    while self.answer(client, server):
                        pass
                except OSError:
                    pass

    def answer(self, client, server):
        request = self.clock.received(client)
        if len(request) < 10:
            return False
        function, start = request[7], int.from_bytes(request[8:10], "big")
        code = self.exception(function, start)
        if code:
            reply = request[:4] + bytes([0, 3, request[6], function | 0x80, code])
        else:
            server.sendall(request)
            reply = self.shown(start, self.clock.received(server))
        client.sendall(reply)
        return True

    def shown(self, start, reply):
        return reply


class LifeBit(Refuser):
    """Stands before fakeplc and shows the last bit of its heartbeat, as of a PLC that toggles a bit."""

    def __init__(self, fake):
        super().__init__(fake, lambda function, start: 0)

    def shown(self, start, reply):
        return reply[:11] + bytes([0, reply[12] & 1]) + reply[13:] if start == 0 else reply


LONG_ALONE = pytest.mark.skipif(not LONG, reason="scripts/test --long")


@LONG_ALONE
def test_a_machine_as_it_should_be(compbox, plc):
    fake = plc()
    code, out, printed = commission(compbox, fake, "--json")
    assert code == 0, printed
    figures = json.loads(out)
    machine = compbox.read("machine.json")
    assert [channel["sign"] for channel in machine["channels"]] == [1, 1, 1]
    kept = machine["provenance"]["commissioning"]
    assert kept["signs"] == figures["signs"]
    for axis in "XYZ":
        assert kept["signs"][axis]["measured_um"] == pytest.approx(20, abs=1)
    times = kept["times"]
    assert times["write_to_applied_ms"]["count"] >= 5
    assert 0 < times["write_to_applied_ms"]["p50"] <= times["write_to_applied_ms"]["p99"]
    assert abs(machine["cycle"]["lead_ms"] - times["lead_ms"]) <= 0.5
    assert times["lead_ms"] > 15 + times["write_to_applied_ms"]["p50"]
    assert set(figures["registers"]["signals"]) == set("XYZ")
    assert figures["registers"]["read_back"] == "answered"
    is_at_rest(fake)


def test_a_machine_of_which_one_axis_moves_the_other_way(compbox, plc):
    fake = plc(TWIN)
    code, out, printed = commission(compbox, fake, "--axis", "X", "--axis", "Y", "--events", "events.jsonl")
    assert code == 0, printed
    assert "sign -1, reversed" in out and "sign 1, as in the file" in out
    machine = compbox.read("machine.json")
    assert [c["sign"] for c in machine["channels"]] == [-1, 1, 1]
    kept = machine["provenance"]["commissioning"]
    assert kept["signs"]["X"]["measured_um"] == pytest.approx(-20, abs=1)
    assert kept["signs"]["Y"]["measured_um"] == pytest.approx(20, abs=1)
    assert abs(machine["cycle"]["lead_ms"] - kept["times"]["lead_ms"]) <= 0.5  # to whole ms
    event = compbox.read("events.jsonl")
    digest = hashlib.sha256((compbox.folder / "machine.json").read_bytes()).hexdigest()
    assert event["kind"] == "commission" and event["file"]["sha256"] == digest
    assert event["file"]["owner"] == os.geteuid() and event["revision"] == machine["revision"]
    assert re.fullmatch(r"commissioned machine, written to machine\.json: sign of X -1, sign of Y 1, "
                        rf"lead_ms {machine['cycle']['lead_ms']:.4g}, registers agree", event["text"]), event["text"]
    is_at_rest(fake)


@pytest.mark.parametrize("profile, round_ms", [
    ("fanuc", 96), pytest.param("sinumerik-840d", 0, marks=LONG_ALONE)])
def test_the_way_into_a_real_control_is_in_the_lead(compbox, plc, profile, round_ms):
    """Three FANUC handshakes, one after the other, take 96 ms: a value waits for half of that."""
    fake = plc(profile=profile)
    code, out, printed = commission(compbox, fake, "--axis", "Z", "--measured", "Z=20", "--json")
    assert code == 0, printed
    times = json.loads(out)["times"]
    assert times["handshake_round_ms"] == round_ms
    least_ms = times["write_to_applied_ms"]["p50"] + 15 + round_ms / 2
    assert least_ms < times["lead_ms"] < least_ms + times["plc_update_ms"] + times["exchange_ms"]["p50"]
    assert times["write_to_applied_ms"]["p50"] > (8 if round_ms else 0)
    is_at_rest(fake)


@LONG_ALONE
def test_a_sign_that_was_turned_round_stays(compbox, plc):
    fake = plc(TWIN, change=lambda machine: machine["channels"][0].update(sign=-1))
    code, out, printed = commission(compbox, fake, "--axis", "X")
    assert code == 0 and "sign -1, as in the file" in out, printed
    assert compbox.read("machine.json")["channels"][0]["sign"] == -1


@LONG_ALONE
def test_measured_on_the_command_line(compbox, plc):
    fake = plc()
    code, out, _ = commission(compbox, fake, "--axis", "Y", "--measured", "Y=+19.8", "-o", "done.json")
    assert code == 0 and "measured 19.8 µm: sign 1" in out
    done = compbox.read("done.json")
    assert done["provenance"]["commissioning"]["signs"]["Y"]["measured_um"] == 19.8
    assert "commissioning" not in compbox.read("machine.json")["provenance"]


def test_a_scale_ten_times_too_large(compbox, plc):
    def coarse(machine):
        for channel in machine["channels"]:
            channel["scale"] = 0.1
            channel.pop("applied")
    fake = plc(change=coarse)
    printed = refusal(compbox, fake, "--axis", "X")
    assert re.match(r"axis X: commanded 20 µm, measured 2\S* µm: wrong by a factor of 10; the scale of "
                    "the channel is too large for what the control takes", printed), printed
    is_at_rest(fake)


@LONG_ALONE
def test_the_indicator_stands_still(compbox, plc):
    fake = plc()
    assert "the axis did not move; is another one moved by its register" in refusal(
        compbox, fake, "--axis", "X", answer=lambda axis: fake.displacement_um("Y"))
    is_at_rest(fake)


@LONG_ALONE
def test_applied_registers_that_are_mixed_up(compbox, plc):
    def swap(machine):
        x, y = machine["channels"][:2]
        x["applied"], y["applied"] = y["applied"], x["applied"]
    fake = plc(change=swap)
    assert re.match(r"channels\.X\.applied: register 26 shows 0 µm where 20 µm were written; ",
                    refusal(compbox, fake, "--axis", "X"))
    is_at_rest(fake)


def test_a_heartbeat_that_stands(compbox, plc):
    fake = plc()
    fake.command("freeze heartbeat 1")
    assert re.match(r"plc\.plc_heartbeat: register 1 stays at \d+; the PLC program has to count it up",
                    refusal(compbox, fake))


def test_a_heartbeat_that_is_a_bit(compbox, plc):
    """Taken for a count of 65536 in two updates, it would give a lead without the PLC's update."""
    fake = plc()
    behind(compbox, LifeBit(fake))
    assert refusal(compbox, fake) == (
        "plc.plc_heartbeat: register 1 goes back from 1 to 0; the PLC program has to count it up by one, "
        "from 65535 to 0")


@pytest.mark.parametrize("command, sentence", [
    ("enable 0", "plc.control: the PLC has not set enable (bit 0): register 0 is 0x000a; release the "
     "compensation on the control"),
    pytest.param("reference 0, enable 1", "plc.control: an axis is not referenced (bits 0x0002): "
                 "register 0 is 0x0009; reference the axes", marks=LONG_ALONE)])
def test_a_plc_that_does_not_permit_it(compbox, plc, command, sentence):
    fake = plc()
    for one in command.split(", "):
        fake.command(one)
    assert refusal(compbox, fake) == sentence


@LONG_ALONE
def test_a_plc_that_refuses_writes(compbox, plc):
    fake = plc()
    fake.command("fault exception 2 100000 write")
    assert refusal(compbox, fake) == (
        "plc.write: the PLC refuses writes to registers 100 to 109 (exception 2: it has no such "
        "registers); look at address, count and access rights of its server")


def refuse_read_back(function, start):
    return 2 if function == 3 and start == 100 else 0


REFUSED = ("the PLC refuses the read-back of registers 100 to 109 (exception 2: it has no such "
           "registers)")


def test_a_plc_that_refuses_the_read_back(compbox, plc):
    fake = plc(TWIN)
    behind(compbox, Refuser(fake, refuse_read_back))
    code, out, printed = commission(compbox, fake, "--axis", "X", "--json")
    assert code == 0, printed
    result = json.loads(out)
    assert result["registers"]["read_back"] == "refused"
    remark, = [text for text in result["remarks"] if "read-back" in text]
    assert remark.startswith(REFUSED + "; at each start outputs begin at applied, or at zero")
    assert "waits for permit resume" in remark and "(function 3) of the write block" in remark
    is_at_rest(fake)


def test_a_refused_read_back_without_permission(compbox, plc):
    fake = plc()
    fake.command("permit 0")
    while int(fake.status()["control"]) & 3 != 3:
        pass    # an enable that goes on later is a permission
    behind(compbox, Refuser(fake, refuse_read_back))
    sentence = refusal(compbox, fake)
    assert sentence.startswith("plc.control: after a loss the box waits for permit resume (bit 3)")
    assert sentence.endswith(
        f"; {REFUSED}, so each start counts as a loss: let its server answer readings of the write "
        "block")


def test_a_plc_without_fc23(compbox, plc):
    fake = plc(change=lambda machine: machine["plc"].update(exchange="fc23"))
    behind(compbox, Refuser(fake, lambda function, _: int(function == 23)))
    assert refusal(compbox, fake) == (
        "plc.write: the PLC refuses writes to registers 100 to 109 (exception 1: it does not know the "
        'function code); set plc.exchange to "fc3+fc16"')


@LONG_ALONE
def test_a_block_that_the_plc_does_not_have(compbox, plc):
    fake = plc(change=lambda machine: machine["plc"]["read"].update(count=125))
    assert refusal(compbox, fake).endswith(
        "refuses to read registers 0 to 124 (exception 2: it has no such registers)")


@LONG_ALONE
def test_a_position_that_is_none(compbox, plc):
    fake = plc(change=lambda machine: machine["signals"][1].update(type="int32cdab"))
    fake.command("move Y=400 feed=20000")
    assert re.match(r"signals\.Y: register 10 gives \S+ mm, outside -10 to 510; look at its address",
                    refusal(compbox, fake))


@LONG_ALONE
def test_nobody_there(compbox, plc):
    fake = plc()
    fake.end()
    printed = refusal(compbox, fake)
    assert printed.startswith(f"plc.transport.tcp: no reply from 127.0.0.1:{fake.port}: ")


@LONG_ALONE
def test_enable_taken_away_in_the_middle(compbox, plc):
    fake = plc()

    def press(run):
        fake.command("enable 0")
    assert refusal(compbox, fake, at=("in µm? ", press)).startswith(
        "plc.control: the PLC has not set enable (bit 0)")
    is_at_rest(fake)


@pytest.mark.parametrize("which", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=LONG_ALONE)])
def test_ctrl_c_goes_back_to_zero(compbox, plc, which):
    fake = plc()
    seen = []

    def press(run):
        seen.append(fake.displacement_um("X"))
        run.send_signal(which)
    printed = refusal(compbox, fake, at=("in µm? ", press))
    assert printed == "interrupted; nothing was written to the file"
    assert seen[0] == pytest.approx(20, abs=1)
    is_at_rest(fake)
    assert fake.displacement_um("X") == pytest.approx(0, abs=0.1)


@LONG_ALONE
def test_questions_need_somebody_who_answers(compbox, plc):
    fake = plc()
    compbox.environment = still_clock.shared_in(compbox.folder)
    done = compbox("commission", "machine.json", "--axis", "X")
    assert done.returncode == 1
    assert "no answer: standard input has ended; give --shows X=… instead" in done.stderr
    is_at_rest(fake)


@pytest.mark.parametrize("arguments, sentence", [
    (["--axis", "Q"], "--axis: no axis Q to test; there is X, Y, Z"),
    (["--axis", "X", "--measured", "Y=3"], "--measured: no axis Y to test; there is X"),
    (["--measured", "X=much"], "--measured: 'X=much' must read NAME=number"),
    (["--measured", "X=1", "--measured", "X=2"], "--measured: one number for each axis, please"),
    (["--offset-um", "0"], "--offset-um")])
def test_wrong_usage(compbox, machine, arguments, sentence):
    done = compbox("commission", "machine.json", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr.splitlines()[0]


def test_files_that_are_none(compbox, machine):
    machine["channels"][0]["limit_um"] = -3
    compbox.write("bad.json", machine)
    assert compbox.refused("commission", "bad.json").startswith("bad.json: channels[0].limit_um: -3 ")
    compbox.write("bad.json", {**machine, "channels": []})
    assert compbox.refused("commission", "bad.json") == (
        "bad.json: channels is missing or no list; see compbox init")
    machine["channels"][0]["limit_um"] = 300
    compbox.write("bad.json", {**machine, "provenance": 7})
    assert compbox.refused("commission", "bad.json") == (
        "bad.json: provenance: must be an object {…}, to take what was found")
