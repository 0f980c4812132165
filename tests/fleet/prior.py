# SPDX-License-Identifier: MIT
"""Measures what a new machine with two days of data gains from its brothers.
  prior.py [--fleets N] [--left-out N] [--write PAGE]"""

import argparse
import os
import pathlib
import sys

import numpy as np

from brothers import KINDS, NEW_DAYS, KNOWN_DAYS, Trainer, Type

BROTHERS = 40
HEAD = f"""# Results: a prior that machines of one type share

`scripts/report fleet-prior --write` makes this page. A new machine has {NEW_DAYS} days of data with a probe every 30
minutes, its brothers have {KNOWN_DAYS} days each. Every row: random fleets of simulated machines with four
thermometers. Of each fleet some machines in turn are the new one, with the others as brothers (leave one machine out).
Each machine has gains and time constants of its own, and a disturbance of 1.5 µm that no thermometer shows. The figures
are rms of the true error left on ten later days, in µm: over all machines, and in brackets of the worst one.

"""
TAIL = """
- *Own* is `compbox train`, *mean* the mean of the brothers with an offset of the machine's own, *shrunk* is
  `compbox train --prior`. The oracle knows the means and the spreads of the gains, the machine's time constants and the
  noise: of a machine of the type no model can be expected to leave less.
- *Worst loss* is the largest of the differences between shrunk and own, over all machines of the row.
- *Own share* is the mean share of the own model in the shrunk one, and *not used* the mean number of brothers that
  `compbox prior` finds too far from most.
"""


def measured(trainer, kind, brothers, fleets, left_out):
    """out: a row of left_without() for each machine that was left out"""
    rows = []
    for seed in range(fleets):
        fleet = Type(trainer, [seed, brothers, list(KINDS).index(kind)], kind, brothers + 1)
        rows += [fleet.left_without(1 + k * brothers // left_out) for k in range(left_out)]
    return np.array(rows)


def line_of(text, rows):
    rms, worst = np.sqrt(np.mean(rows[:, :5] ** 2, axis=0)), np.max(rows[:, 1:4], axis=0)
    cells = [f"{rms[0]:.1f}", *(f"{rms[k]:.2f} ({worst[k - 1]:.2f})" for k in (1, 2)),
             f"**{rms[3]:.2f}** ({worst[2]:.2f})", f"{rms[4]:.2f}", f"{np.max(rows[:, 3] - rows[:, 1]):.2f}",
             f"{100 * np.mean(rows[:, 5]):.0f} %", f"{np.mean(rows[:, 6]):.1f}"]
    return f"| {text} | " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description="what a prior buys")
    parser.add_argument("--fleets", type=int, default=6)
    parser.add_argument("--left-out", type=int, default=6)
    parser.add_argument("--write", metavar="PAGE")
    arguments = parser.parse_args()
    trainer = Trainer(pathlib.Path(os.environ["COMPBOX_BIN"]) / "compbox")
    lines = ["| fleet | error | own (worst) | mean | shrunk | oracle | worst loss | own share | not used |",
             "|---" * 9 + "|"]
    cases = [(kind, BROTHERS) for kind in KINDS] + [("alike", count) for count in (5, 10, 20)]
    for kind, brothers in cases:
        rows = measured(trainer, kind, brothers, arguments.fleets, arguments.left_out)
        lines.append(line_of(f"{KINDS[kind][1]}; {brothers} brothers", rows))
        print(lines[-1], file=sys.stderr, flush=True)
    text = "\n".join(lines) + f"\n\n{arguments.fleets} fleets in each row, {arguments.left_out} machines of each.\n"
    if arguments.write:
        pathlib.Path(arguments.write).write_text(HEAD + text + TAIL)
    print(text, end="")


if __name__ == "__main__":
    main()
