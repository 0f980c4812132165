# SPDX-License-Identifier: MIT
"""Roll-outs of `compbox fleet` to simulated boxes in a folder: stages, halt and return, poison, a killed command."""

import errno
import html.parser
import json
import os
import pathlib
import queue
import random
import shutil
import socket
import subprocess
import threading
import time

import pytest

from boxes import bank_um
from fleets import COUNT, POISONED, Plant, cli
from fleet import __main__, bridge, links, receiving, report, rollout, signing, site, tools
from fleet.errors import FleetError
from fleet.registry import Registry, write_file

ROLLOUT = ("fleet", "rollout", "--key", "plant.key", "--folder", "boxes", "--every", "0.01", "--wait", "100")


def run(plant, boxes, *more, kills=0):
    """Runs the command while boxes live; kills it so many times. out: (exit code, what it printed)"""
    end, dice = threading.Event(), random.Random(kills)

    def live():
        while not end.is_set():
            for box in boxes.values():
                box.turn()
            time.sleep(0.02)

    life = threading.Thread(target=live)
    life.start()
    try:
        while True:
            command = subprocess.Popen([cli.BIN / "compbox", *ROLLOUT, *more], cwd=plant.folder, text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            if not kills:
                out, errors = command.communicate(timeout=100)
                return command.returncode, out + errors
            time.sleep(dice.uniform(0.05, 0.15))
            command.kill()
            command.communicate()
            kills -= 1
    finally:
        end.set()
        life.join()


@pytest.fixture(scope="module", name="made")
def made_once(tmp_path_factory):
    plant = Plant(tmp_path_factory.mktemp("made"))
    plant.make(COUNT)
    return plant.folder


@pytest.fixture
def plant(made, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return Plant(tmp_path)


def test_every_machine_ends_with_a_better_signed_model(plant):
    plant.set_without([f"m{k:03}" for k in range(12, COUNT)])
    boxes = {name: box for name, box in plant.boxes().items() if name < "m012"}
    code, out = run(plant, boxes)
    assert code == 0 and out.endswith("done\n"), out
    assert plant.state()["stages"] == [1, 2, 12]
    for name, box in boxes.items():
        assert box.taken == [8] and box.rms_um() < 1.0, name  # the old model leaves 4 to 6
        entry = plant.entry("machines", name)
        assert (entry["revision"], entry["candidate"]) == (8, None)
        model = plant.entry("models", entry["model"])
        assert [one["revision"] for one in model["signed"]] == [8] and model["parent"]
        file = (plant.folder / "boxes" / name / "coefficients.json").read_bytes()
        assert Registry(plant.folder / "registry").get(model["signed"][0]["file"]) == file
    assert "no machine has a better candidate" in plant.good(*ROLLOUT)
    check_page(plant, boxes)


class Page(html.parser.HTMLParser):
    """Rows of the tables, and numbers of SVG elements; each tag must be closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.shapes = [], [], {}
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.shapes[tag] = self.shapes.get(tag, 0) + 1
        if tag == "tr":
            self.rows.append([])
        if tag != "meta":
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.shapes[tag] = self.shapes.get(tag, 0) + 1

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)


def check_page(plant, boxes):
    """The report of a roll-out that is done: each machine's figures are those of its probes."""
    plant.fleet("report", "-o", "fleet.html")
    text = (plant.folder / "fleet.html").read_text()
    page = Page(text)
    assert "http" not in text and page.shapes["svg"] == 2 and page.shapes["circle"] == 2 * len(boxes)
    assert page.shapes["rect"] == 20  # before and after of the worst ten
    worst, every = page.rows[1:11], page.rows[12:]
    assert [row[0] for row in every] == sorted(boxes)
    after = [float(row[2]) for row in worst]
    assert after == sorted(after, reverse=True) and after[0] == max(float(row[2]) for row in every)
    for name, before, after, bound, state in every:
        seen = plant.state()["machines"][name]["seen_um"]["x"]
        assert float(after) == pytest.approx((sum(um * um for um in seen) / len(seen)) ** 0.5, abs=0.006)
        assert float(before) > float(bound) > float(after) and state == "good"
    plant.fleet("report", "-o", "again.html")
    assert (plant.folder / "again.html").read_text() == text


def test_a_killed_command_goes_on(plant):
    plant.set_without([f"m{k:03}" for k in range(12, COUNT)])
    boxes = {name: box for name, box in plant.boxes().items() if name < "m012"}
    code, out = run(plant, boxes, kills=8)
    assert code == 0 and out.endswith(("done\n", "no machine has a better candidate\n")), out
    assert all(box.taken == [8] and box.rms_um() < 1.0 for box in boxes.values())
    assert all(plant.entry("machines", name)["revision"] == 8 for name in boxes)


class Killed(BaseException):
    pass


class LiveFolder(links.Folder):
    """A folder whose boxes live in each poll. At the n-th writing of the command it dies: with an odd n before the file
    has its name, else after that."""

    def __init__(self, folder, boxes, kill_at, monkeypatch):
        super().__init__(folder, 0)
        self.boxes, self.kill_at, self.writes, self.counts = boxes, kill_at, 0, True
        replace = os.replace

        def counted(*paths):
            self.writes += self.counts
            if self.counts and self.writes == self.kill_at and self.kill_at % 2:
                raise Killed
            replace(*paths)
            if self.counts and self.writes == self.kill_at:
                raise Killed
        monkeypatch.setattr("fleet.registry.os.replace", counted)

    def poll(self):
        self.counts = False
        for box in self.boxes.values():
            box.turn()
        self.counts = True
        return super().poll()


def test_a_kill_at_each_writing(plant, monkeypatch):
    """A roll-out to two machines, of which one has a wrong record, is killed at its first, second … writing. Called
    again, it ends as the one that was not killed."""
    keep = ("m000", POISONED[0])
    plant.set_without([f"m{k:03}" for k in range(COUNT) if f"m{k:03}" not in keep])
    shutil.copytree(plant.folder / "registry", plant.folder / "before")
    kill_at, ended, last = 1, {}, 10**6
    while kill_at <= last + 1:
        shutil.rmtree(plant.folder / "registry")
        shutil.copytree(plant.folder / "before", plant.folder / "registry")
        for name in keep:
            shutil.rmtree(plant.folder / "boxes" / name)
            write_file(plant.folder / "boxes" / name / "coefficients.json", (plant.folder / "old.json").read_bytes())
        registry, boxes = Registry(plant.folder / "registry"), {name: plant.boxes()[name] for name in keep}
        for kill in (kill_at, 0):
            with monkeypatch.context() as patch:
                link = LiveFolder(plant.folder / "boxes", boxes, kill, patch)
                state = site.unfinished(registry)
                if state is None:
                    offers, _ = site.offers(registry, [])
                    state = rollout.begun(offers, "m000") if offers else None
                try:
                    if state:
                        site.Runner(registry, state, link, plant.folder / "plant.key", 0.1).run(60, lambda _: None)
                    last = min(last, link.writes + kill_at) if kill else last
                except Killed:
                    pass
        entries = [registry.read("machines", name) for name in keep]
        ended[kill_at] = [(one["model"], one["revision"], one["candidate"]) for one in entries]
        assert [box.taken for box in boxes.values()] == [[8, 9], [8, 9]], kill_at
        kill_at += 1 if cli.LONG else 9  # before and after a writing in turn
    assert len(ended) >= 5 and len({json.dumps(one) for one in ended.values()}) == 1, ended


def test_poisoned_records_stop_at_the_canary(plant):
    boxes = plant.boxes()
    code, out = run(plant, boxes)
    assert code == 1 and "the roll-out was halted: m" in out, out
    seen = [name for name, box in boxes.items() if box.taken]
    assert len(seen) == 1 and seen[0] in POISONED  # one machine, the first stage
    assert boxes[seen[0]].taken == [8, 9]
    assert json.loads(boxes[seen[0]].place.read_text()) == {**json.loads((plant.folder / "old.json").read_text()),
                                                            "revision": 9}
    entry = plant.entry("machines", seen[0])
    assert entry["revision"] == 9 and len(entry["rejected"]) == 1
    before = entry["model"]
    assert plant("fleet", "train", seen[0]).returncode == 0  # the job is known, its model stays rejected
    assert plant.entry("machines", seen[0])["candidate"] is None
    assert plant.entry("machines", seen[0])["model"] == before


def test_a_poisoned_model_stops_at_the_canary(plant):
    """All candidates are replaced by one with the wrong sign, which promises the same."""
    registry = Registry(plant.folder / "registry")
    for name in registry.names("machines"):
        entry = registry.read("machines", name)
        model = registry.read("models", entry["candidate"])
        text = json.loads(registry.get(entry["candidate"]))
        bank = next(one for one in text["terms"] if "bank" in one)["bank"]
        bank["weights"] = [[-w for w in row] for row in bank["weights"]]
        poisoned = registry.put(json.dumps(text).encode(), "json")
        registry.write("models", poisoned, model)
        registry.write("machines", name, {**entry, "candidate": poisoned})
    plant.set_without(POISONED)
    boxes = {name: box for name, box in plant.boxes().items() if name not in POISONED}
    code, out = run(plant, boxes)
    assert code == 1 and "exceeds" in out, out
    assert [box.taken for box in boxes.values() if box.taken] == [[8, 9]]


def turns(plant, monkeypatch, state, living):
    """50 turns of a roll-out; boxes live in each."""
    with monkeypatch.context() as patch:
        link = LiveFolder(plant.folder / "boxes", living, 0, patch)
        runner = site.Runner(Registry(plant.folder / "registry"), state, link, plant.folder / "plant.key", 0.1)
        for _ in range(50):
            runner.turn()


def test_a_box_that_is_away_catches_up(plant, monkeypatch):
    names = [f"m{k:03}" for k in range(20) if f"m{k:03}" not in POISONED]
    plant.set_without([f"m{k:03}" for k in range(COUNT) if f"m{k:03}" not in names])
    boxes = {name: box for name, box in plant.boxes().items() if name in names}
    away = boxes.pop(names[-1])
    registry = Registry(plant.folder / "registry")
    state = rollout.begun(site.offers(registry, [])[0], "m000")

    turns(plant, monkeypatch, state, boxes)
    assert not away.taken and plant.state()["machines"][names[-1]]["state"] == "sent"
    assert {plant.state()["machines"][name]["state"] for name in boxes} == {"good"}
    assert plant.good(*ROLLOUT, "--wait", "0") == "not over; the same command continues it\n"
    turns(plant, monkeypatch, site.unfinished(registry), {names[-1]: away})
    assert plant.state()["state"] == "done" and away.taken == [8] and plant.good(*ROLLOUT).startswith("no machine")


def test_a_box_that_never_answers_is_left_by_without(plant, monkeypatch):
    names = ["m000", "m001", "m002"]
    plant.set_without([f"m{k:03}" for k in range(COUNT) if f"m{k:03}" not in names])
    boxes = {name: box for name, box in plant.boxes().items() if name in names}
    scrapped, old = boxes.pop("m001"), plant.entry("machines", "m001")
    state = rollout.begun(site.offers(Registry(plant.folder / "registry"), [])[0], "m000")
    turns(plant, monkeypatch, state, boxes)
    assert plant.state()["machines"]["m001"]["state"] == "sent"
    said = plant.good(*ROLLOUT, "--without", "m001")
    assert said.endswith("m001: was left out by --without\ndone\n") and plant.state()["order"] == ["m000", "m002"]
    entry = plant.entry("machines", "m001")
    assert entry == {**old, "candidate": None, "rejected": [], "revision": 9}
    assert plant.good(*ROLLOUT).startswith("no machine")
    scrapped.turn()
    assert scrapped.taken == [9] and json.loads(scrapped.place.read_text()) == \
        {**json.loads((plant.folder / "old.json").read_text()), "revision": 9}


def test_a_box_of_a_higher_revision_is_left():
    """It refuses what it is sent. As the canary it makes place for the next one."""
    def offer(name):
        return {"machine": name, "from": "old", "to": "new", "revision": 8, "forecast_um": {"x": 1.0}, "before_um": {},
                "mean_um": {}}

    state = rollout.begun([offer(name) for name in ("m000", "m001", "m002")], "m001")
    assert rollout.step(state, {}) and state["machines"]["m001"]["state"] == "sent"
    assert not rollout.step(state, {"m001": 8}) and rollout.step(state, {"m001": 20})
    assert {name: one["state"] for name, one in state["machines"].items()} == \
        {"m000": "sent", "m001": "left", "m002": "waiting"}
    assert "its box runs revision 20, above the 8 that it was sent" in state["machines"]["m001"]["why"]
    for name in ("m000", "m002"):
        for _ in range(rollout.PROBES):
            rollout.reported(state, name, 8, "x", 0.5)
        rollout.step(state, {"m001": 20})
    assert state["state"] == "done" and rollout.is_over(state)


def test_a_failed_box_that_is_left_counts_as_failed():
    machines = {name: {"state": "returning", "revision": 9, "why": "x: residual"} for name in ("m000", "m001")}
    state = {"machines": {**machines, "m002": {"state": "waiting"}, "m003": {"state": "good"}},
             "order": ["m000", "m001", "m002", "m003"], "stages": [4], "stage": 0, "state": "running"}
    for name in (*state["machines"], "m004"):
        rollout.leave(state, name, "was left")
    assert state["order"] == ["m000", "m001", "m003"] and rollout.counts(state) == {"left": 2, "good": 1}
    assert state["machines"]["m000"]["why"] == "x: residual"


def test_a_repeated_signing_has_one_entry(plant):
    registry = Registry(plant.folder / "registry")
    entry = registry.read("machines", "m000")
    for revision in (8, 8, 9):  # a command was killed before it wrote that it has signed
        part = {"state": "sent", "from": entry["model"], "to": entry["candidate"], "revision": revision}
        site.prepare(registry, part, plant.folder / "plant.key")
    signed = registry.read("models", entry["candidate"])["signed"]
    assert [one["revision"] for one in signed] == [8, 9]
    assert signed[1] == {name: part[name] for name in ("revision", "file", "signature")}


def test_the_boxes_compute_what_compbox_computes(plant):
    file = json.loads((plant.folder / "old.json").read_text())
    pairs = [(20 + k % 5, 21 + k % 3) for k in range(24)]
    rows = "".join(f"{600 * k},0,0,{one},{other},0,0\n" for k, (one, other) in enumerate(pairs))
    plant.write("in.csv", "time_s,X,Z,T1,T2,probe_x,probe_x_n\n" + rows)
    plant.good("eval", "old.json", "--inputs", "in.csv", "--raw", "-o", "out.csv")
    assert plant.table("out.csv")["error_X_um"] == pytest.approx(bank_um(file, pairs, 600), abs=0.1)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400, "0.1", None, [0.1]],
                         ids=lambda one: f"{one}"[:9])
