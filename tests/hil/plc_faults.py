# SPDX-License-Identifier: MIT
"""What a PLC may do instead of the right reply: each takes a request and that reply, and returns parts for a RawPlc."""
from frames import frame_of


def late(_, reply):
    return [0.033, reply]


def dribble(_, reply):
    steps = []
    for byte in reply:
        steps += [bytes([byte]), 0.033 / len(reply)]
    return steps


def wrong_id(request, reply):
    return [frame_of(request, reply[7:], transaction=request.transaction ^ 0x5500)]


def wrong_unit(request, reply):
    return [reply[:6] + bytes([request.unit ^ 5]) + reply[7:]]


def exception(request, _):
    return [frame_of(request, bytes([request.function | 0x80, 6]))]


def other_length(request, reply):
    return [frame_of(request, reply[7:-2])]


def stops_short(_, reply):
    return [reply[:9]]


def closes(_, __):
    return ["close"]


def closes_in_mid_reply(_, reply):
    return [reply[:9], "close"]


def garbage(_, __):
    return [b"\x15\x03\x03\x00\x02\x02\x28"]


def twice(_, reply):
    return [reply + reply]
