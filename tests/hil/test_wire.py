# SPDX-License-Identifier: MIT
"""One exchange of the whole program against bytes written by hand.

Read block: 6 registers from 0; write block: 6 from 100. X = 123.4567 mm = 1234567 units
(0x0012D687). The term is the line 10 µm + 0.001 µm/mm * X over the whole travel, so Z wants
-10.1235 µm; with sign -1 and 0.01 µm a unit that is +1012 units = 0x000003F4. The PLC applies that
value already, so that the box goes on from it without a ramp. The PLC's heartbeat counts on from 1
in the readings; the first one cannot show that it lives, so the first write says RAMP, HEARTBEAT. Before
it the box reads the write block back: all zeros, as of a PLC that has just started."""
import json
import socket
import threading

import machine
from box import Box
from realtime import run_before_others

CONFIG = {
    "format": "compbox/1", "revision": 1,
    "machine": {"name": "wire", "axes": ["X"]},
    "cycle": {"period_ms": 30},
    "plc": {"profile": "generic",
            "transport": {"tcp": {"host": "127.0.0.1", "port": 0, "unit": 17}},
            "exchange": "fc3+fc16",
            "read": {"start": 0, "count": 6}, "write": {"start": 100, "count": 6},
            "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,
            "heartbeat_timeout_ms": 200},
    "signals": [{"name": "X", "unit": "mm", "plc": 2, "type": "int32", "scale": 0.0001,
                 "min": 0, "max": 14300}],
    "terms": [{"name": "EZX", "type": "polynomial", "signal": "X", "coefficients": [10, 0.001]}],
    "channels": [{"name": "Z", "sum": ["EZX"], "limit_um": 300, "error_um": 400,
                  "slew_um_per_s": 500, "sign": -1, "plc": 104, "type": "int32", "scale": 0.01,
                  "applied": 4}],
    "pairs": [], "safety": {"hold_ms": 500, "ramp_um_per_s": 50}, "provenance": {},
}

#            control   heartbeat   X               applied
READ_DATA = "00 03" " 00 0{}" " 00 12 D6 87" " 00 00 03 F4"


def hexed(text):
    return bytes.fromhex(text)


def talk(tmp_path, exchange, script):
    """Plays request and reply by turns; the bytes of both are given, the transaction counts up."""
    listener = socket.create_server(("127.0.0.1", 0))
    config = json.loads(json.dumps(CONFIG))
    config["plc"]["transport"]["tcp"]["port"] = listener.getsockname()[1]
    config["plc"]["exchange"] = exchange
    path = tmp_path / "coefficients.json"
    path.write_text(json.dumps(config))
    seen = []

    def serve():
        run_before_others()
        connection, _ = listener.accept()
        with connection:
            connection.settimeout(60)
            for number, (request, reply) in enumerate(script, 1):
                transaction = number.to_bytes(2, "big")
                expected = transaction + hexed(request)
                data = b""
                while len(data) < len(expected):
                    more = connection.recv(len(expected) - len(data))
                    if not more:
                        return
                    data += more
                seen.append(data.hex(" "))
                if data != expected:
                    return
                connection.sendall(transaction + hexed(reply))

    thread = threading.Thread(target=serve)
    thread.start()
    with Box(path):
        thread.join(60)
    listener.close()
    return seen, [(n.to_bytes(2, "big") + hexed(request)).hex(" ")
                  for n, (request, _) in enumerate(script, 1)]


def read_reply(beat):
    return "00 00 00 0F 11 03 0C " + READ_DATA.format(beat)


READ = "00 00 00 06 11 03 00 00 00 06"
READ_BACK, NOTHING_YET = "00 00 00 06 11 03 00 64 00 06", "00 00 00 0F 11 03 0C" + " 00" * 12
WRITE = "00 00 00 13 11 10 00 64 00 06 0C {} 00 0{} 00 00 00 00 00 00 03 F4"
WRITE_REPLY = "00 00 00 06 11 10 00 64 00 06"
BOTH = "00 00 00 17 11 17 00 00 00 06 00 64 00 06 0C {} 00 0{} 00 00 00 00 00 00 03 F4"


def both_reply(beat):
    return "00 00 00 0F 11 17 0C " + READ_DATA.format(beat)


RAMP_HEARTBEAT, ACTIVE = "04 03", "00 01"     # reason, mode


TRIES = 20


def check(tmp_path, exchange, script):
    """Where the machine let the box wait for a reply, it asks again, in another frame: then once more."""
    for _ in range(TRIES):
        seen, expected = talk(tmp_path, exchange, script)
        if seen == expected:
            break
    assert seen == expected


def test_fc3_and_fc16_on_the_wire(tmp_path):
    check(tmp_path, "fc3+fc16", [
        (READ, read_reply(1)),
        (READ_BACK, NOTHING_YET),
        (WRITE.format(RAMP_HEARTBEAT, 1), WRITE_REPLY),
        (READ, read_reply(2)),
        (WRITE.format(ACTIVE, 2), WRITE_REPLY),
        (READ, read_reply(3)),
        (WRITE.format(ACTIVE, 3), WRITE_REPLY),
    ])


def test_fc23_on_the_wire(tmp_path):
    """The first reading is by fc3: before it there is nothing to write."""
    check(tmp_path, "fc23", [
        (READ, read_reply(1)),
        (READ_BACK, NOTHING_YET),
        (BOTH.format(RAMP_HEARTBEAT, 1), both_reply(2)),
        (BOTH.format(ACTIVE, 2), both_reply(3)),
        (BOTH.format(ACTIVE, 3), both_reply(4)),
    ])


def test_the_peers_of_the_other_tests_pack_as_written_by_hand():
    """… so that they do not merely agree with the box."""
    assert machine.pack("int32", 1234567) == [0x0012, 0xD687]
    assert machine.pack("int32cdab", 1234567) == [0xD687, 0x0012]
    assert machine.pack("int16", -2) == [0xFFFE]
    assert machine.pack("float32", -1.5) == [0xBFC0, 0x0000]
    assert machine.unpack("int32", [0xFFFF, 0xFC0C]) == -1012
