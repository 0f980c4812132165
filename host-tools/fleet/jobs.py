# SPDX-License-Identifier: MIT
"""A training job: a pure function of files and options. Its name is the hash of them, so a repeated job is found and
not computed. Workers run this module from its text: it needs compbox there, and no registry."""

import pathlib
import tempfile

from . import tools
from .errors import FleetError
from .registry import canonical, digest

MODEL, TERM, MOMENTS, PRIOR = "coefficients.json", "net.json", "moments.json", "prior.json"
NO_BANK = ("--lags", "--squares", "--slope", "--hidden-inputs", "--no-linear-path", "--keep-network", "--regularise")


def has_bank(train):
    """in: options of `compbox train`. out: whether their model is a bank, which brothers can share"""
    return not any(word.startswith(NO_BANK) for word in train)


def job_of(entry, version, brothers=()):
    """in: a machine's entry; the version of compbox; hashes of the moments of its brothers.
    out: the job that trains its model from all its records, and from what the brothers know"""
    train = ["train", "data.csv", "--outputs", ",".join(entry["outputs"]), *entry["train"], "--threads", "1",
             "--name", "net", "-o", TERM]
    steps = [["join", "record.csv", "-o", "data.csv"], train,
             ["build", "machine.json", TERM, "--revision", "0", "-o", MODEL],
             ["check", MODEL]]
    if has_bank(entry["train"]):
        train += ["--moments", MOMENTS]
    if brothers:
        train += ["--prior", PRIOR]
        steps.insert(0, ["prior", *map(name_of_brother, range(len(brothers))), "-o", PRIOR])
    return {"version": version, "steps": steps, "machine": entry["machine"], "records": entry["records"],
            "brothers": list(brothers)}


def name_of_brother(number):
    return f"brother-{number}.json"


def name_of(job):
    return digest(canonical(job))


def joined(records):
    """in: texts of records of one box, in their order. out: one table. Throws FleetError for other columns."""
    header = records[0].split("\n", 1)[0]
    for number, text in enumerate(records, 1):
        if text.split("\n", 1)[0] != header:
            raise FleetError(f"record {number} has other columns than the first one")
    return "\n".join([header, *(text.split("\n", 1)[1].strip("\n") for text in records)]) + "\n"


def run(job, machine, records, brothers):
    """in: a job; the text of its machine file, of its records and of its brothers' moments. out: {"files": {name:
    text}}, or {"failed": sentence} if compbox refuses the inputs, which it would do again. Throws FleetError if this
    computer cannot run the job."""
    if tools.version() != job["version"]:
        raise FleetError(f"this computer has {tools.version()}, and the job needs {job['version']}")
    with tempfile.TemporaryDirectory(prefix="compbox-fleet-") as name:
        folder = pathlib.Path(name)
        (folder / "machine.json").write_text(machine, encoding="utf-8")
        for number, text in enumerate(brothers):
            (folder / name_of_brother(number)).write_text(text, encoding="utf-8")
        try:
            (folder / "record.csv").write_text(joined(records), encoding="utf-8")
            for step in job["steps"]:
                tools.compbox(*step, folder=folder)
        except FleetError as error:
            return {"failed": str(error)}
        made = (file for file in (TERM, MODEL, MOMENTS, PRIOR) if (folder / file).exists())
        return {"files": {file: (folder / file).read_text(encoding="utf-8") for file in made}}
