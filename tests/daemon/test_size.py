# SPDX-License-Identifier: MIT
"""A foreign Modbus client writes to fakeplc whatever it likes: no axis goes further than the PLC's own
size, and an alarm names the axis."""
import csv
import json
import struct
from pathlib import Path

import pytest

from fakeplc import FakePlc
from stage import Stage

DOCS = Path(__file__).resolve().parents[2] / "docs/plc"
ACTIVE = 1
SIZE_UM = 500.0    # of fakeplc, unless given
FORMATS = {"int16": ">h", "int32": ">i", "float32": ">f"}


class Writer:
    """Writes all its numbers 50 times a second, and counts up the box's heartbeat."""

    def __init__(self, stage, plc, data):
        self.stage, self.fakeplc, self.plc = stage, plc, data["plc"]
        self.channels = {channel["name"]: channel for channel in data["channels"]}
        self.beat, self.words = 0, {}

    def set(self, *numbers):
        """From here on, in one block: (address, type, value as the register has it) of each number."""
        for address, kind, value in numbers:
            data = struct.pack(FORMATS[kind], value)
            self.words |= {address + i // 2: struct.unpack_from(">H", data, i)[0] for i in range(0, len(data), 2)}

    def value(self, name, um):
        channel = self.channels[name]
        raw = um / channel["scale"]
        self.set((channel["plc"], channel["type"], raw if channel["type"] == "float32" else round(raw)))

    def line(self, name, slope, reference_mm):
        tangent = self.channels[name]["tangent"]
        self.set((tangent["slope_plc"], "int32", round(slope / tangent["slope_scale"])),
                 (tangent["reference_plc"], "int32", round(reference_mm / tangent["reference_scale"])))

    def write(self):
        """Now, and again and again."""
        self.beat = (self.beat + 1) % 65536
        words = self.words | {self.plc["status"]: ACTIVE, self.plc["box_heartbeat"]: self.beat}
        start, count = self.plc["write"]["start"], self.plc["write"]["count"]
        if self.plc["write"].get("counters"):
            words |= {start: self.beat, start + count - 1: self.beat}
        block = b"".join(struct.pack(">H", words.get(a, 0)) for a in range(start, start + count))
        reply = self.fakeplc.request(struct.pack(">BHHB", 16, start, count, 2 * count) + block)
        assert reply[0] == 16, reply
        self.stage.after(0.02, self.write)


def of_floats(data):
    """The same registers with values of float32."""
    for channel in data["channels"]:
        channel.pop("tangent", None)
        channel["type"] = "float32"
    data["plc"]["profile"] = "generic"


def of_generic(data):
    data["plc"]["profile"] = "generic"


CASES = {"sinumerik-840d": ("sinumerik-840d.json", None), "fanuc": ("fanuc.json", None),
         "generic": ("sinumerik-840d.json", of_generic), "floats": ("sinumerik-840d.json", of_floats)}


class Bench:
    def __init__(self, folder, case, *arguments):
        file, change = CASES[case]
        self.data = json.loads((DOCS / file).read_text())
        if change:
            change(self.data)
        (folder / "map.json").write_text(json.dumps(self.data))
        self.log = folder / "plc.csv"
        self.plc = FakePlc("--map", folder / "map.json", "--log", self.log, *arguments)

        self.plc.__enter__()
        self.writer = Writer(Stage.current, self.plc, self.data)
        self.writer.write()

    def rows(self):
        self.plc.command("status")      # what it has logged is written
        return list(csv.DictReader(self.log.open()))

    def largest_um(self, axis):
        """out: of all scans, what the PLC showed as applied, and what the NC had where the axis stood."""
        applied, here = 0.0, 0.0
        for row in self.rows():
            applied = max(applied, abs(float(row[f"applied_{axis}_um"])))
            way_mm = float(row[f"{axis}_mm"]) - float(row[f"nc_{axis}_reference_mm"])
            here = max(here, abs(float(row[f"nc_{axis}_um"])
                                 + 1000 * float(row[f"nc_{axis}_slope"]) * way_mm))
        return applied, here


@pytest.mark.parametrize("case", CASES)
def test_a_foreign_value_is_held_at_the_plcs_own_size(real_path, case):
    huge = 3000.0 if case == "fanuc" else 10000.0     # what its 16 bits hold
    bench = Bench(real_path, case)
    bench.writer.value("X", huge)
    bench.writer.value("Y", -huge)
    bench.plc.wait(lambda s: s["applied_X"] == SIZE_UM and s["applied_Y"] == -SIZE_UM)
    status = bench.plc.wait(lambda s: s["limited"] >= 2)
    alarms = bench.plc.command("alarms")
    assert "size-X" in alarms and "size-Y" in alarms and "size-Z" not in alarms
    assert status["applied_Z"] == 0
    bench.writer.value("X", 20.0)
    bench.plc.wait(lambda s: s["applied_X"] == pytest.approx(20.0))
    assert "size-X" in bench.plc.command("alarms"), "until reset"
    for axis in "XY":
        assert max(bench.largest_um(axis)) <= SIZE_UM + 1e-3
    assert any("alarm size-X came" in row["event"] for row in bench.rows())


def test_the_size_is_given_to_fakeplc_and_not_by_the_file(real_path):
    bench = Bench(real_path, "sinumerik-840d", "--size-um", "120")
    bench.writer.value("X", 10000.0)
    bench.plc.wait(lambda s: s["applied_X"] == 120)
    assert "PLC's own size of 120 um" in bench.plc.command("alarms")
    assert max(bench.largest_um("X")) <= 120 + 1e-3


@pytest.mark.parametrize("case", ["sinumerik-840d", "generic"])
def test_a_slope_cannot_take_the_sum_beyond_the_size(real_path, case):
    bench = Bench(real_path, case, "--size-um", "120")
    bench.writer.value("X", 90.0)
    bench.plc.wait(lambda s: s["applied_X"] == pytest.approx(90.0))
    assert "size-X" not in bench.plc.command("alarms")
    bench.writer.line("X", 0.001, -400.0)      # 400 um more where the axis stands, at 0
    bench.plc.wait(lambda s: s["applied_X"] == 120 and s["limited"] == 1)
    bench.plc.command("move X=900 feed=10000")
    bench.writer.line("X", -0.001, 1300.0)
    bench.plc.wait(lambda s: not s["moving"])
    assert "size-X" in bench.plc.command("alarms")
    applied, here = bench.largest_um("X")
    assert applied <= 120 + 1e-3
    assert here <= 120 * 1.05, "0.25 um at rest, slope times way in motion"


def test_a_far_reference_alone_moves_nothing(real_path):
    bench = Bench(real_path, "sinumerik-840d", "--size-um", "120")
    bench.writer.value("X", 20.0)
    bench.writer.line("X", 0.0002, 0.0)
    bench.plc.wait(lambda s: s["applied_X"] == pytest.approx(20.0))
    for reference_mm in (200000.0, -200000.0):
        bench.writer.line("X", 0.0, reference_mm)
        until_s = bench.plc.status()["time_s"] + 1
        bench.plc.wait(lambda s: s["time_s"] > until_s)
        bench.writer.line("X", 0.0002, 0.0)
        until_s = bench.plc.status()["time_s"] + 1
        bench.plc.wait(lambda s: s["time_s"] > until_s)
    applied, here = bench.largest_um("X")
    assert applied <= 20 + 1e-3 and here <= 20.3


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_a_number_is_not_taken_over(real_path, value):
    bench = Bench(real_path, "floats")
    bench.writer.value("X", 50.0)
    bench.writer.value("Y", 30.0)
    bench.plc.wait(lambda s: s["applied_X"] == 50 and s["applied_Y"] == 30)
    bench.writer.value("X", value)
    bench.writer.value("Y", 400.0)
    bench.plc.wait(lambda s: s["applied_X"] == 0 and s["applied_Y"] == 0)
    assert "box-number" in bench.plc.command("alarms")
    bench.writer.value("X", 50.0)
    bench.plc.wait(lambda s: s["applied_X"] == 50 and s["applied_Y"] == 400)
    assert "box-number" not in bench.plc.command("alarms")
    assert max(bench.largest_um("X")) <= 50 + 1e-3