def test_what_is_no_number_is_no_probe(value):
    residuals = links.Residuals()
    for count in range(20):
        assert residuals.feed("m000", 8, {"probe_x": value, "probe_x_n": count}) == []
    assert residuals.feed("m000", 8, {"probe_x": 0.1, "probe_x_n": "20"}) == []
    assert residuals.feed("m000", "8", {"probe_x": 0.1, "probe_x_n": 20}) == []
    assert residuals.feed("m000", 8, ["probe_x"]) == []
    assert residuals.feed("m000", 8, {"probe_x": 0.1, "probe_x_n": 21}) == [("x", 0.1)]
    assert residuals.feed("m000", 8, {"probe_x": 0, "probe_x_n": 0}) == []  # its PLC began anew
    assert residuals.feed("m000", 8, {"probe_x": 0.2, "probe_x_n": 65535}) == [("x", 0.2)]
    assert residuals.feed("m000", 8, {"probe_x": 0.3, "probe_x_n": 1}) == [("x", 0.3)]
    seen = {"bound_um": {"x": 1.0}, "seen_um": {"x": [float("nan")] * rollout.PROBES}}
    assert rollout.verdict(seen)  # a machine passes by what was measured alone


@pytest.fixture(name="link")
def link_without_a_broker():
    """(a link, its function that takes a message as the broker brings it)"""
    link = links.Mqtt.__new__(links.Mqtt)
    link.prefix, link.every_s, link.revisions, link.messages = "plant", 0.01, {}, queue.SimpleQueue()
    return link, lambda topic, message: link.messages.put((f"plant/{topic}", json.dumps(message).encode()))


