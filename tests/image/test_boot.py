# SPDX-License-Identifier: MIT
"""Boots of their own: in real time beside cyclictest, and by UEFI firmware."""
import re
import time

import guest as g
from figures import note


def test_jitter_beside_cyclictest(tmp_path, fresh_disk, port):
    """The loop's wake-ups and cyclictest's, at the same time, period and priority, in the same guest, whose time
    is real here. An emulator on a shared machine is no real-time system: the figures are compared, not judged."""
    disk = tmp_path / "disk.img"
    disk.write_bytes(fresh_disk.read_bytes())
    with g.FakePlc(port, tmp_path), g.Guest(disk, tmp_path, real_time=True) as guest:
        guest.wait("revision 1, 2 terms", 60)
        out = guest.run("LD_LIBRARY_PATH=/opt/test /opt/test/cyclictest -q -m -p 80 -i 30000 -l 1000 -h 40000", 90)
        ours = guest.wait_stats(lambda s: s["jitter_us"]["count"] > 900)["jitter_us"]
    counts = [(int(us), int(n)) for us, n in re.findall(r"^(\d{6}) (\d{6})", out, re.M)]
    total = sum(n for _, n in counts)
    assert total > 900
    def percentile(p):
        seen = 0
        for us, n in counts:
            seen += n
            if seen >= p * total:
                return us
    for name, p in (("p50", 0.5), ("p99", 0.99)):
        note(f"wake-up after its tick, {name}, µs, guest in real time",
             f"compboxd {ours[name]:.0f}, cyclictest {percentile(p)}", "–")
    assert ours["p50"] <= 3 * percentile(0.5) + 1000


def test_it_boots_by_uefi(tmp_path, fresh_disk, port):
    """As on a board with UEFI firmware: one EFI program of the disk, no kernel given from outside."""
    firmware = g.WORK / "test-packages/efi/usr/share/qemu-efi-aarch64/QEMU_EFI.fd"
    disk = tmp_path / "disk.img"
    disk.write_bytes(fresh_disk.read_bytes())
    with g.FakePlc(port, tmp_path) as plc, g.Guest(disk, tmp_path, efi=firmware) as guest:
        plc.wait(lambda s: s["mode"] == "1", 90)
        note("the same through UEFI firmware, s", f"{time.monotonic() - guest.on_s:.1f} by the clock, "
             f"{guest.cpu_s():.1f} of processor time", "–")
