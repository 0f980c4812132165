#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Plants each mutant of mutants.py alone, and lets scripts/simulate's program look for it with seeds that no other
test uses. A mutant is found by a run that violates an invariant where the program without a mutant, with the same
seed, cycles and faults, violates none.
  run_mutants.py ROOT [--seconds S] [--jobs J] [--first SEED] [--build-only] [--write FILE] [--missed] [--replay]
                 [--update] [--defects FILE] [--faults KINDS] [NAME…]
--seconds: processor time for each mutant, 600. NAME: a part of a mutant's name. --defects: other mutants than those of
mutants.py, a Python file with the same form, in DEFECTS. --faults: these kinds alone, as for scripts/simulate. --write:
keeps a table of the results in this page, behind its line TABLE. --missed: those that the page does not list as found.
--replay: no search, the run that the page lists. --update: that run, and a search where it shows nothing, or the page
lists none. Exit code 1 when a mutant is missed, or does not compile."""
import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import re
import runpy
import shutil
import signal
import subprocess
import sys
import threading

sys.dont_write_bytecode = True
import mutants  # noqa: E402

# Faults, cycles of a seed, number of seeds; again and again with further seeds. The kinds are those that a seed draws,
# as a user runs it: mostly one to three, because the invariants are at their sharpest there. The longer runs are judged
# for their recovery too, and the last have silences beyond 31 bits of µs.
ROUNDS = [("swarm", 2500, 200), ("swarm", 6000, 40), ("sensors", 90000, 3)]
VIOLATION = re.compile(r"^violation of (.+?) at .*cycle (\d+) of seed (\d+): (.*)$")
REPLAY = re.compile(r"^replay: .* --faults (\S+)$")
TABLE = "<!-- table: scripts/report mutants --write -->\n"
ROW = re.compile(r"^\| (\S+) \| [^|]* \| ([^|]*?) \| ([\d.]+) \| "
                 r"(?:`--seeds (\d+) --cycles (\d+) --faults ([\w,]+)`|) \|$")


@dataclasses.dataclass(frozen=True)
class Run:
    seed: int
    cycles: int
    faults: str

    def options(self, last=None):
        seeds = str(self.seed) if last is None else f"{self.seed}..{last}"
        return ["--seeds", seeds, "--cycles", str(self.cycles), "--faults", self.faults]


@dataclasses.dataclass
class Outcome:
    invariant: str = ""    # "": not found
    words: str = ""
    run: Run = None
    seconds: float = 0.0   # of processor time until then


class Unchanged:
    """The program without a mutant: whether a run of it violates an invariant. Each run is made once."""
    def __init__(self, program):
        self.program, self.passed, self.lock = program, {}, threading.Lock()

    def passes(self, run):
        with self.lock:
            if run not in self.passed:
                done = subprocess.run([self.program, "--no-shrink", *run.options()], capture_output=True)
                self.passed[run] = done.returncode == 0
            return self.passed[run]


def copy_sources(root, folder):
    """Copies what git knows or would add. Files that are the same keep their time, so little is compiled again."""
    names = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root,
                           check=True, capture_output=True, text=True).stdout.split("\0")
    for name in filter(None, names):
        source, copy = root / name, folder / name
        if not source.is_file():
            continue
        if copy.exists() and copy.read_bytes() == source.read_bytes():
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)


def build(folder, program, log):
    """out: whether it was built; then `program` is a copy of it."""
    out = folder / "build/host"
    commands = [["cmake", "--build", out, "--target", "world"]]
    if not (out / "build.ninja").exists():
        commands.insert(0, ["cmake", "--preset", "host", "-DCMAKE_C_FLAGS=-Wno-error"])
    for command in commands:
        if subprocess.run(command, cwd=folder, stdout=log, stderr=log).returncode != 0:
            return False
    program.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["strip", "-o", program, out / "bin/world"], check=True)
    return True


def look(program, unchanged, run, last):
    """Runs the seeds up to the last, until the first violation that the unchanged program does not have."""
    found, violation = Outcome(), None
    with subprocess.Popen([program, "--no-shrink", *run.options(last)], stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True, errors="replace") as process:
        for line in process.stdout:
            violation = VIOLATION.match(line) or violation
            # With the kinds that the seed drew: a row holds when other kinds are drawn later.
            replay = REPLAY.match(line)
            if not replay:
                continue
            here = Run(int(violation[3]), run.cycles, replay[1])
            if unchanged.passes(here):
                found = Outcome(violation[1], violation[4], here)
                os.kill(process.pid, signal.SIGKILL)  # kill() would reap it before wait4()
                break
        process.stdout.close()
        _, _, used = os.wait4(process.pid, 0)  # with the runs, which are its children
        process.returncode = 0
    found.seconds = used.ru_utime + used.ru_stime
    return found


def search(program, unchanged, with_):
    """out: the first violation by the rounds, or none in their processor time"""
    seconds, seed, most_s = 0.0, with_.first, with_.seconds
    while seconds < most_s:
        for kinds, cycles, seeds in ROUNDS:
            faults = with_.faults or kinds
            found = look(program, unchanged, Run(seed, cycles, faults), seed + seeds - 1)
            seed += seeds
            seconds += found.seconds
            found.seconds = seconds
            if found.invariant or seconds >= most_s:
                return found
    return Outcome(seconds=seconds)


def plant(folder, mutant):
    """out: the texts before, by file"""
    def text_of(file):
        return (folder / file).read_text()
    wrong = mutants.wrong_with(mutant, text_of)
    if wrong:
        sys.exit("\n".join(wrong))
    texts = mutants.plant(mutant, text_of)
    before = {file: text_of(file) for file in texts}
    for file, text in texts.items():
        (folder / file).write_text(text)
    return before


def programs(folder, chosen, log):
    """Builds the program with each mutant. out, one after the other: name, program or None"""
    for mutant in chosen:
        before = plant(folder, mutant)
        program = folder / "build/programs" / mutant[0]
        built = build(folder, program, log)
        for file, text in before.items():
            (folder / file).write_text(text)
        yield mutant[0], program if built else None


def line_of(name, found):
    where = f"{found.invariant}: {found.words}" if found.invariant else "NOT FOUND"
    return f"{name:30} {found.seconds:7.1f} s  {where[:150]}"


class Page:
    """The table of results in a page; without a page, the results of this run"""
    def __init__(self, path):
        self.path, self.results = path, {}
        for line in path.read_text().splitlines() if path else []:
            row = ROW.match(line)
            if row and row[4]:
                self.results[row[1]] = Outcome(row[2], "", Run(int(row[4]), int(row[5]), row[6]), float(row[3]))
            elif row:
                self.results[row[1]] = Outcome(seconds=float(row[3]))

    def is_found(self, name):
        return name in self.results and self.results[name].invariant

    def note(self, name, outcome):
        self.results[name] = outcome
        if self.path:
            head = self.path.read_text().partition(TABLE)[0]
            whole = self.path.with_suffix(".new")  # an interrupted search leaves the page whole
            whole.write_text(head + TABLE + "\n" + self.table())
            whole.replace(self.path)

    def table(self):
        listed = [m for m in mutants.MUTANTS if m[0] in self.results]
        found = [m for m in listed if self.is_found(m[0])]
        slowest = max((self.results[m[0]].seconds for m in found), default=0)
        left = len(mutants.MUTANTS) - len(listed)
        lines = [f"{len(found)} of {len(listed)} mutants are found, each within {slowest:.0f} s of processor time."
                 + f" {left} of the list have not been searched with these sources." * (left > 0),
                 "", "| mutant | defect | found by | s | run |", "|---|---|---|---|---|"]
        for name, sentence, *_ in listed:
            outcome = self.results[name]
            run = f"`{' '.join(outcome.run.options())}`" if outcome.run else ""
            lines.append(f"| {name} | {sentence} | {outcome.invariant or '**not found**'} | {outcome.seconds:.1f} | "
                         f"{run} |")
        return "\n".join(lines) + "\n"


def options():
    parser = argparse.ArgumentParser(description="plants mutants and searches them in the world")
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, default=1000000)
    parser.add_argument("--build-only", action="store_true")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--missed", action="store_true")
    parser.add_argument("--replay", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--defects", type=pathlib.Path)
    parser.add_argument("--faults")
    parser.add_argument("names", nargs="*")
    return parser.parse_intermixed_args()


def chosen_by(with_, page):
    """out: the mutants to plant"""
    listed = runpy.run_path(str(with_.defects))["DEFECTS"] if with_.defects else mutants.MUTANTS
    named = [m for m in listed if not with_.names or any(word in m[0] for word in with_.names)]
    if with_.missed:
        return [m for m in named if not page.is_found(m[0])]
    return [m for m in named if page.is_found(m[0])] if with_.replay else named


def main():
    with_ = options()
    root = with_.root.resolve()
    page = Page(with_.write)
    chosen = chosen_by(with_, page)
    folder = root / "build/mutants"
    copy_sources(root, folder)
    missed, failed = [], []

    def judge(name, program, unchanged):
        outcome = Outcome()
        if page.is_found(name) and (with_.replay or with_.update):
            known = page.results[name]
            outcome = look(program, unchanged, known.run, known.run.seed)
            outcome.seconds = known.seconds if with_.update else outcome.seconds
        if not outcome.invariant and not with_.replay:
            outcome = search(program, unchanged, with_)
        if not with_.replay:
            page.note(name, outcome)
        missed.extend([] if outcome.invariant else [name])
        program.unlink()
        print(line_of(name, outcome), flush=True)

    with open(root / "build/mutants.log", "w") as log, concurrent.futures.ThreadPoolExecutor(with_.jobs) as pool:
        bare = folder / "build/programs/unchanged"
        if not build(folder, bare, log):
            sys.exit(f"run_mutants.py: the sources do not build: {log.name}")
        unchanged, searches = Unchanged(bare), []
        for name, program in programs(folder, chosen, log):
            if program is None:
                failed.append(name)
                print(f"{name:30} does not compile", flush=True)
            elif not with_.build_only:
                searches.append(pool.submit(judge, name, program, unchanged))
        for one in searches:
            one.result()
    print(f"{len(chosen) - len(missed) - len(failed)} of {len(chosen)} mutants found, {len(failed)} do not compile")
    return 1 if missed or failed else 0


if __name__ == "__main__":
    sys.exit(main())
