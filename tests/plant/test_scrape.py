# SPDX-License-Identifier: MIT
"""Debian's Prometheus scrapes compbox-view beside a real compboxd and fakeplc: its series are theirs."""

import json
import os
import pathlib
import subprocess
import sys
import urllib.parse
import urllib.request

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
os.environ.setdefault("COMPBOX_BIN", str(ROOT / "build/host/bin"))

from conftest import BIN, PLC, Compbox, term  # noqa: E402
from plant import free_port  # noqa: E402
from test_first_steps import FakePlc  # noqa: E402
from test_view import View, eventually  # noqa: E402

CONFIG = """
global: {{scrape_interval: 1s}}
scrape_configs:
  - job_name: compbox
    basic_auth: {{username: compbox, password_file: {folder}/password}}
    static_configs: [{{targets: ["127.0.0.1:{port}"]}}]
"""


class Prometheus:
    def __init__(self, folder, port):
        (folder / "prometheus.yml").write_text(CONFIG.format(folder=folder, port=port))
        subprocess.run(["promtool", "check", "config", folder / "prometheus.yml"], check=True, capture_output=True)
        self.port = free_port()
        self.process = subprocess.Popen(
            ["prometheus", f"--config.file={folder}/prometheus.yml", f"--storage.tsdb.path={folder}/data",
             f"--web.listen-address=127.0.0.1:{self.port}"], stderr=(folder / "prometheus.log").open("w"))

    def value(self, query):
        """out: the value of the one series; None: there is none, or it does not serve yet"""
        url = f"http://127.0.0.1:{self.port}/api/v1/query?" + urllib.parse.urlencode({"query": query})
        try:
            found = json.load(urllib.request.urlopen(url, timeout=10))["data"]["result"]
        except OSError:
            return None
        assert len(found) < 2, found
        return float(found[0]["value"][1]) if found else None


@pytest.fixture
def running(tmp_path):
    """out: fakeplc, compboxd and Prometheus, all at work"""
    compbox = Compbox(tmp_path)
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=1000,Y=1000,Z=1000", "-o",
                 "machine.json")
    machine = compbox.read("machine.json")
    compbox.write("EZX.json", term(values=(0, 40, 0)))
    (tmp_path / "password").write_text("correct horse\n")
    (tmp_path / "password").chmod(0o600)
    with FakePlc(tmp_path, "--map", "machine.json") as plc:
        machine["plc"]["transport"]["tcp"]["port"] = plc.port
        compbox.write("machine.json", machine)
        compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
        box = subprocess.Popen([BIN / "compboxd", "--config", "coefficients.json", "--snapshot", "snapshot.json"],
                               cwd=tmp_path, stderr=subprocess.DEVNULL)
        view = View(tmp_path, "--password-file", tmp_path / "password")
        prometheus = Prometheus(tmp_path, view.port)
        yield plc, box, prometheus
        for process in (prometheus.process, box):
            process.terminate()
            process.wait(60)
        view.end()


def test_its_series_are_the_boxs(running):
    plc, box, prometheus = running
    eventually(lambda: prometheus.value("compbox_up") == 1)
    eventually(lambda: prometheus.value("compbox_mode") == 1)
    plc.command("move X=250 feed=20000")
    eventually(lambda: abs((prometheus.value('compbox_channel_output_um{name="Z"}') or 0) + 20) < 0.5)
    x_mm = lambda: prometheus.value('compbox_signal_value{name="X",unit="mm"}')
    eventually(lambda: x_mm() == pytest.approx(250, abs=1e-3))
    assert prometheus.value("compbox_file_info") == 1
    # 33 cycles a second, in whatever time this machine takes for them: each has its wake-up in the histogram
    assert eventually(lambda: (prometheus.value("increase(compbox_cycles_total[30s])") or 0) > 0)
    all_of = 'compbox_wakeup_seconds_bucket{le="+Inf"} - ignoring(le) compbox_wakeup_seconds_count'
    assert prometheus.value(all_of) == 0
    assert 0 <= prometheus.value("histogram_quantile(0.5, compbox_wakeup_seconds_bucket)") <= 0.1

    plc.command("freeze heartbeat 1")
    eventually(lambda: prometheus.value("compbox_mode") in (0, 2, 3))
    assert eventually(lambda: prometheus.value("compbox_reason") == 4), "the PLC's heartbeat does not change"
    box.terminate()
    box.wait(60)
    eventually(lambda: prometheus.value("compbox_up") == 0)
    eventually(lambda: prometheus.value("compbox_mode") is None)  # no old value looks fresh
