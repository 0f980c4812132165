# SPDX-License-Identifier: MIT
"""A PLC of raw sockets whose frames are made by hand, and which misbehaves on command."""
import socket
import struct
import threading
import time

import box
import machine


def registers_of(data):
    return list(struct.unpack(f">{len(data) // 2}H", data))


def bytes_of(words):
    return struct.pack(f">{len(words)}H", *words)


class Request:
    """One request frame, taken apart."""

    def __init__(self, frame, number, connection):
        self.frame, self.number, self.connection = frame, number, connection
        self.time_s, self.late_s = time.monotonic(), 0     # late: its answer, beyond what was meant
        self.reading = None                                # the number of the reading that it is answered with
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


class RawPlc:
    """Serves `plc` while the context is open, one connection at a time as small PLCs do.

    fault(request, reply) -> list of what to do instead of sending the reply: bytes to send, a
    number of seconds to wait, or "close"; None for the right reply. Waits are counted from the
    request on, so that one that lasted too long shortens the next ones. It is asked for each
    request; requests are counted over all connections."""

    def __init__(self, plc, port, fault=None, answering=True):
        self.plc, self.port, self.fault, self.answering = plc, port, fault, answering
        self.requests, self.connections = [], 0
        self.failure = None
        self.gaps = []        # (begin, end) in seconds: the process stood still
        self.stopping = False
        self.connection = None

    def __enter__(self):
        self.listener = socket.create_server(("127.0.0.1", self.port), backlog=8)
        self.listener.settimeout(0.02)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        self.pulse = threading.Thread(target=self._feel, daemon=True)
        self.pulse.start()
        return self

    def __exit__(self, kind, *_):
        self.stopping = True
        self.thread.join(60)
        self.pulse.join(60)
        self.listener.close()
        if kind is None and self.failure:
            raise self.failure

    def _feel(self):
        """Notes when this process did not run: nothing of what the box read then counts."""
        box.run_before_others()
        before_s = time.monotonic()
        while not self.stopping:
            time.sleep(0.002)
            now_s = time.monotonic()
            if now_s - before_s > 0.008:
                self.gaps.append((before_s, now_s))
            before_s = now_s

    def _run(self):
        box.run_before_others()
        while not self.stopping:
            try:
                self.connection, _ = self.listener.accept()
            except TimeoutError:
                continue
            self.connections += 1
            self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.connection.settimeout(0.02)
            try:
                self._serve()
            except OSError:
                pass
            except Exception as failure:  # reported when the context closes
                self.failure = failure
            # As a process that is killed: no orderly goodbye.
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.connection.close()

    def _receive(self, count):
        data = b""
        while len(data) < count and not self.stopping:
            try:
                more = self.connection.recv(count - len(data))
            except TimeoutError:
                continue
            if not more:
                return None
            data += more
        return data if len(data) == count else None

    def _serve(self):
        while not self.stopping:
            head = self._receive(6)
            if head is None:
                return
            body = self._receive(struct.unpack(">H", head[4:])[0])
            if body is None:
                return
            request = Request(head + body, len(self.requests), self.connections)
            self.requests.append(request)
            if self.answering and self._respond(request) == "close":
                return

    def _respond(self, request):
        reply = answer(self.plc, request)
        request.reading = len(self.plc.readings) if request.is_cyclic_read else None
        steps = self.fault(request, reply) if self.fault else None
        due_s = request.time_s
        for step in [reply] if steps is None else steps:
            if step == "close":
                return step
            if isinstance(step, bytes):
                self.connection.sendall(step)
            else:
                due_s += step
                time.sleep(max(0, due_s - time.monotonic()))
            request.late_s = max(request.late_s, time.monotonic() - due_s)
        return None
