# SPDX-License-Identifier: MIT
"""compbox-view --mqtt before Debian's mosquitto: state, values and events; a broker that goes away and comes back."""

import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import urllib.request

import pytest

from plant import BIN, ROOT, Broker, Subscriber, only_families, running_box, view, wait_for


PASSWORD = "7f3a lathe 3"
PAGE = ROOT / "docs/uplink.md"


def modes_of(events):
    return [event for event in events if event["kind"] == "mode"]


def events_of(folder):
    return modes_of(map(json.loads, (folder / "events.jsonl").read_text().splitlines()))


def test_the_plant_gets_state_values_and_events(tmp_path):
    with Broker(tmp_path) as broker, Subscriber(broker) as plant, running_box(tmp_path) as plc:
        with view(tmp_path, "--mqtt", broker.at, "--mqtt-topic", "plant/lathe-3", "--mqtt-every", 0.2):
            state = wait_for(lambda: [s for s in plant.json("plant/lathe-3/state") if s.get("mode") == "ACTIVE"])[-1]
            assert state["runs"] and state["reason"] == "all is well" and state["machine"] == "machine", state
            assert plant.last("plant/lathe-3/online") == "1"
            values = wait_for(lambda: [v for v in plant.json("plant/lathe-3/values")
                                       if v["signals"]["X"] == 500 and v["channels"]["Z"]["output_um"] == -12.5])[-1]
            assert values["terms"]["EZX"] == 12.5 and values["mode"] == "ACTIVE"
            plc.command("freeze heartbeat 1")
            lost = wait_for(lambda: [s for s in plant.json("plant/lathe-3/state") if s.get("mode") in ("HOLD", "RAMP")])
            assert lost[0]["reason"] == "the PLC's heartbeat does not change"
            wait_for(lambda: any(e["mode"] == "HOLD" for e in modes_of(plant.json("plant/lathe-3/events"))))
        wait_for(lambda: plant.last("plant/lathe-3/online") == "0")


def test_a_late_subscriber_gets_the_retained_state_and_the_will_says_that_the_view_died(tmp_path):
    with Broker(tmp_path) as broker, running_box(tmp_path), Subscriber(broker) as first:
        with view(tmp_path, "--mqtt", broker.at, "--mqtt-topic", "box") as process:
            wait_for(lambda: [s for s in first.json("box/state") if s.get("mode") == "ACTIVE"])
            with Subscriber(broker) as late:
                assert wait_for(lambda: late.json("box/state"))[-1]["mode"] == "ACTIVE"
                wait_for(lambda: late.last("box/online") == "1")
                process.send_signal(signal.SIGKILL)
                wait_for(lambda: late.last("box/online") == "0")


def figures_at(address):
    """compbox_mqtt_… of its metrics, by the rest of the name."""
    text = urllib.request.urlopen(address + "metrics", timeout=60).read().decode()
    return {name: float(value) for name, value in re.findall(r"^compbox_mqtt_(\w+) (\S+)$", text, re.M)}


def test_nothing_is_lost_while_the_broker_is_away(tmp_path):
    with Broker(tmp_path) as broker, running_box(tmp_path) as plc:
        plant = Subscriber(broker)
        with plant, view(tmp_path, "--mqtt", broker.at, "--mqtt-topic", "box", "--mqtt-every", 0.2) as process:
            wait_for(lambda: len(plant.json("box/values")) > 3)
            known = len(events_of(tmp_path))
            broker.stop()
            for freezes in (1, 0, 1, 0):
                plc.command(f"freeze heartbeat {freezes}")
                wait_for(lambda: (events_of(tmp_path)[-1]["mode"] == "ACTIVE") == (freezes == 0))
            happened = events_of(tmp_path)[known:]
            plant.stop()
            broker.start()
            with Subscriber(broker) as again:
                wait_for(lambda: len(modes_of(again.json("box/events"))) >= len(happened))
                assert modes_of(again.json("box/events"))[:len(happened)] == happened
                wait_for(lambda: [s for s in again.json("box/state")])
                values = [v["unix_s"] for v in again.json("box/values")]
                assert values == sorted(values)
                assert values[0] < happened[0]["unix_s"] + 1, "values of the absence are sent too"
            address = re.search(r"http://\S+", process.stdout.readline())[0]
            wait_for(lambda: figures_at(address)["messages_total"] >= len(values) + len(happened))
            figures = figures_at(address)
            assert (figures["connected"], figures["connections_total"], figures["lost_messages_total"]) == (1, 2, 0)
            process.terminate()
            process.wait(60)
            log = process.stderr.read()
        assert re.search(r"connected to the MQTT broker 127\.0\.0\.1:\d+\n", log), log


def test_a_broker_that_comes_later_gets_all(tmp_path):
    """The view starts before the broker. After some seconds it says so."""
    with Broker(tmp_path) as broker, running_box(tmp_path):
        broker.stop()
        with view(tmp_path, "--mqtt", broker.at, "--mqtt-topic", "box", "--mqtt-every", 0.2) as process:
            line = process.stderr.readline()
            assert line.startswith(f"compbox-view: no connection to the MQTT broker {broker.at}"), line
            broker.start()
            with Subscriber(broker) as plant:
                wait_for(lambda: len(plant.json("box/values")) > 10)
                assert process.stderr.readline() == f"compbox-view: connected to the MQTT broker {broker.at}\n"