def values(revision, count, um):
    return {"values": 1, "unix_s": 5, "revision": revision, "mode": "ACTIVE", "terms": {}, "channels": {},
            "signals": {"probe_x": um, "probe_x_n": count}}


def test_values_that_waited_belong_to_the_revision_that_measured_them(link):
    """A box comes back: it has taken revision 8 before compbox-view sends its state, and what waited of revision 7."""
    link, bring = link
    bring("m000/state", {"revision": 8})
    for count in range(rollout.PROBES + 1):
        bring("m000/values", values(7, count, 9.0))
    for count in range(rollout.PROBES + 1):
        bring("m000/values", values(8, count, 0.5))
    lines = bridge.Lines()
    state = {"machines": {"m000": {"state": "sent", "revision": 8, "bound_um": {"x": 1.0}, "seen_um": {}}}}
    residuals = links.Residuals()
    for name, revision, signals in link.poll():
        for probe, um in residuals.feed(name, revision, signals):
            rollout.reported(state, name, revision, probe, um)
    assert state["machines"]["m000"]["seen_um"] == {"x": [0.5] * rollout.PROBES}
    lines.of("m000", "state", {"revision": 8}, 0)
    lines.of("m000", "values", values(7, 3, 9.0), 0)
    assert not any("residual" in line for line in lines.of("m000", "values", values(8, 4, 9.0), 0))


