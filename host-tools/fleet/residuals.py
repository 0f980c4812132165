# SPDX-License-Identifier: MIT
"""What probes measured: the residuals that the compensation leaves, from a record of the box."""

import csv
import io
import json
import math
import pathlib
import tempfile

from . import tools
from .errors import FleetError


def probe_of(name):
    """in: an output or a channel. out: what its probe is called: "x" of error_X_um, of X and of probe_x"""
    return name.lower().removeprefix("probe_").removeprefix("error_").removesuffix("_um")


def is_new_count(was, now):
    """out: whether there was a probe between the two. A count that is lower began anew with its PLC, as a reference,
    unless it has passed 65535 (host-tools/metrology/probed_record.h)."""
    return now > was or was - now > 32768


def figures(values):
    """in: residuals, um. out: number, mean and rms; None of none"""
    count = len(values)
    if not count:
        return {"count": 0, "mean_um": None, "rms_um": None}
    return {"count": count, "mean_um": round(sum(values) / count, 4),
            "rms_um": round(math.sqrt(sum(v * v for v in values) / count), 4)}


def residuals_of(text, place):
    """in: a record with columns probe_NAME and probe_NAME_n. out: {name: [um]}, one for each is_new_count(); the first
    count is a reference. Throws FleetError for a table that is no such record."""
    rows = csv.reader(io.StringIO(text))
    header = next(rows, [])
    probes = {probe_of(name[:-2]): (header.index(name[:-2]), header.index(name)) for name in header
              if name.startswith("probe_") and name.endswith("_n") and name[:-2] in header}
    if not probes:
        raise FleetError(f"{place}: has no columns probe_NAME and probe_NAME_n")
    found, last = {name: [] for name in probes}, {}
    for row in rows:
        try:
            for name, (value, count) in probes.items():
                if row[count] == "":
                    continue
                now = _finite(row[count])
                if name in last and is_new_count(last[name], now):
                    found[name].append(_finite(row[value]))
                last[name] = now
        except (IndexError, ValueError) as error:
            raise FleetError(f"{place}: line {rows.line_num} has no number for a probe") from error
    return found


def _finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def judged(text, place):
    """in: a record. out: {name: figures with "drift": the finding of `compbox report --drift`, and "drifted"}"""
    found = residuals_of(text, place)
    entry = {name: figures(values) for name, values in found.items()}
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "record.csv").write_text(text, encoding="utf-8")
        tools.compbox("report", "record.csv", "--drift", "-o", "drift.json", folder=folder)
        report = json.loads((pathlib.Path(folder) / "drift.json").read_text(encoding="utf-8"))
    for name, drift in report.items():
        if probe_of(name) in entry:
            entry[probe_of(name)].update(drift=drift["finding"], drifted=drift["noticed"] is not None)
    return entry
