#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: the dearest steps that the search found (found.txt), in instructions of a Cortex-M4F, against their limits.
  worst.py RUN PROGRAM            plays each sequence of found.txt; prints used / limit
  worst.py --cycle RUN PROGRAM    plays the dearest step of the reference load to PROGRAM, which judges whole cycles
  worst.py --self-test RUN PROGRAM  checks that a dearer step and a changed sequence are noticed
  worst.py --search RUN PROGRAM [--seed S] [--tries N] [--files N] [--row TEXT] [--write]
                                  searches dearer ones, from random sequences and from the known ones, and over
                                  N files at the limits of the loader; exit 1 beyond a limit
RUN is cmake/cortex-m4/run. A sequence of events means the same in every run (play.h); so does a seed."""

import argparse
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile

import limit_file

HERE = pathlib.Path(__file__).resolve().parent
FOUND = HERE / "found.txt"
REFERENCE = HERE.parent / "instructions/reference_load.py"
FIRST, LATER, RELOADED = range(3)  # enum play_kind
LARGEST_TEXT = 131072 - 32         # CB_MAX_TEXT_BYTES
EVENT_BYTES = 10 + 64 + 16 + 16    # struct play_event
# What is printed: file, kind of step, limit. docs/results/speed.md has the same rows.
ROWS = {"reference load, first step": ("reference", FIRST, 20500),
        "reference load, any later step": ("reference", LATER, 25000),
        "reference load, step after a reload": ("reference", RELOADED, 25000),
        "own breaks, first step": ("own breaks", FIRST, 23000),
        "own breaks, any later step": ("own breaks", LATER, 28000),
        "own breaks, step after a reload": ("own breaks", RELOADED, 28000),
        "dearest file found, any step": ("limits", LATER, 1500000)}


def text_of(file, shape=None):
    """out: the coefficient file of a row, as bytes; `limits`: of that shape, or of the dearest one"""
    if file == "limits":
        return limit_file.make(shape or limit_file.DEAREST).encode()
    options = ["--own-breaks"] if file == "own breaks" else []
    return subprocess.run([sys.executable, REFERENCE, *options], capture_output=True, check=True).stdout


def emulate(emulator, text, job, events):
    """in : job, kind, seed, tries and rtu as of struct job. out: the ended program"""
    with tempfile.TemporaryDirectory() as folder:
        loaded = []
        job_bytes = struct.pack("<5I", *job, len(events) // EVENT_BYTES) + events
        for name, content, at in (("file", text, 0x080A0000), ("job", job_bytes, 0x080C0000)):
            path = pathlib.Path(folder, name)
            path.write_bytes(content)
            loaded += ["-device", f"loader,file={path},addr={at:#x},force-raw=on"]
        return subprocess.run([*emulator, "-icount", "shift=5", *loaded], capture_output=True, text=True, check=False)


def run(emulator, text, job, events):
    """out: (instructions, events): those of the dearest step of job's kind; 0: the file is refused"""
    if len(text) > LARGEST_TEXT:
        return 0, events
    done = emulate(emulator, text, job, events)
    count = re.search(r"^count (\d+)", done.stdout, re.M)
    found = re.search(r"^events (\w+)", done.stdout, re.M)
    if not count and "refused" not in done.stdout:
        sys.exit(f"worst.py: {done.stdout}{done.stderr}")
    return int(count[1]) if count else 0, bytes.fromhex(found[1]) if found else events


def read_found():
    """out: {row: events} of found.txt"""
    found, row = {}, ""
    for line in FOUND.read_text().splitlines() if FOUND.exists() else []:
        if line.startswith("["):
            row = line.strip("[]")
        elif not line.startswith("#"):
            found[row] = found.get(row, b"") + bytes.fromhex(line)
    return found


def write_found(found):
    lines = ["# Sequences of events (play.h) in hexadecimal, by worst.py --search --write"]
    for row in ROWS:
        digits = found.get(row, b"").hex()
        lines += [f"[{row}]", *(digits[i:i + 116] for i in range(0, len(digits), 116))]
    FOUND.write_text("\n".join(lines) + "\n")


def played(emulator, row, events):
    file, kind, _ = ROWS[row]
    return run(emulator, text_of(file), (kind, 1, 0, file == "limits"), events)[0]


