# SPDX-License-Identifier: MIT
"""The image in QEMU: a shell on its serial line, its power switch, and its network towards the host."""
import csv
import io
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import threading
import time

ROOT = pathlib.Path(__file__).parents[2]
WORK = ROOT / "build/image"
OUT = WORK / "test"
SLOW = float(os.environ.get("COMPBOX_SLOW", "6"))  # how much slower than an idle machine is tolerated

# Temperatures over CAN, a lag, and a register map that fakeplc shows with --map.
COEFFICIENTS = {
    "format": "compbox/1", "revision": 1,
    "machine": {"name": "emulated", "axes": ["X", "Z"]},
    "cycle": {"period_ms": 30},
    "plc": {"profile": "generic", "transport": {"tcp": {"host": "10.0.2.2", "port": 0}},
            "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16},
            "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,
            "heartbeat_timeout_ms": 1000},
    "can": {"interface": "can0",
            "nodes": [{"node": 5, "start": True, "heartbeat_timeout_ms": 3000}]},
    "signals": [
        {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -10, "max": 1010,
         "max_age_ms": 500},
        {"name": "T1", "unit": "degC", "can": "0x185", "type": "int16le", "scale": 0.1, "min": -20,
         "max": 120, "max_age_ms": 3000},
        {"name": "T2", "unit": "degC", "can": "0x18FEEE05", "offset": 2, "type": "uint16le", "scale": 0.1,
         "min": 0, "max": 120, "max_age_ms": 3000},
        {"name": "T1_slow", "unit": "degC", "lag_of": "T1", "tau_s": 4},
        {"name": "T1_memory", "unit": "degC", "lag_of": "T1", "tau_s": 600},
    ],
    "terms": [
        {"name": "GROW", "type": "linear", "inputs": ["T1", "T1_slow"], "weights": [1, 1], "constant": -40},
        {"name": "TILT", "type": "polynomial", "signal": "T2", "coefficients": [0, 1]},
    ],
    "channels": [{"name": "Z", "sum": ["GROW", "TILT"], "limit_um": 300, "error_um": 400,
                  "slew_um_per_s": 500, "plc": 104, "type": "int32", "scale": 0.01, "applied": 24}],
    "safety": {"hold_ms": 500, "ramp_um_per_s": 100},
}


def coefficients(port, revision=1, grow_um=0):
    data = json.loads(json.dumps(COEFFICIENTS))
    data["plc"]["transport"]["tcp"]["port"] = port
    data["revision"] = revision
    data["terms"][0]["constant"] += grow_um
    return data


def wanted_um(t1, t1_slow, t2, grow_um=0):
    return -(t1 + t1_slow - 40 + grow_um + t2)


def make_disk(disk, port):
    """A disk of scripts/image whose data partition holds this machine's files."""
    folder = OUT / "data"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "coefficients.json").write_text(json.dumps(coefficients(port)))
    (folder / "settings").write_text("NETWORK_ADDRESS=10.0.2.15/24\nCAN_BITRATE=250000\nCAN_RESTART_MS=100\n"
                                     "COMPBOXD_OPTIONS=\n")
    subprocess.run([ROOT / "scripts/image", "-o", OUT, "--data", folder], check=True,
                   stdout=subprocess.DEVNULL)
    shutil.copy(OUT / "compbox-arm64.img", disk)
    subprocess.run([ROOT / "tests/image/overlay", OUT / "overlay"], check=True, stdout=subprocess.DEVNULL)
    with open(OUT / "initramfs.test", "wb") as both:
        both.write((OUT / "initramfs").read_bytes() + (OUT / "overlay").read_bytes())


