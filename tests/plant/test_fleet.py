# SPDX-License-Identifier: MIT
"""A roll-out over Debian's mosquitto: retained signed files down, what compbox-view publishes up."""

import json
import subprocess
import sys
import threading
import time

import paho.mqtt.client
import pytest

from plant import ROOT, Broker

sys.path.insert(0, str(ROOT / "tests/fleet"))
from fleets import Plant, cli  # noqa: E402


@pytest.fixture(name="site")
def two_machines(tmp_path):
    made = Plant(tmp_path)
    made.make(2)
    return made


def views(broker, boxes, end):
    """Publishes for each box what compbox-view would: its state, retained, and its values."""
    client = paho.mqtt.client.Client()
    client.username_pw_set("boxes", "b")
    client.reconnect_delay_set(1, 1)
    client.connect("127.0.0.1", broker.port)
    client.loop_start()
    while not end.is_set():
        for name, box in boxes.items():
            box.turn()
            snapshot = json.loads((box.folder / "snapshot.json").read_text())
            client.publish(f"plant/{name}/state", json.dumps({"revision": snapshot["revision"]}), 1, True)
            values = {one["name"]: one["value"] for one in snapshot["signals"]}
            client.publish(f"plant/{name}/values", json.dumps({"signals": values}), 1)
        time.sleep(0.05)
    client.disconnect()
    client.loop_stop()


def test_a_roll_out_over_a_broker_that_dies(site):
    names = ["m000", "m001"]
    boxes = site.boxes()
    (site.folder / "users").write_text("site:s\nboxes:b\n")
    (site.folder / "users").chmod(0o600)
    subprocess.run(["mosquitto_passwd", "-U", site.folder / "users"], check=True)
    (site.folder / "site.txt").write_text("s\n")
    (site.folder / "boxes.txt").write_text("b\n")
    end, started = threading.Event(), []
    with Broker(site.folder, users="users") as broker:
        publisher = threading.Thread(target=views, args=(broker, boxes, end))
        publisher.start()

        def receive(name):
            words = ["fleet", "receive", "--mqtt", broker.at, "--mqtt-topic", f"plant/{name}", "--mqtt-user", "boxes",
                     "--mqtt-password-file", "boxes.txt", "--keys", "keys", "-o", f"boxes/{name}/coefficients.json"]
            started.append(subprocess.Popen([cli.BIN / "compbox", *words], cwd=site.folder, stderr=subprocess.PIPE,
                                            text=True))
        try:
            receive("m000")
            words = ["fleet", "rollout", "--key", "plant.key", "--mqtt", broker.at, "--mqtt-topic", "plant",
                     "--mqtt-user", "site", "--mqtt-password-file", "site.txt", "--every", "0.05", "--wait", "60",
                     "--canary", "m000"]
            command = subprocess.Popen([cli.BIN / "compbox", *words], cwd=site.folder, text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            while not (site.folder / "boxes/m000/coefficients.json.minisig").exists():
                time.sleep(0.02)
            broker.stop()  # it forgets what it retained
            broker.start()
            while site.state()["machines"]["m001"]["state"] != "sent":
                time.sleep(0.02)
            receive("m001")  # which was away
            out, errors = command.communicate(timeout=60)
        finally:
            end.set()
            publisher.join()
            for process in started:
                process.kill()
    assert (command.returncode, errors) == (0, "") and out.endswith("done\n"), (out, errors)
    for name, process in zip(names, started):
        assert json.loads(boxes[name].place.read_text())["revision"] == 8 and boxes[name].rms_um() < 1.0
        assert f"boxes/{name}/coefficients.json: took revision 8\n" in process.communicate()[1]


def test_no_broker(site):
    with Broker(site.folder) as broker:
        pass
    sentence = site.refusal("rollout", "--key", "plant.key", "--mqtt", broker.at)
    assert sentence == f"{broker.at}: no MQTT broker answers at this HOST:PORT"
