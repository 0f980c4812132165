# SPDX-License-Identifier: MIT
"""Who runs the jobs: this computer, workers behind a Dask scheduler, or the array of a Slurm cluster."""

import concurrent.futures
import itertools
import json
import os
import pathlib
import shlex
import socket
import urllib.parse

from . import jobs
from .errors import FleetError
from .registry import read_json, write_file

DEATHS = 10  # of workers under one job before the job is lost
IN_FLIGHT = 4  # jobs for each worker: what waits takes memory in the scheduler


def run_or_lose(job, *texts):
    """jobs.run(); a computer that cannot run it loses the job, so that it is tried again by the next call."""
    try:
        return jobs.run(job, *texts)
    except FleetError as error:
        return {"lost": str(error)}


def here(workers):
    """in: jobs at once on this computer. out: an engine of training.train()"""
    def engine(given):
        with concurrent.futures.ThreadPoolExecutor(workers) as pool:  # a job is a process of compbox, and waits for it
            given, running = iter(given), {}
            try:
                while True:
                    for key, *what in itertools.islice(given, 2 * workers - len(running)):
                        running[pool.submit(run_or_lose, *what)] = key
                    if not running:
                        return
                    for future in concurrent.futures.wait(running, return_when="FIRST_COMPLETED").done:
                        yield running.pop(future), future.result()
            finally:
                pool.shutdown(cancel_futures=True)
    return engine


def dask(scheduler):
    """in: address of a scheduler, as tcp://host:8786. out: an engine of training.train()"""
    def engine(given):
        try:
            import cloudpickle
            import distributed
            import dask.config
        except ImportError as error:
            raise FleetError("Dask is missing; install the package python3-distributed") from error
        import fleet
        cloudpickle.register_pickle_by_value(fleet)
        run_there = ByValue(cloudpickle, run_or_lose)
        dask.config.set({"distributed.scheduler.allowed-failures": DEATHS})
        _knock(scheduler)
        try:
            client = distributed.Client(scheduler, timeout=10)
        except OSError as error:
            raise FleetError(f"{scheduler}: is no Dask scheduler: {error}") from error
        try:
            yield from _in_flight(distributed, client, run_there, given)
        finally:
            client.close()
    return engine


def _knock(scheduler):
    """Throws FleetError at once if no scheduler listens; Dask's client would try for long."""
    try:
        where = urllib.parse.urlsplit(scheduler)
        socket.create_connection((where.hostname, where.port or 8786), 5).close()
    except (OSError, ValueError) as error:
        raise FleetError(f"{scheduler}: no scheduler answers; start one by dask-scheduler") from error


class ByValue:
    """A function whose text goes to the workers: they need compbox, and not this package."""

    def __init__(self, cloudpickle, function):
        self.cloudpickle, self.content = cloudpickle, cloudpickle.dumps(function)

    def __reduce__(self):
        return self.cloudpickle.loads, (self.content,)

    def __call__(self, *arguments):
        return self.cloudpickle.loads(self.content)(*arguments)


def _in_flight(distributed, client, run_there, given):
    """out: (key, result) of each job, while some jobs for each worker are with the scheduler"""
    def submit(key, *what):
        return client.submit(run_there, *what, key=key)

    most = IN_FLIGHT * max(len(client.scheduler_info()["workers"]), 2)
    given = iter(given)
    running = distributed.as_completed([submit(*one) for one in itertools.islice(given, most)])
    for future in running:
        try:
            yield future.key, future.result()
        except distributed.KilledWorker:
            yield future.key, {"lost": f"{DEATHS} workers died under it"}
        future.release()
        for one in itertools.islice(given, 1):
            running.add(submit(*one))


ARRAY = """#!/bin/sh
#SBATCH --job-name=compbox-fleet
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task=1
#SBATCH --output=/dev/null
exec {compbox} fleet run-job {folder} "$SLURM_ARRAY_TASK_ID"
"""


def write_array(rows, registry, folder):
    """Writes an array script for sbatch, and the plan that its tasks read. Registry and folder lie on a file system
    that the cluster's computers share. in: rows of training.plan(), none of them done. out: the script"""
    folder, compbox = pathlib.Path(folder).resolve(), os.environ.get("COMPBOX_PROGRAM", "compbox")
    plan = {"registry": str(registry.folder.resolve()), "rows": rows}
    write_file(folder / "plan.json", json.dumps(plan, indent=1).encode() + b"\n")
    text = ARRAY.format(last=len(rows) - 1, compbox=shlex.quote(compbox), folder=shlex.quote(str(folder)))
    write_file(folder / "array.sh", text.encode())
    return folder / "array.sh"


def plan_of(folder):
    """out: the plan in a folder of write_array(). Throws FleetError for another folder."""
    plan = read_json(pathlib.Path(folder) / "plan.json")
    if not isinstance(plan, dict) or "rows" not in plan:
        raise FleetError(f"{folder}/plan.json: is no plan of `compbox fleet train --slurm`")
    return plan


def result_path(folder, row):
    return pathlib.Path(folder) / "results" / f"{row['job']}.json"
