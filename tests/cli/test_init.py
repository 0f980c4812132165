# SPDX-License-Identifier: MIT
"""compbox init: what it writes, and what it refuses as wrong usage."""

import itertools
import json
import os
import pty
import subprocess

import pytest

from conftest import BIN, PLC, ROOT, term

NO_AXIS = "is not an axis (use letters of XYZUVW, as in XYZ, X,Z1 or X,Y1+Y2)"
USAGE = [
    (["--axes", "XQ"], f"--axes: 'Q' {NO_AXIS}"),
    (["--axes", "X,"], f"--axes: '' {NO_AXIS}"),
    (["--axes", "X,Portal"], f"--axes: 'Portal' {NO_AXIS}"),
    (["--axes", "X, Z"], f"--axes: ' Z' {NO_AXIS}"),
    (["--axes", "XYX"], "--axes: X is named twice"),
    (["--axes", "Y,Y1+Y2"], "--axes: Y is named twice"),
    (["--axes", "Y1+Y1"], "--axes: Y1 is named twice"),
    (["--axes", "Y1+Z2"], "--axes: 'Y1+Z2' must be two motors of one axis, as in Y1+Y2"),
    (["--axes", "Y1+Y2+Y3"], "--axes: 'Y1+Y2+Y3' must be two motors of one axis, as in Y1+Y2"),
    (["--axes", ""], "--axes: is required: axes of the machine, as in XYZ or X,Y1+Y2,Z"),
    (["--axes", "X1,X2,X3,X4,X5,X6,X7,X8,X9"], "--axes: name 1 to 8 axes, as in XYZ or X,Y1+Y2,Z"),
    (["--axes", "XYZC"], "--axes: C is a rotary axis, whose errors compbox cannot fit yet; leave it out"),
    (["--axes", "X", "--travel", "Y=100"], "--travel: the machine has no axis Y (--axes X)"),
    (["--axes", "X", "--travel", "X=100:0"],
     "--travel: 'X=100:0' does not end above where it begins"),
    (["--axes", "X", "--travel", "X=0"], "--travel: 'X=0' does not end above where it begins"),
    (["--axes", "X", "--travel", "X=1,X=2"], "--travel: X is named twice"),
    (["--axes", "X,Z", "--motor-positions"],
     "--motor-positions: --axes X,Z has no stage with two motors, as Y1+Y2"),
    (["--axes", "X", "--name", "x" * 40], "--name: 1 to 39 characters, please"),
] + [(["--axes", "X", "--travel", bad], f"--travel: '{bad}' is not AXIS=LENGTH or AXIS=FROM:TO "
      "in mm, as in X=14300") for bad in ("X", "X=", "X=nan", "X=inf", "X=1e999", "X=1;Y=2", "X=1:")]
PROFILES = ["generic", "sinumerik-840d", "fanuc", "linuxcnc"]
MACHINES = {"X": ["X"], "XYZ": ["X", "Y", "Z"], "ZYX": ["Z", "Y", "X"], "X,Z": ["X", "Z"], "X1,Z1": ["X1", "Z1"],
            "XYZUVW": list("XYZUVW"), "X,Y1+Y2,Z,W": ["X", "Y1", "Y2", "Z", "W"],
            "X1+X2,Y1+Y2,Z1+Z2,U1+U2,V1+V2,W1+W2,X,Y": None}


@pytest.mark.parametrize("arguments, message", USAGE)
def test_wrong_usage(compbox, arguments, message):
    done = compbox("init", *PLC, *arguments, "--profile", "generic", "-o", "machine.json")
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "compbox: " + message
    assert not compbox.files()


def test_unknown_profile_is_wrong_usage(compbox):
    done = compbox("init", *PLC, "--axes", "X", "--profile", "heidenhain", "-o", "machine.json")
    assert done.returncode == 2
    assert "must be one of generic, sinumerik-840d, fanuc, linuxcnc, not heidenhain" in done.stderr
    assert not compbox.files()


def test_a_folder_that_is_missing(compbox):
    message = compbox.refused("init", *PLC, "--axes", "X", "--profile", "generic", "-o", "no/machine.json")
    assert message.startswith("no/machine.json: cannot ")


def registers_of(value):
    return 1 if value.startswith(("int16", "uint16")) else 2


def used_registers(m):
    """[(name of block, address, registers)] of every number in the file."""
    plc, used = m["plc"], []
    for block, keys in (("read", ("control", "plc_heartbeat", "handshake")), ("write", ("status", "box_heartbeat"))):
        used += [(block, plc[key], 1) for key in keys if key in plc]
        if plc[block].get("counters"):
            used += [(block, plc[block]["start"], 1), (block, plc[block]["start"] + plc[block]["count"] - 1, 1)]
    used += [("read", s["plc"], registers_of(s["type"])) for s in m["signals"]]
    for c in m["channels"]:
        used += [("read", c["applied"], registers_of(c["type"])), ("write", c["plc"], registers_of(c["type"]))]
        for key in ("slope", "reference") if "tangent" in c else ():
            used.append(("write", c["tangent"][key + "_plc"], registers_of(c["tangent"][key + "_type"])))
    return used


