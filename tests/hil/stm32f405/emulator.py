# SPDX-License-Identifier: MIT
"""compbox-stm32f405 in qemu-system-arm, its three serial ports on unix sockets."""
import os
import pathlib
import re
import socket
import struct
import subprocess
import threading
import time
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[3]
IMAGE = os.environ.get("IMAGE", str(ROOT / "build/stm32f405/bin/compbox-stm32f405.elf"))
TEST_IMAGE = os.environ.get("TEST_IMAGE", IMAGE.replace(".elf", "-test.elf"))  # with the commands `crash`
SLOTS = {"A": 0x08020000, "B": 0x08040000}
ERASED = b"\xff" * (128 * 1024)


def packed(text, revision, text_sum=None, header_sum=None, report=(0, 0, 0, 0)):
    """A slot as docs/coefficient-file.md says, by our own arithmetic; sums may be planted. report: status
    register, unit, line, baud."""
    text = text if isinstance(text, bytes) else text.encode()
    head = struct.pack("<4sIIIHBBI4x", b"CBX1", revision, len(text),
                       zlib.crc32(text) if text_sum is None else text_sum, *report)
    return head + struct.pack("<I", zlib.crc32(head) if header_sum is None else header_sum) + text


class Console:
    """Reads lines in the background; command() types one."""

    def __init__(self, path):
        self.lines, self.lock = [], threading.Lock()
        self.socket = connected(path)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        waiting = b""
        while True:
            try:
                got = self.socket.recv(4096)
            except OSError:
                return
            if not got:
                return
            *whole, waiting = (waiting + got).split(b"\n")
            with self.lock:
                self.lines += [line.decode("ascii", "replace").rstrip("\r") for line in whole]

    def command(self, line):
        self.socket.sendall(line.encode() + b"\n")

    def wait(self, pattern, since=0, timeout_s=300):
        """The first line from `since` on that fits; fails with what came."""
        until = time.monotonic() + timeout_s
        while True:
            with self.lock:
                lines = self.lines[since:]
            for line in lines:
                if re.search(pattern, line):
                    return line
            assert time.monotonic() < until, f"never came: {pattern}\n" + "\n".join(lines[-30:])
            time.sleep(0.02)

    def mark(self):
        with self.lock:
            return len(self.lines)


def connected(path, timeout_s=300):
    until = time.monotonic() + timeout_s
    while True:
        try:
            client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            client.connect(str(path))
            return client
        except OSError:
            client.close()
            assert time.monotonic() < until, f"the emulator does not open {path}"
            time.sleep(0.02)


class Box:
    """Runs the image with these slots ({"A": bytes}); the emulator waits for the console. plc and
    bus: sockets of servers, or None for an unplugged cable. image: IMAGE or TEST_IMAGE."""

    def __init__(self, folder, slots=None, plc=None, bus=None, image=IMAGE):
        self.folder = pathlib.Path(folder)
        self.console_path = self.folder / "console.sock"
        self.arguments = ["qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none"]
        for name, path in (("plc", plc), ("bus", bus)):
            self.arguments += ["-chardev", f"socket,id={name},path={path},reconnect=1" if path
                               else f"null,id={name}", "-serial", f"chardev:{name}"]
        self.arguments += ["-serial", f"unix:{self.console_path},server=on,wait=on", "-kernel", image]
        for name, content in {**{"A": ERASED, "B": ERASED}, **(slots or {})}.items():
            file = self.folder / f"slot{name}.bin"
            file.write_bytes(content)
            self.arguments += ["-device", f"loader,file={file},addr={SLOTS[name]:#x},force-raw=on"]

    def __enter__(self):
        self.process = subprocess.Popen(self.arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.console = Console(self.console_path)
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.console.socket.close()
