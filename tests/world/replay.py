#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The same seed gives the same bytes: what a run sent, wrote and logged has the same hash in another process.
  replay.py WORLD"""

import re
import subprocess
import sys


def hashes(world, seeds):
    text = subprocess.run([world, "--seeds", seeds, "--cycles", "300", "--hash"], check=True, capture_output=True,
                          text=True).stdout
    if not re.search(r"^\d+ cycles, \d+ seeds, 0 violations, \d+ times real time$", text.splitlines()[-1]):
        sys.exit("the last line is not the sum: " + text)
    return re.findall(r"seed \d+: hash ([0-9a-f]{16})", text)


first, again = hashes(sys.argv[1], "1..4"), hashes(sys.argv[1], "1..4")
if first != again:
    sys.exit(f"two runs of the same seeds differ: {first}, {again}")
if len(set(first)) != 4:
    sys.exit(f"four seeds gave equal runs: {first}")
print("4 seeds, each twice: the same bytes")