@pytest.mark.parametrize("positions", [[], ["--motor-positions"]])
@pytest.mark.parametrize("axes", MACHINES)
@pytest.mark.parametrize("profile", PROFILES)
def test_registers_do_not_overlap_and_fit_their_blocks(compbox, axes, profile, positions):
    channels = MACHINES[axes]
    if channels is None:
        done = compbox("init", *PLC, "--axes", axes, "--profile", profile, "-o", "m.json")
        assert done.stderr.startswith("compbox: --axes: X is named twice")
        axes = axes[:-4]
        channels = axes.replace("+", ",").split(",")
    positions = positions if "+" in axes else []
    compbox.good("init", *PLC, "--axes", axes, "--profile", profile, *positions, "-o", "m.json")
    m = compbox.read("m.json")
    used = used_registers(m)
    for (block, a, na), (other, b, nb) in itertools.combinations(used, 2):
        assert block != other or a + na <= b or b + nb <= a
    for block, a, na in used:
        start, count = m["plc"][block]["start"], m["plc"][block]["count"]
        assert start <= a and a + na <= start + count <= start + 121
    assert m["plc"]["profile"] == ("generic" if profile == "linuxcnc" else profile)
    assert [c["name"] for c in m["channels"]] == channels
    stages = [name for name in axes.split(",") if "+" in name]
    assert [pair["channels"] for pair in m["pairs"]] == [name.split("+") for name in stages]
    paired = {name for pair in m["pairs"] for name in pair["channels"]}
    shown = [c for c in channels if c not in paired or positions or c.endswith("1")]
    assert [s["name"] for s in m["signals"]] == [c[0] if c in paired and not positions else c for c in shown]
    tangents = {c["name"]: c["tangent"]["signal"] for c in m["channels"] if "tangent" in c}
    assert tangents == {c: c for c in channels if c not in paired and profile == "sinumerik-840d"}


# The files of docs/plc have the registers of init, in every key that init writes of them.
@pytest.mark.parametrize("profile", ["sinumerik-840d", "fanuc"])
def test_the_documents_files_have_the_registers_of_init(compbox, profile):
    document = json.loads((ROOT / f"docs/plc/{profile}.json").read_text())
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", profile, "-o", "m.json")
    m = compbox.read("m.json")
    for key, value in m["plc"].items():
        assert document["plc"].get(key, value) == value, key
    assert set(document["plc"]) <= set(m["plc"])
    assert used_registers(m) == used_registers(document)
    for kind in ("signals", "channels"):
        for own, theirs in zip(m[kind], document[kind]):
            for key in ("name", "plc", "type", "scale", "applied", "tangent"):
                assert own.get(key) == theirs.get(key), (own["name"], key)


@pytest.mark.parametrize("profile", PROFILES)
def test_it_builds_as_it_is_once_a_curve_is_there(compbox, profile):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", profile, "-o", "m.json")
    compbox.write("t.json", term("EZX", "X", travel=(-500, 500)))
    compbox.good("build", "m.json", "t.json", "-o", "c.json")
    compbox.good("check", "c.json")
    built = compbox.read("c.json")
    assert [s["name"] for s in built["signals"]] == ["X"]
    assert (built["signals"][0]["min"], built["signals"][0]["max"]) == (-600, 600)
    assert [(c["name"], c["sum"]) for c in built["channels"]] == [("Z", ["EZX"])]
    assert "tangent" not in built["channels"][0], "no curve is over Z, whose signal was left out"


def test_a_stage_builds_with_both_its_motors(compbox):
    """Terms towards Y act in both motors; without any the pair goes with its channels."""
    compbox.good("init", *PLC, "--axes", "X,Y1+Y2", "--profile", "sinumerik-840d", "-o", "m.json")
    compbox.write("y.json", term("EYY", "Y"))
    compbox.write("x.json", term("EXX", "X"))
    compbox.good("build", "m.json", "y.json", "x.json", "-o", "c.json")
    compbox.good("check", "c.json")
    built = compbox.read("c.json")
    assert [(c["name"], c["sum"]) for c in built["channels"]] == [("X", ["EXX"]), ("Y1", ["EYY"]), ("Y2", ["EYY"])]
    assert built["channels"][0]["tangent"]["signal"] == "X"
    compbox.good("build", "m.json", "x.json", "-o", "d.json")
    compbox.good("check", "d.json")
    assert compbox.read("d.json")["pairs"] == []


