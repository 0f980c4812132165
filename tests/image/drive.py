# SPDX-License-Identifier: MIT
"""A drive with a write cache that loses its power: an NBD server for QEMU, on a Unix socket.

What was written is on the medium only when a flush, or a write with FUA, has been answered; until then it is in
the cache, in the order of its arrival. A power cut leaves of each sector of 512 bytes what is on the medium or
any of the cached versions, as a drive may have written out some of them in any order: acknowledged writes are
lost, requests are torn, later ones survive earlier ones. It may fail by itself between any two requests.

Protocol: github.com/NetworkBlockDevice/nbd/blob/master/doc/proto.md (fixed newstyle, simple replies)."""
import pathlib
import socket
import struct
import threading

SECTOR = 512
MAGIC, OPTION_MAGIC, REPLY_MAGIC = 0x4e42444d41474943, 0x49484156454f5054, 0x3e889045565a9
OPTION_ABORT, OPTION_GO = 2, 7
READ, WRITE, DISCONNECT, FLUSH = 0, 1, 2, 3
FUA = 1
EINVAL = 22


class Drive:
    """`address` is what QEMU connects to while the power is on; what is on the medium stays when it is off."""

    def __init__(self, image, folder, ignores_flush=False):
        self.medium, self.cached = bytearray(pathlib.Path(image).read_bytes()), {}
        self.path = pathlib.Path(folder) / "drive"
        self.address = f"nbd:unix:{self.path}"
        self.ignores_flush = ignores_flush  # a drive that lies
        self.lock, self.on, self.off = threading.Lock(), False, threading.Event()

    def power_on(self):
        self.cached, self.on, self.left = {}, True, None
        self.off.clear()
        self.path.unlink(missing_ok=True)
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.bind(str(self.path))
        self.socket.listen(1)
        threading.Thread(target=self._serve, args=(self.socket,), daemon=True).start()

    def stop_after(self, requests):
        """It answers no more once it has done so many writes and flushes from now on; `off` tells."""
        with self.lock:
            self.left = requests

    def _count(self, kind):
        if self.left is None or kind == READ:
            return
        self.left -= 1
        if self.left == 0:
            self.on = False
            self.off.set()

    def power_cut(self, dice, survives):
        """From now on nothing reaches it. Of each cached sector one of its versions comes to the medium with the
        probability `survives`. out: how many sectors were cached, how many of them lost their last version"""
        with self.lock:
            self.on, lost = False, 0
            for sector, versions in self.cached.items():
                kept = dice.choice(versions) if dice.random() < survives else None
                lost += kept is not versions[-1]
                if kept is not None:
                    self._put(sector, kept)
            self.socket.close()
            return len(self.cached), lost

    def _put(self, sector, data):
        self.medium[sector * SECTOR:(sector + 1) * SECTOR] = data

    def write(self, offset, data, fua=False):
        """out: 0 or an errno"""
        if offset % SECTOR or len(data) % SECTOR or offset + len(data) > len(self.medium):
            return EINVAL
        for i in range(0, len(data), SECTOR):
            sector = (offset + i) // SECTOR
            if fua and not self.ignores_flush:
                self.cached.pop(sector, None)
                self._put(sector, data[i:i + SECTOR])
            else:
                self.cached.setdefault(sector, []).append(data[i:i + SECTOR])
        return 0

    def read(self, offset, length):
        """out: what was written last, cached or not; whole sectors"""
        data = bytearray(self.medium[offset:offset + length])
        for at in range(0, length, SECTOR) if self.cached else ():
            if versions := self.cached.get((offset + at) // SECTOR):
                data[at:at + SECTOR] = versions[-1]
        return bytes(data)

    def flush(self):
        if self.ignores_flush:
            return
        for sector, versions in self.cached.items():
            self._put(sector, versions[-1])
        self.cached.clear()

    def _serve(self, listener):
        """One client, as long as it and the power are there."""
        try:
            client, _ = listener.accept()
            with client:
                if self._negotiate(client):
                    self._transmit(client, listener)
        except OSError:
            pass  # the client is gone

    def _negotiate(self, client):
        """out: true when the client goes on to reading and writing."""
        client.sendall(struct.pack(">QQH", MAGIC, OPTION_MAGIC, 1))  # fixed newstyle
        _take(client, 4)
        while True:
            _, option, length = struct.unpack(">QII", _take(client, 16))
            _take(client, length)
            def answer(kind, data=b""):
                client.sendall(struct.pack(">QIII", REPLY_MAGIC, option, kind, len(data)) + data)
            if option == OPTION_GO:
                flags = 1 | 1 << 2 | 1 << 3  # flags are there; flush; FUA
                answer(3, struct.pack(">HQH", 0, len(self.medium), flags))
                answer(3, struct.pack(">HIII", 3, SECTOR, 4096, 1 << 20))  # block sizes
                answer(1)
                return True
            answer(1 if option == OPTION_ABORT else (1 << 31) + 1)  # acknowledged; not supported
            if option == OPTION_ABORT:
                return False

    def _transmit(self, client, listener):
        while True:
            _, flags, kind, cookie, offset, length = struct.unpack(">IHHQQI", _take(client, 28))
            data = _take(client, length) if kind == WRITE else b""
            if kind == DISCONNECT:
                return
            with self.lock:
                if not self.on or self.socket is not listener:
                    return
                error, answer = self._do(kind, flags, offset, length, data)
                self._count(kind)
                if not self.on:
                    return
            client.sendall(struct.pack(">IIQ", 0x67446698, error, cookie) + answer)

    def _do(self, kind, flags, offset, length, data):
        if kind == READ:
            return 0, self.read(offset, length)
        if kind == FLUSH:
            self.flush()
            return 0, b""
        if kind == WRITE:
            return self.write(offset, data, bool(flags & FUA)), b""
        return EINVAL, b""


def _take(client, count):
    parts = bytearray()
    while len(parts) < count:
        part = client.recv(count - len(parts))
        if not part:
            raise OSError("gone")
        parts += part
    return bytes(parts)
