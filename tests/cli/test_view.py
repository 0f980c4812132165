# SPDX-License-Identifier: MIT
"""compbox-view with real sockets: beside fakeplc and compboxd its values are theirs; with files that a test writes,
what happens when they vanish, break or grow; hostile and slow readers, whose cost has a bound."""

import base64
import contextlib
import http.client
import json
import os
import pathlib
import re
import resource
import shutil
import socket
import subprocess
import time

import pytest

from conftest import BIN, term
from test_first_steps import FakePlc

SNAPSHOT = {
    "snapshot": 1, "machine": "mill", "version": "1", "revision": 3, "crc": "00ab", "finished": False,
    "mode": "ACTIVE", "reason": "all is well", "cause": None,
    "signals": [{"name": "X", "unit": "mm", "value": 12.5, "age_ms": 0.1, "state": "fresh"}],
    "terms": [{"name": "EZX", "value": 3.5}],
    "channels": [{"name": "Z", "demand_um": -3.5, "output_um": -3.5, "applied_um": None, "limit_um": 300}],
    "counters": {"cycles": 7},
}


def eventually(condition):
    """Waits until the condition holds; out: its value."""
    for _ in range(3000):
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError("it does not happen")


class View:
    """compbox-view on a free port."""

    def __init__(self, folder, *options, listen="127.0.0.1:0"):
        self.folder = folder
        self.process = subprocess.Popen(
            [BIN / "compbox-view", "--snapshot", folder / "snapshot.json", "--listen", listen, *options],
            text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        line = self.process.stdout.readline()
        assert line.startswith("compbox-view: listening on http://"), self.process.communicate()
        self.port = int(re.search(r":(\d+)/$", line.strip()).group(1))

    def request(self, path, method="GET", headers=(), body=None, source="127.0.0.1"):
        """out: the response, read, with its body as .text"""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60, source_address=(source, 0))
        connection.request(method, path, body=body, headers=dict(headers))
        response = connection.getresponse()
        response.text = response.read().decode()
        connection.close()
        return response

    def get(self, path):
        response = self.request(path)
        assert response.status == 200, (path, response.status, response.text)
        return json.loads(response.text)

    def connect(self, first=b""):
        one = socket.create_connection(("127.0.0.1", self.port), timeout=60)
        one.sendall(first)
        return one

    def stream(self):
        """out: the lines of /api/stream, and its connection"""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.request("GET", "/api/stream")
        return connection.getresponse(), connection

    def metric(self, name):
        found = re.search(rf"^{re.escape(name)} (\S+)$", self.request("/metrics").text, re.M)
        return found and float(found.group(1))

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def memory_kb(self):
        text = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text).group(1))

    def end(self):
        self.process.terminate()
        _, errors = self.process.communicate(timeout=60)
        assert self.process.returncode == 0 and errors == "", (self.process.returncode, errors)


def next_message(lines, event):
    """Reads the stream up to the next message of this event. out: its data"""
    for _ in range(2000):
        line = lines.readline()
        assert line, "the stream ended"
        assert line != b":\n", "nothing for ten seconds"
        if line.strip() == b"event: " + event:
            return json.loads(lines.readline()[len("data: "):])
    raise AssertionError(f"no {event}")


@pytest.fixture
def view(tmp_path):
    started = []

    def start(*options, **how):
        started.append(View(tmp_path, *options, **how))
        return started[-1]

    yield start
    for one in started:
        one.end()


@pytest.fixture
def snapshot(tmp_path):
    """Writes the file by rename, as compboxd does."""
    def write(text=None, **changes):
        new = tmp_path / "snapshot.json.new"
        new.write_text(json.dumps({**SNAPSHOT, "unix_s": time.time(), **changes}) if text is None else text)
        new.rename(tmp_path / "snapshot.json")

    write()
    return write


