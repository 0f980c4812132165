# SPDX-License-Identifier: MIT
"""A simulated mill with its control, the box and compbox-view, as processes."""
import contextlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/hil"))

from fakeplc import FakePlc  # noqa: E402

BIN = pathlib.Path(os.environ.get("COMPBOX_BIN", ROOT / "build/host/bin"))
MILL = ROOT / "examples/bpnet-840d"
HOSTILE = "<img src=x onerror=alert(1)>&</h1>"  # a name has up to 39 bytes
HEARTBEAT_TIMEOUT_S = 0.2  # of the mill's file

TERMS = {"terms": [
    {"name": "EXX", "type": "polyline", "signal": "X", "positions": [0, 400, 800], "values": [0, 9, -6]},
    {"name": "EXZ", "type": "polyline", "signal": "Z", "positions": [0, 500], "values": [-4, 7]},
    {"name": "EYY", "type": "polyline", "signal": "Y", "positions": [0, 500], "values": [0, -12]},
    {"name": "EZZ", "type": "polyline", "signal": "Z", "positions": [0, 500], "values": [6, -6]},
    {"name": "warm_bearing", "type": "polynomial", "signal": "TX_bearing", "coefficients": [-60, 3]},
]}
SUMS = {"X": ["EXX", "EXZ", "warm_bearing"], "Y": ["EYY"], "Z": ["EZZ"]}


def write_file(folder, port, revision=1, name="mill 4"):
    """coefficients.json of the mill, checked by `compbox build`."""
    machine = json.loads((MILL / "machine.json").read_text())
    machine["revision"] = revision
    machine["machine"]["name"] = name
    machine["plc"]["transport"]["tcp"]["port"] = port
    for channel in machine["channels"]:
        channel.update(sum=SUMS[channel["name"]], limit_um=60, error_um=120)
    (folder / "machine.json").write_text(json.dumps(machine))
    (folder / "terms.json").write_text(json.dumps(TERMS))
    subprocess.run([BIN / "compbox", "build", "machine.json", "terms.json", "-o", "new.json"], cwd=folder, check=True,
                   capture_output=True)
    (folder / "new.json").rename(folder / "coefficients.json")
    return folder / "coefficients.json"


def mill():
    return FakePlc("--profile", "sinumerik-840d", "--machine", MILL / "machine_twin.json",
                   "--map", MILL / "machine.json")


def heed_ctrl_c():
    """A shell cannot trap a signal that its parent ignores, as a job in the background does."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextlib.contextmanager
def demo():
    """scripts/demo --view, ended as by Ctrl-C; gives the page's address."""
    running = subprocess.Popen(["scripts/demo", "--view"], cwd=ROOT, stdout=subprocess.PIPE, text=True,
                               start_new_session=True, preexec_fn=heed_ctrl_c)
    try:
        yield next(match[0] for line in running.stdout if (match := re.search(r"http://127\.0\.0\.1:\d+/", line)))
    finally:
        os.killpg(running.pid, signal.SIGINT)
        running.communicate(timeout=60)
    assert running.returncode == 0


class View:
    """compbox-view on the files of a folder; port 0: a free one."""

    def __init__(self, folder, port=0, *arguments):
        self.arguments = [BIN / "compbox-view", "--snapshot", folder / "snapshot.json", "--events",
                          folder / "events.jsonl", "--listen", f"127.0.0.1:{port}", *arguments]

    def __enter__(self):
        self.process = subprocess.Popen(self.arguments, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        assert line.startswith("compbox-view: listening on http://127.0.0.1:"), line
        self.url = line.split()[-1]
        self.port = int(self.url.rstrip("/").rsplit(":", 1)[1])
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(10)
        self.process.stdout.close()

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(10)
