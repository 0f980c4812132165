# SPDX-License-Identifier: MIT
"""The registry of `compbox fleet`, and which machines drift."""

import hashlib
import os
import pathlib
import signal
import subprocess
import sys

import pytest

from fleets import ADD, ROOT
from fleet.registry import Registry, write_file
from twins import TRUTH, Twin, machine_file


def test_objects_are_named_by_their_content(plant, twin):
    plant.add_lathe("lathe-1", twin)
    objects = [path for path in (plant.folder / "registry/objects").rglob("*") if path.is_file()]
    assert sorted(path.suffix for path in objects) == [".csv", ".json"]
    for path in objects:
        name = hashlib.sha256(path.read_bytes()).hexdigest()
        assert (path.parent.name, path.stem) == (name[:2], name)
    assert Registry(plant.folder / "registry").get(plant.entry("machines", "lathe-1")["records"][0]) == \
        (plant.folder / "record.csv").read_bytes()


def test_a_command_that_is_repeated_changes_nothing(plant, twin):
    plant.add_lathe("lathe-1", twin)
    before = plant.everything()
    plant.fleet("record", "lathe-1", "record.csv")
    plant.fleet("add", "lathe-1", "machine.json", *ADD)
    assert plant.everything() == before


def test_a_changed_object_is_noticed(plant, twin):
    plant.add_lathe("lathe-1", twin)
    registry = Registry(plant.folder / "registry")
    data = plant.entry("machines", "lathe-1")["records"][0]
    path = next((plant.folder / "registry/objects").rglob(data + ".csv"))
    path.write_bytes(path.read_bytes().replace(b"20", b"21", 1))
    with pytest.raises(Exception, match="its content is not that of its name"):
        registry.get(data)


def test_figures_of_a_record_count_its_probes(plant, twin):
    machine_file(plant)
    plant.fleet("add", "lathe-1", "machine.json", *ADD)
    plant.write("record.csv", "time_s,probe_x,probe_x_n\n0,9,7\n1,9,7\n2,3,8\n3,3,8\n4,-5,9\n")
    assert plant.fleet("record", "lathe-1", "record.csv") == "record.csv: x: 2 probes, rms 4.1231 um\n"
    figures = plant.status()["lathe-1"]["measured"]["x"]
    assert (figures["count"], figures["mean_um"], figures["rms_um"]) == (2, -1.0, 4.1231)
    assert not figures["drifted"]


def test_status_names_the_machines_that_drift(plant):
    for name, seed in (("calm", 1), ("worn", 2), ("warned", 3)):
        one = Twin(seed)
        plant.add_lathe(name, one, 10, compensated=TRUTH)
        if name == "worn":  # for the second half of the record
            first = (plant.folder / "record.csv").read_text()
            rest = one.record(10, compensated=TRUTH, shift_um=4).split("\n", 1)[1]
            plant.write("worn.csv", first + rest)
            plant.fleet("record", name, "worn.csv")
    plant.write("box.json", {"snapshot": 1, "unix_s": 5, "mode": "ACTIVE", "reason": "probes differ", "revision": 3,
                             "crc": "0", "adapted": [{"name": "X_adapted", "innovation_um": 1, "expected_um": 2,
                                                      "cusum": -11.5}]})
    plant.fleet("snapshot", "warned", "box.json")
    found = plant.status()
    assert [name for name, row in found.items() if row["drifts"]] == ["warned", "worn"]
    assert "the model has drifted since" in found["worn"]["findings"][0]
    assert found["warned"]["findings"] == ["X_adapted: innovations lie to one side, CUSUM -11.5"]
    assert plant.fleet("status").endswith("2 of 3 machines drift\n")


def test_refusals(plant, twin):
    assert plant.refusal("status") == "registry: is no registry; `compbox fleet add` makes one"
    machine_file(plant)
    plant.fleet("add", "lathe-1", "machine.json", *ADD)
    assert "is not a name" in plant.refusal("add", "../x", "machine.json", *ADD)
    plant.write("record.csv", "time_s,X\n0,1\n")
    assert plant.refusal("record", "lathe-1", "record.csv") == \
        "record.csv: has no columns probe_NAME and probe_NAME_n"
    plant.write("record.csv", "time_s,probe_x,probe_x_n\n0,1,1\n1,nan,2\n")
    assert plant.refusal("record", "lathe-1", "record.csv") == "record.csv: line 3 has no number for a probe"
    assert plant.refusal("record", "lathe-2", "record.csv") == \
        "registry: machines has no lathe-2 (it has lathe-1)"
    assert plant.refusal("record", "lathe-1", "none.csv") == "none.csv: No such file or directory"
    assert "is no machine file" in plant.refusal("add", "a", "registry/registry.json", *ADD)
    assert plant.refusal("snapshot", "lathe-1", "machine.json") == "machine.json: is no snapshot of compboxd"
    assert plant.refusal("report", "-o", "machine.json/page.html").startswith("machine.json: ")
    assert "has other files" in plant.refusal("add", "a", "machine.json", *ADD, "--registry", ".")
    plant.add_record("lathe-1", twin, 1)
    plant.fleet("add", "lathe-2", "machine.json", *ADD)
    assert "is a record of lathe-1, not of lathe-2" in plant.refusal("record", "lathe-2", "record.csv")


def test_one_writer_at_a_time(plant, twin):
    plant.add_lathe("lathe-1", twin)
    with Registry(plant.folder / "registry").locked():
        assert "another compbox fleet is writing" in plant.refusal("record", "lathe-1", "record.csv")
    plant.fleet("record", "lathe-1", "record.csv")


def test_a_kill_while_writing_leaves_the_old_file(tmp_path):
    """A writer of ever new contents is killed; the file has one of them, as a whole."""
    path = tmp_path / "file"
    write_file(path, b"0" * 100000)
    program = ("import pathlib,sys; from fleet.registry import write_file\n"
               "for k in range(10**6): write_file(pathlib.Path(sys.argv[1]), b'%d' % (k % 10) * 100000); "
               "print(k, flush=True)")
    for _ in range(5):
        writer = subprocess.Popen([sys.executable, "-c", program, path], stdout=subprocess.PIPE,
                                  env=dict(os.environ, PYTHONPATH=str(ROOT / "host-tools")))
        for _ in range(3):
            writer.stdout.readline()
        writer.send_signal(signal.SIGKILL)
        writer.wait(60)
        writer.stdout.close()
        content = path.read_bytes()
        assert len(content) == 100000 and len(set(content)) == 1
    assert pathlib.Path(path).exists()
