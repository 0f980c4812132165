#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: each fault that scripts/test-planted-faults or scripts/report mutants plants still has its place in the
sources, just one, and the tests that have to catch it are there.
  planted.py ROOT         prints how many faults were looked at, or every one that is wrong
  planted.py --self-test  plants mistakes into such a fault; each must be caught"""

import pathlib
import runpy
import sys
import tempfile

sys.dont_write_bytecode = True  # beside the lists
MUTANTS = "tests/world/mutants.py"
LISTS = ("tests/hil/planted_faults.py", "tests/hil/stm32f405/planted_faults.py")


def wrong_with(root, folder, fault):
    """A line for each thing that is wrong with a fault of planted_faults.py; folder: of its tests."""
    name, file, before, after, tests = fault
    path = root / file
    times = path.read_text().count(before) if path.exists() else 0
    wrong = [] if times == 1 else [f"{name}: {before!r} is {times} times in {file}, has to be once"]
    wrong += [f"{name}: nothing is planted"] * (before == after)
    for test in tests:
        source, _, function = test.partition("::")
        path = folder / source
        there = path.exists() and f"def {function.partition('[')[0]}" in path.read_text()
        wrong += [] if there else [f"{name}: there is no {test}"]
    return wrong + [f"{name}: no test has to catch it"] * (not tests)


def check(root):
    """out: how many faults there are, and a line for each thing that is wrong."""
    count, wrong = 0, []
    for file in LISTS:
        faults = runpy.run_path(str(root / file))["FAULTS"]
        count += len(faults)
        for fault in faults:
            wrong += [f"{file}: {line}" for line in wrong_with(root, (root / file).parent, fault)]
    sys.path.insert(0, str((root / MUTANTS).parent))  # it has another list beside it
    mutants = runpy.run_path(str(root / MUTANTS))
    names = [mutant[0] for mutant in mutants["MUTANTS"]]
    wrong += [f"{MUTANTS}: {name} is {names.count(name)} times there" for name in set(names) if names.count(name) > 1]
    planted = {}
    for mutant in mutants["MUTANTS"]:
        found = mutants["wrong_with"](mutant, lambda file: (root / file).read_text())
        wrong += [f"{MUTANTS}: {line}" for line in found]
        texts = mutants["plant"](mutant, lambda file: (root / file).read_text())
        first = planted.setdefault(tuple(sorted(texts.items())), mutant[0])
        wrong += [f"{MUTANTS}: {mutant[0]} is {first} once more"] * (first != mutant[0])
    return count + len(names), wrong


GOOD = ("slew", "firmware/box/box.c", "CB_BOX_MAX", "CB_BOX_LEAST", ["test_wire.py", "test_stop.py::test_one[of it]"])
TEXTS = {"firmware/box/box.c": "enum { CB_BOX_MAX = 1 };\nint twice, twice;\n",
         "tests/hil/test_wire.py": "def test_wire():\n", "tests/hil/test_stop.py": "def test_one(plc):\n"}
MISTAKES = [(1, "firmware/bax.c"), (2, "CB_BOX_MIN"), (2, "twice"), (3, "CB_BOX_MAX"), (4, ["test_wires.py"]),
            (4, ["test_stop.py::test_two"]), (4, [])]


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in TEXTS.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        tests = root / "tests/hil"
        if wrong_with(root, tests, GOOD):
            sys.exit(f"planted.py: what is good is called wrong: {wrong_with(root, tests, GOOD)}")
        for at, mistake in MISTAKES:
            if len(wrong_with(root, tests, GOOD[:at] + (mistake,) + GOOD[at + 1:])) != 1:
                sys.exit(f"planted.py: {mistake!r} was not caught")
    print(f"{len(MISTAKES)} of {len(MISTAKES)} planted mistakes caught")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    count, wrong = check(pathlib.Path(sys.argv[1]).resolve())
    print("\n".join(wrong + [f"planted faults: {count}, {len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
