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
from test_mqtt import certificates

sys.path.insert(0, str(ROOT / "tests/fleet"))
from fleets import Plant, cli  # noqa: E402


@pytest.fixture(name="site")
def two_machines(tmp_path):
    made = Plant(tmp_path)
    made.make(2)
    return made


def secured(folder, names):
    """Certificates and a login for each name. out: settings of Broker: a box may use its own topics alone"""
    certificates(folder)
    (folder / "users").write_text("".join(f"{name}:{name}\n" for name in names))
    (folder / "users").chmod(0o600)
    subprocess.run(["mosquitto_passwd", "-U", folder / "users"], check=True)
    (folder / "acl").write_text("pattern readwrite plant/%u/#\nuser site\ntopic readwrite plant/#\n")
    (folder / "acl").chmod(0o600)
    for name in names:
        (folder / f"{name}.txt").write_text(f"{name}\n")
        (folder / f"{name}.txt").chmod(0o600)
    return {"users": "users", "acl_file": "acl", "cafile": "ca.pem", "certfile": "broker.pem", "keyfile": "broker.key"}


def view_of(broker, name):
    """A client with the login of a box, which connects again."""
    client = paho.mqtt.client.Client()
    client.username_pw_set(name, name)
    client.tls_set(broker.folder / "ca.pem")
    client.reconnect_delay_set(1, 1)
    client.connect("127.0.0.1", broker.port)
    client.loop_start()
    return client


def views(broker, boxes, end):
    """Publishes for each box what compbox-view would: its state, retained, and its values."""
    clients = {name: view_of(broker, name) for name in boxes}
    while not end.is_set():
        for name, box in boxes.items():
            box.turn()
            client, snapshot = clients[name], json.loads((box.folder / "snapshot.json").read_text())
            client.publish(f"plant/{name}/state", json.dumps({"revision": snapshot["revision"]}), 1, True)
            values = {one["name"]: one["value"] for one in snapshot["signals"]}
            client.publish(f"plant/{name}/values", json.dumps({"signals": values}), 1)
        time.sleep(0.05)
    for client in clients.values():
        client.disconnect()
        client.loop_stop()


def test_a_roll_out_over_a_broker_that_dies(site):
    names = ["m000", "m001"]
    boxes = site.boxes()
    settings = secured(site.folder, ("site", *names))
    end, started = threading.Event(), []
    with Broker(site.folder, **settings) as broker:
        publisher = threading.Thread(target=views, args=(broker, boxes, end))
        publisher.start()

        def receive(name):
            words = ["fleet", "receive", "--mqtt", broker.at, "--mqtt-topic", f"plant/{name}", "--mqtt-user", name,
                     "--mqtt-password-file", f"{name}.txt", "--mqtt-ca", "ca.pem", "--keys", "keys", "-o",
                     f"boxes/{name}/coefficients.json"]
            started.append(subprocess.Popen([cli.BIN / "compbox", *words], cwd=site.folder, stderr=subprocess.PIPE,
                                            text=True))
        try:
            receive("m000")
            words = ["fleet", "rollout", "--key", "plant.key", "--mqtt", broker.at, "--mqtt-topic", "plant",
                     "--mqtt-user", "site", "--mqtt-password-file", "site.txt", "--mqtt-ca", "ca.pem", "--every",
                     "0.05", "--wait", "60", "--canary", "m000"]
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


def test_logins(site):
    with Broker(site.folder, **secured(site.folder, ("site",))) as broker:
        words = ("rollout", "--key", "plant.key", "--mqtt", broker.at, "--mqtt-user", "site", "--mqtt-password-file")
        (site.folder / "wrong.txt").write_text("s1te\n")
        (site.folder / "wrong.txt").chmod(0o600)
        sentence = site.refusal(*words, "wrong.txt", "--mqtt-ca", "ca.pem")
        assert sentence.startswith(f"{broker.at}: ") and "not authorised" in sentence
        other = "192.0.2.1:8883"
        sentence = site.refusal(*(other if word == broker.at else word for word in words), "site.txt")
        assert sentence.startswith(f"{other}: a login at another computer needs --mqtt-ca")


def test_no_broker(site):
    with Broker(site.folder) as broker:
        pass
    sentence = site.refusal("rollout", "--key", "plant.key", "--mqtt", broker.at)
    assert sentence == f"{broker.at}: no MQTT broker answers at this HOST:PORT"
