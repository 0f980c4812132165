#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: figures that several documents state are the same in each, and are those of the script that made
them or of the gate that limits them.
  figures.py [ROOT]                         prints how many figures were compared, or every one that differs
  figures.py ROOT --instructions COMMAND…   runs a gate's PROGRAM.elf; compares counts of instructions with its output
  figures.py --self-test                    plants wrong figures; each must be found"""

import pathlib
import re
import subprocess
import sys

RESULT = "docs/results/gantry-straightness.md"  # scripts/report results --write gantry-straightness
# Row of RESULT: row of the README, row of docs/fitting.md.
METHODS = {"**bspline** (ours)": ("**compbox, B-spline**", "bspline"),
           "bspline-lmc": ("B-spline as published", "bspline-lmc"),
           "polynomial": ("polynomial of 7th degree", "polynomial"),
           "polyline": ("straight lines between the points", "polyline"),
           "bspline-lmc-1um": ("B-spline as published, ε = 1 µm", None),
           "its worst machine": ("its worst machine", None),
           "a perfect model": ("a perfect model", None)}
# Of each program of the gates: a page, and the rows of its table by the rows of the program's output.
COUNTED = {
    "instructions": ("docs/results/speed.md", {
        "19-20-3 network": "19-20-3, network",
        "spline of 20 control points, value and slope": "spline, 20 control points, value and slope",
        "lag, one step": "lag, one step",
        "volumetric term": "volumetric, 21 errors to the tip",
        "reference load": "18 splines, volumetric, network, 24 lags",
        "`cb_box_step` with that load, at rest": "cb_box_step, reference load, at rest",
        "`cb_box_step` with that load, travelling": "cb_box_step, reference load, travelling",
        "the same, every curve on breaks of its own": "cb_box_step, every curve on breaks of its own",
        "`cb_box_step` with that load and a bank of 256 lags": "cb_box_step, and a bank of 256 lags"}),
    "worst": ("docs/results/speed.md", {
        "reference load: the first step": "reference load, first step",
        "reference load: any later step": "reference load, any later step",
        "reference load: a step after a reload": "reference load, step after a reload",
        "own breaks: the first step": "own breaks, first step",
        "own breaks: any later step": "own breaks, any later step",
        "own breaks: a step after a reload": "own breaks, step after a reload",
        "the dearest file found: any step": "dearest file found, any step"}),
    "cycle_conformance": ("docs/stm32f405.md", {"instructions of a cycle": "whole cycle, conformance inputs:"}),
    "cycle_reference": ("docs/stm32f405.md", {
        "… of the reference load, travelling": "whole cycle, reference load, travelling:"}),
    "cycle_worst": ("docs/stm32f405.md", {
        "… of the reference load, the dearest found": "whole cycle, reference load, dearest step:"})}


def numbers(text):
    """out: the numbers of a cell; a blank between digits groups thousands."""
    return [float(number.replace(" ", "")) for number in re.findall(r"-?\d+(?: \d{3})*(?:\.\d+)?", text)]


def row(page, first, count=3):
    """out: the cells behind the first one of the table row that begins so; IndexError where there is none."""
    found = [line for line in page.split("\n") if line.startswith(f"| {first}")]
    return [cell.strip() for cell in found[0].split("|")[2:2 + count]]


def gantry(read):
    """out: (place, stated, source) of the figures that README and fitting.md take from RESULT."""
    result, readme, fitting = read(RESULT), read("README.md"), read("docs/fitting.md")
    for source, (in_readme, in_fitting) in METHODS.items():
        made = [numbers(cell)[0] for cell in row(result, f"{source} |", 6)]  # remeasured, then by the truth
        yield f"README.md, {in_readme}", [numbers(cell)[0] for cell in row(readme, f"{in_readme} |", 6)], made
        if in_fitting:
            stated = [numbers(cell)[0] for cell in row(fitting, f"{in_fitting} |")]
            yield f"docs/fitting.md, {in_fitting}", stated, made[3:]
    worst = [numbers(cell)[0] for cell in row(result, "its worst machine", 6)[3:]]
    yield ("docs/fitting.md, bspline, worst", [numbers(cell)[1] for cell in row(fitting, "bspline |")], worst)


def intervals(read):
    """out: the intervals of the README's medians of the gantry, by the truth, as RESULT has them for each axis."""
    lines = [line.split("|") for line in read(RESULT).split("\n") if line.startswith("| space diagonal |")]
    made = [numbers(line[6]) for line in lines[:3]]
    stated = [numbers(cell) for cell in row(read("README.md"), "the median of all such machines, with 95 %", 6)[3:]]
    yield "README.md, intervals of compbox, B-spline", sum(stated, []), sum(made, [])


