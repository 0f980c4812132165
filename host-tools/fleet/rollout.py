# SPDX-License-Identifier: MIT
"""The state of a roll-out and its steps. These functions are pure: a state and what boxes reported give the next state.

A machine is waiting, sent (its box has to take the file and to measure), good, returning (its box has to take the old
model again), returned, or left (its box is awaited no more). States move forward only, and each is written before
anything is sent because of it."""

import math
import re
import statistics

import json

from .errors import FleetError
from .registry import canonical, digest
from .residuals import figures

PROBES = 8  # of each kind before a machine is judged
WORSE = 1.5  # times the residual before the roll-out: more is no better model, whatever the forecast says
AWAY = 0.1  # of a stage, and one machine at least, may be away when the next one begins; the canary may not


def with_revision(text, revision):
    """out: the same coefficient file with another revision"""
    made = re.sub(r'("revision":\s*)\d+', rf"\g<1>{revision}", text, count=1)
    if json.loads(made) != {**json.loads(text), "revision": revision}:
        raise FleetError("the coefficient file has no revision at its beginning; build it by compbox build")
    return made


def stages_of(count):
    """out: numbers of machines after each stage: one, 1 %, 10 %, all; equal ones once"""
    return sorted({1, math.ceil(count / 100), math.ceil(count / 10), count} - {0})


def suspicion(means):
    """in: {machine: {probe: mean of its newest record, um}}. out: {machine: distance from the median of all, um}, the
    largest of its probes"""
    probes = {probe for row in means.values() for probe in row}
    middle = {probe: statistics.median(row[probe] for row in means.values() if probe in row) for probe in probes}
    return {name: max((abs(row[probe] - middle[probe]) for probe in row), default=0.0) for name, row in means.items()}


def begun(offers, canary=None):
    """in: [{"machine", "from", "to", "revision", "forecast_um": {probe: um}, "before_um", "mean_um": the same}].
    out: a new state. The canary is the machine whose record differs most from the others: what is wrong shows there."""
    doubt = suspicion({offer["machine"]: offer["mean_um"] for offer in offers})
    order = sorted(doubt, key=lambda name: (name != canary, -doubt[name], name))
    machines = {}
    for offer in offers:
        bound = {probe: round(min(2 * sigma, WORSE * offer["before_um"].get(probe, math.inf)), 4)
                 for probe, sigma in offer["forecast_um"].items()}
        machines[offer["machine"]] = {"from": offer["from"], "to": offer["to"], "revision": offer["revision"],
                                      "bound_um": bound, "before_um": offer["before_um"], "state": "waiting",
                                      "file": None, "signature": None, "seen_um": {}}
    return {"id": digest(canonical(machines))[:16], "order": order, "stages": stages_of(len(order)), "stage": 0,
            "state": "running", "why": None, "machines": machines}


def better(offer):
    """out: whether the candidate promises less than the running model leaves, by every probe"""
    return bool(offer["forecast_um"]) and all(
        probe in offer["before_um"] and sigma < offer["before_um"][probe]
        for probe, sigma in offer["forecast_um"].items())


def reported(state, name, revision, probe, residual_um):
    """Takes a probe of a box that runs a revision; one of another revision than the one sent counts for nothing."""
    machine = state["machines"].get(name)
    if machine and machine["state"] == "sent" and revision == machine["revision"] and probe in machine["bound_um"]:
        machine["seen_um"].setdefault(probe, []).append(residual_um)


def verdict(machine):
    """out: None before it has all its probes; "" for a good machine; else a sentence"""
    seen = {probe: machine["seen_um"].get(probe, []) for probe in machine["bound_um"]}
    if any(len(values) < PROBES for values in seen.values()):
        return None
    for probe, values in sorted(seen.items()):
        rms, bound = figures(values)["rms_um"], machine["bound_um"][probe]
        if not rms <= bound:
            return f"{probe}: residual {rms:.2f} um of {len(values)} probes exceeds {bound:.2f} um"
    return ""


def give_back(machine):
    """The next revision has the old model."""
    machine.update(state="returning", revision=machine["revision"] + 1, file=None, signature=None)


def leave(state, name, why):
    """Awaits a machine's box no more; one that was sent the new model is sent the old one. A machine that is judged
    stays."""
    machine = state["machines"].get(name)
    if machine is None or machine["state"] in ("good", "returned", "left"):
        return
    if "why" not in machine:  # it is no failure: the next in the order takes its place
        state["order"].remove(name)
    if machine["state"] == "waiting":
        del state["machines"][name]
        return
    if machine["state"] == "sent":
        give_back(machine)
    machine.update(state="left", why=machine.get("why", why))


def step(state, running, most_failures=0.1):
    """Judges what was reported. in: running: {machine: revision that its box runs}; most_failures: part of a stage's
    machines that may fail. Changes state. out: whether it changed"""
    before = canonical(state)
    for name, machine in list(state["machines"].items()):
        if machine["state"] == "sent" and running.get(name, 0) > machine["revision"]:  # it refuses what is older
            leave(state, name, f"its box runs revision {running[name]}, above the {machine['revision']} that it was "
                               "sent; `compbox fleet running` adds its file")
    group = [state["machines"][name] for name in state["order"][:state["stages"][state["stage"]]]]
    for name, machine in state["machines"].items():
        said = verdict(machine) if machine["state"] == "sent" else None
        if said == "":
            machine["state"] = "good"
        elif said:
            machine["why"] = said
            give_back(machine)
            failed = sum("why" in one for one in group)
            if state["state"] == "running" and (state["stage"] == 0 or failed > most_failures * len(group)):
                state.update(state="halted", why=f"{name}: {said}; {failed} of {len(group)} machines failed")
        if machine["state"] == "returning" and running.get(name, 0) >= machine["revision"]:
            machine["state"] = "returned"
    if state["state"] == "halted":
        for machine in state["machines"].values():
            if machine["state"] in ("sent", "good"):
                give_back(machine)
    elif state["state"] == "running":
        _advance(state, group)
    return canonical(state) != before


def _advance(state, group):
    """Sends to the group; begins the next stage when enough of this one is judged, and ends after the last one."""
    for machine in group:
        if machine["state"] == "waiting":
            machine["state"] = "sent"
    judged = sum(machine["state"] in ("good", "returned", "left") for machine in group)
    last = state["stage"] == len(state["stages"]) - 1
    if last and judged == len(group):
        state["state"] = "done"
    elif not last and len(group) - judged <= (max(1, AWAY * len(group)) if state["stage"] else 0):
        state["stage"] += 1
        _advance(state, [state["machines"][name] for name in state["order"][:state["stages"][state["stage"]]]])


def is_over(state):
    """out: whether nothing has to be sent or awaited"""
    return state["state"] != "running" and all(
        machine["state"] not in ("sent", "returning") for machine in state["machines"].values())


def counts(state):
    """out: {state of a machine: how many}"""
    found = {}
    for machine in state["machines"].values():
        found[machine["state"]] = found.get(machine["state"], 0) + 1
    return found
