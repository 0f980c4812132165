#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Talks to a fakeplc of the gantry example with pymodbus, a client that is not ours.

usage: fakeplc_peer.py PORT   (exit 0: everything was as expected)
"""
import struct
import sys

from pymodbus.client import ModbusTcpClient


def int32(registers):
    return struct.unpack(">i", struct.pack(">HH", *registers))[0]


def wait_for_scans(client, count):
    """Until the PLC's heartbeat has counted on by so many scans."""
    first = last = client.read_holding_registers(1, 1, slave=1).registers[0]
    while (last - first) % 65536 < count:
        last = client.read_holding_registers(1, 1, slave=1).registers[0]


def main():
    client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=60)
    assert client.connect(), "no connection"

    read = client.read_holding_registers(0, 30, slave=1)
    assert not read.isError() and len(read.registers) == 30, read
    assert int32(read.registers[8:10]) == 42900000, "X stands at 4290 mm, in 0.1 µm"
    assert int32(read.registers[12:14]) == 7500000, "Z stands at 750 mm"

    wait_for_scans(client, 12)

    values = [1, 1, 0, 0] + list(struct.unpack(">HH", struct.pack(">i", 1234))) + [0, 0, 0, 0]
    assert not client.write_registers(100, values, slave=1).isError()
    assert client.read_holding_registers(100, 6, slave=1).registers == values[:6]
    wait_for_scans(client, 3)

    beyond = client.read_holding_registers(100, 50, slave=1)
    assert beyond.isError() and beyond.exception_code == 2, beyond
    coils = client.read_coils(0, 1, slave=1)
    assert coils.isError() and coils.exception_code == 1, coils
    both = client.readwrite_registers(
        read_address=0, read_count=2, write_address=101, write_registers=[7], slave=1
    )
    assert not both.isError() and len(both.registers) == 2, both
    client.close()


if __name__ == "__main__":
    main()
