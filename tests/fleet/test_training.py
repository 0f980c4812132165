# SPDX-License-Identifier: MIT
"""Plan and training of `compbox fleet`: jobs by name, the same bytes from every engine, workers that die."""

import contextlib
import json
import os
import random
import shutil
import subprocess
import time

import psutil
import pytest

from fleets import cli
from fleet import jobs
from fleet.processes import free_port, listens
from fleet.registry import write_file
from twins import TRUTH, Twin


def test_a_job_is_named_by_its_inputs(plant, twin):
    plant.add_lathe("lathe-1", twin, 5)
    [row] = json.loads(plant.fleet("plan", "--json"))
    assert (row["machine"], row["why"], row["done"]) == ("lathe-1", "it has no model", False)
    assert row["job"] == jobs.name_of(row["what"])
    plant.fleet("add", "lathe-1", "machine.json", "--outputs", "error_X_um", "--train", "--inputs T1 --hidden 0")
    [other] = json.loads(plant.fleet("plan", "--json"))
    assert other["job"] != row["job"]
    plant.add_record("lathe-1", twin, 5)
    [third] = json.loads(plant.fleet("plan", "--json"))
    assert len({row["job"], other["job"], third["job"]}) == 3


def test_a_model_has_its_data_and_its_forecast(plant, twin):
    plant.add_lathe("lathe-1", twin)
    plant.add_record("lathe-1", twin, 3)
    assert plant.fleet("train", "--workers", 1) == "1 trained, 0 known before, 0 refused\n"
    machine = plant.entry("machines", "lathe-1")
    model = plant.entry("models", machine["candidate"])
    assert model["data"] == machine["records"] and model["parent"] is None
    assert plant.entry("jobs", model["job"])["model"] == machine["candidate"]
    assert model["forecast_um"]["x"] == pytest.approx(1.0, abs=0.15)  # the noise of the probe, 1 um
    [content] = plant.models().values()
    assert {"revision": 0, "format": "compbox/1"}.items() <= json.loads(content).items()


def test_a_known_job_is_not_computed(plant, twin):
    plant.add_lathe("lathe-1", twin, 5)
    plant.fleet("train", "--workers", 1)
    before = plant.everything()
    assert plant.fleet("train", "--all", "--workers", 1) == "0 trained, 1 known before, 0 refused\n"
    assert plant.everything() == before


def test_a_record_that_cannot_be_trained_on_costs_its_machine_alone(plant):
    plant.add_lathes(2)
    bad = "time_s,T9,probe_x,probe_x_n,comp_X_um,unix_s\n" + "".join(f"{k},1,2,{k},0,{k}\n" for k in range(50))
    plant.write("bad.csv", bad)
    plant.fleet("add", "bad", "machine.json", "--outputs", "error_X_um", "--train", "--inputs T1 --hidden 0")
    plant.fleet("record", "bad", "bad.csv")
    out = plant.fleet("train", "--workers", 1)
    assert out.startswith("bad: compbox train: ") and out.endswith("2 trained, 0 known before, 1 refused\n")
    assert plant.fleet("train", "bad").endswith("0 trained, 0 known before, 1 refused\n")  # the same inputs, the same


def test_the_same_bytes_from_1_2_and_8_workers_and_from_an_array(plant):
    count = 6 if cli.LONG else 3
    plant.add_lathes(count)
    shutil.copytree(plant.folder / "registry", plant.folder / "untrained")
    made = {}
    for workers in (1, 2, 8):
        plant.fleet("train", "--workers", workers)
        made[workers] = plant.models()
        shutil.rmtree(plant.folder / "registry")
        shutil.copytree(plant.folder / "untrained", plant.folder / "registry")
    assert f"{count} jobs: sbatch" in plant.fleet("train", "--slurm", "array")
    script = (plant.folder / "array/array.sh").read_text()
    assert f"#SBATCH --array=0-{count - 1}\n" in script
    for task in random.Random(1).sample(range(count), count):  # as sbatch runs it
        subprocess.run(["/bin/sh", "array/array.sh"], cwd=plant.folder, check=True,
                       env=dict(os.environ, SLURM_ARRAY_TASK_ID=str(task)))
    assert plant.fleet("collect", "array") == f"{count} trained, 0 known before, 0 refused\n"
    made["array"] = plant.models()
    assert len(made[1]) == count and all(models == made[1] for models in made.values())


