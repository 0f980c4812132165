# SPDX-License-Identifier: MIT
"""A PLC of raw sockets whose frames are made by hand, and which misbehaves on command."""
import socket
import struct
import threading
import time

from frames import Request, answer
from realtime import run_before_others


class RawPlc:
    """Serves `plc` while the context is open, one connection at a time as small PLCs do.

    fault(request, reply) -> list of what to do instead of sending the reply: bytes to send, a
    number of seconds to wait, or "close"; None for the right reply. Waits are counted from the
    request on, so that one that lasted too long shortens the next ones. Called for each
    request; requests are counted over all connections."""

    def __init__(self, plc, port, fault=None, answering=True):
        self.plc, self.port, self.fault, self.answering = plc, port, fault, answering
        self.requests, self.connections = [], 0
        self.failure = None
        self.stopping = False
        self.connection = None

    def __enter__(self):
        self.listener = socket.create_server(("127.0.0.1", self.port), backlog=8)
        self.listener.settimeout(0.02)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        return self

    def __exit__(self, kind, *_):
        self.stopping = True
        self.thread.join(60)
        self.listener.close()
        if kind is None and self.failure:
            raise self.failure

    def _run(self):
        run_before_others()
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
            request = Request(head + body, len(self.requests), self.connections, time.monotonic())
            self.requests.append(request)
            if self.answering and self._respond(request) == "close":
                return

    def _respond(self, request):
        reply = answer(self.plc, request)
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
        return None