@contextlib.contextmanager
def many_descriptors():
    """This process may have as many sockets as the kernel lets it."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (before[1], before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_its_values_are_those_of_fakeplc(compbox, machine, tmp_path, view):
    compbox.write("EZX.json", term(values=(0, 40, 0)))
    with FakePlc(tmp_path, "--map", "machine.json") as plc:
        machine["plc"]["transport"]["tcp"]["port"] = plc.port
        compbox.write("machine.json", machine)
        compbox.good("build", "machine.json", "EZX.json", "-o", "coefficients.json")
        box = subprocess.Popen(
            [BIN / "compboxd", "--config", "coefficients.json", "--snapshot", "snapshot.json", "--events",
             "events.jsonl", "--record", "record.csv"], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        try:
            one = view("--events", tmp_path / "events.jsonl", "--record", tmp_path / "record.csv")
            live = lambda: one.get("/api/live")["snapshot"]
            eventually(lambda: (live() or {}).get("mode") == "ACTIVE")
            plc.command("move X=250 feed=20000")
            x_mm = eventually(lambda: "X=250" in plc.command("position") and 250)

            def channel():
                return {c["name"]: c for c in live()["channels"]}["Z"]
            eventually(lambda: abs(channel()["output_um"] + 20) < 0.1 and not channel()["slewed"])
            printed = re.findall(r"Z=(\S+)", plc.command("error"))
            assert float(printed[1]) - float(printed[0]) == pytest.approx(channel()["output_um"], abs=0.15)

            def signal():
                return {s["name"]: s["value"] for s in live()["signals"]}["X"]
            eventually(lambda: signal() == pytest.approx(x_mm, abs=0.001))

            # where the computer stands still for a moment, the box is in HOLD
            eventually(lambda: one.metric("compbox_up") == 1 and one.metric("compbox_mode") == 1)
            eventually(lambda: one.metric('compbox_signal_value{name="X",unit="mm"}') == pytest.approx(x_mm, abs=0.001)
                       and one.metric('compbox_channel_output_um{name="Z"}') == channel()["output_um"])
            cycles = one.metric("compbox_cycles_total")
            assert 0 < cycles <= live()["counters"]["cycles"]
            assert one.metric("compbox_wakeup_seconds_count") >= cycles
            assert one.metric('compbox_wakeup_seconds_bucket{le="+Inf"}') > 0

            eventually(lambda: (table := one.get("/api/recent"))["mode"][-1] == "ACTIVE"
                       and table["signals"]["X"][-1] == pytest.approx(x_mm, abs=0.001)
                       and abs(table["channels"]["Z"]["output_um"][-1] + 20) < 0.1)
            past = eventually(lambda: (table := one.get("/api/history?hours=1"))["unix_s"] and table)
            assert min(past["channels"]["Z"]["output_um"]) == pytest.approx(channel()["output_um"], abs=20.1)
            assert set(past["terms"]) == {"EZX"} and abs(past["unix_s"][-1] - time.time()) < 60
            assert any(event.get("mode") == "ACTIVE" for event in one.get("/api/events"))

            lines, stream = one.stream()
            eventually(lambda: next_message(lines, b"live")["snapshot"]["mode"] == "ACTIVE")
            plc.command("freeze heartbeat 1")
            while next_message(lines, b"event").get("reason") != "the PLC's heartbeat does not change":
                pass  # a busy machine has other events too
            eventually(lambda: live()["mode"] in ("HOLD", "RAMP", "STANDBY"))
            stream.close()
        finally:
            box.terminate()
            errors = box.communicate(timeout=60)[1]
        assert box.returncode == 0, errors
        eventually(lambda: one.metric("compbox_up") == 0)
        assert one.get("/api/live")["why"] == "compboxd has ended; this is its last snapshot"


def test_the_page_is_there_and_kept_by_its_etag(snapshot, view):
    one = view()
    page = one.request("/")
    assert page.status == 200 and page.getheader("Content-Type") == "text/html; charset=utf-8"
    assert page.getheader("Content-Security-Policy").startswith("default-src 'self';")
    assert page.getheader("X-Content-Type-Options") == "nosniff"
    assert page.getheader("Referrer-Policy") == "no-referrer"
    again = one.request("/", headers={"If-None-Match": page.getheader("ETag")})
    assert again.status == 304 and again.text == ""
    head = one.request("/", "HEAD")
    assert head.text == "" and head.getheader("Content-Length") == str(len(page.text.encode()))
    live = one.request("/api/live")
    assert live.getheader("Cache-Control") == "no-store" and live.getheader("ETag") is None
    assert "http://" not in page.text and "https://" not in page.text


@pytest.mark.parametrize("path", ["/x", "/api", "/api/", "/api/live/", "//", "/..", "/../page.h", "/index.html/",
                                  "/%2e%2e/page.h", "/" + "a" * 2000])
def test_another_address_is_not_there(snapshot, view, path):
    assert view().request(path).status == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "BREW"])
def test_other_methods_are_refused(snapshot, view, method):
    refused = view().request("/api/live", method, body="x" * 100 if method in ("POST", "PUT") else None)
    assert refused.status == 405 and refused.getheader("Allow") == "GET, HEAD"


@pytest.mark.parametrize("argument", ["hours=0", "hours=745", "hours=x", "hours=1.5", "hours=",
                                      "hours=99999999999999999999", "hours=-1", "hours=1%20"])
def test_an_argument_out_of_range_is_refused(snapshot, view, argument):
    one = view()
    assert one.request("/api/history?" + argument).status == 400
    assert one.request("/api/events?" + argument.replace("hours", "limit").replace("745", "1001")).status == 400
    assert one.request("/api/history").status == one.request("/api/events").status == 200


def test_a_snapshot_that_vanishes_or_breaks_is_no_box(snapshot, view, tmp_path):
    one = view()
    assert one.metric("compbox_up") == 1 and one.get("/api/live")["snapshot"]["machine"] == "mill"
    lines, stream = one.stream()
    assert next_message(lines, b"live")["stale"] is False
    whole = json.dumps(SNAPSHOT)
    for text, why in ((None, "No such file"), (whole[:100], "is not valid JSON"), ("", "is not valid JSON"),
                      (whole + " " * 300000, "more than 262144"), ("[" * 100000, "is not valid JSON"),
                      ('{"snapshot": 9}', "another version")):
        if text is None:
            (tmp_path / "snapshot.json").unlink()
        else:
            snapshot(text)
        gone = next_message(lines, b"live")
        assert gone["snapshot"] is None and gone["stale"] and why in gone["why"], gone
        assert "\ncompbox_up 0\n# EOF\n" in one.request("/metrics").text
        assert one.get("/api/live")["why"] == gone["why"]
        snapshot()
        assert next_message(lines, b"live")["snapshot"]["mode"] == "ACTIVE"
        assert one.metric("compbox_up") == 1
    os.utime(tmp_path / "snapshot.json", (time.time() - 100,) * 2)
    old = next_message(lines, b"live")
    assert old["snapshot"]["machine"] == "mill" and old["stale"] and old["age_s"] > 99
    assert one.metric("compbox_up") == 0 and one.metric("compbox_mode") is None
    stream.close()


def test_new_events_reach_the_stream(snapshot, view, tmp_path):
    events = tmp_path / "events.jsonl"
    events.write_text('{"n": 1}\n')
    one = view("--events", events)
    lines, stream = one.stream()
    next_message(lines, b"live")
    with events.open("a") as file:
        file.write('{"n": 2}\n{"torn')
    assert next_message(lines, b"event") == {"n": 2}
    events.rename(tmp_path / "events.jsonl.1")
    events.write_text('{"n": 3}\n')
    assert next_message(lines, b"event") == {"n": 3}
    assert one.get("/api/events?limit=2") == [{"n": 2}, {"n": 3}]
    stream.close()


def test_another_site_cannot_read_it_by_a_name_of_its_own(snapshot, view):
    one = view()
    for host in ("evil.example", "127.0.0.1.evil.example:8090", "localhost:1x"):
        assert one.request("/api/live", headers={"Host": host}).status == 421
    for host in ("localhost", "127.0.0.1:9", "[::1]:9"):
        assert one.request("/api/live", headers={"Host": host}).status == 200


def refused(*options):
    done = subprocess.run([BIN / "compbox-view", *options], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stderr


def test_an_address_that_others_reach_needs_a_password(snapshot, tmp_path):
    for address in ("0.0.0.0:0", "[::]:0", "192.0.2.1:80"):
        code, said = refused("--snapshot", "x", "--listen", address)
        assert code == 2 and said == \
            "compbox-view: --listen: an address that others can reach needs --password-file F\n"
    assert refused("--snapshot", "x", "--listen", "box:80")[0] == 2
    assert refused()[0] == 2
    password = tmp_path / "password"
    password.write_text("correct horse\n")
    password.chmod(0o644)
    code, said = refused("--snapshot", "x", "--listen", "0.0.0.0:0", "--password-file", password)
    assert code == 1 and said == f"compbox-view: {password}: other users can read it: chmod o= {password}\n"


def basic(login):
    text = base64.b64encode(login.encode()).decode()
    return {"Authorization": "Basic " + text} if login else {}


def test_the_password_opens_and_is_in_no_reply(snapshot, view, tmp_path):
    password = tmp_path / "password"
    password.write_text("correct horse\n")
    password.chmod(0o640)
    one = view("--password-file", password, listen="0.0.0.0:0")

    paths = ("/", "/api/live", "/api/recent", "/api/history", "/api/events", "/metrics", "/x")
    for number, path in enumerate((*paths, "/api/stream")):
        for login in ("", "compbox:wrong horse", "compbox:", "admin:correct horse", ":", "compbox"):
            closed = one.request(path, headers=basic(login), source=f"127.0.0.{number + 2}")
            assert closed.status == 401 and closed.getheader("WWW-Authenticate").startswith("Basic realm")
            assert "correct" not in closed.text and "mill" not in closed.text
    for path in paths:
        opened = one.request(path, headers=basic("compbox:correct horse"))
        assert opened.status == (404 if path == "/x" else 200)
        assert "correct" not in opened.text + str(opened.getheaders())
    assert one.request("/", headers={"Authorization": "Basic ####"}).status == 401


def test_passwords_cannot_be_guessed_fast(snapshot, view, tmp_path):
    """From each address ten at once. The right one gets through from another, and from this one again later."""
    password = tmp_path / "password"
    password.write_text("correct horse\n")
    password.chmod(0o600)
    one = view("--password-file", password, listen="0.0.0.0:0")
    right, wrong = basic("compbox:correct horse"), basic("compbox:wrong horse")
    assert one.request("/api/live", headers=right, source="127.0.0.9").status == 200
    found = [one.request("/api/live", headers=wrong, source="127.0.0.9") for _ in range(60)]
    assert [reply.status for reply in found[:10]] == [401] * 10
    assert sum(reply.status == 429 for reply in found) >= 40 and "wrong passwords" in found[-1].text
    assert found[-1].getheader("Retry-After") == "10"
    assert one.request("/api/live", headers=right).status == 200
    assert one.request("/api/live", source="127.0.0.9").status == 401, "without a password it is asked for"
    eventually(lambda: one.request("/api/live", headers=right, source="127.0.0.9").status == 200)


HOSTILE = [
    b"\0" * 5000, b"\xff\xfe" * 3000, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"b" * 100000 + b"\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"A: b\r\n" * 20000 + b"\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n" + b"c" * 1000000,
    b"GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n" + b"d" * 1000,
    b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n" + b"e" * 1000000,
    b"GET http://evil/ HTTP/1.1\r\nHost: evil\r\n\r\n", b"GET /%zz%00%ff?%=%&=&&& HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET /api/events?" + b"limit=1&" * 800 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nAuthorization: Basic " + b"A" * 4000 + b"\r\n\r\n",
    b"CONNECT evil:80 HTTP/1.1\r\nHost: evil\r\n\r\n",
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"\x16\x03\x01" + b"f" * 500,
]


def send_and_leave(one, text):
    """Sends what the other side takes, reads a reply if there is one, closes."""
    with contextlib.suppress(OSError), one:
        one.settimeout(0.05)
        one.sendall(text)
        one.recv(65536)


def test_hostile_requests_cost_nothing_that_lasts(snapshot, view):
    one = view()
    for text in HOSTILE:
        send_and_leave(one.connect(), text)
    eventually(lambda: one.get("/api/live"))
    open_before, kb_before = one.descriptors(), one.memory_kb()
    for _ in range(20):
        for text in HOSTILE:
            send_and_leave(one.connect(), text)
    assert one.get("/api/live")["snapshot"]["machine"] == "mill"
    assert eventually(lambda: one.descriptors() <= open_before)
    assert one.memory_kb() - kb_before < 2000


def test_a_thousand_connections_held_open_have_a_bound(snapshot, view):
    one = view()
    one.get("/api/recent")
    open_before, kb_before = one.descriptors(), one.memory_kb()
    with many_descriptors(), contextlib.ExitStack() as held:
        texts = (b"", b"GET / HT", b"GET /api/live HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 6000)
        for i in range(1000):
            held.enter_context(one.connect(texts[i % 3]))
        eventually(lambda: one.descriptors() >= open_before + 990)
        for path in ("/", "/api/live", "/metrics"):
            assert one.request(path).status == 200
        assert one.memory_kb() - kb_before < 1000 * 16
    assert eventually(lambda: one.descriptors() <= open_before)


def test_slow_readers_queue_nothing_and_cost_no_other_reader(snapshot, view):
    one = view()
    name = "N" * 100000  # each text is large
    for i in range(3):
        snapshot(machine=name, revision=i)
        one.get("/api/live")
    with many_descriptors(), contextlib.ExitStack() as held:
        for _ in range(99):
            slow = socket.socket()
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            slow.connect(("127.0.0.1", one.port))
            slow.sendall(b"GET /api/stream HTTP/1.1\r\nHost: localhost\r\n\r\n")
            held.enter_context(slow)
        lines, fast = one.stream()
        held.callback(fast.close)
        assert next_message(lines, b"live")["stale"] is False
        assert one.request("/api/stream").status == 503, "too many"
        kb_before = one.memory_kb()
        for i in range(30):
            snapshot(machine=name, revision=1000 + i)
            while next_message(lines, b"live")["snapshot"]["revision"] != 1000 + i:
                pass
        # at most one text each, of which the kernel's buffers are no part
        assert one.memory_kb() - kb_before < 99 * 110 + 2000
        assert one.get("/api/live")["snapshot"]["revision"] == 1029
    assert eventually(lambda: one.request("/api/stream", "HEAD").status == 200), "their places are free again"


def test_readers_that_take_no_body_have_a_bound_together(snapshot, view):
    one = view()
    for _ in range(2):
        assert one.get("/api/live")
    snapshot(machine="N" * 250000)
    eventually(lambda: "N" in one.request("/api/live").text)
    kb_before = one.memory_kb()
    with many_descriptors(), contextlib.ExitStack() as held:
        for _ in range(400):
            slow = socket.socket()
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            slow.connect(("127.0.0.1", one.port))
            slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)
            held.enter_context(slow)
        one.request("/")
        assert one.memory_kb() - kb_before < (64 + 24) * 1024
        assert one.request("/").status == 200


def test_no_record_is_read_for_a_request(snapshot, view, tmp_path):
    """What /api/history answers, it has; a huge record costs no more."""
    record = tmp_path / "record.csv"
    now = time.time()
    with record.open("w") as file:
        file.write("time_s,T1,comp_X_um,mode,reason,unix_s\n")
        for i in range(200000):
            file.write(f"{i / 10},{20 + i % 7},{-250 if i == 77777 else 1},1,0,{now - 20000 + i / 10:.3f}\n")
    one = view("--record", record)
    table = eventually(lambda: (got := one.get("/api/history?hours=6"))["unix_s"]
                       and got["unix_s"][-1] > now - 120 and got)
    assert len(table["unix_s"]) <= 1500 and min(table["channels"]["X"]["output_um"]) == -250

    def bytes_read():
        text = pathlib.Path(f"/proc/{one.process.pid}/io").read_text()
        return int(re.search(r"rchar: (\d+)", text).group(1))

    before = bytes_read()
    for hours in range(1, 745, 31):
        assert len(one.get(f"/api/history?hours={hours}")["unix_s"]) <= 1500
    assert bytes_read() - before < 1 << 20


@pytest.mark.skipif(shutil.which("promtool") is None, reason="promtool is of Debian's package prometheus")
def test_promtool_finds_nothing_in_its_metrics(snapshot, view):
    snapshot(machine='a "quoted" \\ name\nin two lines',
             jitter_us={"count": 3, "sum": 5.5, "up_to": {"10": 1, "20": 3}})
    one = view()
    eventually(lambda: "quoted" in one.request("/metrics").text)
    text = one.request("/metrics", headers={"Accept": "text/plain"}).text
    done = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and done.stderr == "", done.stdout + done.stderr
