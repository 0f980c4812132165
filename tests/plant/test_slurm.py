# SPDX-License-Identifier: MIT
"""The array of `compbox fleet train --slurm` on Debian's Slurm, a cluster of this one computer."""

import contextlib
import os
import pathlib
import shutil
import socket
import subprocess
import sys

from plant import ROOT, free_port, wait_for

sys.path.insert(0, str(ROOT / "tests/fleet"))
from fleets import Fleet  # noqa: E402

CONF = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


@contextlib.contextmanager
def slurm(folder):
    """Starts munged, slurmctld and slurmd in this folder. out: the environment of sbatch"""
    host, ports = socket.gethostname().split(".")[0], (free_port(), free_port())
    for name in ("state", "spool"):
        (folder / name).mkdir()
    (folder / "munge.key").write_bytes(os.urandom(1024))
    (folder / "munge.key").chmod(0o600)
    (folder / "slurm.conf").write_text(CONF.format(host=host, folder=folder, ports=ports))
    environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"))
    files = [f"--{what}-file={folder}/munge.{what}" for what in ("key", "pid", "log", "seed")]
    munge = ["munged", "-F", "--force", *files, f"--socket={folder}/munge.sock"]
    started = []
    with open(folder / "log", "w") as log:
        def start(*words):
            started.append(subprocess.Popen(words, env=environment, stdout=log, stderr=log))

        def is_idle():
            state = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True)
            return state.stdout.strip() == "idle"
        try:
            start(*munge)
            wait_for((folder / "munge.sock").exists)
            start("slurmctld", "-D")
            start("slurmd", "-D", "-N", host)
            wait_for(is_idle)
            yield environment
        finally:
            for process in reversed(started):
                process.terminate()
                process.wait(60)


def test_the_same_bytes_from_slurm_and_from_this_computer():
    # munged wants a folder that nobody else may write to, and a short name of the socket
    folder = pathlib.Path("/run/compbox-slurm-test")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(mode=0o755)
    try:
        plant = Fleet(folder / "plant")
        plant.folder.mkdir()
        plant.add_lathes(6)
        shutil.copytree(plant.folder / "registry", plant.folder / "untrained")
        plant.fleet("train", "--workers", 2)
        here = plant.models()
        shutil.rmtree(plant.folder / "registry")
        (plant.folder / "untrained").rename(plant.folder / "registry")
        plant.fleet("train", "--slurm", "array")
        with slurm(folder) as environment:
            subprocess.run(["sbatch", "--wait", plant.folder / "array/array.sh"], env=environment, check=True,
                           cwd=plant.folder, timeout=120)
        assert plant.fleet("collect", "array") == "6 trained, 0 known before, 0 refused\n"
        assert len(here) == 6 and plant.models() == here
    finally:
        shutil.rmtree(folder)
