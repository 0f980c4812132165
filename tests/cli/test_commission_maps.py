# SPDX-License-Identifier: MIT
"""compbox commission finds wrong register maps. All axes are at 0 at first, where every one of these maps
agrees with the control by chance; a person jogs each axis and types what the control shows."""

import concurrent.futures

import pytest

from conftest import Compbox
from commissioning import Person, commission, start_plc


def part(machine, kind, name):
    return next(one for one in machine[kind] if one["name"] == name)


def signal(name="X", **keys):
    return lambda machine: part(machine, "signals", name).update(keys)


def exchanged(kind, one, other, *keys):
    def change(machine):
        a, b = part(machine, kind, one), part(machine, kind, other)
        for key in keys:
            a[key], b[key] = b[key], a[key]
    return change


def shifted(machine):
    for one in machine["signals"]:
        one["plc"] += 1


def open_range(change):
    def both(machine):
        change(machine)
        part(machine, "signals", "X").update(min=None, max=None)
    return both


def dead_motor(machine):
    part(machine, "channels", "Y2").update(plc=102, applied=20)


def heartbeat_in_the_status(machine):
    plc = machine["plc"]
    plc["status"], plc["box_heartbeat"] = plc["box_heartbeat"], plc["status"]


# name: (axes, the mistake in the box's file, a piece of the sentence)
MAPS = {
    "two axes exchanged": (
        "XYZ", exchanged("signals", "X", "Y", "plc"),
        "signals.X: the jog moved Y by 12.5000 mm and X not at all; are their registers (plc) exchanged"),
    "each axis one register too far": (
        "XYZ", shifted, "signals.X: "),
    "a spare register": (
        "XYZ", signal("X", plc=16), "register 8 as int32 has the value: look at plc"),
    "one register instead of two": (
        "XYZ", signal(type="int16"), "signals.X.type: int16 with this scale reaches from -3.2768 to 3.2767 mm only"),
    "one register instead of two, without a range": (
        "XYZ", open_range(signal(type="uint16", plc=9)), "min and max of the signal must state the travel"),
    "another word order": (
        "XYZ", open_range(signal(type="int32cdab")), "as int32 it shows the value: look at type"),
    "float instead of int": (
        "XYZ", signal(type="float32"), "as int32 it shows the value: look at type"),
    "ten times too large": (
        "XYZ", open_range(signal(scale=0.001)), "the control shows 12.5 mm, registers 8 and 9 give (int32) 125; "
        "10 times too large: look at scale"),
    "a thousandth": (
        "XYZ", open_range(signal(scale=1e-7)), "1000 times too small: look at scale"),
    "the other sign": (
        "XYZ", open_range(signal(scale=-0.0001)), "its sign is inverted: look at scale"),
    "inches": (
        "XYZ", signal(scale=0.0001 / 25.4), "it is in inches: look at scale and unit"),
    "micrometres": (
        "XYZ", signal(unit="um"), "signals.X.unit: the position of an axis is in mm or deg, not um"),
    "a temperature in place of an axis": (
        "XYZ+T", exchanged("signals", "X", "T1", "plc", "type", "scale"), "signals.X: "),
    "motors of a pair exchanged": (
        "X,Y1+Y2", exchanged("channels", "Y1", "Y2", "plc", "applied"), "axis Y1: commanded 20 µm, measured 0 µm: "
        "the axis did not move"),
    "a dead motor of a pair": (
        "X,Y1+Y2", dead_motor, "channels.Y2.applied: register 20 shows 0 µm where 20 µm were written"),
    "the order of the write block": (
        "XYZ", exchanged("channels", "X", "Y", "plc", "applied"), "axis X: commanded 20 µm, measured 0 µm: the axis "
        "did not move; is another one moved by its register"),
    "heartbeat and status exchanged": (
        "XYZ", heartbeat_in_the_status, "channels.X.applied: register 24 shows 0 µm where 20 µm were written"),
}
RIGHT = ("XYZ", "X,Y1+Y2", "XYZ+T")


def with_thermometer(machine):
    machine["signals"].append({"name": "T1", "plc": 16, "type": "int16", "scale": 0.1, "unit": "degC",
                               "min": -20, "max": 120})


class AtMotors(Person):
    """His indicator is at the motor, or between both; the thermometer shows 0 °C."""

    def __init__(self, plc):
        super().__init__(plc, self.indicator_um)

    def indicator_um(self, name):
        status = self.plc.status()
        motors = name.split("+")
        return sum(float(status["applied_" + motor]) for motor in motors) / len(motors)

    def display(self, name):
        return "0.0" if name == "T1" else super().display(name)


def walk(folder, axes, change):
    """out: exit code, the refusal or stdout, whether the file is unchanged, status of the PLC"""
    compbox = Compbox(folder)
    folder.mkdir()
    plc = start_plc(compbox, axes=axes.split("+T")[0], change=change,
                    served=with_thermometer if axes.endswith("+T") else None)
    before = (folder / "machine.json").read_bytes()
    try:
        code, out, err = commission(compbox, plc, person=AtMotors(plc))
        return code, err if code else out, (folder / "machine.json").read_bytes() == before, plc.status()
    finally:
        plc.end()


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """All of them at once: they mostly wait."""
    folder = tmp_path_factory.mktemp("maps")
    jobs = {name: (axes, change) for name, (axes, change, _) in MAPS.items()}
    jobs.update({axes: (axes, None) for axes in RIGHT})
    with concurrent.futures.ThreadPoolExecutor(10) as pool:
        runs = {name: pool.submit(walk, folder / str(i), *job) for i, (name, job) in enumerate(jobs.items())}
        return {name: run.result() for name, run in runs.items()}


@pytest.mark.parametrize("name", MAPS)
def test_a_wrong_map_is_refused_before_a_file_is_written(walks, name):
    code, text, unchanged, status = walks[name]
    assert code == 1 and MAPS[name][2] in text, text
    assert unchanged
    assert all(float(value) == 0 for key, value in status.items() if key.startswith("applied_")), status


@pytest.mark.parametrize("axes", RIGHT)
def test_the_right_map_of_each_machine_passes(walks, axes):
    code, text, unchanged, _ = walks[axes]
    assert code == 0 and not unchanged, text