class Guest:
    """The guest's time counts instructions, 4 ns each, unless real_time: so a busy host makes it slow, not
    late, and what is tested is the image and not the load of the test machine."""
    prompt = r"BusyBox v(?:.|\n)*\x1b\[6n"

    def __init__(self, disk, folder, efi=None, real_time=False):
        """in: disk, a file or a Drive, whose power is the user's business"""
        self.disk, self.folder, self.efi, self.real_time = disk, pathlib.Path(folder), efi, real_time
        self.text, self.lock, self.serial = "", threading.Condition(), 0

    def __enter__(self):
        self.power_on()
        return self

    def __exit__(self, *_):
        self.power_cut()

    def command(self):
        boot = ["-kernel", OUT / "vmlinuz", "-initrd", OUT / "initramfs.test",
                "-append", "console=ttyAMA0 quiet panic=5"]
        if not self.real_time:
            boot += ["-icount", "shift=2"]
        if self.efi:
            boot = ["-bios", self.efi, "-boot", "menu=on,splash-time=0"]  # its menu waits for nobody
        return [str(word) for word in (
            "qemu-system-aarch64", "-M", "virt", "-cpu", "cortex-a53", "-smp", "2",
            "-m", "512" if self.efi else "256", *boot, "-no-reboot",
            "-drive", f"file={getattr(self.disk, 'address', self.disk)},format=raw,if=none,id=disk,cache=writeback",
            "-device", "virtio-blk-pci,drive=disk",
            "-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile=",
            "-object", "can-bus,id=bus", "-device", "kvaser_pci,canbus=bus", "-device", "kvaser_pci,canbus=bus",
            "-device", "i6300esb", "-display", "none", "-serial", "stdio",
            "-monitor", f"unix:{self.folder}/monitor,server=on,wait=off")]

    def power_on(self):
        (self.folder / "monitor").unlink(missing_ok=True)
        with self.lock:
            self.text = ""
        self.on_s = time.monotonic()
        self.qemu = subprocess.Popen(self.command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                     stderr=subprocess.STDOUT)
        self.listener = threading.Thread(target=self._listen, args=(self.qemu.stdout,), daemon=True)
        self.listener.start()

    def _listen(self, pipe):
        while chunk := os.read(pipe.fileno(), 4096):
            with self.lock:
                self.text += chunk.decode(errors="replace").replace("\r", "")
                self.lock.notify_all()

    def power_cut(self):
        """`quit` in the monitor: nothing in the guest hears of it."""
        if self.qemu.poll() is None:
            try:
                with socket.socket(socket.AF_UNIX) as monitor:
                    monitor.connect(f"{self.folder}/monitor")
                    monitor.sendall(b"quit\n")
                    self.qemu.wait(20)
            except (OSError, subprocess.TimeoutExpired):
                self.qemu.kill()
        self.qemu.wait()
        self.listener.join()  # what the guest printed last counts too

    def cpu_s(self):
        """Processor time that the emulator took so far: does not depend on who else computes."""
        fields = pathlib.Path(f"/proc/{self.qemu.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def wait(self, pattern, timeout_s=30, since=0):
        """Waits for a text on the serial line; out: the match."""
        until = time.monotonic() + timeout_s * SLOW
        with self.lock:
            while not (found := re.search(pattern, self.text[since:])):
                left = until - time.monotonic()
                if left <= 0 or (self.qemu.poll() is not None and not self.lock.wait(1)):
                    raise AssertionError(f"{pattern!r} never came; the last that did:\n{self.text[-3000:]}")
                self.lock.wait(left)
        return found

    def now(self):
        """This moment, as a place in the text: what is logged from here on."""
        with self.lock:
            return len(self.text)

    def wait_reset(self):
        """Waits until the hardware reset the machine. That ends QEMU (-no-reboot), and this powers it on again:
        the emulated SJA1000 keeps the write pointer of its FIFO over a reset and is deaf when it was not at 0."""
        self.qemu.wait(60 * SLOW)
        self.power_cut()
        self.power_on()
        self.wait(r"revision \d+, 2 terms", 60)

    def type(self, line):
        self.qemu.stdin.write(line.encode() + b"\n")
        self.qemu.stdin.flush()

    def run(self, command, timeout_s=20):
        """A command in the guest's shell; out: its output. Fails when it does."""
        self.serial += 1
        self.wait(self.prompt, 60)  # before the first one it reads nothing
        since = self.now()
        # The echo of the command holds "$?" and a quote, so only the answer has these marks.
        self.type(f'echo @"{self.serial}>"; {command}; echo @{self.serial}:$?@')
        done = self.wait(rf"@{self.serial}>\n((?:.|\n)*)@{self.serial}:(\d+)@", timeout_s, since)
        output = done[1]
        output = re.sub(r"^compboxd: +[0-9.]+ s: .*\n", "", output, flags=re.M)  # the log goes to the same line
        assert done[2] == "0", f"{command}: {output}"
        return output

    def stats(self):
        """The daemon's statistics; they are written every 5 s."""
        text = self.run("cat /run/compboxd/stats.json")
        return json.loads(text[text.index("{"):text.rindex("}") + 1])

    def wait_stats(self, condition, timeout_s=30):
        """Waits until statistics of completed cycles are so; out: the statistics."""
        until = time.monotonic() + timeout_s * SLOW
        while time.monotonic() < until:
            stats = self.stats()
            if stats["elapsed_s"] > 0 and condition(stats):
                return stats
            time.sleep(0.5)
        raise AssertionError(f"the statistics never came to that: {json.dumps(stats, indent=1)[:3000]}")


class FakePlc:
    """fakeplc on the host; commands in, answers out."""

    def __init__(self, port, folder):
        map_file = pathlib.Path(folder) / "map.json"
        map_file.write_text(json.dumps(coefficients(port)))
        self.log = pathlib.Path(folder) / "plc.csv"
        self.arguments = [str(ROOT / "build/host/bin/fakeplc"), "--profile", "generic", "--log", str(self.log),
                          "--listen", f"127.0.0.1:{port}", "--map", str(map_file)]

    def __enter__(self):
        self.process = subprocess.Popen(self.arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert "listening" in self.process.stdout.readline()
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def command(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().strip()
        assert answer.startswith("ok"), answer
        return dict(word.split("=", 1) for word in answer.split() if "=" in word)

    def wait(self, condition, timeout_s=30):
        """Waits until the status is so; out: the status."""
        until = time.monotonic() + timeout_s * SLOW
        while time.monotonic() < until:
            status = self.command("status")
            if condition(status):
                return status
            time.sleep(0.02)
        raise AssertionError(f"never came; the last status was {status}")

    def wait_um(self, um, within=0.5, timeout_s=30):
        """Waits until a box that is there compensates so much: a dead one leaves its last status behind."""
        return self.wait(lambda s: s["alive"] == "1" and s["mode"] == "1" and
                         abs(float(s["applied_Z"]) - um) < within, timeout_s)

    def now_s(self):
        return float(self.command("status")["time_s"])

    def scans(self, from_s, to_s):
        """What the control did in each scan between two of its times, from its log."""
        until = time.monotonic() + 10 * SLOW
        while time.monotonic() < until:  # it is flushed once a second
            text = self.log.read_text()
            rows = list(csv.DictReader(io.StringIO(text[:text.rfind("\n") + 1])))
            if rows and float(rows[-1]["time_s"]) >= to_s:
                return [row for row in rows if from_s <= float(row["time_s"]) <= to_s]
            time.sleep(0.2)
        raise AssertionError(f"{self.log} does not reach {to_s} s")
