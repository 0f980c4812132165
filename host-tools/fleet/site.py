# SPDX-License-Identifier: MIT
"""Runs a roll-out: between the pure steps of rollout.py it signs, sends, listens and writes the registry.

The state is in rollouts/ID.json. It is written before a file is sent because of it, and a repeated sending changes
nothing, so the command may be killed at any moment and called again."""

import time

from . import machines, rollout, signing
from .errors import FleetError
from .links import Residuals, payload_of
from .registry import read_bytes


def add_running(registry, name, path):
    """Keeps the coefficient file that a machine's box runs: what a roll-out returns to."""
    entry, text = registry.read("machines", name), machines.text_of(path)[1]
    file = machines.read_json(path)
    revision = file.get("revision") if isinstance(file, dict) else None
    if not isinstance(revision, int):
        raise FleetError(f"{path}: is no coefficient file")
    model = registry.put(rollout.with_revision(text, 0).encode(), "json")
    if not registry.has("models", model):
        registry.write("models", model, {"machine": name, "job": None, "data": [], "term": None, "parent": None,
                                         "forecast_um": {}, "signed": []})
    registry.write("machines", name, {**entry, "model": model, "revision": revision})


def offers(registry, without):
    """in: names of machines to leave alone. out: (offers of rollout.begun(), {machine: why it has none})"""
    found, left = [], {}
    for name in registry.names("machines"):
        entry = registry.read("machines", name)
        candidate = entry.get("candidate")
        if name in without or candidate is None or candidate == entry["model"]:
            continue
        measured = machines.measured_of(registry, entry)
        offer = {"machine": name, "from": entry["model"], "to": candidate, "revision": entry["revision"] + 1,
                 "forecast_um": registry.read("models", candidate)["forecast_um"],
                 "before_um": {probe: one["rms_um"] for probe, one in measured.items() if one["rms_um"] is not None},
                 "mean_um": {probe: one["mean_um"] for probe, one in measured.items() if one["mean_um"] is not None}}
        if entry["model"] is None:
            left[name] = "has no running file to return to; `compbox fleet running` adds it"
        elif not rollout.better(offer):
            left[name] = "its candidate promises no less than its model leaves"
        else:
            found.append(offer)
    return found, left


def unfinished(registry):
    """out: the state of the roll-out that is not over, or None"""
    states = (registry.read("rollouts", name) for name in registry.names("rollouts"))
    return next((state for state in states if not rollout.is_over(state)), None)


def settle(registry, state, name):
    """Writes the end of a machine's part into its entry; a repetition changes nothing."""
    part, entry = state["machines"][name], registry.read("machines", name)
    model = part["to"] if part["state"] == "good" else part["from"]
    if part["state"] not in ("waiting", "sent") and entry["revision"] < part["revision"]:
        rejected = entry.get("rejected", []) + ([part["to"]] if part["state"] in ("returning", "returned") else [])
        registry.write("machines", name, {**entry, "model": model, "revision": part["revision"], "candidate": None,
                                          "rejected": sorted(set(rejected))})


def prepare(registry, part, key):
    """Makes and signs the file of a machine that has to be sent one, and notes both in the registry."""
    model = part["to"] if part["state"] == "sent" else part["from"]
    text = rollout.with_revision(registry.get(model).decode(), part["revision"])
    signature = signing.signed(text, key)
    part.update(file=registry.put(text.encode(), "json"), signature=registry.put(signature.encode(), "minisig"))
    entry = registry.read("models", model)
    made = {"revision": part["revision"], "file": part["file"]}
    entry["signed"] = [one for one in entry["signed"] if {**one, **made} != one]  # of a command that was killed here
    entry["signed"].append({**made, "signature": part["signature"]})
    registry.write("models", model, entry)


class Runner:
    """in: a registry that is locked; a state; a link; path of the secret key"""

    def __init__(self, registry, state, link, key, most_failures):
        self.registry, self.state, self.link, self.key = registry, state, link, key
        self.most_failures, self.residuals, self.sent, self.settled = most_failures, Residuals(), {}, {}
        read_bytes(key)  # a missing key ends the command before anything is written
        registry.write("rollouts", state["id"], state)
        self.save_and_send()

    def save_and_send(self):
        """Signs what is new, writes the state, then sends."""
        due = {name: part for name, part in self.state["machines"].items()
               if part["state"] in ("sent", "returning", "left") and self.sent.get(name) != part["revision"]}
        for name, part in due.items():
            if part["file"] is None:
                prepare(self.registry, part, self.key)
        self.registry.write("rollouts", self.state["id"], self.state)
        for name, part in self.state["machines"].items():
            if self.settled.get(name) != part["state"]:
                settle(self.registry, self.state, name)
                self.settled[name] = part["state"]
        for name, part in due.items():
            texts = [self.registry.get(part[what]).decode() for what in ("file", "signature")]
            self.link.send(name, payload_of(*texts))
            self.sent[name] = part["revision"]

    def turn(self):
        """One poll and one step. out: whether the state changed"""
        news = False
        for name, revision, signals in self.link.poll():
            if name in self.state["machines"]:
                for probe, residual_um in self.residuals.feed(name, revision, signals):
                    rollout.reported(self.state, name, revision, probe, residual_um)
                    news = True
        changed = rollout.step(self.state, self.residuals.running, self.most_failures)
        if changed or news:
            self.save_and_send()
        return changed

    def run(self, wait_s, show):
        """in: seconds after which it ends, to be continued; show: is called with each changed state"""
        end = time.monotonic() + wait_s
        while not rollout.is_over(self.state) and time.monotonic() < end:
            if self.turn():
                show(self.state)
        return self.state


def line_of(state):
    """out: stage and numbers of machines in one line"""
    parts = ", ".join(f"{number} {name}" for name, number in sorted(rollout.counts(state).items()))
    return f"{state['id']}: {state['state']}, stage {state['stage'] + 1} of {len(state['stages'])}: {parts}"