@pytest.mark.parametrize("payload", [b"[" * 100000, b"1" + b"0" * 400, b"7", b'{"revision": [], "signals": 7}',
                                     json.dumps({**values(8, 1, 0.5), "unix_s": float("inf")}).encode()],
                         ids=("deep", "large", "number", "types", "time"))
def test_no_message_ends_the_site(link, payload):
    link, bring = link
    ends = iter([False, True])
    for turn in (link.poll, lambda: bridge.run(link, bridge.Database("http://127.0.0.1:9"), dict, lambda: next(ends))):
        for kind in ("online", "state", "values"):
            link.messages.put((f"plant/m000/{kind}", payload))
        bring("m001/state", {"revision": 8, "runs": True})
        turn()


def test_lines_wait_while_the_database_does_not_speak_http():
    with socket.create_server(("127.0.0.1", 0)) as door:
        database = bridge.Database(f"http://127.0.0.1:{door.getsockname()[1]}")
        database.take(["line"])

        def answer():
            connection = door.accept()[0]
            connection.recv(10000)
            connection.sendall(b"what?\r\n")
            connection.close()
        thread = threading.Thread(target=answer)
        thread.start()
        assert not database.write()
        thread.join()
    assert database.waiting == ["line"]


def test_messages_without_a_pause_are_taken_in_parts(link):
    link, _ = link

    class Endless:
        left = 10**7

        def get(self, timeout):
            assert timeout > 0
            self.left -= 1
            if self.left < 0:
                raise queue.Empty
            return "topic", b"payload"

    link.messages = Endless()
    assert link.received() and link.messages.left > 0


