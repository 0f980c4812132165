# SPDX-License-Identifier: MIT
"""A Debian with systemd in QEMU (tests/packages/debian-guest) that gets the packages from a second disk."""
import json
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[2]
PACKAGES = ROOT / "build/packages"
BUILT = ROOT / "build/debian/guest"

sys.path.insert(0, str(ROOT / "tests/image"))
import guest  # noqa: E402


def coefficients(port, revision, grow_um):
    """The image's machine with its temperatures in registers: fakeplc, which does not know of them, says 0 °C."""
    data = guest.coefficients(port, revision, grow_um)
    del data["can"]
    for register, signal in enumerate(data["signals"][1:3], 14):
        data["signals"][register - 13] = {"name": signal["name"], "unit": "degC", "plc": register, "type": "int16",
                                          "scale": 0.1, "min": -20, "max": 120, "max_age_ms": 3000}
    return data


def make_disk(folder, port, files):
    """A disk with the arm64 packages of both versions, and these coefficient files: {name: (revision, µm)}."""
    content = folder / "content"
    content.mkdir()
    for package in [*PACKAGES.glob("*_arm64.deb"), *PACKAGES.glob("later/*_arm64.deb")]:
        shutil.copy(package, content)
    for name, (revision, grow_um) in files.items():
        (content / name).write_text(json.dumps(coefficients(port, revision, grow_um)))
    disk = folder / "packages.img"
    subprocess.run(["truncate", "-s", "64M", disk], check=True)
    subprocess.run(["mke2fs", "-q", "-t", "ext4", "-d", content, disk], check=True)
    return disk


class Debian(guest.Guest):
    """Its own disk is as tests/packages/debian-guest left it at every start of the emulator."""
    prompt = r"shell of [0-9a-f-]{36}\n(?:.|\n)*?guest: "

    def command(self):
        return [str(word) for word in (
            "qemu-system-aarch64", "-M", "virt", "-cpu", "cortex-a53", "-m", "512", "-icount", "shift=2",
            "-kernel", BUILT / "vmlinuz", "-initrd", BUILT / "initramfs",
            "-append", "console=ttyAMA0 quiet panic=5 systemd.show_status=0 systemd.getty_auto=0",
            "-drive", f"file={BUILT / 'disk.img'},format=raw,if=virtio,snapshot=on",
            "-drive", f"file={self.disk},format=raw,if=virtio,readonly=on",
            "-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile=",
            "-display", "none", "-serial", "stdio",
            "-monitor", f"unix:{self.folder}/monitor,server=on,wait=off")]

    def unit(self, *names):
        """Properties of compboxd's unit as systemd has them."""
        shown = self.run(f"systemctl show compboxd -p {','.join(names)}")
        values = dict(line.split("=", 1) for line in shown.splitlines() if "=" in line)
        return [values[name] for name in names] if len(names) > 1 else values[names[0]]

    def reboot(self):
        since = self.now()
        self.qemu.stdin.write(b"systemctl reboot\n")
        self.qemu.stdin.flush()
        self.wait(self.prompt, 90, since)

    def uptime_s(self):
        return float(self.run("cat /proc/uptime").split()[0])

    def journal(self, lines=1000):
        return self.run(f"journalctl -u compboxd --no-pager -o cat -n {lines}")

    def pid(self):
        return int(self.unit("MainPID"))

    def inside(self, command):
        """A command by root in the daemon's own view of the file system; out: what it says."""
        return self.run(f"nsenter -m -t {self.pid()} sh -c '{command}' 2>&1 || true")
