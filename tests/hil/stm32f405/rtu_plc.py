# SPDX-License-Identifier: MIT
"""A Modbus RTU slave on a unix socket, frames made by hand, that misbehaves on command."""
import pathlib
import socket
import struct
import threading
import time


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)


def framed(unit, pdu):
    body = bytes([unit]) + pdu
    return body + crc(body)


def words_of(data):
    return list(struct.unpack(f">{len(data) // 2}H", data))


def bytes_of(words):
    return struct.pack(f">{len(words)}H", *words)


def request_bytes(data):
    """Length of the request that begins so; None: not known yet; 0: no request of the box begins so."""
    if len(data) < 2:
        return None
    if data[1] == 3:
        return 8
    at = {16: 6, 23: 10}.get(data[1])
    if at is None:
        return 0
    return None if len(data) <= at else at + 3 + data[at]


class RtuPlc:
    """Answers for `units` ({unit: object with read(start, count) and write(start, words)}). fault(frame,
    reply) returns what is sent instead: a list of bytes and pauses in seconds. A server that is closed
    and opened again is a PLC that restarts."""

    def __init__(self, path, units):
        self.path, self.units = str(path), units
        self.fault = None
        self.requests = []          # (time, unit, function) of each whole request
        self.broken = 0             # requests whose check sum was wrong
        self.closing = False

    def __enter__(self):
        self.server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.server.bind(self.path)
        self.server.listen(4)
        self.client = None
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.closing = True
        for one in (self.client, self.server):
            if one:
                try:
                    one.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
                one.close()
        self.thread.join(5)
        pathlib.Path(self.path).unlink(missing_ok=True)

    def _serve(self):
        while not self.closing:
            try:
                self.client, _ = self.server.accept()
                self._talk(self.client)
            except OSError:
                pass

    def _talk(self, client):
        waiting, last_s = b"", 0
        while True:
            got = client.recv(4096)
            if not got:
                return
            if time.monotonic() - last_s > 0.2:
                waiting = b""       # what a restarted master left unfinished
            last_s = time.monotonic()
            waiting += got
            while (size := request_bytes(waiting)) is not None and len(waiting) >= size:
                frame, waiting = waiting[:size], waiting[size:]
                if size > 0 and crc(frame[:-2]) == frame[-2:]:
                    self._handle(client, frame)
                else:               # it listens from the middle of a request on, or a byte is wrong
                    self.broken += 1
                    waiting = b""

    def _handle(self, client, frame):
        unit, function = frame[0], frame[1]
        self.requests.append((time.monotonic(), unit, function))
        if unit not in self.units:
            return
        reply = framed(unit, self._answer(self.units[unit], frame[1:-2]))
        for step in self.fault(frame, reply) if self.fault else [reply]:
            if isinstance(step, bytes):
                client.sendall(step)
            else:
                time.sleep(step)

    @staticmethod
    def _answer(device, pdu):
        function = pdu[0]
        if function == 3:
            start, count = struct.unpack(">HH", pdu[1:5])
            return bytes([3, 2 * count]) + bytes_of(device.read(start, count))
        if function == 16:
            start, count = struct.unpack(">HH", pdu[1:5])
            device.write(start, words_of(pdu[6:]))
            return pdu[:5]
        read_start, count, start, _ = struct.unpack(">HHHH", pdu[1:9])
        device.write(start, words_of(pdu[10:]))
        return bytes([23, 2 * count]) + bytes_of(device.read(read_start, count))
