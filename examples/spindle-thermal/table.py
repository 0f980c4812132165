# SPDX-License-Identifier: MIT
"""The tables of the README.
  table.py cut STEPS.csv FROM_S TO_S OUT.csv   rows of one run, for a box that is switched on with it
  table.py show STEPS.csv FOLDER               what is left of each speed that was held out"""

import csv
import pathlib
import sys

# Speed held out with the idle stretch after it: first and last second.
RUNS = {"1250": (465, 29264), "2500": (29265, 58064), "3500": (115665, 130050),
        "3750": (58065, 86864), "5000": (86865, 115664)}
BETWEEN = ("2500", "3500", "3750")  # speeds that lie between others
AIM = {"ch1_um": 25, "ch2_um": 25, "ch3_um": 12, "ch4_um": 12, "ch5_um": 25}


def table(path):
    with open(path, newline="") as file:
        return [{key: float(value) for key, value in row.items() if key != "run"}
                for row in csv.DictReader(file)]


def cut(steps, begin, end, out):
    lines = pathlib.Path(steps).read_text().splitlines()
    inside = [line for line in lines[1:] if float(begin) <= float(line.split(",")[0]) <= float(end)]
    pathlib.Path(out).write_text("\n".join(lines[:1] + inside) + "\n")


def worst(steps, answers, name, begin, end, largest):
    """Largest |measured - box| of a run, percent of the largest error of the record."""
    said = {row["time_s"]: row[name] for row in answers}
    return 100 / largest * max(abs(row[name] - said[row["time_s"]]) for row in steps
                               if begin <= row["time_s"] <= end)


def show(steps_file, folder):
    steps = table(steps_file)
    largest = {name: max(abs(row[name]) for row in steps) for name in AIM}
    missed = []
    for title, file in (("the box runs on from the runs before", "on"),
                        ("the box is switched on when the run begins", "new")):
        print(f"\nworst residual of a speed held out, percent of the largest error; {title}")
        print(f"{'rpm':>6}" + "".join(f"{name[:-3]:>8}" for name in AIM))
        for speed, (begin, end) in RUNS.items():
            answers = table(folder / f"{file}-{speed}.csv")
            left = {n: worst(steps, answers, n, begin, end, largest[n]) for n in AIM}
            print(f"{speed:>6}" + "".join(f"{left[n]:>8.1f}" for n in AIM) +
                  ("" if speed in BETWEEN else "  slowest or fastest: beyond what was trained"))
            missed += [f"{n} at {speed}" for n in AIM if speed in BETWEEN and left[n] > AIM[n]]
        print("   aim" + "".join(f"{limit:>8}" for limit in AIM.values()))
    if missed:
        print("beyond the aim: " + ", ".join(missed))
    box, predicted = table(folder / "box.csv"), table(folder / "predictions.csv")
    apart = max(abs(b[n] - p[n + "_predicted"]) for b, p in zip(box, predicted) for n in AIM)
    print(f"\nbox and trainer differ by at most {apart:.2g} um over {len(box)} rows")
    sys.exit(1 if missed or apart > 0.01 else 0)


if sys.argv[1] == "cut":
    cut(*sys.argv[2:])
else:
    show(sys.argv[2], pathlib.Path(sys.argv[3]))
