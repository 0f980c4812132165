# SPDX-License-Identifier: MIT
"""examples/plant before Debian's Prometheus: it scrapes a real box, its rules load, fire, and know the metrics."""

import contextlib
import json
import re
import shutil
import subprocess
import urllib.parse
import urllib.request

from plant import ROOT, free_port, running_box, view, wait_for

FILES = ROOT / "examples/plant"


def get(url, accept="*/*"):
    with urllib.request.urlopen(urllib.request.Request(url, headers={"Accept": accept}), timeout=30) as reply:
        return reply.read().decode()


def address_of(process):
    return re.search(r"http://([\d.:]+)/", process.stdout.readline())[1]


@contextlib.contextmanager
def prometheus(folder, target):
    """The example's settings with this target, looked at every second. out: query(expression)"""
    for name in ("prometheus.yml", "compbox.rules.yml"):
        shutil.copy(FILES / name, folder)
    file = folder / "prometheus.yml"
    text = file.read_text().replace("127.0.0.1:8090", target)
    assert target in text
    file.write_text(text.replace("scrape_interval: 10s", "scrape_interval: 1s\n  evaluation_interval: 1s"))
    at = f"127.0.0.1:{free_port()}"
    process = subprocess.Popen(["prometheus", f"--config.file={file}", f"--storage.tsdb.path={folder / 'data'}",
                                f"--web.listen-address={at}"], stderr=subprocess.DEVNULL)

    def query(expression):
        try:
            found = json.loads(get(f"http://{at}/api/v1/query?query={urllib.parse.quote(expression)}"))
        except OSError:  # it is starting
            return {}
        return {entry["metric"].get("name", entry["metric"].get("alertname", "")): float(entry["value"][1])
                for entry in found["data"]["result"]}
    try:
        yield query
    finally:
        process.terminate()
        process.wait(60)


def test_the_rules_are_valid_and_fire_for_what_they_are_about():
    for arguments in (("check", "config", "prometheus.yml"), ("test", "rules", "compbox.rules.test.yml")):
        done = subprocess.run(["promtool", *arguments], cwd=FILES, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_prometheus_scrapes_a_box_and_reports_its_fault(tmp_path):
    with running_box(tmp_path) as plc, view(tmp_path) as process:
        with prometheus(tmp_path, address_of(process)) as query:
            wait_for(lambda: query("compbox_channel_output_um") == {"Z": -12.5})
            assert query("compbox_mode") == {"": 1}
            assert query("compbox_signal_value") == {"X": 500, "Y": 0, "Z": 0}
            assert query('ALERTS{alertname="CompboxFault"}') == {}
            plc.command("fault exception 4 100000 write")  # refused for long: a FAULT, which stays
            wait_for(lambda: query('ALERTS{alertname="CompboxFault",alertstate="firing"}') == {"CompboxFault": 1})


def test_the_metrics_are_valid_and_those_of_rules_and_dashboard_exist(tmp_path):
    with running_box(tmp_path), view(tmp_path) as process:
        at = address_of(process)
        wait_for(lambda: "compbox_signal_value{" in get(f"http://{at}/metrics"))
        text = get(f"http://{at}/metrics", "text/plain;version=0.0.4")  # promtool does not check OpenMetrics
    done = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    names = set(re.findall(r"^(compbox_\w+)", text, re.M))
    used = set()
    for name in ("compbox.rules.yml", "compbox.dashboard.json"):
        used |= set(re.findall(r"\bcompbox_\w+", (FILES / name).read_text()))
    assert len(used) > 10 and used <= names, used - names
