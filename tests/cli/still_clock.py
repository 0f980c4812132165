# SPDX-License-Identifier: MIT
"""One clock for compbox, compboxd and fakeplc, which stands while any of them runs (still_clock.c): what a test finds
is that of an idle machine, and it waits for no real time."""

import contextlib
import ctypes
import functools
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


@functools.lru_cache(None)
def library():
    return ctypes.CDLL(LIBRARY)


@contextlib.contextmanager
def entered(folder):
    """A thread of the test acts on the programs of this folder: their clock stands but where it waits, in wait_for_more
    and sleep."""
    library().still_enter(shared_in(folder)["STILL_CLOCK"].encode())
    try:
        yield
    finally:
        library().still_leave()


def wait_for_more(stream):
    """Waits for what a program writes. Without effect for a thread that has not entered."""
    library().still_wait_here(stream.fileno())


def sleep(seconds):
    library().still_sleep(ctypes.c_int64(int(seconds * 1e9)))


class Member:
    """The clock of a folder, for threads of the test that pass on what programs send: it waits for them too."""

    def __init__(self, folder):
        self.library = library()
        self.library.still_open(shared_in(folder)["STILL_CLOCK"].encode())

    def received(self, sock):
        """out: what comes; nothing at the end of the stream, or when another test has begun"""
        return b"" if self.library.still_wait_readable(sock.fileno()) else sock.recv(300)

    def accepted(self, listener):
        """out: a connection; None when another test has begun"""
        return None if self.library.still_wait_readable(listener.fileno()) else listener.accept()[0]
