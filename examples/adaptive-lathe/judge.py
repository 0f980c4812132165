#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes lathes (lathe.py), trains on 30 days of each, and judges the 13 later ones.
    judge.py COMPBOX [--write] [--machines N]"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "docs/results/adaptive-lathe.md"
DAYS, TRAINED, MINUTES = 43, 30, (30, 60, 120)
OUTPUTS = ("error_X_um", "error_Z_um")


def figures(compbox, seed, folder):
    """out: by output, what `train` found on the days held out (provenance of its term)"""
    record, term = folder / "lathe.csv", folder / "net.json"
    subprocess.run([sys.executable, HERE / "lathe.py", str(seed), str(DAYS), record], check=True)
    held = ",".join(str(day) for day in range(TRAINED + 1, DAYS + 1))
    subprocess.run([compbox, "train", record, "--outputs", ",".join(OUTPUTS), "--run-column", "day", "--name", "net",
                    "--accept-worse", "--adapt", "--simulate-probes", ",".join(map(str, MINUTES)), "--hold-out", held,
                    "-o", term], check=True, stdout=subprocess.DEVNULL)
    return json.loads(term.read_text(encoding="utf-8"))["provenance"]["net"]["probes"]


def rows_of(found):
    """{row: figures} of one output"""
    rows = {"nothing": found["nothing"], "offline model": found["model"]}
    for kind, text in (("rezero", "re-zero by the probe, every {} min"), ("adapted", "**adapted**, every {} min"),
                       ("adapted_5_percent_wrong", "adapted, 5 % of the probes wrong by 100 µm, every {} min")):
        for one in found["probed"]:
            rows[text.format(f"{one['interval_min']:g}")] = one[kind]
    return rows


def cell(values):
    return f"{statistics.median(values):.2f} ({max(values):.2f})"


def page(machines):
    names = list(rows_of(machines[0][OUTPUTS[0]]))
    count = len(machines)
    lines = ["# A lathe over a season: results", "",
             "`scripts/report adaptive-lathe --write` makes this page with "
             "[examples/adaptive-lathe](../../examples/adaptive-lathe/README.md).",
             f"The machines are {count} simulated lathes (seeds 1 to {count}) with seasons, coolant, ageing, "
             "and a wander that",
             f"no thermometer shows. `train` sees the first {TRAINED} days. Every figure is of the "
             f"{DAYS - TRAINED} days after them, on which nothing",
             "was chosen. The probe is simulated with the box's own filter; a doubtful probe is not repeated.", "",
             "Median over the machines, and the worst one in brackets, µm:", "",
             "| | X rms | X 95 % | Z rms | Z 95 % |", "|---|---|---|---|---|"]
    for name in names:
        parts = [[rows_of(machine[output])[name][key] for machine in machines]
                 for output in OUTPUTS for key in ("rms_um", "p95_um")]
        lines.append(f"| {name} | " + " | ".join(map(cell, parts)) + " |")
    lines += ["", "Part of the right probes within two standard deviations of what the filter expected, least, "
              "median and largest of the machines:", "", "| every | X | Z |", "|---|---|---|"]
    for k, minutes in enumerate(MINUTES):
        shares = [sorted(100 * machine[output]["probed"][k]["within_two_sigma"] for machine in machines)
                  for output in OUTPUTS]
        lines.append(f"| {minutes} min | " + " | ".join(
            f"{s[0]:.1f}, {statistics.median(s):.1f}, {s[-1]:.1f} %" for s in shares) + " |")
    return "\n".join(lines) + "\n"


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("compbox")
    options.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    options.add_argument("--machines", type=int, default=20)
    given = options.parse_args()
    machines = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, given.machines + 1):
            machines.append(figures(given.compbox, seed, pathlib.Path(folder)))
            print(f"  machine {seed}", file=sys.stderr)
    text = page(machines)
    if given.write:
        PAGE.write_text(text, encoding="utf-8")
    print(text, end="")
    missed = []
    for output in OUTPUTS:
        for k, minutes in enumerate(MINUTES[:2]):
            adapted, rezero, model = (statistics.median(part(machine[output]) for machine in machines) for part in (
                lambda f, k=k: f["probed"][k]["adapted"]["rms_um"], lambda f, k=k: f["probed"][k]["rezero"]["rms_um"],
                lambda f: f["model"]["rms_um"]))
            if adapted > min(rezero, model):
                missed.append(f"{output} at {minutes} min: {adapted:.2f}, re-zero {rezero:.2f}, offline {model:.2f}")
    if missed:
        sys.exit("adaptive-lathe: adapted is not better than both: " + "; ".join(missed))


if __name__ == "__main__":
    main()
