# SPDX-License-Identifier: MIT
"""The ways between site and boxes. Down: a retained signed file for each machine. Up: what compbox-view publishes.

A folder (a share of the plant, or a stick) does what a broker does: DIR/NAME/file.json down, DIR/NAME/snapshot.json up.
A link has send(name, payload), poll() → [(name, revision, signals)] and close()."""

import contextlib
import json
import math
import pathlib
import queue
import ssl
import time

from .errors import FleetError
from .registry import read_bytes, write_file
from .residuals import is_new_count

# What reading a message can throw, whatever it is: numbers beyond a float and deep lists too.
NOT_OF_A_BOX = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)


def payload_of(text, signature):
    return json.dumps({"file": text, "signature": signature})


def is_number(value):
    """out: whether a box reported a finite number"""
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number beyond a float
        return False


class Residuals:
    """Makes residuals of the signals of boxes: probe_NAME at each is_new_count() of probe_NAME_n. The first count of a
    revision is a reference."""

    def __init__(self):
        self.running, self.last = {}, {}

    def feed(self, name, revision, signals):
        """out: [(probe, um)] that this report adds. What is no number counts for nothing: a box may report anything."""
        if not isinstance(revision, int) or not isinstance(signals, dict):
            return []
        if self.running.get(name) != revision:
            self.running[name], self.last[name] = revision, {}
        found = []
        for count in (key for key in signals if key.startswith("probe_") and key.endswith("_n")):
            probe, value = count[6:-2].lower(), signals.get(count[:-2])
            if not is_number(signals[count]):
                continue
            if is_new_count(self.last[name].get(probe, signals[count]), signals[count]) and is_number(value):
                found.append((probe, value))
            self.last[name][probe] = signals[count]
        return found


class Folder:
    """in: the folder that all boxes share"""

    def __init__(self, folder, every_s):
        self.folder, self.every_s, self.times = pathlib.Path(folder), every_s, {}

    def send(self, name, payload):
        write_file(self.folder / name / "file.json", payload.encode())

    def poll(self):
        """Waits a while. out: the snapshots that are new"""
        time.sleep(self.every_s)
        found = []
        for path in sorted(self.folder.glob("*/snapshot.json")):
            try:
                changed, snapshot = path.stat().st_mtime_ns, None
                if self.times.get(path) != changed:
                    snapshot = json.loads(path.read_text(encoding="utf-8"))
                    found.append((path.parent.name, snapshot["revision"],
                                  {str(one["name"]): one["value"] for one in snapshot["signals"]}))
                self.times[path] = changed
            except (OSError, *NOT_OF_A_BOX):
                continue  # half copied: the next poll reads it again
        return found

    def close(self):
        pass


class Mqtt:
    """in: "HOST:PORT" of the broker; prefix of the topics, as compbox in compbox/lathe-3/state;
    (user, password) or None; certificate of the broker's authority or None; topics below the prefix"""

    def __init__(self, broker, prefix, every_s, login=None, authority=None, follow=("+/state", "+/values")):
        try:
            import paho.mqtt.client as mqtt
        except ImportError as error:
            raise FleetError("the MQTT client is missing; install the package python3-paho-mqtt") from error
        self.prefix, self.every_s, self.revisions, self.messages = prefix, every_s, {}, queue.SimpleQueue()
        self.client, self.joined = mqtt.Client(), queue.SimpleQueue()
        host, _, port = broker.rpartition(":")
        if login and not authority and host not in ("localhost", "127.0.0.1", "[::1]"):
            raise FleetError(f"{broker}: a login at another computer needs --mqtt-ca, because others could read it")
        if login:
            self.client.username_pw_set(*login)
        if authority:
            read_bytes(authority)
            self.client.tls_set(authority)
        self.retained = {}
        self.client.on_connect = self._connected
        self.client.on_message = lambda _, __, message: self.messages.put((message.topic, message.payload))
        self.topics = [f"{prefix}/{topic}" for topic in follow]
        self.client.reconnect_delay_set(1, 30)
        try:
            self.client.connect(host.strip("[]"), int(port))
            self.client.loop_start()
            refused = self.joined.get(timeout=10)
        except ssl.SSLError as error:
            raise FleetError(f"{broker}: TLS failed: {error.reason}") from error
        except (OSError, ValueError, queue.Empty) as error:
            raise FleetError(f"{broker}: no MQTT broker answers at this HOST:PORT") from error
        if refused:
            self.close()
            raise FleetError(f"{broker}: {mqtt.connack_string(refused)}")

    def _connected(self, client, _, __, refused):
        """Each time: a broker that was away may have lost subscriptions and what it retained."""
        self.joined.put(refused)
        if self.topics:  # a broker closes the connection of a client that subscribes to nothing
            client.subscribe([(topic, 1) for topic in self.topics])
        for topic, payload in list(self.retained.items()):
            client.publish(topic, payload, qos=1, retain=True)

    def send(self, name, payload):
        """It is sent at the next connection if the broker is away."""
        self.retained[f"{self.prefix}/{name}/file"] = payload
        self.client.publish(f"{self.prefix}/{name}/file", payload, qos=1, retain=True)

    def poll(self):
        """Waits a while. out: (name, revision, signals) of each message. Values have the revision that they belong to;
        without one it is that of `state`, retained."""
        found = []
        for topic, payload in self.received():
            try:
                name, message = topic[len(self.prefix) + 1:].split("/")[0], json.loads(payload)
                if topic.endswith("/state"):
                    self.revisions[name] = message.get("revision")
                revision = message.get("revision", self.revisions.get(name))
                if revision is not None:
                    found.append((name, revision, message.get("signals", {})))
            except NOT_OF_A_BOX:
                continue
        return found

    def received(self):
        """Waits a while. out: (topic, payload) of each message; what comes without a pause is taken in parts"""
        found, left_s = [], self.every_s
        end = time.monotonic() + left_s
        with contextlib.suppress(queue.Empty):
            while not found or left_s > 0:
                found.append(self.messages.get(timeout=max(left_s, 0.001)))
                left_s = end - time.monotonic()
        return found

    def close(self):
        self.client.disconnect()
        self.client.loop_stop()