def test_the_report_has_the_latest_roll_out_of_each_machine(tmp_path):
    """The first one reached a high revision of another machine."""
    def part(revision, state, um):
        return {"state": state, "revision": revision, "bound_um": {"x": 2.0}, "before_um": {"x": um},
                "seen_um": {"x": [1.0]}}
    registry = Registry.create(tmp_path / "registry")
    registry.write("rollouts", "a", {"machines": {"m000": part(9, "good", 7.0), "m001": part(3, "returned", 8.0)}})
    registry.write("rollouts", "b", {"machines": {"m001": part(4, "good", 5.0), "m002": part(1, "waiting", 1.0)}})
    rows = {row["machine"]: (row["before_um"], row["state"]) for row in report.rows_of(registry)}
    assert rows == {"m000": (7.0, "good"), "m001": (5.0, "good")}


def test_a_password_is_the_first_line_of_a_file_that_no_other_user_reads(plant):
    path = plant.folder / "site.txt"
    path.write_text(" word \r\n# of the site\n")
    words = ("rollout", "--key", "plant.key", "--mqtt", "127.0.0.1:9", "--mqtt-user", "site")
    path.chmod(0o644)
    assert plant.refusal(*words, "--mqtt-password-file", "site.txt") == \
        "site.txt: other users can read it: chmod o= site.txt"
    assert plant.refusal(*words) == "--mqtt-user and --mqtt-password-file belong together"
    path.chmod(0o640)
    assert __main__.password_of(path) == " word "


