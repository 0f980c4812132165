# SPDX-License-Identifier: MIT
"""What broker, bridge and database of a site cost: Debian's mosquitto and VictoriaMetrics and `compbox fleet bridge` as
processes of their own, and one publisher that sends the `values` of many boxes at their real pace."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request

import paho.mqtt.client
import psutil

from fleet.processes import free_port, listens

VALUES, PERIOD_S, PERIODS = 30, 10, 5
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def listening(port):
    while not listens(port):
        time.sleep(0.05)


def message(number, unix_s):
    """out: `values` of a box with so many numbers: signals, terms and channels"""
    signals = {f"T{k}": round(20 + number % 7 + k / 10 + unix_s % 60 / 100, 2) for k in range(1, 15)}
    terms = {f"E{k}": round(number % 11 + k / 7, 4) for k in range(1, 8)}
    one = {"demand_um": -12.5, "output_um": -12.25 + number % 5, "applied_um": -12.25, "limit_um": 60}
    channels = {"X": one, "Z": one}
    assert 1 + len(signals) + len(terms) + sum(map(len, channels.values())) == VALUES  # and the mode
    return json.dumps({"values": 1, "unix_s": round(unix_s, 3), "mode": "ACTIVE", "signals": signals, "terms": terms,
                       "channels": channels})


def spent_s(process):
    """out: processor time of a process so far"""
    times = psutil.Process(process.pid).cpu_times()
    return times.user + times.system


def counted(database):
    """out: samples in the database, by an export of all of them"""
    query = urllib.parse.urlencode({"match[]": '{__name__=~"compbox_.+"}'})
    with urllib.request.urlopen(f"{database}/api/v1/export?{query}", timeout=300) as reply:
        return sum(len(json.loads(line)["values"]) for line in reply)


def publish(port, boxes):
    """Sends PERIODS messages of each box, spread over each period. out: the time that the last confirmation took, s"""
    client = paho.mqtt.client.Client()
    client.max_inflight_messages_set(200)
    client.connect("127.0.0.1", port)
    client.loop_start()
    began, sent = time.time(), []
    for turn in range(PERIODS):
        for number in range(boxes):
            due = began + PERIOD_S * (turn + number / boxes)
            time.sleep(max(due - time.time(), 0))
            sent.append(client.publish(f"compbox/box-{number}/values", message(number, due), 1))
    for one in sent:
        one.wait_for_publish(60)
    client.disconnect()
    client.loop_stop()
    return sum(not one.is_published() for one in sent)


def measured(boxes, program):
    """in: path of compbox. out: processor seconds of each part in PERIODS periods, and what arrived"""
    with tempfile.TemporaryDirectory() as name:
        folder, ports = pathlib.Path(name), [free_port(), free_port()]
        database = f"http://127.0.0.1:{ports[1]}"
        (folder / "mosquitto.conf").write_text(f"listener {ports[0]} 127.0.0.1\nallow_anonymous true\n"
                                               "max_queued_messages 0\n")
        parts = {"broker_s": subprocess.Popen(["/usr/sbin/mosquitto", "-c", folder / "mosquitto.conf"], **QUIET),
                 "database_s": subprocess.Popen(["victoria-metrics", "-storageDataPath", folder / "data",
                                                 "-httpListenAddr", f"127.0.0.1:{ports[1]}"], **QUIET)}
        try:
            for port in ports:
                listening(port)
            parts["bridge_s"] = subprocess.Popen([program, "fleet", "bridge", "--mqtt", f"127.0.0.1:{ports[0]}",
                                                  "--database", database], **QUIET)
            time.sleep(3)
            before = {part: spent_s(process) for part, process in parts.items()}
            lost = publish(ports[0], boxes)
            wanted = boxes * PERIODS * VALUES
            found = {}
            for _ in range(60):  # the bridge writes each second
                time.sleep(1)
                found = {part: spent_s(process) - before[part] for part, process in parts.items()}
                urllib.request.urlopen(f"{database}/internal/force_flush", timeout=60).close()
                arrived = counted(database)
                if arrived >= wanted:
                    break
            size = sum(path.stat().st_size for path in (folder / "data").rglob("*") if path.is_file())
            memory = {part[:-2] + "_mb": psutil.Process(process.pid).memory_info().rss / 1e6
                      for part, process in parts.items()}
            return {**found, **memory, "samples": arrived, "lost": wanted - arrived + lost * VALUES,
                    "bytes": len(message(1, time.time())), "disk_mb": size / 1e6}
        finally:
            for process in parts.values():
                process.terminate()
                process.wait(60)


if __name__ == "__main__":
    print(measured(int(sys.argv[1]), pathlib.Path(os.environ["COMPBOX_BIN"]) / "compbox"))
