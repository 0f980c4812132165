# SPDX-License-Identifier: MIT
"""The table of the README: what is left of each speed when it was held out, and whether the box
computes what the trainer predicted.   table.py FOLDER (of scripts/spindle-thermal)"""

import csv
import json
import pathlib
import sys

SPEEDS = {"1250": "slowest", "2500": "", "3500": "", "3750": "", "5000": "fastest: extrapolated"}
AIM = {"ch1_um": 25, "ch2_um": 25, "ch3_um": 10, "ch4_um": 10, "ch5_um": 25}
BETWEEN = ("2500", "3500", "3750")  # speeds that lie between others


def left(folder, speed, model):
    """Worst residual of the speed held out, percent of the largest error of the whole record."""
    terms = json.loads((folder / f"without-{speed}.json").read_text())["provenance"]["spindle"]
    return {out: v["worst_percent_of_largest"] for out, v in terms[model]["held_out"].items()}


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def main(folder):
    print("\nworst residual of the speed held out, percent of the largest error; what is written / "
          "linear map alone")
    print(f"{'rpm':>6}" + "".join(f"{name[:-3]:>14}" for name in AIM))
    worst = dict.fromkeys(AIM, 0.0)
    for speed, remark in SPEEDS.items():
        written, linear = left(folder, speed, "written"), left(folder, speed, "linear")
        print(f"{speed:>6}" + "".join(f"{written[n]:>8.1f}/{linear[n]:>5.1f}" for n in AIM), remark)
        if speed in BETWEEN:
            worst = {n: max(worst[n], written[n]) for n in AIM}
    print("  aim " + "".join(f"{limit:>14}" for limit in AIM.values()))
    box, predicted = table(folder / "box.csv"), table(folder / "predictions.csv")
    apart = max(abs(float(b[n]) - float(p[n + "_predicted"]))
                for b, p in zip(box, predicted) for n in AIM)
    print(f"\nbox and trainer differ by at most {apart:.2g} um over {len(box)} rows")
    missed = [n for n in AIM if worst[n] > AIM[n]]
    if missed:
        print("beyond the aim at a speed between others: " + ", ".join(missed))
    sys.exit(1 if missed or apart > 0.01 else 0)


main(pathlib.Path(sys.argv[1]))