@pytest.mark.parametrize("topic", [b"plant/#", b"+/lathe", b"plant/\xff"])
def test_a_topic_that_no_broker_takes_is_wrong_usage(plant, topic):
    done = plant(*ROLLOUT[:4], "--mqtt", "127.0.0.1:9", "--mqtt-topic", os.fsdecode(topic))
    assert done.returncode == 2 and done.stderr.startswith("compbox: fleet: argument --mqtt-topic: invalid topic value")


def test_a_running_file_that_is_no_object(plant):
    plant.write("list.json", [])
    assert plant.refusal("running", "m000", "list.json") == "list.json: is no coefficient file"


def test_stages():
    assert [rollout.stages_of(count) for count in (1, 5, 40, 1000)] == [[1], [1, 5], [1, 4, 40], [1, 10, 100, 1000]]


def test_a_candidate_that_promises_no_less_stays(plant):
    registry = Registry(plant.folder / "registry")
    entry = registry.read("machines", "m003")
    model = registry.read("models", entry["candidate"])
    registry.write("models", entry["candidate"], {**model, "forecast_um": {"x": 50.0}})
    offers, left = site.offers(registry, ["m004"])
    assert list(left) == ["m003"] and len(offers) == COUNT - 2


@pytest.fixture(name="arrived")
def signed_file(plant):
    """(a payload that is in order, keys, place of the running file)"""
    text = rollout.with_revision((plant.folder / "old.json").read_text(), 8)
    signature = signing.signed(text, plant.folder / "plant.key")
    return text, signature, plant.folder / "keys", plant.folder / "boxes/m000/coefficients.json"


def payload(text, signature):
    return json.dumps({"file": text, "signature": signature}).encode()


def test_a_box_takes_what_is_in_order(arrived):
    text, signature, keys, place = arrived
    assert receiving.take(payload(text, signature), keys, place) == 8
    assert place.read_text() == text and pathlib.Path(f"{place}.minisig").read_text() == signature
    assert receiving.take(payload(text, signature), keys, place) is None


