# SPDX-License-Identifier: MIT
"""fakeplc with clients that are not ours: mbpoll (libmodbus), pymodbus, and frames made by hand."""
import asyncio
import os
import re
import shutil
import socket
import struct
import subprocess

import pytest
from pymodbus.client import AsyncModbusTcpClient, ModbusTcpClient
from pymodbus.pdu import ModbusExceptions

from fakeplc import FakePlc

PROFILES = {"generic": {"clients": 8}, "sinumerik-840d": {"clients": 1}, "fanuc": {"clients": 4}}
SERVED, NO_ADDRESS, NO_FUNCTION = 0, 2, 1   # the exception code
CODES = [1, 2, 3, 4, 5, 6, 15, 16, 20, 22, 23, 43]
# docs/fakeplc.md, "Modbus"; docs/plc-profiles.md has the sources.
ANSWERS = {
    "generic": {3: SERVED, 4: SERVED, 6: SERVED, 16: SERVED, 23: SERVED},
    "sinumerik-840d": {3: SERVED, 4: SERVED, 6: SERVED, 16: SERVED, 1: NO_ADDRESS, 2: NO_ADDRESS,
                       5: NO_ADDRESS, 15: NO_ADDRESS},
    "fanuc": {3: SERVED, 16: SERVED, 23: SERVED},
}
SIZE = 110  # registers of the generic map: 0 to 109, for every profile
COMPBOX = os.environ.get("COMPBOX", os.path.join(os.path.dirname(__file__), "../../build/host/bin/compbox"))


@pytest.fixture(params=PROFILES)
def plc(request, tmp_path):
    subprocess.run([COMPBOX, "init", "--axes", "XYZ", "--profile", "generic", "--host", "127.0.0.1", "-o",
                    tmp_path / "map.json"], check=True, capture_output=True)
    with FakePlc("--profile", request.param, "--map", tmp_path / "map.json") as running:
        running.profile = request.param
        yield running


# ---- mbpoll

def mbpoll(plc, *arguments):
    """Runs it once, zero-based addresses; out: exit code, {address: text}, what else it printed."""
    done = subprocess.run(["mbpoll", "-1", "-0", "-p", str(plc.port), "-o", "2", *arguments[:-1],
                           "127.0.0.1", *arguments[-1]], capture_output=True, text=True, timeout=60)
    values = {int(a): v for a, v in re.findall(r"^\[(\d+)\]:\s*(\S+)", done.stdout, re.M)}
    return done.returncode, values, done.stdout + done.stderr


needs_mbpoll = pytest.mark.skipif(not shutil.which("mbpoll"), reason="scripts/setup test installs it")


@needs_mbpoll
def test_mbpoll_reads_what_the_control_shows(plc):
    plc.command("signal X 123.4567")
    plc.command("signal Y -0.5")
    plc.wait(lambda status: status["time_s"] > 1.2)
    code, values, printed = mbpoll(plc, "-t", "4:int", "-B", "-r", "8", "-c", "2", [])
    assert code == 0, printed
    assert values == {8: "1234567", 10: "-5000"}, "0.0001 mm, big-endian words"
    code, values, printed = mbpoll(plc, "-t", "4", "-r", "0", "-c", "1", [])
    assert code == 0 and int(values[0]) == 1 | 2 | 8, printed
    first, second = (int(mbpoll(plc, "-t", "4", "-r", "1", [])[1][1]) for _ in range(2))
    assert second != first, "the heartbeat counts"


@needs_mbpoll
def test_mbpoll_writes_what_the_box_would(plc):
    code, _, printed = mbpoll(plc, "-t", "4", "-r", "100", ["1", "7", "0", "0", "0", "250"])
    assert code == 0 and "Written 6 references" in printed, printed
    code, values, printed = mbpoll(plc, "-t", "4", "-r", "100", "-c", "6", [])
    assert [values[a] for a in range(100, 106)] == ["1", "7", "0", "0", "0", "250"], printed


@needs_mbpoll
@pytest.mark.parametrize("code, how", [(1, ["-t", "0"]), (2, ["-t", "1"]), (4, ["-t", "3"])])
def test_mbpoll_is_refused_what_the_control_does_not_have(plc, code, how):
    failed, _, printed = mbpoll(plc, *how, "-r", "8", "-c", "2", [])
    expected = {SERVED: "[8]:", NO_ADDRESS: "Illegal data address", NO_FUNCTION: "Illegal function"}
    assert expected[ANSWERS[plc.profile].get(code, NO_FUNCTION)] in printed, printed
    assert failed in (0, 1)


