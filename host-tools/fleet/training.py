# SPDX-License-Identifier: MIT
"""From machines to jobs, and from results to models in the registry."""

import json

from . import jobs, machines, tools
from .registry import canonical, digest
from .residuals import probe_of


LEAST_BROTHERS, MOST_BROTHERS = 5, 40


def known_by_type(registry):
    """out: {what brothers have in common: {space of the weights: [(machine, moments of its running model)]}}, of
    machines that do not drift. A running model has passed a roll-out."""
    found = {}
    for name in sorted(registry.names("machines"), key=lambda one: digest(one.encode())):
        entry = registry.read("machines", name)
        model = registry.read("models", entry["model"]) if entry["model"] else {}
        if model.get("moments") and not machines.findings(registry, entry):
            spaces = found.setdefault(common_of(entry), {})
            spaces.setdefault(model["space"], []).append((name, model["moments"]))
    return found


def common_of(entry):
    return canonical([entry["type"], entry["outputs"], entry["train"]])


def brothers_of(known, name, entry):
    """out: moments of a machine's brothers in the space that most have, at most MOST_BROTHERS; or none"""
    spaces = known.get(common_of(entry), {}).values()
    others = [[moments for other, moments in one if other != name] for one in spaces]
    most = max(others, key=len, default=[])[:MOST_BROTHERS]
    return most if len(most) >= LEAST_BROTHERS else []


def plan(registry, only, everything):
    """in: names of machines (none: all); whether those that need no training have a job too.
    out: a row for each machine with records, by name: its job, the job's name, why, and whether it is done"""
    rows, version, known = [], tools.version(), known_by_type(registry)
    for name in only or registry.names("machines"):
        entry = registry.read("machines", name)
        why = machines.findings(registry, entry) if entry["model"] else ["it has no model"]
        if not entry["records"] or not (why or everything or only):
            continue
        job = jobs.job_of(entry, version, brothers_of(known, name, entry))
        rows.append({"machine": name, "job": jobs.name_of(job), "what": job, "why": "; ".join(why) or "asked for",
                     "done": registry.has("jobs", jobs.name_of(job))})
    return rows


def inputs_of(registry, job):
    """out: the texts that jobs.run() takes"""
    records, brothers = ([registry.get(name).decode() for name in job[kind]] for kind in ("records", "brothers"))
    return registry.get(job["machine"]).decode(), records, brothers


def forecast(term):
    """in: the term of `compbox train`. out: {probe: rms of the residuals of runs left out of the training, um}"""
    left = term["provenance"]["net"]["written"]["left_out"]
    return {probe_of(output): figures["rms"] for output, figures in left.items()}


def take(registry, row, result):
    """Puts a job's result into the registry: the model becomes the machine's candidate.
    in: a row of plan(); what jobs.run() returned. out: the model's hash, or None for a refused job"""
    entry = {"machine": row["machine"], "what": row["what"], "model": None, "failed": result.get("failed")}
    if "files" in result:
        files = {name: text.encode() for name, text in result["files"].items()}
        model = entry["model"] = registry.put(files[jobs.MODEL], "json")
        machine = registry.read("machines", row["machine"])
        space = digest(canonical(json.loads(files[jobs.MOMENTS])["bank"])) if jobs.MOMENTS in files else None
        moments, prior = (registry.put(files[name], "json") if name in files else None
                          for name in (jobs.MOMENTS, jobs.PRIOR))
        if not registry.has("models", model):
            registry.write("models", model, {
                "machine": row["machine"], "job": row["job"], "data": row["what"]["records"],
                "term": registry.put(files[jobs.TERM], "json"), "moments": moments, "space": space,
                "prior": prior,
                "parent": machine["model"],
                "forecast_um": forecast(json.loads(files[jobs.TERM])), "signed": []})
    registry.write("jobs", row["job"], entry)
    finish(registry, row)
    return entry["model"]


def finish(registry, row):
    """Makes the model of a done job the machine's candidate, unless a roll-out rejected it. out: the job's entry"""
    done, machine = registry.read("jobs", row["job"]), registry.read("machines", row["machine"])
    refused = (None, machine["model"], machine.get("candidate"), *machine.get("rejected", []))
    if done["model"] not in refused:
        registry.write("machines", row["machine"], {**machine, "candidate": done["model"]})
    return done


def train(registry, rows, engine, progress):
    """in: rows of plan(); engine: a function of [(key, job, machine, records)] that yields (key, result) in any order,
    where a result may be {"lost": sentence}. out: {"trained", "cached", "failed", "lost": names of machines}"""
    ended = {"trained": [], "cached": [], "failed": [], "lost": []}
    todo = {row["job"]: row for row in rows if not row["done"]}
    for row in rows:
        if row["done"]:
            ended["failed" if finish(registry, row)["failed"] else "cached"].append(row["machine"])
    given = ((row["job"], row["what"], *inputs_of(registry, row["what"])) for row in todo.values())
    for number, (key, result) in enumerate(engine(given) if todo else (), 1):
        if "lost" in result:
            ended["lost"].append(todo[key]["machine"])
        else:
            ended["trained" if take(registry, todo[key], result) else "failed"].append(todo[key]["machine"])
        progress(number, len(todo))
    return ended