@pytest.mark.parametrize("host, name", [("127.0.0.1", "127.0.0.1"), ("127.0.0.1", "localhost"), ("::1", "[::1]")])
def test_the_limits_of_the_service_let_it_reach_the_broker(tmp_path, host, name):
    """The address families and threads that the unit allows: IPv4, IPv6, and a name of /etc/hosts."""
    unit = (ROOT / "packaging/compbox-view.service").read_text()
    families = re.search(r"^RestrictAddressFamilies=(.*)$", unit, re.M)[1].split()
    assert "AF_UNIX" not in families
    with Broker(tmp_path, host=host) as broker, running_box(tmp_path):
        with view(tmp_path, "--mqtt", f"{name}:{broker.port}", "--mqtt-topic", "box", families=families) as process:
            line = process.stderr.readline()
            assert line == f"compbox-view: connected to the MQTT broker {name.strip('[]')}:{broker.port}\n", line
            threads = len(list(pathlib.Path(f"/proc/{process.pid}/task").iterdir()))
            assert threads <= int(re.search(r"^TasksMax=(\d+)$", unit, re.M)[1]) / 2
            with pytest.raises(subprocess.CalledProcessError):  # the limit is real
                subprocess.run([sys.executable, "-c", "import socket; socket.socket(socket.AF_UNIX)"], check=True,
                               preexec_fn=lambda: only_families(families), stderr=subprocess.DEVNULL)


def certificates(folder):
    """ca.pem, broker.pem, broker.key: an authority of its own and its certificate for 127.0.0.1."""
    def openssl(*arguments):
        subprocess.run(["openssl", *map(str, arguments)], cwd=folder, check=True, capture_output=True)
    openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "ca.key", "-out", "ca.pem", "-days", 2, "-subj",
            "/CN=plant")
    openssl("req", "-newkey", "rsa:2048", "-nodes", "-keyout", "broker.key", "-out", "broker.csr", "-subj",
            "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1")
    openssl("x509", "-req", "-in", "broker.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out",
            "broker.pem", "-days", 2, "-copy_extensions", "copy")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
def test_tls_and_a_password(tmp_path):
    certificates(tmp_path)
    subprocess.run(["mosquitto_passwd", "-b", "-c", "users", "lathe", PASSWORD], cwd=tmp_path, check=True)
    tls = {"cafile": "ca.pem", "certfile": "broker.pem", "keyfile": "broker.key"}
    with Broker(tmp_path, users="users", **tls) as broker, running_box(tmp_path):
        for password, joins in (("wrong", False), (PASSWORD, True)):
            (tmp_path / "password").write_text(password + "\r\n")
            (tmp_path / "password").chmod(0o600)
            with view(tmp_path, "--mqtt", broker.at, "--mqtt-ca", tmp_path / "ca.pem", "--mqtt-user", "lathe",
                      "--mqtt-password-file", tmp_path / "password", "--mqtt-topic", "box") as process:
                line = process.stderr.readline()
                address = re.search(r"http://\S+", process.stdout.readline())[0]
                for path in ("", "api/live", "api/recent", "api/events", "metrics"):
                    assert PASSWORD not in urllib.request.urlopen(address + path, timeout=60).read().decode(), path
            assert ("connected to the MQTT broker" in line) == joins, line
            assert joins or "not authorised" in line, line
            assert PASSWORD not in line


def test_wrong_usage_is_one_sentence(tmp_path):
    def printed(*arguments):
        done = subprocess.run([BIN / "compbox-view", "--snapshot", "s.json", *map(str, arguments)], cwd=tmp_path,
                              capture_output=True, text=True, timeout=60)
        return done.returncode, done.stderr.replace("Run with --help for more information.\n", "")
    assert printed("--mqtt", "a:b")[0] == 2 and "needs HOST or HOST:PORT" in printed("--mqtt", "a:b")[1]
    far = ("--mqtt", "10.0.0.1", "--mqtt-user", "u", "--mqtt-password-file", "f")
    assert printed(*far)[0] == 2 and "needs --mqtt-ca F.pem" in printed(*far)[1]
    assert printed("--mqtt", "10.0.0.1", "--mqtt-user", "u")[0] == 2
    assert printed("--mqtt", "10.0.0.1", "--mqtt-topic", "a/#")[0] == 2
    code, line = printed("--mqtt", "10.0.0.1", "--mqtt-ca", tmp_path / "none.pem")
    assert code == 1 and "none.pem: cannot be read" in line


def test_the_stated_size_of_a_day(tmp_path):
    """docs/uplink.md: bytes of the values message of the three-axis machine of this test."""
    with Broker(tmp_path) as broker, Subscriber(broker) as plant, running_box(tmp_path):
        with view(tmp_path, "--mqtt", broker.at, "--mqtt-topic", "box", "--mqtt-every", 0.2):
            message = wait_for(lambda: [text for text in plant.messages("box/values")
                                        if json.loads(text)["signals"]["X"] == 500])[0]
    values = json.loads(message)
    assert [len(values[key]) for key in ("signals", "terms", "channels")] == [3, 1, 1]
    stated = re.search(r"A values message of the three-axis machine in the\s+test has (\d+) bytes", PAGE.read_text())
    assert abs(len(message) - int(stated[1])) <= 3, message  # digits of the clock