@needs_mbpoll
def test_mbpoll_writes_one_register_by_function_6_which_fanuc_refuses(plc):
    _, _, printed = mbpoll(plc, "-t", "4", "-r", "102", ["99"])
    assert ("Illegal function" in printed) == (plc.profile == "fanuc"), printed
    _, values, printed = mbpoll(plc, "-t", "4", "-r", "102", [])
    assert values[102] == ("0" if plc.profile == "fanuc" else "99"), printed


@needs_mbpoll
def test_mbpoll_finds_the_end_of_the_registers(plc):
    _, values, printed = mbpoll(plc, "-t", "4", "-r", "0", "-c", str(SIZE), [])
    assert len(values) == SIZE, printed
    _, _, printed = mbpoll(plc, "-t", "4", "-r", "0", "-c", str(SIZE + 1), [])
    assert "Illegal data address" in printed


# ---- pymodbus

@pytest.fixture
def client(plc):
    client = ModbusTcpClient("127.0.0.1", port=plc.port, timeout=60)
    assert client.connect()
    yield client
    client.close()


def test_pymodbus_writes_and_reads_back(plc, client):
    words = [1, 5, 0, 0, 0x0001, 0xE240, 0xFFFF, 0xFFFE]
    reply = client.write_registers(100, words, slave=1)
    assert not reply.isError(), reply
    assert client.read_holding_registers(100, 8, slave=1).registers == words
    both = client.readwrite_registers(read_address=100, read_count=2, write_address=101,
                                      write_registers=[6], slave=1)
    if plc.profile == "sinumerik-840d":
        assert both.exception_code == ModbusExceptions.IllegalFunction
    else:
        assert both.registers == [1, 6], "it writes before it reads"


@pytest.mark.parametrize("call, code", [
    (lambda c: c.read_coils(0, 1, slave=1), 1),
    (lambda c: c.read_discrete_inputs(0, 1, slave=1), 2),
    (lambda c: c.read_holding_registers(0, 1, slave=1), 3),
    (lambda c: c.read_input_registers(0, 1, slave=1), 4),
    (lambda c: c.write_coil(0, True, slave=1), 5),
    (lambda c: c.write_register(102, 3, slave=1), 6),
    (lambda c: c.write_coils(0, [True] * 3, slave=1), 15),
    (lambda c: c.write_registers(102, [3], slave=1), 16),
    (lambda c: c.mask_write_register(102, 0xFF, 0, slave=1), 22),
])
def test_pymodbus_gets_each_function_code_or_its_refusal(plc, client, call, code):
    reply = call(client)
    expected = ANSWERS[plc.profile].get(code, NO_FUNCTION)
    assert reply.isError() == (expected != SERVED), reply
    if expected != SERVED:
        assert reply.exception_code == expected


def test_pymodbus_clients_side_by_side_do_not_disturb_each_other(plc):
    """As many as the control has; each writes its own register and finds what it wrote."""
    count = PROFILES[plc.profile]["clients"]

    async def work(number):
        client = AsyncModbusTcpClient("127.0.0.1", port=plc.port, timeout=60)
        await client.connect()
        for i in range(40):
            reply = await client.write_registers(102 + number % 2 * 4 + number // 2 % 2,
                                                 [number * 100 + i], slave=1)
            assert not reply.isError(), reply
            reply = await client.read_holding_registers(8, 6, slave=1)
            assert len(reply.registers) == 6
        await client.close()

    async def everybody():
        await asyncio.gather(*(work(n) for n in range(count)))

    asyncio.run(everybody())


def test_one_client_too_many_is_turned_away_and_the_others_go_on(plc):
    count = PROFILES[plc.profile]["clients"]
    clients = [ModbusTcpClient("127.0.0.1", port=plc.port, timeout=60) for _ in range(count)]
    for client in clients:
        assert client.connect()
        assert client.read_holding_registers(0, 1, slave=1).registers
    with socket.create_connection(("127.0.0.1", plc.port), 60) as late:
        assert late.recv(10) == b"", "closed at once"
    for client in clients:
        assert client.read_holding_registers(0, 1, slave=1).registers
    clients.pop().close()
    plc.wait(lambda status: status["clients"] == count - 1)
    with socket.create_connection(("127.0.0.1", plc.port), 60) as heir:
        heir.sendall(frame(1, bytes([3, 0, 0, 0, 1])))
        assert receive(heir)[1][:2] == bytes([3, 2])
    for client in clients:
        client.close()


