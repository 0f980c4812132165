# SPDX-License-Identifier: MIT
"""The prior that machines of one type share: what it leaves on twins of known variance (docs/results/fleet-prior.md has
many more of them), and which machines a fleet takes for brothers."""

import json

import numpy as np
import pytest

from brothers import Machine, NEW_DAYS, Trainer, Type, left_by
from fleets import cli
from twins import TRUTH, Twin

BROTHERS = 12


@pytest.fixture(scope="module")
def trainer():
    return Trainer(cli.BIN / "compbox")


def left(trainer, kind, numbers=(1, 2, 3, 4)):
    """out: (rms of own models, of shrunk ones, of the oracle, rows) over machines of two fleets, each left out"""
    fleets = [Type(trainer, [seed, len(kind)], kind, BROTHERS + 1) for seed in (7, 8)]
    rows = np.array([fleet.left_without(number) for fleet in fleets for number in numbers])
    return (*np.sqrt(np.mean(rows[:, [1, 3, 4]] ** 2, axis=0)), rows)


def test_a_new_machine_gains_from_its_brothers(trainer):
    own, shrunk, oracle, _ = left(trainer, "alike")
    assert oracle < shrunk < own


def test_machines_without_anything_in_common_cost_little(trainer):
    own, shrunk, _, _ = left(trainer, "nothing in common")
    assert shrunk < 1.25 * own


def test_wrong_brothers_are_not_used(trainer):
    own, shrunk, _, rows = left(trainer, "wrong brothers")
    assert (rows[:, 6] >= 3).all() and shrunk < 1.1 * own


def test_the_prior_and_its_model_are_the_same_bytes_again(trainer):
    fleet = Type(trainer, 3, "alike", 4)
    machine = Machine(fleet.dice, fleet.gains())
    made = []
    for _ in range(2):
        trainer.prior(fleet.files)
        made.append((trainer.term(machine, NEW_DAYS, "prior.json"), (trainer.folder / "prior.json").read_bytes()))
    assert made[0] == made[1] and left_by(machine, made[0][0]) > 0


def test_a_fleet_uses_the_brothers_that_are_good(plant):
    plant.add_lathes(7)
    plant.fleet("train", "--workers", 2)
    registry = plant.folder / "registry"
    for path in (registry / "machines").glob("*.json"):  # they have passed a roll-out
        entry = json.loads(path.read_text())
        path.write_text(json.dumps({**entry, "model": entry["candidate"], "candidate": None}))
    for k in range(7):  # the last one drifts
        twin = Twin(k)
        twin.clock_s = 5 * 86400
        plant.add_record(f"m{k:03}", twin, 2, compensated=TRUTH, shift_um=20 if k == 6 else 0)
    plant.add_lathe("new", Twin(50), 2)
    plant.add_lathe("other", Twin(51), 2)
    other = json.loads((registry / "machines/other.json").read_text())
    (registry / "machines/other.json").write_text(json.dumps({**other, "type": "mill"}))
    jobs = {row["machine"]: row["what"] for row in json.loads(plant.fleet("plan", "--json"))}
    assert set(jobs) == {"m006", "new", "other"}
    good = {plant.entry("models", plant.entry("machines", f"m{k:03}")["model"])["moments"] for k in range(6)}
    assert set(jobs["new"]["brothers"]) == good == set(jobs["m006"]["brothers"]) and jobs["other"]["brothers"] == []
    assert plant.fleet("train", "--workers", 2).endswith("3 trained, 0 known before, 0 refused\n")
    model = plant.entry("models", plant.entry("machines", "new")["candidate"])
    prior = json.loads((registry / f"objects/{model['prior'][:2]}/{model['prior']}.json").read_text())
    assert prior["format"] == "compbox-prior/1" and prior["machines"] == 6
    assert plant.entry("models", plant.entry("machines", "other")["candidate"])["prior"] is None
