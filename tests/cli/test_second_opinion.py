# SPDX-License-Identifier: MIT
"""compbox commission: libmodbus' reading of the read block beside the box's."""

import json
import socket
import threading

import still_clock
from commissioning import behind, commission

ONE_AXIS = ("--axis", "X", "--measured", "X=20", "--json")


class Liar:
    """Stands before fakeplc and changes the last register of what the first client reads."""

    def __init__(self, fake):
        self.to, self.clock = fake.port, still_clock.Member(fake.folder)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        number = -1
        while client := self.clock.accepted(self.listener):
            number += 1
            with client, socket.create_connection(("127.0.0.1", self.to)) as server:
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                server.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                while request := self.clock.received(client):
                    server.sendall(request)
                    reply = self.clock.received(server)
                    client.sendall(reply[:-1] + bytes([reply[-1] ^ 0x55]) if number == 0 else reply)


def opinion(compbox, fake):
    code, out, message = commission(compbox, fake, *ONE_AXIS)
    assert code == 0, message
    figures = json.loads(out)
    return figures["registers"]["libmodbus"], figures["remarks"]


def test_both_read_the_same_registers(compbox, plc):
    found, remarks = opinion(compbox, plc())
    read = compbox.read("machine.json")["plc"]["read"]["count"]
    assert found["differing"] == [] and found["compared"] + found["changing"] == read
    assert found["changing"] < 4 < found["compared"]
    assert not any("libmodbus" in remark for remark in remarks)


def test_a_register_that_they_read_differently_is_a_remark(compbox, plc):
    fake = plc()
    behind(compbox, Liar(fake))
    found, remarks = opinion(compbox, fake)
    block = compbox.read("machine.json")["plc"]["read"]
    last = block["start"] + block["count"] - 1
    assert found["differing"] == [last]
    assert f"libmodbus and the box read different values in register {last};" in " ".join(remarks)
