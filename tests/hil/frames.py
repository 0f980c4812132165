# SPDX-License-Identifier: MIT
"""Modbus/TCP frames made by hand, and a PLC's answers to them."""
import struct

import machine


def registers_of(data):
    return list(struct.unpack(f">{len(data) // 2}H", data))


def bytes_of(words):
    return struct.pack(f">{len(words)}H", *words)


class Request:
    """One request frame, taken apart."""

    def __init__(self, frame, number, connection, time_s):
        self.frame, self.number, self.connection, self.time_s = frame, number, connection, time_s
        self.transaction, self.protocol, _, self.unit, self.function = struct.unpack(
            ">HHHBB", frame[:8])
        self.start = struct.unpack(">H", frame[8:10])[0]

    @property
    def is_cyclic_read(self):
        """A reading of the read block: the first exchange of a cycle."""
        return self.function in (3, 23) and self.start == machine.READ[0]

    @property
    def is_write(self):
        return self.function in (16, 23)


def answer(plc, request):
    """The right reply."""
    f, data = request.function, request.frame[8:]
    if f != 16 and plc.refuse_reads or f != 3 and plc.refuse_writes:
        return frame_of(request, bytes([f | 0x80, 4]))
    if f == 3:
        start, count = struct.unpack(">HH", data)
        words = plc.read(start, count)
        pdu = bytes([3, 2 * count]) + bytes_of(words)
    elif f == 16:
        start, count, size = struct.unpack(">HHB", data[:5])
        assert size == 2 * count == len(data) - 5
        plc.write(start, registers_of(data[5:]))
        pdu = bytes([16]) + data[:4]
    elif f == 23:
        start, count, write_start, write_count, size = struct.unpack(">HHHHB", data[:9])
        assert size == 2 * write_count == len(data) - 9
        plc.write(write_start, registers_of(data[9:]))
        pdu = bytes([23, 2 * count]) + bytes_of(plc.read(start, count))
    else:
        raise AssertionError(f"function {f} is not one the box may use")
    return frame_of(request, pdu)


def frame_of(request, pdu, transaction=None):
    transaction = request.transaction if transaction is None else transaction
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, request.unit) + pdu


def size_of_frame(data):
    """out: bytes of the first frame; 0 while its length is not known"""
    return 6 + struct.unpack(">H", data[4:6])[0] if len(data) >= 6 else 0
