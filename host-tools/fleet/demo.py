# SPDX-License-Identifier: MIT
"""A site on this computer, to look at: a broker with TLS and a login for each box, a time-series database, the bridge
between them, alerts, a page, and boxes: a real one before fakeplc, and simulated ones of which one drifts. All of it
listens on 127.0.0.1 alone, lives in one folder, and ends with this process."""

import contextlib
import json
import math
import pathlib
import random
import shutil
import subprocess
import time

from . import bridge, pages, tools
from .errors import FleetError
from .logins import Logins
from .processes import Processes, free_port, program_of

REAL, DRIFTS = "lathe-1", "lathe-3"
FORECAST_UM = 1.0  # what the models of the simulated boxes promise
PERIOD_S = 2.0  # between two values; a real box has 10
HERE = pathlib.Path(__file__).resolve().parent


def rules():
    """out: the alert rules of the examples, in the source or in the package"""
    places = [folder / "examples/plant/compbox.site.rules.yml" for folder in HERE.parents[:2]]
    found = next((place for place in places if place.exists()), None)
    if found is None:
        raise FleetError(f"{places[0]} is missing; install the package compbox")
    return found


class Demo(Processes):
    """in: a folder of its own; number of boxes. start() returns when all is there; close() ends all of it"""

    def __init__(self, folder, count):
        super().__init__(pathlib.Path(folder))
        self.names = [f"lathe-{number}" for number in range(1, count + 1)]

    def start(self):
        mosquitto, victoria = program_of("mosquitto", "mosquitto"), program_of("victoria-metrics", "victoria-metrics")
        vmalert = program_of("vmalert", "victoria-metrics")
        for name in ("broker", "database", "alerts"):
            self.ports[name] = free_port()
        at = {name: f"http://127.0.0.1:{port}" for name, port in self.ports.items()}
        self.logins = Logins(self.folder, self.names, self.ports["broker"])
        self.logins.write()
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
        self.work("bridge", self.bridged, self.logins.link("site", ("+/online", "+/state", "+/values")))
        for number, name in enumerate(self.names):
            if name != REAL:
                self.work(name, self.simulated, name, self.logins.link(name), random.Random(number))
        self.real_box()

    def bridged(self, link):
        try:
            bridge.run(link, bridge.Database(f"http://127.0.0.1:{self.ports['database']}"),
                       lambda: {name: {"x": FORECAST_UM} for name in self.names if name != REAL}, self.ended.is_set)
        finally:
            link.close()

    def simulated(self, name, link, dice):
        """Publishes what compbox-view of a box would, with a probe in each message."""
        began, count = time.time(), 0
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
                {"values": 1, "unix_s": time.time(), "revision": 7, "mode": "ACTIVE", "signals": signals,
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