# ---- frames made by hand

def frame(transaction, pdu, unit=1, protocol=0):
    return struct.pack(">HHHB", transaction, protocol, len(pdu) + 1, unit) + pdu


def receive(connection):
    """One frame; out: (transaction, unit), PDU."""
    head = b""
    while len(head) < 7:
        more = connection.recv(7 - len(head))
        assert more, "closed"
        head += more
    transaction, _, length, unit = struct.unpack(">HHHB", head)
    pdu = b""
    while len(pdu) < length - 1:
        pdu += connection.recv(length - 1 - len(pdu))
    return (transaction, unit), pdu


@pytest.fixture
def line(plc):
    with socket.create_connection(("127.0.0.1", plc.port), 60) as connection:
        yield connection


def exchange(line, pdu):
    line.sendall(frame(9, pdu))
    return receive(line)[1]


def test_every_other_function_code_is_refused(plc, line):
    for code in range(1, 128):
        if ANSWERS[plc.profile].get(code, NO_FUNCTION) != NO_FUNCTION:
            continue
        assert exchange(line, bytes([code, 0, 0, 0, 1])) == bytes([code | 0x80, 1]), code


def test_limits_of_a_request(plc, line):
    """125 registers may be read, 123 written (121 by function 23); counts and lengths that cannot
    be are exception 3, before the addresses are looked at; nothing is written."""
    read = lambda start, count: bytes([3]) + struct.pack(">HH", start, count)
    assert exchange(line, read(0, SIZE))[1] == 2 * SIZE
    assert exchange(line, read(SIZE, 1)) == bytes([0x83, 2])
    assert exchange(line, read(65535, 125)) == bytes([0x83, 2])
    assert exchange(line, read(0, 125)) == bytes([0x83, 2]), "a legal count, beyond the end"
    for count in (0, 126, 65535):
        assert exchange(line, read(0, count)) == bytes([0x83, 3])

    def write(start, count, words, size=None):
        data = struct.pack(f">{len(words)}H", *words)
        return bytes([16]) + struct.pack(">HHB", start, count, (len(data) if size is None else size) & 255) + data
    assert exchange(line, write(102, 2, [11, 12])) == bytes([16, 0, 102, 0, 2])
    for bad in (write(102, 0, []), write(102, 124, [7] * 123), write(102, 2, [7, 7], size=3),
                write(102, 2, [7])):
        assert exchange(line, bad) == bytes([0x90, 3])
    assert exchange(line, write(SIZE - 1, 2, [7, 7])) == bytes([0x90, 2])
    assert exchange(line, read(102, 2)) == bytes([3, 4, 0, 11, 0, 12])


def test_pipelined_requests_are_answered_in_order(plc, line):
    requests = [(1000 + i, 1 + i % 247, struct.pack(">BHH", 3, i, 2)) for i in range(40)]
    line.sendall(b"".join(frame(t, pdu, unit) for t, unit, pdu in requests))
    for transaction, unit, _ in requests:
        who, pdu = receive(line)
        assert who == (transaction, unit)
        assert len(pdu) == 6


def test_a_request_in_pieces_is_answered_once(plc, line):
    whole = frame(77, struct.pack(">BHH", 3, 0, 1))
    for byte in whole:
        line.sendall(bytes([byte]))
    assert receive(line)[0] == (77, 1)
    line.settimeout(0.1)
    with pytest.raises(TimeoutError):
        line.recv(1)


def test_what_is_no_modbus_is_closed_and_the_server_goes_on(plc):
    for rubbish in (b"GET / HTTP/1.0\r\n\r\n", frame(1, b"\x03\0\0\0\1", protocol=9),
                    struct.pack(">HHHB", 1, 0, 300, 1) + bytes(299)):
        with socket.create_connection(("127.0.0.1", plc.port), 60) as connection:
            connection.sendall(rubbish)
            assert connection.recv(100) == b""
    plc.wait(lambda status: status["clients"] == 0)
    with socket.create_connection(("127.0.0.1", plc.port), 60) as connection:
        connection.sendall(frame(1, b"\x03\0\0\0\1"))
        assert receive(connection)[1][0] == 3
