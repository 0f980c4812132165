# SPDX-License-Identifier: MIT
"""Power cut at random moments while coefficient files are replaced: at every boot the old one or the new one
is active, never none."""
import os
import random
import re
import time

import guest as g
from figures import note

CUTS = int(os.environ.get("COMPBOX_CUTS", "50"))

# New files one after the other; what is said on the console is known to the host at once.
WRITER = r"""i=%d; while :; do i=$((i+1)); echo "writing $i"; sed "s/\"revision\": [0-9]*/\"revision\": $i/" """ \
         r"""/data/coefficients.json >/tmp/next; compbox-put - </tmp/next && echo "written $i"; done"""


def test_the_old_file_or_the_new_one(tmp_path, fresh_disk, port):
    disk = tmp_path / "disk.img"
    disk.write_bytes(fresh_disk.read_bytes())
    dice = random.Random(7)
    known, tried, mid_write, replaced = 1, 1, 0, 0
    guest = g.Guest(disk, tmp_path)
    for cut in range(CUTS + 1):
        guest.power_on()
        try:
            active = int(guest.wait(r"emulated, revision (\d+), 2 terms", 60)[1])
            assert known <= active <= tried, f"boot {cut}: {active} is neither {known} nor {tried}"
            if cut == CUTS:
                break
            guest.wait(r"[~#] #|~ #", 60)
            guest.qemu.stdin.write((WRITER % active + "\n").encode())
            guest.qemu.stdin.flush()
            guest.wait(rf"\nwriting {active + 1}\n", 60)
            time.sleep(dice.uniform(0, 3))
        finally:
            guest.power_cut()
        known = max([active] + [int(n) for n in re.findall(r"\nwritten (\d+)\n", guest.text)])
        tried = max([active] + [int(n) for n in re.findall(r"\nwriting (\d+)\n", guest.text)])
        mid_write += tried > known
        replaced += tried > active
    note("power cuts; of them while a file was on its way", f"{CUTS}; {mid_write}", "at least 50")
    assert mid_write > CUTS / 4, "the cuts must meet the writing"
