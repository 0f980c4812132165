# SPDX-License-Identifier: MIT
"""A touch probe from compbox init to the PLC program. tests/unit/fakeplc/computing/program_test.cpp runs those of the
840D and FANUC; the component of LinuxCNC runs here, on pins that are a dictionary."""
import importlib.util
import sys
import types

import pytest

from conftest import PLC
from test_init import PROFILES, used_registers


def made(compbox, profile, *more):
    compbox.good("init", *PLC, "--axes", "X,Y1+Y2,Z", "--profile", profile, *more, "-o", "m.json")
    return compbox.read("m.json")


@pytest.mark.parametrize("profile", PROFILES)
def test_registers_of_the_probe_come_behind_all_others(compbox, profile):
    plain, probed = made(compbox, profile), made(compbox, profile, "--probe", "X,Y")
    names = ["probe_x", "probe_x_n", "probe_y", "probe_y_n"]
    assert [signal["name"] for signal in probed["signals"]] == [signal["name"] for signal in plain["signals"]] + names
    signals = {signal["name"]: signal for signal in probed["signals"]}
    used = [(block, address + i) for block, address, n in used_registers(probed) for i in range(n)]
    used.append(("write", probed["plc"]["request"]))
    assert len(used) == len(set(used)), "no register has two numbers"
    for name, address in used:
        block = probed["plc"][name]
        assert block["start"] <= address < block["start"] + block["count"]
    before = max(c["applied"] for c in probed["channels"])
    assert all(signals[name]["plc"] > before for name in names)
    for name, unit, low, high in (("probe_x", "um", -500, 500), ("probe_x_n", "1", 0, 65535)):
        assert (signals[name]["unit"], signals[name]["min"], signals[name]["max"]) == (unit, low, high)
    assert probed["provenance"]["probes"]["Y"] == {"value": "probe_y", "count": "probe_y_n"}
    assert probed["channels"] == plain["channels"]


def test_wrong_usage(compbox):
    for axes, words in (("W", "--probe: the machine has no axis W (--axes XZ)"), ("X,X", "--probe: X is named twice")):
        done = compbox("init", *PLC, "--axes", "XZ", "--profile", "fanuc", "--probe", axes, "-o", "m.json")
        assert done.returncode == 2 and done.stderr.splitlines()[0] == "compbox: " + words


def test_the_hint_names_the_keys(compbox):
    text = compbox.good("init", *PLC, "--axes", "XZ", "--profile", "fanuc", "--probe", "Z", "-o", "m.json")
    assert '"probe": {"value": "probe_z", "count": "probe_z_n"}' in text


@pytest.mark.parametrize("profile, file, words", [
    ("sinumerik-840d", "sinumerik-840d.scl",
     ["probe_x_done : BOOL;", "REAL_TO_DINT(probe_x_um / 0.01)", "probe_again :="]),
    ("fanuc", "fanuc.txt", ["R82.0 the probe cycle of the NC has measured X", "WRT     R87.0"]),
    ("linuxcnc", "compbox.hal", ["motion.digital-out-00 => compbox.probe-0", "=> motion.digital-in-00"])])
def test_the_program_hands_the_cycle_over(compbox, profile, file, words):
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", profile, "--probe", "X", "-o", "m.json")
    compbox.good("export", "m.json", "--format", "plc-program", "-o", "plc")
    text = (compbox.folder / "plc" / file).read_text()
    assert all(word in text for word in words) and "[probe]" in text
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", profile, "-o", "m.json")
    compbox.good("export", "m.json", "--format", "plc-program", "-o", "plain")
    assert "probe" not in (compbox.folder / "plain" / file).read_text()


class Pins(dict):
    def newpin(self, name, *_):
        self[name] = 0

    def ready(self):
        pass


def program_of(compbox, monkeypatch):
    """The component of a machine with a probe of X, on pins without LinuxCNC."""
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", "linuxcnc", "--probe", "X", "-o", "m.json")
    compbox.good("export", "m.json", "--format", "plc-program", "-o", "plc")
    hal = types.SimpleNamespace(component=lambda name: Pins(), HAL_BIT=0, HAL_FLOAT=1, HAL_IN=0, HAL_OUT=1)
    monkeypatch.setitem(sys.modules, "hal", hal)
    spec = importlib.util.spec_from_file_location("compbox_plc", compbox.folder / "plc/compbox_plc.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Program(module.component()), compbox.read("m.json")


def test_linuxcnc_counts_a_scan_after_the_value(compbox, monkeypatch):
    program, m = program_of(compbox, monkeypatch)
    signals = {s["name"]: s for s in m["signals"]}
    value = lambda: program.registers.get(signals["probe_x"]["plc"], "int32") * 0.01  # noqa: E731
    count = lambda: program.registers.words[signals["probe_x_n"]["plc"]]  # noqa: E731
    program.scan()
    assert (value(), count()) == (0, 0)
    program.pins["signal-2"], program.pins["probe-0"] = 14.5, 1
    program.scan()
    assert (value(), count()) == (14.5, 0)
    program.pins["signal-2"] = 99
    program.scan()
    assert (value(), count()) == (14.5, 1)
    program.scan()
    program.pins["probe-0"] = 0
    program.scan()
    assert (value(), count()) == (14.5, 1)
    program.pins["probe-0"] = 1
    program.scan()
    program.scan()
    assert (value(), count()) == (99, 2)


def test_linuxcnc_shows_the_request(compbox, monkeypatch):
    program, m = program_of(compbox, monkeypatch)
    for word, asks in ((0, 0), (1, 1), (2, 0), (3, 1)):
        program.registers.words[m["plc"]["request"]] = word
        program.scan()
        assert program.pins["probe-again"] == asks
