#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: the table of docs/plc/README.md, the marks [duty] of the PLC programs beside it, and those of
fakeplc name the same duties, and the functions that the table names are there.
  plc_program.py [ROOT]       prints how many duties were looked at, or every one that is wrong
  plc_program.py --self-test  plants one mistake after the other; each must be caught"""

import pathlib
import re
import shutil
import sys
import tempfile

README, SCL, LADDER = "docs/plc/README.md", "docs/plc/sinumerik-840d.scl", "docs/plc/fanuc.txt"
FAKEPLC = "host-tools/fakeplc"
ROW = re.compile(r"^\| `([a-z-]+)` [^|]*\| (yes|no)[^|]*\| (yes|no)[^|]*\| (\S+) `(\w+)` \|$", re.M)
MARK = re.compile(r"\[([a-z]+(?:-[a-z]+)*)\]")


def marks(text):
    """out: the marks in its comments."""
    return {m for line in re.findall(r"//(.*)", text) for m in MARK.findall(line)}


def check(root):
    """out: how many duties there are, and a line for each that is wrong."""
    rows = ROW.findall((root / README).read_text())
    wrong = []
    duties = {row[0] for row in rows}
    for place, column in ((SCL, 1), (LADDER, 2)):
        there = marks((root / place).read_text())
        told = {row[0] for row in rows if row[column] == "yes"}
        wrong += [f"{place}: [{m}] is not in the table" for m in sorted(there - told)]
        wrong += [f"{place}: [{m}] of the table is not in it" for m in sorted(told - there)]
    for duty, _, _, file, function in rows:
        path = root / FAKEPLC / file
        text = path.read_text() if path.exists() else ""
        if duty not in marks(text):
            wrong.append(f"{FAKEPLC}/{file}: [{duty}] is not in it")
        if not re.search(rf"\b{function}\(", text):
            wrong.append(f"{FAKEPLC}/{file}: has no {function}()")
    for path in sorted((root / FAKEPLC).glob("*.[hc]*")):
        wrong += [f"{FAKEPLC}/{path.name}: [{m}] is not in the table"
                  for m in sorted(marks(path.read_text()) - duties)]
    return len(rows), wrong


PLANTED = [(SCL, "[watchdog]", "[watchdg]"), (LADDER, "[ramp]", ""), (README, "`watch_box`", "`watch_fox`"),
           (FAKEPLC + "/duties.cpp", "[torn]", ""), (README, "| `start`", "| `begin`"),
           (FAKEPLC + "/plc.cpp", "[start]", "[start] [other]"), (README, "duties.cpp", "chores.cpp")]


def self_test():
    source = pathlib.Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name in ("docs/plc", FAKEPLC):
            shutil.copytree(source / name, root / name)
        if check(root)[1]:
            sys.exit(f"plc_program.py: what is good is called wrong: {check(root)[1]}")
        for name, good, bad in PLANTED:
            text = (root / name).read_text()
            (root / name).write_text(text.replace(good, bad, 1))
            if text.count(good) == 0 or not check(root)[1]:
                sys.exit(f"plc_program.py: {bad!r} for {good!r} in {name} was not caught")
            (root / name).write_text(text)
    print(f"{len(PLANTED)} of {len(PLANTED)} planted mistakes caught")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    count, wrong = check(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "."))
    print("\n".join(wrong + [f"plc program: {count} duties, {len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