def test_a_task_of_an_array_that_died_is_named(plant):
    plant.add_lathes(2)
    plant.fleet("train", "--slurm", "array")
    plant.fleet("run-job", "array", 1)
    done = plant("fleet", "collect", "array")
    assert done.returncode == 1 and "1 jobs have no result, that of m000 first" in done.stderr
    plant.fleet("run-job", "array", 0)
    assert plant.fleet("collect", "array") == "1 trained, 1 known before, 0 refused\n"
    assert "has no job 2, but 0 to 1" in plant.refusal("run-job", "array", 2)


def test_a_refused_task_of_an_array_is_told_also_if_its_machine_has_a_record_more(plant):
    plant.add_lathes(1)
    plant.fleet("train", "--slurm", "array")
    [row] = plant.read("array/plan.json")["rows"]
    write_file(plant.folder / f"array/results/{row['job']}.json", b'{"failed": "compbox train: it is too short"}')
    plant.add_record("m000", Twin(7), 1)
    assert plant.fleet("collect", "array") == \
        "m000: compbox train: it is too short\n0 trained, 0 known before, 1 refused\n"


def workers_below(process):
    """out: the living workers of a dask-worker, each below its nanny"""
    found = []
    for one in process.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            if "spawn_main" in " ".join(one.cmdline()):
                found.append(one)
    return found


@contextlib.contextmanager
def scheduler(folder, workers, longer_s=0.2):
    """A scheduler and workers as Dask's documentation starts them; compbox takes a while longer there. out: (address,
    the process above the workers)"""
    slow = folder / "compbox"
    slow.write_text(f'#!/bin/sh\n[ "$1" = train ] && sleep {longer_s}\nexec {cli.BIN}/compbox "$@"\n')
    slow.chmod(0o755)
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "COMPBOX"))}
    environment["PATH"] = f"{folder}:/usr/bin:/bin"  # so workers find compbox, and know nothing of this package
    quiet = {"env": environment, "cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen(["dask-scheduler", "--host", address, "--no-dashboard"], **quiet),
               subprocess.Popen(["dask-worker", address, "--nworkers", str(workers), "--nthreads", "1",
                                 "--no-dashboard", "--local-directory", folder], **quiet)]
    try:
        while not listens(port):
            time.sleep(0.05)
        yield address, psutil.Process(started[1].pid)
    finally:
        for process in reversed(started):
            for child in psutil.Process(process.pid).children(recursive=True):
                child.kill()
            process.kill()
            process.wait(60)


def test_killed_workers_cost_their_jobs_only(plant, tmp_path_factory):
    plant.add_lathes(6)
    shutil.copytree(plant.folder / "registry", plant.folder / "untrained")
    plant.fleet("train", "--workers", 2)
    expected = plant.models()
    shutil.rmtree(plant.folder / "registry")
    shutil.copytree(plant.folder / "untrained", plant.folder / "registry")
    with scheduler(tmp_path_factory.mktemp("dask"), 2) as (address, above):
        training = subprocess.Popen([cli.BIN / "compbox", "fleet", "train", "--scheduler", address], cwd=plant.folder,
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        dice, killed = random.Random(2), 0
        while training.poll() is None:
            time.sleep(0.05)
            ended = len(list((plant.folder / "registry/models").glob("*")))
            workers = workers_below(above)
            if killed < 2 and workers and ended > 2 * killed:
                dice.choice(workers).kill()
                killed += 1
        out, errors = training.communicate()
    assert killed == 2 and out == "6 trained, 0 known before, 0 refused\n", (killed, out, errors)
    assert plant.models() == expected


def test_no_scheduler(plant, twin):
    plant.add_lathe("lathe-1", twin, 2)
    sentence = plant.refusal("train", "--scheduler", f"tcp://127.0.0.1:{free_port()}")
    assert sentence.endswith("no scheduler answers; start one by dask-scheduler")


def test_a_machine_that_drifts_is_due_again(plant):
    worn = Twin(3)
    plant.add_lathe("worn", worn)
    assert "  no model\n" in plant.fleet("status")
    plant.fleet("train", "--workers", 1)
    registry = plant.folder / "registry/machines/worn.json"
    entry = json.loads(registry.read_text())
    registry.write_text(json.dumps({**entry, "model": entry["candidate"]}))
    plant.add_record("worn", worn, 2, compensated=TRUTH)
    assert plant.fleet("plan") == "0 of 0 jobs to do\n" and "  good\n" in plant.fleet("status")
    plant.add_record("worn", worn, 2, compensated=TRUTH, shift_um=5)
    assert "residual 5." in plant.fleet("plan") and "1 of 1 jobs to do" in plant.fleet("plan")
