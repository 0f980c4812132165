# SPDX-License-Identifier: MIT
"""The machines of a registry: what they are, their records and snapshots, and which of them drift."""

import json

from . import residuals
from .errors import FleetError
from .registry import digest, read_bytes, read_json

CUSUM_MOST = 10.0  # of a snapshot: beyond it the box has reason 22 (docs/snapshot.md)


def text_of(path):
    """out: (bytes, text). Throws FleetError for what is not UTF-8."""
    content = read_bytes(path)
    try:
        return content, content.decode()
    except UnicodeDecodeError as error:
        raise FleetError(f"{path}: is not UTF-8") from error


def add(registry, name, machine_file, outputs, train, kind):
    """Adds a machine, or changes its file and options; its records and its model stay.
    in: train: options of `compbox train` beside --outputs, --name and -o, in their order; kind: its type"""
    machine = read_json(machine_file)
    if not isinstance(machine, dict) or not isinstance(machine.get("signals"), list):
        raise FleetError(f"{machine_file}: is no machine file; `compbox init` makes one")
    entry = {"records": [], "snapshot": None, "model": None, "revision": int(machine.get("revision", 0))}
    if registry.has("machines", name):
        entry = registry.read("machines", name)
    entry.update(machine=registry.put(read_bytes(machine_file), "json"), outputs=outputs, train=train, type=kind)
    registry.write("machines", name, entry)


def add_record(registry, name, path):
    """Adds a record of the box to a machine's, at the end; one that it has stays where it is. out: its figures"""
    entry = registry.read("machines", name)
    content, text = text_of(path)
    data = digest(content)
    if not registry.has("data", data):
        figures = residuals.judged(text, path)
        registry.put(content, "csv")
        registry.write("data", data, {"machine": name, "residual": figures})
    if registry.read("data", data)["machine"] != name:
        raise FleetError(f"{path}: is a record of {registry.read('data', data)['machine']}, not of {name}")
    if data not in entry["records"]:
        entry["records"].append(data)
        registry.write("machines", name, entry)
    return registry.read("data", data)["residual"]


def add_snapshot(registry, name, path):
    """Keeps of a box's snapshot what judges its model; an older one than the kept one changes nothing."""
    entry, snapshot = registry.read("machines", name), read_json(path)
    if not isinstance(snapshot, dict) or snapshot.get("snapshot") != 1 or "unix_s" not in snapshot:
        raise FleetError(f"{path}: is no snapshot of compboxd")
    if entry["snapshot"] and entry["snapshot"]["unix_s"] >= snapshot["unix_s"]:
        return
    entry["snapshot"] = {key: snapshot.get(key) for key in ("unix_s", "mode", "reason", "revision", "crc")}
    entry["snapshot"]["adapted"] = [{key: one.get(key) for key in ("name", "innovation_um", "expected_um", "cusum")}
                                    for one in snapshot.get("adapted", [])]
    registry.write("machines", name, entry)


def forecast_of(registry, entry):
    """out: {probe: standard deviation that its model left of runs left out, um}; empty without a model"""
    return registry.read("models", entry["model"])["forecast_um"] if entry["model"] else {}


def measured_of(registry, entry):
    """out: {probe: figures of its newest record}; empty without a record"""
    return registry.read("data", entry["records"][-1])["residual"] if entry["records"] else {}


def findings(registry, entry):
    """in: a machine's entry. out: one sentence for each reason to train it again; none for a good machine"""
    found = []
    forecast = forecast_of(registry, entry)
    for probe, figures in sorted(measured_of(registry, entry).items()):
        rms, bound = figures["rms_um"], 2 * forecast.get(probe, float("inf"))
        if rms is not None and rms > bound:
            found.append(f"{probe}: residual {rms:.2f} um exceeds the forecast's 2 sigma {bound:.2f} um")
        if figures.get("drifted"):
            found.append(f"{probe}: {figures['drift']}")
    for one in (entry["snapshot"] or {}).get("adapted", []):
        if one["cusum"] is not None and abs(one["cusum"]) > CUSUM_MOST:
            found.append(f"{one['name']}: innovations lie to one side, CUSUM {one['cusum']:.1f}")
        elif one["expected_um"] and abs(one["innovation_um"]) > 3 * one["expected_um"]:
            found.append(f"{one['name']}: last innovation {one['innovation_um']:.2f} um is beyond three sigma of it")
    return found


def status(registry):
    """out: a row for each machine: its figures, and "drifts" with the findings"""
    rows = []
    for name in registry.names("machines"):
        entry = registry.read("machines", name)
        found = findings(registry, entry)
        rows.append({"machine": name, "type": entry["type"], "model": entry["model"], "records": len(entry["records"]),
                     "measured": measured_of(registry, entry), "forecast_um": forecast_of(registry, entry),
                     "drifts": bool(found), "findings": found})
    return rows


def status_text(rows):
    """out: a table, the machines that drift first, and a last line that counts"""
    lines = [f"{'machine':<24}{'type':<12}{'model':<10}{'records':>8}{'residual':>10}{'2 sigma':>9}  finding"]
    for row in sorted(rows, key=lambda one: not one["drifts"]):
        residual = max((one["rms_um"] for one in row["measured"].values() if one["rms_um"] is not None), default=None)
        bound = max((2 * sigma for sigma in row["forecast_um"].values()), default=None)
        missing = "no record" if not row["records"] else "no model" if not row["model"] else "good"
        said = "; ".join(row["findings"]) or missing
        lines.append(f"{row['machine']:<24}{row['type']:<12}{(row['model'] or '-')[:8]:<10}{row['records']:>8}"
                     f"{_um(residual):>10}{_um(bound):>9}  {said}")
    lines.append(f"{sum(row['drifts'] for row in rows)} of {len(rows)} machines drift")
    return "\n".join(lines)


def _um(value):
    return "-" if value is None else f"{value:.2f}"


def status_json(rows):
    return json.dumps(rows, indent=2, sort_keys=True)
