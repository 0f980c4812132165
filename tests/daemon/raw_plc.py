# SPDX-License-Identifier: MIT
"""A PLC whose frames are made by hand, and which misbehaves on command."""
from frames import Request, answer, size_of_frame
from stage import Stage


class RawPlc:
    """Serves `plc` while the context is open, one connection at a time as small PLCs do.

    fault(request, reply) -> list of what to do instead of sending the reply: bytes to send, a number of seconds to
    wait, or "close"; None for the right reply. It is asked for each request; requests are counted over all
    connections. A request waits for the reply to the one before it."""

    def __init__(self, plc, port, fault=None, answering=True):
        self.plc, self.port, self.fault, self.answering = plc, port, fault, answering
        self.requests, self.connections = [], 0
        self.link, self._waiting, self._busy = None, [], False

    def __enter__(self):
        self.stage = Stage.current
        self.stage.listen(self.port, self)
        return self

    def __exit__(self, *_):
        self.stage.listen(self.port, None)
        for link in [self.link, *self._waiting]:
            if link:
                link.hang_up()

    # ---- of the stage

    def connected(self, link):
        self._waiting.append(link)
        if self.link is None:
            self._next()

    def received(self, link):
        if link is self.link:
            self._serve()

    def closed(self, link):
        if link is not self.link:
            self._waiting.remove(link)
        elif not self._busy:
            self._serve()

    # ---- one connection after the other

    def _next(self):
        self._busy = False
        self.link = self._waiting.pop(0) if self._waiting else None
        self.connections += self.link is not None
        if self.link:
            self._serve()

    def _leave(self):
        self.link.hang_up()
        self._next()

    def _serve(self):
        while self.link and not self._busy:
            size = size_of_frame(self.link.received)
            if not 0 < size <= len(self.link.received):
                break
            frame, self.link.received = self.link.received[:size], self.link.received[size:]
            request = Request(frame, len(self.requests), self.connections, self.stage.now_s)
            self.requests.append(request)
            if self.answering:
                self._respond(request)
        if self.link and self.link.finished and not self._busy:
            self._leave()

    def _respond(self, request):
        reply = self.reply(request)
        parts = self.fault(request, reply) if self.fault else None
        self._busy = True
        self._play(self.link, [reply] if parts is None else list(parts))

    def reply(self, request):
        return answer(self.plc, request)

    def _play(self, link, parts):
        while parts:
            part = parts.pop(0)
            if part == "close":
                self._leave()
                return
            if isinstance(part, bytes):
                link.send(part)
            else:
                self.stage.after(part, lambda: self._play(link, parts))
                return
        if link is self.link:
            self._busy = False
            self._serve()
