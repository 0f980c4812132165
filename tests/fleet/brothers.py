# SPDX-License-Identifier: MIT
"""Twins of one type with known variance between them, and what a model of one leaves: for the prior that they share.

A machine's error is the sum over four thermometers of gain · lag(temperature − 20 °C), and a slow disturbance that no
thermometer shows. Gains and time constants of a machine are drawn around those of its type. A thermometer shows the
hall, which has days of its own, and the heat of shifts, each machine's own. The parts of this file alone know it."""

import copy
import json
import math
import pathlib
import subprocess
import tempfile

import numpy as np

STEP_S, DAY, PROBE = 600, 144, 3  # a row; rows of a day; every so many rows a probe
MEAN_UM_PER_K, MEAN_TAU_S = np.array([4.0, -2.5, 1.5, 3.0]), np.array([900.0, 3600.0, 7200.0, 1800.0])
NOISE_UM, DISTURBANCE_UM, DISTURBANCE_S, TAU_SPREAD = 1.0, 1.5, 7200.0, 0.2
INPUTS = [f"T{k}" for k in range(1, 5)]
NEW_DAYS, KNOWN_DAYS, FIRST_JUDGED, DAYS = 2, 12, 4, 14  # of a new machine, of its brothers; the judged days


def lagged(values, tau_s):
    """in: a column each row, linear between the rows. out: its first-order lag from a steady state, as in the box"""
    if tau_s == 0:
        return values
    a = math.exp(-STEP_S / tau_s)
    share = (1 - a) * tau_s / STEP_S
    found = values.copy()
    for k in range(1, len(values)):
        found[k] = a * found[k - 1] + (share - a) * values[k - 1] + (1 - share) * values[k]
    return found


