# SPDX-License-Identifier: MIT
"""compbox eval --sigma and --sigma-map: standard deviations of curves and squareness, carried on to terms and channels.
The sensitivities are compared with full homogeneous matrices (tests/oracle/volumetric.py)."""

import json
import random

import numpy
import pytest

from conftest import LONG, PLC
from test_volumetric import KINDS, STRAIGHT, TRAVEL, curve, geometry, machine_file, matrices, write_axis

MACHINES = 12 if LONG else 7


def two_curves(compbox):
    """EZX has sigma 3 at 0 mm, 5 at 1000 mm; EZY 4 everywhere; warm = T EZX."""
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=1000,Y=800,Z=600",
                 "-o", "machine.json")
    machine = compbox.read("machine.json")
    machine["plc"]["read"]["count"] += 1
    machine["signals"].append({"name": "T", "unit": "degC", "plc": 30, "type": "int16", "scale": 0.1, "min": 10,
                               "max": 40})
    compbox.write("machine.json", machine)
    line = {"type": "polyline", "positions": [0, 1000], "values": [1, -1]}
    fragment = {
        "terms": [{"name": "EZX", "signal": "X", **line},
                  {"name": "EZY", "signal": "Y", "type": "polynomial", "coefficients": [1, 2, 3], "center": 400,
                   "half_range": 400, "from": 0, "to": 800},
                  {"name": "warm", "type": "product", "term": "EZX", "signal": "T"}],
        "provenance": {"EZX": {"sigma": {"from_mm": 0, "to_mm": 1000, "values": [3, 3.5, 5]}},
                       "EZY": {"sigma": {"from_mm": 0, "to_mm": 800, "values": [4, 4]}}}}
    return fragment


def sigmas(compbox, places, *columns):
    rows = ["time_s,X,Y,Z,T"] + [f"{i}," + ",".join(map(str, place)) for i, place in enumerate(places)]
    compbox.write("s.csv", "\n".join(rows) + "\n")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--sigma", "-o", "out.csv")
    table = compbox.table("out.csv")
    return [table[column] for column in columns]


def test_curves_add_as_squares_and_a_product_scales(compbox):
    compbox.write("t.json", two_curves(compbox))
    compbox.good("build", "machine.json", "t.json", "--accept-range", "-o", "c.json")
    places = [(0, 400, 300, 20), (250, 0, 300, 20), (750, 800, 0, 20), (1000, 1, 0, 20)]
    one, two, product, channel = sigmas(compbox, places, "sigma_EZX", "sigma_EZY", "sigma_warm", "sigma_comp_Z_um")
    assert one == pytest.approx([3, 3.25, 4.25, 5], abs=1e-4) and two == pytest.approx([4] * 4, abs=1e-4)
    assert product == pytest.approx(20 * numpy.array(one), rel=1e-4)
    assert channel == pytest.approx(two, rel=1e-4), "build puts the product into no channel, and its factor into none"
    plain = two_curves(compbox)
    plain["terms"].pop()
    compbox.write("t.json", plain)
    compbox.good("build", "machine.json", "t.json", "--accept-range", "-o", "c.json")
    assert sigmas(compbox, places, "sigma_comp_Z_um")[0] == pytest.approx(numpy.hypot(one, two), rel=1e-4)


def volumetric(compbox, dice, noise):
    """21 errors with a sigma of their own each, the curves of which the box gets noisy."""
    true = {axis: [curve(dice, "um" if k < 3 else "urad", 31, smooth=True) for k in range(6)] for axis in "XYZ"}
    positions = {}
    for axis in "XYZ":
        positions[axis] = write_axis(compbox, axis, true, 31, noise, dice)
    return true, positions


def test_volumetric_errors_take_their_lever_arms(compbox):
    dice = random.Random(1)
    true, positions = volumetric(compbox, dice, 0.3)
    machine_file(compbox)
    compbox.write("sq.json", {"squareness_urad": {"C0Y": 12.5}, "sigma_urad": {"C0Y": 0.8}})
    options = [option for option in geometry("YfXZ") if "C0Y" not in option and "A0Z" not in option
               and option != "--squareness"]
    compbox.good("volumetric", "X", "Y", "Z", *options, "--squareness", "sq.json", "--tool-length-mm", 120, "--name",
                 "vol", "-o", "vol.json")
    compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
    provenance = compbox.read("c.json")["provenance"]
    assert provenance["vol"]["squareness_sigma_urad"] == {"C0Y": 0.8}
    places = [[dice.uniform(0, TRAVEL[axis]) for axis in "XYZ"] for _ in range(6)]
    names = [f"E{kind}{axis}" for axis in "XYZ" for kind in KINDS]
    rows = ["time_s,X,Y,Z"] + [f"{i}," + ",".join(map(repr, place)) for i, place in enumerate(places)]
    compbox.write("s.csv", "\n".join(rows) + "\n")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--sigma", "-o", "out.csv")
    table = compbox.table("out.csv")
    zero = {axis: [numpy.zeros(31)] * 6 for axis in "XYZ"}
    for i, place in enumerate(places):
        variance = numpy.zeros(3)
        for name in names:
            unit = {axis: list(zero[axis]) for axis in "XYZ"}
            unit[name[2]][KINDS.index(name[1])] = numpy.ones(31)
            effect = numpy.array(matrices("YfXZ", unit, positions, place, 120, STRAIGHT)[0])
            variance += (effect * table[f"sigma_{name}"][i]) ** 2
        tilt = numpy.array(matrices("YfXZ", zero, positions, place, 120, {**STRAIGHT, "C0Y": 1.0})[0])
        variance += (0.8 * tilt) ** 2
        want = numpy.sqrt(variance)
        assert [table[f"sigma_comp_{axis}_um"][i] for axis in "XYZ"] == pytest.approx(want, rel=2e-3)