def test_a_fanuc_control_shows_its_handshake(compbox):
    for profile in PROFILES:
        compbox.good("init", *PLC, "--axes", "XYZ", "--profile", profile, "-o", "m.json")
        plc = compbox.read("m.json")["plc"]
        keys = {key: plc.get(key) for key in ("handshake", "scan_ms", "axes_at_once")}
        if profile == "fanuc":
            assert keys == {"handshake": 2, "scan_ms": 8, "axes_at_once": False}
        else:
            assert set(keys.values()) == {None}


def test_options_reach_the_file(compbox):
    out = compbox.good("init", "--axes", "XY", "--profile", "fanuc", "--name", "mill 3", "--travel",
                       "X=-100:1500.5", "--host", "10.0.0.7", "--port", "502", "--unit", "9",
                       "--period-ms", "20", "-o", "-")
    m = json.loads(out)
    assert m["machine"] == {"name": "mill 3", "axes": ["X", "Y"]}
    assert m["cycle"]["period_ms"] == 20
    assert m["plc"]["transport"]["tcp"] == {"host": "10.0.0.7", "port": 502, "unit": 9}
    assert (m["signals"][0]["min"], m["signals"][0]["max"]) == (-110, 1510.5)
    assert (m["signals"][1]["min"], m["signals"][1]["max"]) == (None, None)


def test_it_says_what_is_still_to_be_set(compbox):
    out = compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "Y=50", "-o", "m")
    assert out.splitlines()[0].startswith("To set: min and max of X, Z ")


def test_a_host_in_letters_is_refused(compbox):
    """The loader would refuse it, and that late: when everything is measured."""
    init = ("init", "--axes", "X", "--profile", "generic", "-o", "m.json", "--host")
    done = compbox(*init, "plc.example")
    assert done.returncode == 2
    assert "--host: 'plc.example' is not a numeric IP address such as 192.168.0.10" in done.stderr
    compbox.good(*init, "fe80::1")


@pytest.mark.parametrize("missing, sentence", [
    ("--axes", "axes of the machine, as in XYZ or X,Y1+Y2,Z"),
    ("--profile", "kind of control: generic, sinumerik-840d, fanuc, linuxcnc"),
    ("--host", "IP address of the PLC, as in 192.168.0.10")])
def test_nothing_is_guessed_that_only_a_person_knows(compbox, missing, sentence):
    given = {"--axes": "X,Z", "--profile": "fanuc", "--host": "192.168.0.10", "-o": "m.json"}
    del given[missing]
    done = compbox("init", *itertools.chain(*given.items()))
    assert done.returncode == 2 and not compbox.files()
    assert done.stderr.splitlines()[0] == f"compbox: {missing}: is required: {sentence}"


def test_a_real_file_has_no_address_of_a_simulator(compbox):
    compbox.good("init", "--axes", "X", "--profile", "generic", "--host", "10.1.2.3", "-o", "m.json")
    assert compbox.read("m.json")["plc"]["transport"]["tcp"] == {"host": "10.1.2.3", "port": 502, "unit": 1}


@pytest.mark.parametrize("answers, travel", [("X,Z\nfanuc\n10.1.2.3\nX=2000\n", 2010),
                                             ("X,Z\nfanuc\n10.1.2.3\n\n", None)])
def test_at_a_terminal_it_asks(compbox, answers, travel):
    master, slave = pty.openpty()
    os.write(master, answers.encode())
    done = subprocess.run([BIN / "compbox", "init", "-o", "m.json"], cwd=compbox.folder, stdin=slave,
                          capture_output=True, text=True, timeout=60)
    os.close(master), os.close(slave)
    assert done.returncode == 0, done.stderr
    m = compbox.read("m.json")
    assert [c["name"] for c in m["channels"]] == ["X", "Z"] and m["plc"]["profile"] == "fanuc"
    assert m["plc"]["transport"]["tcp"]["host"] == "10.1.2.3"
    assert m["signals"][0]["max"] == travel


def test_names_in_another_code_page(compbox):
    """A terminal or a folder in Latin-1: JSON is UTF-8 all the same."""
    name = os.fsdecode("Fräse".encode("latin-1"))
    compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "--name", name, "-o", "m.json")
    assert compbox.read("m.json")["machine"]["name"] == "Fräse"
    done = subprocess.run([BIN / "compbox", "init", *PLC, "--axes", "X", "--profile", "generic", "--json",
                           "-o", name + ".json"], cwd=compbox.folder, capture_output=True)
    assert done.returncode == 0 and json.loads(done.stdout)["files"] == ["Fräse.json"]


def test_travels_in_metres_and_in_micrometres_are_named(compbox):
    out = compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=0.5,Y=500,Z=2000000", "-o",
                       "m.json")
    assert [line for line in out.splitlines() if "--travel is in mm" in line] == [
        "To check: the travel of X is 0.5 mm; --travel is in mm.",
        "To check: the travel of Z is 2e+06 mm; --travel is in mm."]
