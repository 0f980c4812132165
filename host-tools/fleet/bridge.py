# SPDX-License-Identifier: MIT
"""From the broker to a time-series database: what boxes publish becomes lines of Prometheus' text format, with times,
for the address /api/v1/import/prometheus of VictoriaMetrics. Values of an absence keep the time of their reading."""

import http.client
import json
import time
import urllib.request

from .links import NOT_OF_A_BOX, Residuals, is_number

MODES = ("STANDBY", "ACTIVE", "HOLD", "RAMP", "FAULT", "STOPPED")
MOST_LINES = 1_000_000  # that wait for the database, some 100 MB; then the oldest go


def label(text):
    return '"' + str(text).replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n") + '"'


def line_of(metric, value, unix_s, **labels):
    text = ",".join(f"{key}={label(one)}" for key, one in labels.items())
    return f"compbox_{metric}{{{text}}} {float(value):.9g} {int(unix_s * 1000)}"


class Lines:
    """Makes lines of messages; knows the revision of each box."""

    def __init__(self):
        self.residuals, self.revisions = Residuals(), {}

    def of(self, box, kind, message, now_s):
        """in: the last level of a topic, and its payload; now_s: for what has no time. out: lines"""
        if kind == "online":
            return [line_of("online", message, now_s, box=box)]
        if kind == "state":
            self.revisions[box] = message.get("revision")
            return [line_of("runs", message["runs"], now_s, box=box)] if "runs" in message else []
        return self._of_values(box, message, message["unix_s"]) if kind == "values" else []

    def _of_values(self, box, message, unix_s):
        found = [line_of("mode", MODES.index(message["mode"]), unix_s, box=box)] if message["mode"] in MODES else []
        for kind, metric in (("signals", "signal_value"), ("terms", "term_value")):
            found += [line_of(metric, value, unix_s, box=box, name=name)
                      for name, value in message[kind].items() if is_number(value)]
        for name, channel in message["channels"].items():
            found += [line_of(f"channel_{key}", value, unix_s, box=box, name=name)
                      for key, value in channel.items() if is_number(value)]
        revision = message.get("revision", self.revisions.get(box))  # the state may be another one by now
        for probe, value in self.residuals.feed(box, revision, message["signals"]):
            found.append(line_of("residual_um", value, unix_s, box=box, probe=probe))
        return found


class Database:
    """in: its address, as http://127.0.0.1:8428. Lines wait while it does not answer."""

    def __init__(self, address):
        self.address, self.waiting, self.lost, self.written = address.rstrip("/"), [], 0, 0

    def take(self, lines):
        self.waiting += lines
        beyond = max(len(self.waiting) - MOST_LINES, 0)
        self.lost += beyond
        del self.waiting[:beyond]

    def write(self):
        """Sends what waits. out: whether it is empty now"""
        if self.waiting:
            body = ("\n".join(self.waiting) + "\n").encode()
            request = urllib.request.Request(self.address + "/api/v1/import/prometheus", data=body, method="POST")
            try:
                urllib.request.urlopen(request, timeout=30).close()
            except (OSError, http.client.HTTPException):
                return False
            self.written += len(self.waiting)
            self.waiting = []
        return True


def forecast_lines(forecasts, now_s):
    """in: {box: {probe: um}}. out: lines, which alert rules compare with residuals"""
    return [line_of("forecast_um", um, now_s, box=box, probe=probe)
            for box, of_box in forecasts.items() for probe, um in of_box.items()]


def run(link, database, forecasts, end, every_s=30):
    """Until end() is true. in: a links.Mqtt that follows values, state and online; forecasts() as for forecast_lines,
    written every so many seconds"""
    lines, next_s = Lines(), 0.0
    while not end():
        for topic, payload in link.received():
            try:
                box, kind = topic[len(link.prefix) + 1:].split("/")
                database.take(lines.of(box, kind, json.loads(payload), time.time()))
            except NOT_OF_A_BOX:
                continue
        if time.time() >= next_s:
            database.take(forecast_lines(forecasts(), time.time()))
            next_s = time.time() + every_s
        database.write()
