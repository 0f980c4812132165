# SPDX-License-Identifier: MIT
"""One clock for compbox and fakeplc, which stands while any of them runs (still_clock.c): what a test finds is that of
an idle machine, and it waits for no real time."""

import ctypes
import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARY = os.environ.get("STILL_CLOCK_LIBRARY", str(ROOT / "build/host/tests/cli/libcli_still_clock.so"))


def shared_in(folder):
    """The environment of the programs that run in this folder."""
    path = pathlib.Path(folder).with_suffix(".clock")
    if not path.exists():
        path.write_bytes(bytes(4096))
    return dict(os.environ, LD_PRELOAD=LIBRARY, STILL_CLOCK=str(path))


class Member:
    """The clock of a folder, for threads of the test that pass on what programs send: it waits for them too."""

    def __init__(self, folder):
        self.library = ctypes.CDLL(LIBRARY)
        self.library.still_open(shared_in(folder)["STILL_CLOCK"].encode())

    def received(self, sock):
        """out: what comes; nothing at the end of the stream, or when another test has begun"""
        return b"" if self.library.still_wait_readable(sock.fileno()) else sock.recv(300)

    def accepted(self, listener):
        """out: a connection; None when another test has begun"""
        return None if self.library.still_wait_readable(listener.fileno()) else listener.accept()[0]