class Machine:
    """in: numpy's generator; gains, um/K. One record of DAYS days, and what the machine really does in it."""

    def __init__(self, dice, gains):
        self.gains, rows = gains, DAYS * DAY
        self.tau_s = MEAN_TAU_S * np.exp(TAU_SPREAD * dice.standard_normal(len(INPUTS)))
        hours = np.arange(rows) * STEP_S / 3600
        days = np.repeat(3 + dice.standard_normal(DAYS), DAY)
        hall = days * np.sin(2 * np.pi * (hours / 24 + dice.random()))
        works = np.repeat(dice.random(rows // 24 + 1) * (dice.random(rows // 24 + 1) < 0.6), 24)[:rows]
        heat = [lagged(works, tau_s) * dice.uniform(3, 9) for tau_s in (600, 1800, 5400, 2700)]
        seen = dice.uniform(0.5, 1.2, len(INPUTS))
        noise = 0.05 * dice.standard_normal((len(INPUTS), rows))
        self.temperatures = np.array([20 + seen[k] * hall + heat[k] + noise[k] for k in range(len(INPUTS))])
        a = math.exp(-STEP_S / DISTURBANCE_S)
        steps = DISTURBANCE_UM * math.sqrt(1 - a * a) * dice.standard_normal(rows)
        self.disturbance_um = np.zeros(rows)
        for k in range(1, rows):
            self.disturbance_um[k] = a * self.disturbance_um[k - 1] + steps[k]
        self.features = np.array([lagged(row - 20, tau_s) for row, tau_s in zip(self.temperatures, self.tau_s)])
        self.true_um = gains @ self.features + 5 * dice.standard_normal()
        self.seen_um = self.true_um + self.disturbance_um + NOISE_UM * dice.standard_normal(rows)

    def table(self, days):
        """out: the rows of its first days, for `compbox train`"""
        probed = range(0, days * DAY, PROBE)
        lines = (",".join(f"{value:.4f}" for value in (k * STEP_S, *self.temperatures[:, k], self.seen_um[k]))
                 for k in probed)
        return f"time_s,{','.join(INPUTS)},error_X_um\n" + "\n".join(lines) + "\n"

    def left_um(self, predicted_um):
        """out: rms that a prediction leaves of the true error on the judged days"""
        judged = slice(FIRST_JUDGED * DAY, None)
        return float(np.sqrt(np.mean((predicted_um - self.true_um)[judged] ** 2)))

    def columns(self, tau_s):
        """out: columns of a bank, in its order"""
        return np.array([lagged(row, tau) for row in self.temperatures for tau in tau_s])

    def predicted_um(self, weights, bias, tau_s):
        return weights @ self.columns(tau_s) + bias

    def oracle_um(self, mean, spread):
        """out: the prediction of one who knows this machine's time constants, the means and spreads of the gains in
        its type and the noise: the most probable gains after the first days"""
        features = np.vstack([self.features, np.ones(len(self.seen_um))])  # the offset is any machine's own
        mean, precision = np.append(mean, 0), np.diag(np.append(spread ** -2.0, 0))
        known, seen = features[:, :NEW_DAYS * DAY:PROBE], self.seen_um[:NEW_DAYS * DAY:PROBE]
        noise = NOISE_UM ** 2 + DISTURBANCE_UM ** 2 * 2 * DISTURBANCE_S / (PROBE * STEP_S)
        gains = mean + np.linalg.solve(known @ known.T / noise + precision, known @ (seen - mean @ known) / noise)
        return gains @ features


class Trainer:
    """Runs `compbox train` in a folder of its own."""

    def __init__(self, program):
        self.program, self.place = program, tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.place.name)

    def term(self, machine, days, prior=None, moments=None):
        """in: names of files here. out: the term of its first days"""
        (self.folder / "data.csv").write_text(machine.table(days))
        words = ["train", "data.csv", "--outputs", "error_X_um", "--inputs", ",".join(INPUTS), "--hidden", "0",
                 "--threads", "1", "--name", "net", "-o", "net.json"]
        words += (["--prior", prior] if prior else []) + (["--moments", moments] if moments else [])
        self.run(*words)
        return json.loads((self.folder / "net.json").read_text())

    def prior(self, moments, name="prior.json"):
        """out: the prior of these files, as the file of this name"""
        self.run("prior", *moments, "-o", name)
        return json.loads((self.folder / name).read_text())["spaces"][-1]  # that of the shorter lags

    def run(self, *words):
        done = subprocess.run([self.program, *words], cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def bank_of(term):
    return term["terms"][0]["bank"]


def left_by(machine, term):
    bank = bank_of(term)
    return machine.left_um(machine.predicted_um(np.array(bank["weights"][0]), bank["bias"][0], bank["tau_s"]))


def left_by_mean(machine, prior):
    """out: what the brothers' mean leaves, with an offset from the machine's first days"""
    predicted, known = machine.predicted_um(np.array(prior["mean"][0]), 0.0, prior["bank"]["tau_s"]), \
        slice(0, NEW_DAYS * DAY, PROBE)
    return machine.left_um(predicted + np.mean((machine.seen_um - predicted)[known]))


KINDS = {  # relative spread of the gains in the type, and what is different
    "alike": (0.2, "machines of one type: gains spread by 20 %"),
    "unlike": (0.5, "gains spread by 50 %"),
    "nothing in common": (None, "gains of 4 µm/K times a normal number: no machine says anything about another"),
    "wrong brothers": (0.2, "as the first, and a fifth of the brothers has records with the opposite error, doubled"),
    "strange machine": (0.2, "as the first, and the new machine has gains as in the third row"),
}


class Type:
    """One type of machines. in: seed; a key of KINDS; how many machines"""

    def __init__(self, trainer, seed, kind, count):
        self.trainer, self.kind, self.dice = trainer, kind, np.random.default_rng(seed)
        self.spread, self.files = KINDS[kind][0], [f"moments-{k}.json" for k in range(count)]
        self.machines = [Machine(self.dice, self.gains()) for _ in self.files]
        for k, (machine, file) in enumerate(zip(self.machines, self.files)):
            trainer.term(self.as_recorded(machine, k), KNOWN_DAYS, moments=file)

    def gains(self, strange=False):
        if self.spread is None or strange:
            return 4 * self.dice.standard_normal(len(INPUTS))
        return MEAN_UM_PER_K * (1 + self.spread * self.dice.standard_normal(len(INPUTS)))

    def as_recorded(self, machine, number):
        """out: the machine, or one whose probe is wrong"""
        if self.kind != "wrong brothers" or number % 5:
            return machine
        wrong = copy.copy(machine)
        wrong.seen_um = machine.seen_um - 3 * machine.true_um
        return wrong

    def left_without(self, number):
        """The machine of this number is new: it has two days, and its brothers are the others.
        out: rms that its error, its own model, the brothers' mean, the shrunk model and the oracle leave; the share of
        its own model; the number of brothers that were not used"""
        machine = self.machines[number]
        if self.kind == "strange machine":
            machine = Machine(self.dice, self.gains(strange=True))
        prior = self.trainer.prior([file for k, file in enumerate(self.files) if k != number])
        own, shrunk = self.trainer.term(machine, NEW_DAYS), self.trainer.term(machine, NEW_DAYS, "prior.json")
        known = self.spread is not None
        oracle = machine.oracle_um(MEAN_UM_PER_K if known else 0 * MEAN_UM_PER_K,
                                   self.spread * np.abs(MEAN_UM_PER_K) if known else 4 * np.ones(len(INPUTS)))
        left = [machine.left_um(np.full(len(machine.true_um), np.mean(machine.true_um))), left_by(machine, own),
                left_by_mean(machine, prior), left_by(machine, shrunk), machine.left_um(oracle)]
        shares = shrunk["provenance"]["net"]["prior"]["shares"]["error_X_um"]
        return np.array([*left, shares["own"], len(prior["strange"][0])])