def judge(counts):
    """in : {row: instructions}. out: whether each is a step, and within its limit; prints used / limit"""
    good = True
    for row, used in counts.items():
        limit = ROWS[row][2]
        good = good and 0 < used <= limit
        print(f"{row:44} {used:7} / {limit:7}" + ("" if 0 < used <= limit else "  OVER" if used else "  NO STEP"))
    return good


def cycle(emulator):
    row = "reference load, any later step"
    done = emulate(emulator, text_of(ROWS[row][0]), (LATER, 1, 0, 0), read_found()[row])
    print(done.stdout, end="")
    return done.returncode == 0


def self_test(emulator):
    """A sequence of no events has no such step; one whose last event is calm is not the dearest any more."""
    row = "reference load, any later step"
    events = read_found()[row]
    known = played(emulator, row, events)
    calm = played(emulator, row, events[:-EVENT_BYTES] + bytes(EVENT_BYTES))
    if judge({row: ROWS[row][2] + 1}) or judge({row: played(emulator, row, b"")}):
        sys.exit("worst.py: a step beyond its limit, or no step, was accepted")
    if calm >= known:
        sys.exit(f"worst.py: a calm last event costs {calm}, the dearest {known}")
    print(f"a calm last event costs {calm} of {known}; 2 of 2 planted faults found")
    return True


# ---- search ----

def starts(row, found):
    """out: sequences to begin with: none, the known one, and those of neighbouring rows as a step of this kind"""
    def group(name):
        return ROWS[name][0] == "limits", ROWS[name][1] == FIRST

    kind = ROWS[row][1]
    yield b""
    for events in [found[other] for other in ROWS if found.get(other) and group(other) == group(row)]:
        last = bytearray(events[-EVENT_BYTES:])
        last[4] = last[4] | 16 if kind == RELOADED else last[4] & ~16  # PLAY_RELOAD
        yield events[:-EVENT_BYTES] + bytes(last)


def search_row(emulator, row, found, options):
    """out: (instructions, events) of the dearest step that was met"""
    file, kind, _ = ROWS[row]
    text, best = text_of(file), (0, b"")
    tries = options.tries // 100 if file == "limits" else options.tries  # its steps are fifty times as long
    for events in starts(row, found):
        best = max(best, run(emulator, text, (kind, options.seed, tries, file == "limits"), events))
    return best


def search_files(emulator, events, options):
    """Changes the shape of a file at the limits, and keeps what makes a step dearer; each file is searched shortly.
    out: (instructions, shape) of the dearest file that was met"""
    dice = random.Random(options.seed)
    job = (LATER, options.seed, 12, 1)
    best = here = (run(emulator, text_of("limits"), job, events)[0], limit_file.DEAREST)
    for _ in range(options.files):
        shape = limit_file.change(dice, here[1])
        count = run(emulator, text_of("limits", shape), job, events)[0]
        if count >= 0.97 * here[0]:
            here = (count, shape)
        if count > best[0]:
            best = here
    return best


def search(emulator, options):
    found, counts = read_found(), {}
    for row in ROWS:
        if options.row not in row:
            continue
        known = played(emulator, row, found[row]) if row in found else 0
        count, events = search_row(emulator, row, found, options)
        counts[row] = max(count, known)
        if count > known:
            print(f"{row}: found {count}, known {known}", flush=True)
            found[row] = events
    if options.write:
        write_found(found)
    row = list(ROWS)[-1]
    if options.files and options.row in row:
        count, shape = search_files(emulator, found[row], options)
        counts[row] = max(count, counts[row])
        print(f"files: {options.files} tried; {count} instructions of {shape}")
    return judge(counts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--search", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--cycle", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tries", type=int, default=4000)
    parser.add_argument("--files", type=int, default=40)
    parser.add_argument("--row", default="")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("emulator", nargs=2, metavar="RUN PROGRAM")
    options = parser.parse_args()
    if options.self_test:
        return 0 if self_test(options.emulator) else 1
    if options.cycle:
        return 0 if cycle(options.emulator) else 1
    if options.search:
        return 0 if search(options.emulator, options) else 1
    found = read_found()
    return 0 if judge({row: played(options.emulator, row, found[row]) for row in ROWS}) else 1


if __name__ == "__main__":
    sys.exit(main())
