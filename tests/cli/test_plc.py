# SPDX-License-Identifier: MIT
"""compbox plc: registers by libmodbus, against fakeplc and servers that fail in one way each."""

import fcntl
import json
import os
import re
import signal
import socket
import subprocess
import threading

import pytest

from conftest import BIN, PLC


class Fake:
    """fakeplc at a free port or a serial line."""

    def __init__(self, folder, *arguments, listen="127.0.0.1:0"):
        self.process = subprocess.Popen([BIN / "fakeplc", "--listen", listen, *arguments], cwd=folder,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.at = self.process.stdout.readline().split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.terminate()
        self.process.wait(10)


class Server:
    """Answers each request by answer(request), bytes; None closes the connection."""

    def __init__(self, answer):
        self.answer = answer
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.at = "127.0.0.1:%d" % self.listener.getsockname()[1]
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            client, _ = self.listener.accept()
            with client:
                while request := client.recv(300):
                    reply = self.answer(request)
                    if reply is None:
                        break
                    client.sendall(reply)


def exception(code):
    return lambda request: request[:4] + bytes([0, 3, request[6], request[7] | 0x80, code])


class Registers:
    """A server of 200 holding and input registers, and bits; write(address, value) may change what is stored."""

    def __init__(self, write=lambda address, value: value):
        self.words, self.write, self.functions = [0] * 200, write, []

    def __call__(self, request):
        function, start, count = request[7], *(int.from_bytes(request[i:i + 2], "big") for i in (8, 10))
        self.functions.append(function)
        if function in (3, 4):
            data = b"".join(word.to_bytes(2, "big") for word in self.words[start:start + count])
        elif function in (1, 2):
            bits = [self.words[start + i] & 1 for i in range(count)]
            data = bytes(sum(bit << i for i, bit in enumerate(bits[at:at + 8])) for at in range(0, count, 8))
        else:
            for i in range(count):
                new = int.from_bytes(request[13 + 2 * i:15 + 2 * i], "big") if function == 16 else \
                    request[13 + i // 8] >> i % 8 & 1
                self.words[start + i] = self.write(start + i, new)
            return request[:4] + bytes([0, 6]) + request[6:12]
        return request[:4] + (3 + len(data)).to_bytes(2, "big") + request[6:8] + bytes([len(data)]) + data


@pytest.fixture
def machine_at(compbox):
    """out: function(address): machine.json of a PLC at this address"""
    def write(at):
        compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=500,Y=500,Z=500",
                     "-o", "machine.json")
        machine = compbox.read("machine.json")
        machine["plc"]["transport"]["tcp"]["port"] = int(at.rsplit(":")[1])
        compbox.write("machine.json", machine)
        return machine
    return write


def test_a_file_names_registers_and_where_they_are(compbox, machine_at):
    machine_at("127.0.0.1:1")
    with Fake(compbox.folder, "--profile", "generic", "--map", "machine.json") as plc:
        machine = machine_at(plc.at)
        read = json.loads(compbox.good("plc", "read", "machine.json", "--json"))
        found = {one["name"]: one for one in read["values"]}
        assert set(found) == {"control", "plc_heartbeat", "status", "box_heartbeat", *"XYZ",
                              *("value_" + a for a in "XYZ"), *("applied_" + a for a in "XYZ")}
        for one in machine["signals"]:
            assert found[one["name"]]["address"] == one["plc"] and found[one["name"]]["unit"] == "mm"
        text = compbox.good("plc", "read", "machine.json", "X", "control")
        assert [line.split()[1] for line in text.splitlines()] == ["X", "control"]
        at = compbox.good("plc", "read", plc.at, "X", "--config", "machine.json")
        assert at.split()[:2] == text.split()[:2]


def test_a_written_value_is_read_back(compbox, machine_at):
    machine_at("127.0.0.1:1")
    with Fake(compbox.folder, "--profile", "generic", "--map", "machine.json") as plc:
        channel = next(one for one in machine_at(plc.at)["channels"] if one["name"] == "Z")
        text = compbox.good("plc", "write", "machine.json", "value_Z", "-12.5")
        assert text.endswith("\nwritten and read back\n") and "-12.5 um" in text
        raw = round(-12.5 / channel["scale"]) & 0xffffffff
        words = json.loads(compbox.good("plc", "read", plc.at, channel["plc"], 2, "--json"))["values"]
        assert [one["value"] for one in words] == [raw >> 16, raw & 0xffff]


def test_the_four_tables_and_their_functions(compbox):
    plc = Registers()
    at = Server(plc).at
    done = json.loads(compbox.good("plc", "write", at, "3", "1", "0", "1", "--table", "coil", "--json"))
    assert done["read_back"] == "equal" and plc.words[3:6] == [1, 0, 1]
    for table in ("holding", "input", "coil", "discrete"):
        read = json.loads(compbox.good("plc", "read", at, "2", "4", "--table", table, "--json"))
        assert [one["value"] for one in read["values"]] == [0, 1, 0, 1]
    compbox.good("plc", "write", at, "9", "7")
    assert plc.functions == [15, 1, 3, 4, 1, 2, 16, 3], "one register too by function 16, which every control has"


def test_more_registers_than_one_request_carries(compbox):
    plc = Registers()
    plc.words = list(range(200))
    read = json.loads(compbox.good("plc", "read", Server(plc).at, "0", "200", "--json"))["values"]
    assert [one["value"] for one in read] == list(range(200)) and plc.functions == [3, 3]


def test_types_and_scale(compbox):
    at = Server(Registers()).at
    for name, text in (("int32", "-70000"), ("float32cdab", "0.5"), ("uint16le", "258"), ("int16", "-1")):
        compbox.good("plc", "write", at, "10", text, "--type", name)
        assert compbox.good("plc", "read", at, "10", "--type", name).split()[1] == text
    compbox.good("plc", "write", at, "10", "1.25", "--scale", "0.01")
    assert compbox.good("plc", "read", at, "10", "2").splitlines()[0].split()[1:] == ["125", "0x007d"]


def test_a_register_that_the_plc_overwrites_is_reported(compbox):
    plc = Registers(write=lambda address, value: 5)
    at = Server(plc).at
    assert compbox.refused("plc", "write", at, "7", "9") == (
        at + ": register 7 has 5 (0x0005) after 9 (0x0009) was written and confirmed: the PLC program "
        "overwrites it, or maps it elsewhere")
    assert compbox.good("plc", "write", at, "7", "9", "--no-read-back").endswith("\nwritten\n")


def test_a_refused_read_back_is_a_remark(compbox):
    plc = Registers()
    at = Server(lambda request: exception(2)(request) if request[7] == 3 else plc(request)).at
    done = json.loads(compbox.good("plc", "write", at, "7", "9", "--json"))
    assert done["read_back"] == "refused" and "exception 2" in done["remarks"][0] and plc.words[7] == 9


def closed_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return "127.0.0.1:%d" % listener.getsockname()[1]


@pytest.mark.parametrize("answer, words", [
    (exception(1), "exception 1, illegal function: the server does not have this function; try another --table"),
    (exception(2), "exception 2, illegal address: the server has no such registers; compare address (from 0) and "
     "count with its map"),
    (exception(6), "exception 6, server busy: ask again later"),
    (exception(11), "exception 11, no reply behind the gateway: check --unit and the device's power"),
    (lambda request: b"", "no reply from unit 3 within 100 ms: check --unit, and whether the server serves one "
     "client only"),
    (lambda request: None, "the server closed the connection: does it serve another client?"),
    (lambda request: bytes(12), "a reply that does not match the request: the peer may be no Modbus server"),
])
def test_what_fails_gets_cause_and_remedy(compbox, answer, words):
    at = Server(answer).at
    message = compbox.refused("plc", "read", at, "4", "2", "--unit", "3", "--timeout-ms", "100")
    assert message == f"{at}, unit 3: reading registers 4 to 5: {words}"


def test_a_server_that_is_not_there(compbox):
    at = closed_port()
    assert compbox.refused("plc", "read", at, "0") == (
        at + ": connection refused: nothing listens on this port; start the PLC's Modbus server, or check the "
        "port (usually 502)")
    assert compbox.refused("plc", "read", "/dev/ttyUSB77", "0").startswith("/dev/ttyUSB77: there is no such device: ")
    assert compbox.refused("plc", "read", "/dev/null", "0") == "/dev/null: this is no serial device"


@pytest.mark.parametrize("words, sentence", [
    (("read", "h"), "an address is missing, as in compbox plc read 192.168.0.10:502 100 4"),
    (("write", "h", "1"), "write needs an address or name and the values, as in compbox plc write "
     "192.168.0.10:502 104 250"),
    (("read", "h", "X"), "'X' is no address from 0 to 65535; names need --config with a machine file"),
    (("read", "h", "-1"), "'-1' is no address from 0 to 65535; names need --config with a machine file"),
    (("read", "h", "65536"), "address 65536 is beyond 65535"),
    (("read", "h", "65535", "--type", "int32"), "address 65536 is beyond 65535"),
    (("read", "h", "1", "0"), "behind the address comes one COUNT, a number of values"),
    (("read", "h", "1", "--count", "3"), "--every-ms and --count belong to compbox plc watch"),
    (("read", "h", "1", "--no-read-back"), "--no-read-back belongs to compbox plc write"),
    (("read", "h", "1", "--baud", "9600"), "--baud, --parity, --stop-bits and --rs485 belong to a serial device"),
    (("read", "h", "1", "--type", "int8"), "--type: must be int16, uint16, int32, uint32 or float32, perhaps with "
     "cdab or le behind it, not int8"),
    (("read", "h", "1", "--scale", "0"), "--scale: must not be 0"),
    (("write", "h", "1", "2", "--table", "input"), "--table: only holding registers and coils can be written"),
    (("read", "h", "1", "--table", "coil", "--type", "int32"), "--table: coils and discrete inputs have no type and "
     "scale"),
    (("write", "h", "0", *["1"] * 124), "one request writes at most 123 registers"),
])
def test_wrong_usage(compbox, words, sentence):
    done = compbox("plc", *words)
    assert (done.returncode, done.stderr.splitlines()[0]) == (2, "compbox: " + sentence)


def test_an_unknown_name_lists_those_of_the_file(compbox, machine_at):
    machine_at("127.0.0.1:1")
    message = compbox.refused("plc", "read", "machine.json", "Q")
    start, names = message.split("; there are ")
    assert start == "machine.json: no register is named Q" and {"control", "X", "value_Z"} <= set(names.split(", "))


@pytest.mark.parametrize("change, words", [
    (lambda plc, signal: plc.update(transport="tcp"), "plc.transport: needs tcp or rtu, the wire to the PLC"),
    (lambda plc, signal: plc["transport"]["tcp"].pop("host"), "host"),
    (lambda plc, signal: plc["transport"]["tcp"].update(port="x"), "port"),
    (lambda plc, signal: signal.update(unit=5), "unit"),
    (lambda plc, signal: plc.pop("control"), "plc.control: is missing"),
])
def test_a_wrong_file_is_refused_with_its_key(compbox, machine_at, change, words):
    machine = machine_at("127.0.0.1:1")
    change(machine["plc"], machine["signals"][0])
    compbox.write("machine.json", machine)
    message = compbox.refused("plc", "read", "machine.json")
    assert message.startswith("machine.json: ") and words in message


def watch(at, *arguments):
    return subprocess.Popen([BIN / "compbox", "plc", "watch", at, *arguments], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def test_watch_prints_all_at_first_and_then_what_changed_until_interrupted(compbox):
    plc = Registers()
    plc.words[4:6] = [1, 2]
    with watch(Server(plc).at, "4", "2", "--every-ms", "5") as process:
        first = [process.stdout.readline() for _ in range(2)]
        plc.words[5] = 300
        changed = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, error = process.communicate(timeout=20)
    assert (process.returncode, rest, error) == (0, "", "")
    lines = [re.fullmatch(r"\d\d:\d\d:\d\d\.\d{3}  (\d+) +(\d+)  (0x\w{4})\n", line).groups()
             for line in (*first, changed)]
    assert lines == [("4", "1", "0x0001"), ("5", "2", "0x0002"), ("5", "300", "0x012c")]


def test_watch_survives_a_server_that_closes_and_reports_it_once(compbox):
    plc, calls = Registers(), []

    def answer(request):
        calls.append(request)
        if 3 <= len(calls) <= 5:
            return None
        if len(calls) == 8:
            plc.words[0] = 9
        return plc(request)
    with watch(Server(answer).at, "0", "--every-ms", "5", "--json", "--count", "20") as process:
        out, error = process.communicate(timeout=60)
    assert process.returncode == 0
    assert [json.loads(line)["value"] for line in out.splitlines()] == [0, 9]
    lost, back = error.splitlines()
    assert "the server closed the connection" in lost and back.endswith(" replies again")


def test_watch_of_a_server_that_never_answers_ends_at_once(compbox):
    assert "connection refused" in compbox.refused("plc", "watch", closed_port(), "0")


def test_a_serial_line(compbox, tmp_path):
    line = str(tmp_path / "line")
    with Fake(compbox.folder, "--profile", "generic", listen="rtu:" + line):
        serial = ("--baud", "115200", "--parity", "none")
        assert len(compbox.good("plc", "read", line, "0", "3", *serial).splitlines()) == 3
        message = compbox.refused("plc", "read", line, "0", *serial, "--unit", "9", "--timeout-ms", "100")
        assert message.endswith("no reply from unit 9 within 100 ms: check --unit, --baud, --parity, --stop-bits and "
                                "the wires A and B")
        holder = os.open(line, os.O_RDWR | os.O_NOCTTY)
        try:
            fcntl.flock(holder, fcntl.LOCK_EX)
            assert compbox.refused("plc", "read", line, "0", *serial) == (
                line + ": another program has it open, such as compboxd: stop that first")
        finally:
            os.close(holder)


def test_a_named_register_of_the_plc_is_not_written(compbox, machine_at):
    machine_at("127.0.0.1:1")
    done = compbox("plc", "write", "machine.json", "Z", "12")
    assert (done.returncode, done.stderr.splitlines()[0]) == (
        2, "compbox: Z is a register that the PLC writes; the box writes value_CHANNEL, status and box_heartbeat (to "
        "test the PLC give the address 12)")
