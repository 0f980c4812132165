# SPDX-License-Identifier: MIT
"""compbox init: what it writes, and what it refuses as wrong usage."""

import itertools
import json
import os
import subprocess

import pytest

from conftest import BIN, term

USAGE = [
    (["--axes", "XQ"], "--axes: 'Q' is not an axis (use letters of XYZUVWABC)"),
    (["--axes", "XYX"], "--axes: X is named twice"),
    (["--axes", ""], "--axes: name 1 to 8 axes, as in XYZ"),
    (["--axes", "XYZUVWABC"], "--axes: name 1 to 8 axes, as in XYZ"),
    (["--axes", "AC"], "--axes: at least one linear axis is needed (letters of XYZUVW)"),
    (["--axes", "X", "--travel", "Y=100"], "--travel: the machine has no axis Y (--axes X)"),
    (["--axes", "X", "--travel", "X=100:0"],
     "--travel: 'X=100:0' does not end above where it begins"),
    (["--axes", "X", "--travel", "X=0"], "--travel: 'X=0' does not end above where it begins"),
    (["--axes", "X", "--travel", "X=1,X=2"], "--travel: X is named twice"),
    (["--axes", "X", "--name", "x" * 40], "--name: 1 to 39 characters, please"),
] + [(["--axes", "X", "--travel", bad], f"--travel: '{bad}' is not AXIS=LENGTH or AXIS=FROM:TO "
      "in mm, as in X=14300") for bad in ("X", "X=", "X=nan", "X=inf", "X=1e999", "X=1;Y=2", "X=1:")]


@pytest.mark.parametrize("arguments, message", USAGE)
def test_wrong_usage(compbox, arguments, message):
    done = compbox("init", *arguments, "--profile", "generic", "-o", "machine.json")
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "compbox: " + message
    assert not compbox.files()


def test_unknown_profile_is_wrong_usage(compbox):
    done = compbox("init", "--axes", "X", "--profile", "heidenhain", "-o", "machine.json")
    assert done.returncode == 2
    assert "must be one of generic, sinumerik-840d, fanuc, not heidenhain" in done.stderr
    assert not compbox.files()


def test_a_folder_that_is_missing(compbox):
    message = compbox.refused("init", "--axes", "X", "--profile", "generic", "-o", "no/machine.json")
    assert message.startswith("no/machine.json: cannot ")


def registers_of(value):
    return 1 if value.startswith(("int16", "uint16")) else 2


@pytest.mark.parametrize("axes", ["X", "XYZ", "XYZUVW", "XYZUVAC", "ZYX"])
@pytest.mark.parametrize("profile", ["generic", "sinumerik-840d", "fanuc"])
def test_registers_do_not_overlap_and_fit_their_blocks(compbox, axes, profile):
    compbox.good("init", "--axes", axes, "--profile", profile, "-o", "m.json")
    m = compbox.read("m.json")
    read, write = [], []
    for block, keys in ((read, ("control", "plc_heartbeat")), (write, ("status", "box_heartbeat"))):
        block += [(m["plc"][key], 1) for key in keys]
    read += [(s["plc"], registers_of(s["type"])) for s in m["signals"]]
    read += [(c["applied"], registers_of(c["type"])) for c in m["channels"]]
    write += [(c["plc"], registers_of(c["type"])) for c in m["channels"]]
    for name, used in (("read", read), ("write", write)):
        block = m["plc"][name]
        for (a, na), (b, nb) in itertools.combinations(used, 2):
            assert a + na <= b or b + nb <= a
        for a, na in used:
            assert block["start"] <= a and a + na <= block["start"] + block["count"]
    assert [s["name"] for s in m["signals"]] == list(axes)
    assert [c["name"] for c in m["channels"]] == [a for a in axes if a in "XYZUVW"]
    assert [s["unit"] for s in m["signals"]] == ["mm" if a in "XYZUVW" else "deg" for a in axes]


@pytest.mark.parametrize("profile", ["generic", "sinumerik-840d", "fanuc"])
def test_it_builds_as_it_is_once_a_curve_is_there(compbox, profile):
    compbox.good("init", "--axes", "XYZ", "--profile", profile, "-o", "m.json")
    compbox.write("t.json", term("EZX", "X", travel=(-500, 500)))
    compbox.good("build", "m.json", "t.json", "-o", "c.json")
    compbox.good("check", "c.json")
    built = compbox.read("c.json")
    assert [s["name"] for s in built["signals"]] == ["X"]
    assert (built["signals"][0]["min"], built["signals"][0]["max"]) == (-600, 600)
    assert [(c["name"], c["sum"]) for c in built["channels"]] == [("Z", ["EZX"])]


def test_a_fanuc_control_shows_its_handshake(compbox):
    for profile in ("fanuc", "generic", "sinumerik-840d"):
        compbox.good("init", "--axes", "XYZ", "--profile", profile, "-o", "m.json")
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
    out = compbox.good("init", "--axes", "XYZ", "--profile", "generic", "--travel", "Y=5", "-o", "m")
    assert out.splitlines()[0].startswith("To set: min and max of X, Z ")


def test_a_host_in_letters_is_refused(compbox):
    """The loader would refuse it, and that late: when everything is measured."""
    init = ("init", "--axes", "X", "--profile", "generic", "-o", "m.json", "--host")
    done = compbox(*init, "plc.example")
    assert done.returncode == 2
    assert "--host: 'plc.example' is not a numeric IP address such as 192.168.0.10" in done.stderr
    compbox.good(*init, "fe80::1")


def test_names_in_another_code_page(compbox):
    """A terminal or a folder in Latin-1: JSON is UTF-8 all the same."""
    name = os.fsdecode("Fräse".encode("latin-1"))
    compbox.good("init", "--axes", "X", "--profile", "generic", "--name", name, "-o", "m.json")
    assert compbox.read("m.json")["machine"]["name"] == "Fräse"
    done = subprocess.run([BIN / "compbox", "init", "--axes", "X", "--profile", "generic", "--json",
                           "-o", name + ".json"], cwd=compbox.folder, capture_output=True)
    assert done.returncode == 0 and json.loads(done.stdout)["files"] == ["Fräse.json"]