@pytest.mark.parametrize("steps", [0, 1, 2, 3])
def test_a_box_that_is_cut_off_while_it_takes_a_file_has_one_that_verifies(arrived, plant, monkeypatch, steps):
    text, signature, keys, place = arrived
    old = place.read_text()
    write_file(pathlib.Path(f"{place}.minisig"), signing.signed(old, plant.folder / "plant.key").encode())
    left = [steps]

    def dies_after(call):
        def step(*words):
            left[0] -= 1
            if left[0] < 0:
                raise KeyboardInterrupt
            return call(*words)
        return step

    monkeypatch.setattr(receiving, "write_file", dies_after(write_file))
    monkeypatch.setattr(pathlib.Path, "replace", dies_after(pathlib.Path.replace))
    try:
        receiving.put(text, signature, place)
    except KeyboardInterrupt:
        pass
    assert left[0] == (0 if steps == 3 else -1)
    assert place.read_text() == (text if steps > 1 else old)
    tools.compbox("verify", place, "--keys", keys)


def test_a_box_that_is_cut_off_twice_has_a_file_that_verifies(arrived, plant, monkeypatch):
    """First before the signature has its place; `receive` starts again; then while it takes the next file."""
    text, signature, keys, place = arrived
    with monkeypatch.context() as patch:
        patch.setattr(pathlib.Path, "replace", lambda *_: None)
        receiving.put(text, signature, place)
    assert receiving.take(payload(text, signature), keys, place) is None
    following = signing.signed(rollout.with_revision(text, 9), plant.folder / "plant.key")
    write_file(pathlib.Path(f"{place}.minisig.new"), following.encode())
    tools.compbox("verify", place, "--keys", keys)


def test_a_box_follows_a_folder_that_goes_and_comes_back(arrived, plant, monkeypatch, capsys):
    """Half of a file is copied, the share is gone, then all of it is there with the same coarse time."""
    text, signature, keys, place = arrived
    folder, whole, turns = plant.folder / "stick", payload(text, signature), []
    folder.mkdir()
    file, stat = folder / "file.json", pathlib.Path.stat

    def away(path, **how):
        if len(turns) in (2, 3) and path == file:
            raise OSError(errno.ESTALE, "Stale file handle", str(path))
        return stat(path, **how)

    def second(_):
        turns.append(None)
        if len(turns) > 5:
            raise KeyboardInterrupt
        if len(turns) in (1, 4):
            file.write_bytes(whole[:50] if len(turns) == 1 else whole)
            os.utime(file, (1000, 1000))

    monkeypatch.setattr(pathlib.Path, "stat", away)
    monkeypatch.setattr(receiving.time, "sleep", second)
    with pytest.raises(KeyboardInterrupt):
        receiving.from_folder(folder, keys, place, False)
    assert place.read_text() == text
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 3 and "no file and signature" in said[0] and "Stale" in said[1] and "took revision 8" in said[2]


def test_a_box_refuses(arrived, plant):
    text, signature, keys, place = arrived
    before = place.read_bytes()

    def refusal(*words):
        with pytest.raises(FleetError) as error:
            receiving.take(words[0] if len(words) == 1 else payload(*words), keys, place)
        assert place.read_bytes() == before
        return str(error.value)

    dice = random.Random(4)
    for _ in range(20):
        at = dice.randrange(len(text))
        assert "is not what was signed" in refusal(text[:at] + chr(ord(text[at]) ^ 1) + text[at + 1:], signature)
    assert "is not a signature" in refusal(text, "")
    assert "has no file and signature" in refusal(b"{}")
    assert "has no file and signature" in refusal(b"\xff")
    assert "has no file and signature" in refusal(b"[" * 100000)
    place.write_text(rollout.with_revision(text, 9))
    before = place.read_bytes()
    assert "revision 8 is older than the running 9" in refusal(text, signature)
    place.write_text(text.replace('"name": "machine"', '"name": "other"', 1))
    before = place.read_bytes()
    assert "the file is of machine, not of other" in refusal(text, signature)
    shutil.rmtree(keys)
    keys.mkdir()
    assert "has no key NAME.pub" in refusal(text, signature)
