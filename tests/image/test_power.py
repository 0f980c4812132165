# SPDX-License-Identifier: MIT
"""Power cut at random moments while coefficient files are replaced: at every boot the old one or the new one
is active, never none; and what compbox-put called done is done. The drive loses its write cache (drive.py)."""
import collections
import concurrent.futures
import os
import random
import re
import time

import pytest

import guest as g
from drive import Drive
from figures import note

CUTS = int(os.environ.get("COMPBOX_CUTS", "50"))
MACHINES = 2  # at the same time, one for each processor

# New files one after the other; what is printed on the console is known to the host at once.
WRITER = r"""i=%d; while :; do i=$((i+1)); echo "writing $i"; sed "s/\"revision\": [0-9]*/\"revision\": $i/" """ \
         r"""/data/coefficients.json >/tmp/next; compbox-put - </tmp/next && echo "written $i"; done"""


class Box:
    """A box whose power is cut again and again, and what it reported."""

    def __init__(self, image, folder, seed, ignores_flush=False):
        folder.mkdir()
        self.dice, self.drive = random.Random(seed), Drive(image, folder, ignores_flush)
        self.guest = g.Guest(self.drive, folder)
        self.known = self.tried = 1  # revision that must be there; that may be there
        self.count = collections.Counter()

    def power_on(self):
        self.drive.power_on()
        self.guest.power_on()

    def boot(self):
        """The daemon is up with a file that may be there; out: its revision."""
        self.power_on()
        active = int(self.guest.wait(r"emulated, revision (\d+), 2 terms", 60)[1])
        known, tried = self.known, self.tried
        assert known <= active <= tried, f"after {self.count}: {active} is neither {known} nor {tried}"
        return active

    def write(self, active):
        """Files are written one after the other from now on."""
        self.guest.wait(r"[~#] #|~ #", 60)
        self.guest.type(WRITER % active)
        self.guest.wait(rf"\nwriting {active + 1}\n", 60)

    def cut(self, survives=None):
        survives = self.dice.choice((0, 0.5, 0.9)) if survives is None else survives
        cached, lost = self.drive.power_cut(self.dice, survives)
        self.guest.power_cut()
        self.count.update(cuts=1, cached=cached, lost=lost, lossy=lost > 0)

    def cut_while_writing(self):
        """Between two of the drive's requests, about ten of which make one new file; now and then by the clock."""
        active = self.boot()
        self.write(active)
        if self.dice.random() < 0.8:
            self.drive.stop_after(self.dice.randint(1, 25))
            assert self.drive.off.wait(60 * g.SLOW)
        else:
            time.sleep(self.dice.uniform(0, 2))
        self.cut()
        self.known = max([active] + [int(n) for n in re.findall(r"\nwritten (\d+)\n", self.guest.text)])
        self.tried = max([active] + [int(n) for n in re.findall(r"\nwriting (\d+)\n", self.guest.text)])
        self.count.update(mid_write=self.tried > self.known)

    def cut_while_starting(self):
        """The power comes and goes again while the journal is replayed, or soon after."""
        self.power_on()
        self.drive.stop_after(self.dice.randint(1, 12))
        while not self.drive.off.wait(0.1) and "2 terms" not in self.guest.text:
            assert time.monotonic() < self.guest.on_s + 60 * g.SLOW
        self.count.update(starting=self.drive.off.is_set())
        self.cut()

    def live(self, cuts):
        try:
            for cut in range(cuts):
                self.cut_while_writing()
                if cut % 5 == 0:
                    self.cut_while_starting()
            self.boot()
        finally:
            self.guest.power_cut()
        return self.count


def test_the_old_file_or_the_new_one(tmp_path, fresh_disk):
    with concurrent.futures.ThreadPoolExecutor(MACHINES) as pool:
        lives = [pool.submit(Box(fresh_disk, tmp_path / str(seed), seed).live, (CUTS + MACHINES - 1 - seed) // MACHINES)
                 for seed in range(MACHINES)]
        total = sum((life.result() for life in lives), collections.Counter())
    note("power cuts while files are written; of them before the file was done", f"{CUTS}; {total['mid_write']}",
         "at least 50")
    note("cuts at which the drive lost acknowledged writes; sectors in its cache, lost",
         f"{total['lossy']}; {total['cached']}, {total['lost']}", "–")
    note("further cuts while the box starts, in its first twelve writes", f"{total['starting']}", "–")
    assert total["mid_write"] > CUTS / 4, "the cuts must meet the writing"
    assert total["lossy"] > CUTS / 4, "the cuts must meet a cache"


def test_a_drive_that_lies_is_found_out(tmp_path, fresh_disk):
    """What the test above can see: a drive that answers a flush and does nothing loses what was called done."""
    box = Box(fresh_disk, tmp_path / "liar", 1, ignores_flush=True)
    try:
        box.write(box.boot())
        box.guest.wait(r"\nwritten 3\n", 60)
        box.cut(survives=0)
        box.known = box.tried = 3
        with pytest.raises(AssertionError, match="is neither"):
            box.boot()
    finally:
        box.guest.power_cut()