def test_the_truth_is_inside_two_sigma(compbox):
    """Machines with white noise: the share of errors in space inside 2 sigma, 60 of each."""
    inside, shares = [], []
    for seed in range(MACHINES):
        dice = random.Random(seed)
        compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel", "X=1000,Y=800,Z=600",
                     "-o", "machine.json")
        for axis in "XYZ":
            for kind in KINDS:
                (compbox.folder / axis / f"E{kind}{axis}.csv").unlink(missing_ok=True)
            if (compbox.folder / axis).exists():
                (compbox.folder / axis).rmdir()
        true, positions = volumetric(compbox, dice, 0.4)
        compbox.good("volumetric", "X", "Y", "Z", *geometry("fXYZ"), "--tool-length-mm", 100, "--name", "vol",
                     "-o", "vol.json")
        compbox.good("build", "machine.json", "vol.json", "-o", "c.json")
        places = [[dice.uniform(0, TRAVEL[axis]) for axis in "XYZ"] for _ in range(20)]
        rows = ["time_s,X,Y,Z"] + [f"{i}," + ",".join(map(repr, place)) for i, place in enumerate(places)]
        compbox.write("s.csv", "\n".join(rows) + "\n")
        compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "--sigma", "-o", "out.csv")
        table = compbox.table("out.csv")
        for i, place in enumerate(places):
            want = matrices("fXYZ", true, positions, place, 100)[0]
            for axis, error in zip("XYZ", want):
                share = abs(table[f"comp_{axis}_um"][i] + error) / table[f"sigma_comp_{axis}_um"][i]
                inside.append(share < 2)
                shares.append(share)
    assert len(inside) == 60 * MACHINES
    assert 0.90 < numpy.mean(inside) <= 0.995, (numpy.mean(inside), numpy.sqrt(numpy.mean(numpy.square(shares))))


def test_the_map_is_the_same_on_a_grid(compbox):
    fragment = two_curves(compbox)
    fragment["terms"].pop()
    fragment["terms"].append({"name": "heat", "type": "linear", "inputs": ["T"], "weights": [1.5]})
    compbox.write("t.json", fragment)
    compbox.good("build", "machine.json", "t.json", "--accept-range", "-o", "c.json")
    done = compbox("eval", "c.json", "--sigma-map", "--plot", "map.svg", "-o", "map.csv")
    assert done.returncode == 0, done.stderr
    assert "no sigma is known of heat: counts as exact" in done.stderr
    table = compbox.table("map.csv")
    assert list(table)[:2] == ["X_mm", "Y_mm"] and len(table["X_mm"]) == 121
    signals = {signal["name"]: signal for signal in compbox.read("c.json")["signals"]}
    assert min(table["X_mm"]) == signals["X"]["min"] and max(table["Y_mm"]) == signals["Y"]["max"]
    middle = [i for i, x in enumerate(table["X_mm"]) if abs(x - 500) < 1]
    assert middle and [table["U_Z_um"][i] for i in middle] == pytest.approx([2 * numpy.hypot(3.5, 4)] * len(middle),
                                                                           abs=1e-3)
    assert "<svg" in (compbox.folder / "map.svg").read_text()


def test_what_has_no_sigma_is_refused_or_named(compbox):
    fragment = two_curves(compbox)
    fragment["terms"].pop()
    compbox.write("t.json", {"terms": fragment["terms"]})
    compbox.good("build", "machine.json", "t.json", "--accept-range", "-o", "c.json")
    assert compbox.refused("eval", "c.json", "--sigma-map", "-o", "map.csv") == (
        "c.json: a map needs curves of one to three axes with a sigma in the provenance, as fit and volumetric write "
        "it; here are 0")
    broken = json.loads(json.dumps(fragment))
    broken["provenance"]["EZX"]["sigma"]["values"] = [1]
    compbox.write("t.json", broken)
    compbox.good("build", "machine.json", "t.json", "--accept-range", "-o", "c.json")
    assert "provenance.EZX.sigma needs two values" in compbox.refused("eval", "c.json", "--sigma-map", "-o", "map.csv")
    assert compbox("eval", "c.json", "-o", "o.csv").returncode == 2
    assert compbox("eval", "c.json", "--sigma-map", "--inputs", "s.csv", "-o", "o.csv").returncode == 2