def warm_machine(read):
    """out: the figures of the warm machine that the README takes from its result page, each with one decimal."""
    page, name = read("docs/results/bpnet-840d.md"), "[a warm machine and a thin wall]"
    gone = [numbers(cell)[0] for cell in row(page, "**with-memory**", 12)]
    y, space = [numbers(cell) for cell in row(page, "its 95 % interval", 4)[1::2]]
    paper = float(re.search(r"S3 reports ([0-9.]+) % in Y", page)[1])
    stated = [float(number) for number in re.findall(r"\d+\.\d", row(read("README.md"), name, 1)[0])]
    yield f"README.md, {name}", stated, [gone[4], *y, paper, gone[10], *space, gone[5], gone[11]]


def budgets(read):
    """out: the same of the limits of the STM32F405's image."""
    page, memory, stack = read("docs/stm32f405.md"), read("tests/gates/memory.py"), read("tests/gates/stack.py")
    for name, text, pattern in (("code and constants", memory, r"^CODE_LIMIT = (\d+) \* KIB"),
                                ("static RAM", memory, r"^RAM_LIMIT = (\d+) \* KIB"),
                                ("stack: main", stack, r"^IMAGE_LIMIT = (\d+)")):
        limit = float(re.search(pattern, text, re.M)[1])
        yield f"docs/stm32f405.md, {name}", numbers(row(page, name, 2)[1])[:1], [limit]


def counted(read, output, page, rows):
    """out: the same of counts of instructions: in the page's table, and in a program's output."""
    text = read(page)
    for stated, printed in rows.items():
        used = re.search(rf"^{re.escape(printed)} +(\d+) /", output, re.M)
        yield f"{page}, {stated}", numbers(row(text, stated, 1)[0])[:1], [float(used[1])] if used else []


def judge(compared):
    """out: how many figures there are, and a line for each place that differs."""
    compared = list(compared)
    wrong = [f"{place}: {stated}, made {made}" for place, stated, made in compared if stated != made or not made]
    return sum(len(made) for _, _, made in compared), wrong


def run_and_judge(command, read, page, rows):
    """out: as judge(), of what the command prints, which is printed; a failed command is wrong whatever it prints"""
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    print(done.stdout, end="")
    count, wrong = judge(counted(read, done.stdout, page, rows))
    return count, wrong + [f"exit code {done.returncode}: {' '.join(map(str, command))}"] * (done.returncode != 0)


def self_test():
    root = pathlib.Path(__file__).resolve().parents[2]
    read = {}

    def pages(name):
        return read.setdefault(name, (root / name).read_text())

    def wrong():
        return len(judge([*gantry(pages), *intervals(pages), *warm_machine(pages), *budgets(pages)])[1])

    if wrong():
        sys.exit("figures.py: the documents are wrong already")
    planted = (("README.md", "| 95.8 %", "| 95.9 %"), ("README.md", "**97.4 %**", "**98.4 %**"),
               ("README.md", " to 96.2 %", " to 96.3 %"), ("README.md", "own machine: 59.1 %", "own machine: 59.2 %"),
               ("docs/fitting.md", "| bspline | 95.8", "| bspline | 96.3"),
               ("docs/stm32f405.md", " KiB |\n", "0 KiB |\n"))
    for name, before, after in planted:
        good = pages(name)
        read[name] = good.replace(before, after)
        if (read[name] == good) == bool(wrong()):
            sys.exit(f"figures.py: {after!r} in {name} gave {wrong()}")
        read[name] = good
    table = {"a.md": "| lag, one step | 1 034 | 1 050 |\n"}
    for output, count in (("lag   1034 / 1050\n", 0), ("lag   1035 / 1050\n", 1), ("", 1)):
        found = len(judge(counted(table.get, output, "a.md", {"lag, one step": "lag"}))[1])
        if found != count:
            sys.exit(f"figures.py: {output!r} gave {found}")
    for code in (0, 1):
        command = (sys.executable, "-c", f"print('lag   1034 / 1050'); raise SystemExit({code})")
        if len(run_and_judge(command, table.get, "a.md", {"lag, one step": "lag"})[1]) != code:
            sys.exit(f"figures.py: exit code {code} of a program that prints the right figures")
    print(f"{len(planted) + 3} of {len(planted) + 3} planted figures and failures found")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")

    def read(name):
        return (root / name).read_text()

    if sys.argv[2:3] == ["--instructions"]:
        program = next(pathlib.Path(part).stem for part in sys.argv[3:] if part.endswith(".elf"))
        count, wrong = run_and_judge(sys.argv[3:], read, *COUNTED[program])
    else:
        count, wrong = judge([*gantry(read), *intervals(read), *warm_machine(read), *budgets(read)])
    print("\n".join(wrong + [f"figures: {count} compared, {len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
