#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Plants each mutant of mutants.py alone, and lets scripts/simulate's program look for it with seeds that no other
test uses. A run ends at the first violation of an invariant.
  run_mutants.py ROOT [--seconds S] [--jobs J] [--first SEED] [--build-only] [--write FILE] [NAME…]
--seconds: processor time for each mutant, 600. NAME: a part of a mutant's name. --write: a table, as Markdown.
Exit code 1 when the program without a mutant violates an invariant, or a mutant is missed."""
import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
import mutants  # noqa: E402

# Faults, cycles of a seed, number of seeds; again and again with further seeds.
ROUNDS = [("none", 1000, 20), ("swarm", 2000, 200), ("swarm", 20000, 20)]
VIOLATION = re.compile(r"^violation of (\S+) at .*cycle (\d+) of seed (\d+): (.*)$")


@dataclasses.dataclass
class Outcome:
    invariant: str = ""    # "": not found
    words: str = ""
    replay: str = ""
    seconds: float = 0.0   # of processor time until then


def copy_sources(root, folder):
    """Copies what git knows or would add. Files that are the same keep their time, so little is compiled again."""
    names = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root,
    check=True,
                           capture_output=True, text=True).stdout.split("\0")
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
        commands.insert(0, ["cmake", "--preset", "host", "-DCMAKE_CXX_FLAGS=-Wno-error", "-DCMAKE_C_FLAGS=-Wno-error"])
    for command in commands:
        if subprocess.run(command, cwd=folder, stdout=log, stderr=log).returncode != 0:
            return False
    program.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["strip", "-o", program, out / "bin/world"], check=True)
    return True


def look(program, faults, cycles, first, last, most_s):
    """Runs these seeds until the first violation, a crash, or most_s of processor time."""
    command = [program, "--seeds", f"{first}..{last}", "--cycles", str(cycles), "--faults", faults]
    limit = max(1, round(most_s))
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, errors="replace",
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))) as process:
        found = Outcome()
        for line in process.stdout:
            violation = VIOLATION.match(line)
            if violation:
                found = Outcome(violation[1], violation[4],
                                f"scripts/simulate --seeds {violation[3]}..{violation[3]} --cycles {cycles} --faults "
                                "{faults}")
                process.kill()
                break
        process.stdout.close()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = 0
    found.seconds = used.ru_utime + used.ru_stime
    ended_by = status & 0x7F
    if not found.invariant and ended_by and found.seconds < limit - 0.5:
        found.invariant, found.words = "crash", f"the program ended by signal {ended_by}"
        found.replay = f"scripts/simulate --seeds {first}..{last} --cycles {cycles} --faults {faults}"
    return found


def search(program, first, most_s):
    """out: the first violation by the rounds, or none in most_s of processor time"""
    seconds, seed = 0.0, first
    while seconds < most_s:
        for faults, cycles, seeds in ROUNDS:
            found = look(program, faults, cycles, seed, seed + seeds - 1, most_s - seconds)
            seed += seeds
            found.seconds += seconds
            if found.invariant or found.seconds >= most_s:
                return found
            seconds = found.seconds
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
    """Builds the program without a mutant, then with each. out, one after the other: name, program or None"""
    bare = folder / "build/programs/bare"
    if not build(folder, bare, log):
        sys.exit(f"run_mutants.py: the sources do not build: {log.name}")
    yield "", bare
    for mutant in chosen:
        before = plant(folder, mutant)
        program = folder / "build/programs" / mutant[0]
        built = build(folder, program, log)
        for file, text in before.items():
            (folder / file).write_text(text)
        yield mutant[0], program if built else None


def line_of(name, found):
    where = f"{found.invariant}: {found.words}" if found.invariant else "NOT FOUND"
    return f"{name or 'no mutant':30} {found.seconds:7.1f} s  {where[:150]}"


def table_of(chosen, results, seconds):
    found = [results[mutant[0]] for mutant in chosen if results[mutant[0]].invariant]
    rows = [f"| {name} | {sentence} | {results[name].invariant or 'not found'} | "
            f"{results[name].seconds:.1f} |" for name, sentence, *_ in chosen]
    return "\n".join([f"{len(found)} of {len(chosen)} found, each within {seconds:.0f} s of processor time.", "",
                      "| mutant | defect | invariant | s |", "|---|---|---|---|", *rows, ""])


def options():
    parser = argparse.ArgumentParser(description="plants mutants and searches them in the world")
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, default=1000000)
    parser.add_argument("--build-only", action="store_true")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    return parser.parse_intermixed_args()


def main():
    with_ = options()
    root = with_.root.resolve()
    chosen = [m for m in mutants.MUTANTS if not with_.names or any(word in m[0] for word in with_.names)]
    folder = root / "build/mutants"
    copy_sources(root, folder)
    results, failed = {}, []

    def finish(name, program, outcome):
        results[name] = outcome
        program.unlink()
        print(line_of(name, outcome), flush=True)

    with open(root / "build/mutants.log", "w") as log, concurrent.futures.ThreadPoolExecutor(with_.jobs) as pool:
        for name, program in programs(folder, chosen, log):
            if program is None:
                failed.append(name)
                print(f"{name:30} does not compile", flush=True)
            elif not with_.build_only:
                pool.submit(lambda n, p: finish(n, p, search(p, with_.first, with_.seconds)), name, program)
    missed = [m[0] for m in chosen if m[0] in results and not results[m[0]].invariant]
    bad = bool(results) and bool(results[""].invariant)
    if with_.write and not failed and not bad:
        text = with_.write.read_text()
        head = text[:text.index("<!-- table -->")] if "<!-- table -->" in text else text
        with_.write.write_text(head + "<!-- table -->\n" + table_of(chosen, results, with_.seconds))
    print(f"{len(chosen) - len(missed) - len(failed)} of {len(chosen)} mutants found, {len(failed)} do not compile")
    return 1 if missed or failed or bad else 0


if __name__ == "__main__":
    sys.exit(main())
