# SPDX-License-Identifier: MIT
"""A site on this computer, to look at: a broker with TLS and a login for each box, a time-series database, the bridge
between them, alerts, a page, and boxes: a real one before fakeplc, and simulated ones of which one drifts. All of it
listens on 127.0.0.1 alone, lives in one folder, and ends with this process."""

import contextlib
import ctypes
import getpass
import json
import math
import os
import pathlib
import random
import secrets
import shutil
import signal
import socket
import subprocess
import threading
import time

from . import bridge, links, pages, tools
from .errors import FleetError
from .registry import write_file

REAL, DRIFTS = "lathe-1", "lathe-3"
FORECAST_UM = 1.0  # what the models of the simulated boxes promise
PERIOD_S = 2.0  # between two values; a real box has 10
HERE = pathlib.Path(__file__).resolve().parent
PR_SET_PDEATHSIG = 1


def die_with_parent():
    """In a child: it gets SIGTERM if this process is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def program_of(name, package):
    """out: the path of a program beside compbox, or of the system. Throws FleetError that names its package"""
    beside = pathlib.Path(os.environ.get("COMPBOX_PROGRAM", "compbox")).parent
    found = shutil.which(name, path=f"{beside}:{os.environ.get('PATH', '')}:/usr/sbin")
    if not found:
        raise FleetError(f"{name} is missing; install the package {package}")
    return found


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def rules():
    """out: the alert rules of the examples, in the source or in the package"""
    places = [folder / "examples/plant/compbox.site.rules.yml" for folder in HERE.parents[:2]]
    found = next((place for place in places if place.exists()), None)
    if found is None:
        raise FleetError(f"{places[0]} is missing; install the package compbox")
    return found


class Demo:
    """in: a folder of its own; names of boxes. start() returns when all is there; close() ends all of it"""

    def __init__(self, folder, count):
        self.folder, self.closing = pathlib.Path(folder), contextlib.ExitStack()
        self.names = [f"lathe-{number}" for number in range(1, count + 1)]
        self.ended, self.ports = threading.Event(), {}

    def start(self):
        mosquitto, victoria = program_of("mosquitto", "mosquitto"), program_of("victoria-metrics", "victoria-metrics")
        vmalert = program_of("vmalert", "victoria-metrics")
        for name in ("broker", "database", "alerts"):
            self.ports[name] = free_port()
        at = {name: f"http://127.0.0.1:{port}" for name, port in self.ports.items()}
        self.secure(mosquitto)
        self.run("broker", mosquitto, "-c", "mosquitto.conf")
        self.run("database", victoria, "-storageDataPath", "data", "-search.latencyOffset", "0s", "-httpListenAddr",
                 f"127.0.0.1:{self.ports['database']}")
        self.wait("broker", "database")
        self.page = pages.Server(at["database"])
        self.closing.callback(self.page.close)
        shutil.copy(rules(), self.folder / "rules.yml")
        self.run("alerts", vmalert, "-rule", "rules.yml", "-datasource.url", at["database"], "-remoteWrite.url",
                 at["database"], "-notifier.url", self.page.address, "-evaluationInterval", "5s", "-httpListenAddr",
                 f"127.0.0.1:{self.ports['alerts']}", "-remoteWrite.flushInterval", "1s")
        self.wait("alerts")
        self.work("bridge", self.bridged)
        for number, name in enumerate(self.names):
            if name != REAL:
                self.work(name, self.simulated, name, random.Random(number))
        self.real_box()

    def close(self):
        self.ended.set()
        self.closing.close()

    def run(self, name, program, *arguments, **how):
        """Starts a program, which ends at close(). out: its process"""
        log = self.closing.enter_context(open(self.folder / f"{name}.log", "wb"))
        process = subprocess.Popen([program, *map(str, arguments)], cwd=self.folder, start_new_session=True,
                                   preexec_fn=die_with_parent,
                                   **{"stdout": log, "stderr": log, "stdin": subprocess.DEVNULL, **how})
        self.closing.callback(self.end, process)
        return process

    @staticmethod
    def end(process):
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe:
                pipe.close()

    def work(self, name, function, *arguments):
        """Runs a function of this package in a thread until close()."""
        thread = threading.Thread(target=function, args=arguments, name=name)
        thread.start()
        self.closing.callback(thread.join)

    def wait(self, *names):
        """Until these listen. Throws FleetError with the end of the log of one that does not."""
        for name in names:
            for _ in range(600):
                if listens(self.ports[name]):
                    break
                time.sleep(0.05)
            else:
                lines = (self.folder / f"{name}.log").read_text(errors="replace").strip().splitlines() or ["no log"]
                raise FleetError(f"{self.folder}/{name}.log: it does not start: {lines[-1]}")

    def secure(self, mosquitto):
        """An authority and a certificate for 127.0.0.1, a login for each box and for the site, and the rules by which a
        box sees its own topics alone."""
        def openssl(*words):
            done = subprocess.run([program_of("openssl", "openssl"), *words], cwd=self.folder, capture_output=True,
                                  text=True)
            if done.returncode:
                raise FleetError(f"openssl: {done.stderr.strip().splitlines()[-1]}")
        openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "ca.key", "-out", "ca.pem", "-days", "30",
                "-subj", "/CN=compbox demo")
        openssl("req", "-newkey", "rsa:2048", "-nodes", "-keyout", "broker.key", "-out", "broker.csr", "-subj",
                "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1")
        openssl("x509", "-req", "-in", "broker.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out",
                "broker.pem", "-days", "30", "-copy_extensions", "copy")
        self.passwords = {name: secrets.token_urlsafe(16) for name in ("site", *self.names)}
        self.secret("users", "".join(f"{name}:{word}\n" for name, word in self.passwords.items()))
        done = subprocess.run([program_of("mosquitto_passwd", "mosquitto"), "-U", "users"], cwd=self.folder,
                              capture_output=True, text=True)
        if done.returncode:
            raise FleetError(f"mosquitto_passwd: {done.stderr.strip()}")
        for name, word in self.passwords.items():
            self.secret(f"{name}.password", word + "\n")
        self.secret("acl", "pattern readwrite compbox/%u/#\nuser site\ntopic readwrite compbox/#\n")
        lines = [f"listener {self.ports['broker']} 127.0.0.1", "allow_anonymous false", f"user {getpass.getuser()}",
                 *(f"{key} {self.folder / name}" for key, name in (
                     ("password_file", "users"), ("acl_file", "acl"), ("cafile", "ca.pem"), ("certfile", "broker.pem"),
                     ("keyfile", "broker.key")))]
        (self.folder / "mosquitto.conf").write_text("\n".join(lines) + "\n")

    def secret(self, name, text):
        write_file(self.folder / name, text.encode())
        (self.folder / name).chmod(0o600)

    def link(self, name, follow=()):
        return links.Mqtt(f"127.0.0.1:{self.ports['broker']}", "compbox", 0.2, (name, self.passwords[name]),
                          self.folder / "ca.pem", follow)

    def bridged(self):
        link = self.link("site", ("+/online", "+/state", "+/values"))
        try:
            bridge.run(link, bridge.Database(f"http://127.0.0.1:{self.ports['database']}"),
                       lambda: {name: {"x": FORECAST_UM} for name in self.names if name != REAL}, self.ended.is_set)
        finally:
            link.close()

    def simulated(self, name, dice):
        """Publishes what compbox-view of a box would, with a probe in each message."""
        link, began, count = self.link(name), time.time(), 0
        send = link.client.publish
        send(f"compbox/{name}/online", "1", 1, True)
        send(f"compbox/{name}/state", json.dumps({"state": 1, "runs": True, "machine": name, "revision": 7,
                                                  "mode": "ACTIVE", "unix_s": began}), 1, True)
        while not self.ended.is_set():
            count += 1
            worn_um = min(count / 3, 8.0) if name == DRIFTS else 0.0
            angle = (time.time() - began) / 60 + dice.random() / 10
            t1, t2 = 24 + 3 * math.sin(angle), 22 + math.sin(angle - 1)
            output_um = -4 * (t1 - 20) + 2.5 * (t2 - 20)
            signals = {"T1": round(t1, 2), "T2": round(t2, 2), "probe_x": round(dice.gauss(worn_um, 0.8), 2),
                       "probe_x_n": count}
            channel = {"demand_um": output_um, "output_um": output_um, "applied_um": output_um, "limit_um": 60}
            send(f"compbox/{name}/values", json.dumps(
                {"values": 1, "unix_s": time.time(), "mode": "ACTIVE", "signals": signals,
                 "terms": {"error_X_um": -output_um}, "channels": {"X": channel}}), 1)
            self.ended.wait(PERIOD_S)
        send(f"compbox/{name}/online", "0", 1, True).wait_for_publish(5)
        link.close()

    def real_box(self):
        """compboxd before fakeplc, and its compbox-view. Its X axis moves to and fro."""
        fakeplc = self.run("fakeplc", program_of("fakeplc", "compbox"), "--listen", "127.0.0.1:0", "--profile",
                           "generic", stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        port = fakeplc.stdout.readline().rsplit(":", 1)[1].strip()
        curve = {"name": "EXX", "type": "polyline", "signal": "X", "positions": [0, 200, 400], "values": [0, 12.5, 4]}
        (self.folder / "EXX.json").write_text(json.dumps({"terms": [curve]}))
        tools.compbox("init", "--host", "127.0.0.1", "--port", port, "--axes", "X,Z", "--profile", "generic", "--name",
                      REAL, "--travel", "X=400,Z=500", "-o", "machine.json", folder=self.folder)
        tools.compbox("build", "machine.json", "EXX.json", "-o", "coefficients.json", folder=self.folder)
        self.run("compboxd", program_of("compboxd", "compboxd"), "--config", "coefficients.json", "--snapshot",
                 "snapshot.json", "--events", "events.jsonl")
        self.ports["view"] = free_port()
        self.run("compbox-view", program_of("compbox-view", "compbox-view"), "--snapshot", "snapshot.json", "--events",
                 "events.jsonl", "--listen", f"127.0.0.1:{self.ports['view']}", "--mqtt",
                 f"127.0.0.1:{self.ports['broker']}", "--mqtt-topic", f"compbox/{REAL}", "--mqtt-user", REAL,
                 "--mqtt-password-file", f"{REAL}.password", "--mqtt-ca", "ca.pem", "--mqtt-every", PERIOD_S)
        self.work("moves", self.moves, fakeplc)

    def moves(self, fakeplc):
        for turn in range(1_000_000):
            with contextlib.suppress(OSError, ValueError):
                fakeplc.stdin.write(f"move X={50 + 300 * (turn % 2)} feed=3000\n")
                fakeplc.stdin.flush()
                fakeplc.stdout.readline()
            if self.ended.wait(10):
                return

    def addresses(self):
        return [("page of all boxes", self.page.address + "/"),
                (f"page of {REAL}, the real box", f"http://127.0.0.1:{self.ports['view']}/"),
                ("database", f"http://127.0.0.1:{self.ports['database']}/vmui"),
                ("alerts", f"http://127.0.0.1:{self.ports['alerts']}/"),
                ("broker", f"127.0.0.1:{self.ports['broker']}, TLS; logins and certificate in {self.folder}")]
