# SPDX-License-Identifier: MIT
"""compbox fleet demo: broker, database, bridge, alerts, page, a real box and simulated ones, and what its end leaves;
the bridge while the database is away; the rules and the dashboard of a site."""

import contextlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request

import psutil
import pytest

from plant import BIN, ROOT, Broker, free_port, wait_for

sys.path[:0] = [str(ROOT / "host-tools"), str(ROOT / "tests/view")]
from browser import Browser  # noqa: E402
from fleet import bridge, links, pages, processes  # noqa: E402
from fleet.errors import FleetError  # noqa: E402

FILES, PICTURES = ROOT / "examples/plant", ROOT / "build/plant"
BOXES = {f"lathe-{number}" for number in range(1, 6)}


def get(address):
    with urllib.request.urlopen(address, timeout=30) as reply:
        return reply.read().decode()


def samples(database, query):
    """out: {box: value}"""
    try:
        found = json.loads(get(f"{database}/api/v1/query?" + urllib.parse.urlencode({"query": query})))
    except OSError:
        return {}
    return {one["metric"].get("box"): float(one["value"][1]) for one in found["data"]["result"]}


@contextlib.contextmanager
def started(folder):
    """out: (the process of the demo, {name: address})"""
    process = subprocess.Popen([BIN / "compbox", "fleet", "demo", "-o", "site"], cwd=folder, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    try:
        found = dict(re.match(r"(.*): {2,}(\S+)", process.stdout.readline()).groups() for _ in range(5))
        yield process, found
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(60)


@contextlib.contextmanager
def browser(address):
    one = Browser()
    try:
        one.look("panel")
        one.open(address)
        yield one.driver
    finally:
        one.close()


def test_the_demo_from_its_start_to_its_end(tmp_path):
    with started(tmp_path) as (process, at):
        database, page = at["database"].removesuffix("/vmui"), at["page of all boxes"]
        wait_for(lambda: set(samples(database, "compbox_channel_output_um")) == BOXES)
        assert set(samples(database, "compbox_mode == 1")) == BOXES
        assert set(samples(database, "compbox_online == 1")) == BOXES
        wait_for(lambda: samples(database, 'ALERTS{alertname="CompboxDrift",alertstate="firing"}'))
        assert set(samples(database, 'ALERTS{alertname="CompboxDrift"}')) == {"lathe-3"}
        wait_for(lambda: [one["labels"]["box"] for one in json.loads(get(page + "alerts"))] == ["lathe-3"])
        assert "compbox" in get(at["page of lathe-1, the real box"])
        with browser(page + "#lathe-3") as driver:
            wait_for(lambda: "CompboxDrift" in driver.page_source and driver.page_source.count("<polyline") >= 3)
            assert "5 boxes, 1 to look at" in driver.page_source
            PICTURES.mkdir(parents=True, exist_ok=True)
            driver.save_screenshot(str(PICTURES / "site.png"))
        children = psutil.Process(process.pid).children(recursive=True)
        assert {"mosquitto", "victoria-metrics", "vmalert", "compboxd", "compbox-view", "fakeplc"} <= {
            child.name() for child in children}
        listens_elsewhere = [one for child in children for one in child.connections()
                             if one.status == psutil.CONN_LISTEN and one.laddr.ip != "127.0.0.1"]
        assert not listens_elsewhere
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0 and process.stderr.read() == ""
        assert not [child for child in children if child.is_running() and child.status() != psutil.STATUS_ZOMBIE]


def test_a_killed_demo_leaves_no_process(tmp_path):
    with started(tmp_path) as (process, _):
        children = psutil.Process(process.pid).children(recursive=True)
        assert len(children) >= 6
        process.kill()
        process.wait(60)
        wait_for(lambda: not [child for child in children
                              if child.is_running() and child.status() != psutil.STATUS_ZOMBIE])


def test_a_box_sees_its_own_topics_alone(tmp_path):
    with started(tmp_path) as (_, at):
        port, folder = at["broker"].rstrip(",").rsplit(":", 1)[1], tmp_path / "site"
        words = ["mosquitto_sub", "-h", "127.0.0.1", "-p", port, "--cafile", folder / "ca.pem", "-t", "#", "-F", "%t",
                 "-W", "6", "-u", "lathe-2", "-P", (folder / "lathe-2.password").read_text().strip()]
        seen = set(subprocess.run(words, capture_output=True, text=True).stdout.split())
        assert seen and {topic.split("/")[1] for topic in seen} == {"lathe-2"}
        assert (folder / "lathe-2.password").stat().st_mode & 0o077 == 0


@contextlib.contextmanager
def victoria(folder, port):
    process = subprocess.Popen(["victoria-metrics", "-storageDataPath", folder / "data", "-httpListenAddr",
                                f"127.0.0.1:{port}", "-search.latencyOffset", "0s"], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait(60)


def test_values_of_an_absence_have_their_own_times(tmp_path):
    """The box was away for two days, and the database while its messages arrived."""
    now, port, end = time.time(), free_port(), threading.Event()
    ages = [2 * 86400 - 600 * k for k in range(200)]
    with Broker(tmp_path) as broker:
        link = links.Mqtt(broker.at, "compbox", 0.1, follow=("+/online", "+/state", "+/values"))
        database = bridge.Database(f"http://127.0.0.1:{port}")
        running = threading.Thread(target=bridge.run, args=(link, database, dict, end.is_set))
        running.start()
        box = links.Mqtt(broker.at, "compbox", 0.1, follow=())
        box.client.publish("compbox/lathe-9/values", "no JSON", 1)
        for count, age in enumerate(ages):
            values = {"values": 1, "unix_s": now - age, "mode": "ACTIVE", "terms": {}, "channels": {},
                      "signals": {"T1": 20.0 + count, "text": None}}
            box.client.publish("compbox/lathe-9/values", json.dumps(values), 1)
        wait_for(lambda: len(database.waiting) == 2 * len(ages))
        with victoria(tmp_path, port):
            wait_for(lambda: database.written == 2 * len(ages))
            at = f"http://127.0.0.1:{port}"
            wait_for(lambda: samples(at, "count_over_time(compbox_signal_value[3d])") == {"lathe-9": len(ages)})
            middle = f"compbox_signal_value @ {now - ages[77]:.3f}"
            assert samples(at, middle) == {"lathe-9": 20.0 + 77}
        end.set()
        running.join()
        box.close()
        link.close()


def test_the_rules_are_valid_and_fire_for_what_they_are_about():
    done = subprocess.run(["promtool", "test", "rules", "compbox.site.rules.test.yml"], cwd=FILES, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_rules_dashboard_and_page_use_metrics_of_the_bridge():
    lines = bridge.Lines()
    made = lines.of("b", "online", 1, 1.0) + lines.of("b", "state", {"runs": True, "revision": 1}, 1.0)
    for count in (1, 2):
        made += lines.of("b", "values", {"unix_s": 1.0, "mode": "HOLD", "signals": {"probe_x": 1.5, "probe_x_n": count},
                                         "terms": {"EXX": 1.0}, "channels": {"X": dict.fromkeys(
                                             ("demand_um", "output_um", "applied_um", "limit_um"), 2.0)}}, 1.0)
    made += bridge.forecast_lines({"b": {"x": 1.0}}, 1.0)
    assert 'compbox_mode{box="b"} 2 1000' in made and 'compbox_residual_um{box="b",probe="x"} 1.5 1000' in made
    names = {line.split("{")[0] for line in made}
    for place in (FILES / "compbox.site.rules.yml", FILES / "compbox.site.dashboard.json", pages.PAGE):
        used = set(re.findall(r"\bcompbox_\w+", pathlib.Path(place).read_text()))
        assert used and used <= names, (place, used - names)


def test_the_page_answers_this_computer_alone():
    server = pages.Server("http://127.0.0.1:1")
    try:
        assert "All boxes" in get(server.address + "/")
        for path, host, code in (("/", "evil.example", 403), ("/etc/passwd", "127.0.0.1", 404),
                                 ("/api/v1/query?query=1", "127.0.0.1", 502)):
            with pytest.raises(urllib.error.HTTPError) as refused:
                question = urllib.request.Request(server.address + path, headers={"Host": host})
                urllib.request.urlopen(question, timeout=30)
            assert refused.value.code == code
    finally:
        server.close()


def test_a_missing_client_is_named(tmp_path):
    (tmp_path / "paho.py").write_text("raise ImportError\n")
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT / 'host-tools'}", "COMPBOX_PROGRAM": BIN / "compbox"}
    done = subprocess.run(["/usr/bin/python3", "-m", "fleet", "demo", "-o", "site", "--wait", "1"], cwd=tmp_path,
                          text=True, capture_output=True, env=environment)
    assert done.returncode == 1
    assert done.stderr == "compbox: the MQTT client is missing; install the package python3-paho-mqtt\n"


def test_a_missing_program_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setenv("COMPBOX_PROGRAM", "/nowhere/compbox")
    with pytest.raises(FleetError, match="^vmalert is missing; install the package victoria-metrics$"):
        processes.program_of("vmalert", "victoria-metrics")
