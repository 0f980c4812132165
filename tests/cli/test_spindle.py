# SPDX-License-Identifier: MIT
"""The recipe of examples/spindle-thermal: what the box leaves of a speed that training never saw."""

import pytest

from conftest import ROOT

EXAMPLE = ROOT / "examples/spindle-thermal"
AIM = {"ch1_um": 25, "ch2_um": 25, "ch3_um": 12, "ch4_um": 12, "ch5_um": 25}  # % of the largest error
HELD_OUT = {"2500,0#3": (29265, 58064), "3750,0#4": (58065, 86864), "3500": (115665, 130050)}


def recipe():
    """The train command of the README, without its outputs."""
    text = (EXAMPLE / "README.md").read_text()
    command = text[text.index("compbox train"):text.index("compbox build")].replace("\\\n", " ")
    words = [word.strip("'") for word in command.split()[1:]]
    at = words.index("--plot")
    return words[:at] + words[at + 2:]


@pytest.mark.parametrize("runs", HELD_OUT)
def test_a_speed_that_was_never_seen(compbox, runs):
    words = [str(EXAMPLE / "steps.csv") if word == "steps.csv" else word for word in recipe()]
    compbox.good(*words, "--hold-out", runs)
    compbox.good("build", EXAMPLE / "machine.json", "spindle.json", "-o", "c.json")
    compbox.good("eval", "c.json", "--inputs", EXAMPLE / "steps.csv", "--raw", "-o", "box.csv")
    lines = (EXAMPLE / "steps.csv").read_text().splitlines()
    names = lines[0].split(",")
    rows = [dict(zip(names, map(float, line.split(",")))) for line in lines[1:]]
    box = compbox.table("box.csv")
    begin, end = HELD_OUT[runs]
    for name, aim in AIM.items():
        largest = max(abs(row[name]) for row in rows)
        worst = max(abs(row[name] - printed) for row, printed in zip(rows, box[name])
                    if begin <= row["time_s"] <= end)
        assert 100 * worst / largest <= aim, name
