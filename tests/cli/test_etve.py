# SPDX-License-Identifier: MIT
"""compbox etve against numpy: the range over the record, and the largest within any window."""

import json

import numpy
import pytest


def night(compbox, minutes=480, step=2.0, seed=3, name="night.csv"):
    """A record in minutes and °F, with a drift, a bump of half an hour and noise."""
    dice = numpy.random.default_rng(seed)
    t = numpy.arange(0, minutes + step / 2, step)
    x = numpy.round(3 * numpy.sin(t / 150) + 2.5 * numpy.exp(-((t - 300) / 15) ** 2) + dice.normal(0, 0.05, len(t)), 4)
    b = numpy.round(4 * t / minutes + dice.normal(0, 0.05, len(t)), 4)
    air = numpy.round(68 + 1.8 * numpy.sin(t / 150), 3)
    columns = (values.tolist() for values in (t, x, b, air))
    rows = [f"{i!r},{j / 1000:.7f},{k!r},{a!r},7" for i, j, k, a in zip(*columns)]
    compbox.write(name, "time [min],X [mm],B_urad,air [°F],count\n" + "\n".join(rows) + "\n")
    return t, x, b, (air - 32) / 1.8


def largest_within(t, values, window):
    """By definition: every start, all readings up to the window's end."""
    return max(numpy.ptp(values[(t >= start) & (t <= start + window)]) for start in t)


@pytest.mark.parametrize("window", [20, 60, 1000])
def test_ranges(compbox, window):
    t, x, b, air = night(compbox)
    found = json.loads(compbox.good("etve", "night.csv", "--window-min", window, "--json"))
    assert (found["hours"], found["readings"]) == (8, len(t))
    for name, values, kind in (("X_um", x, "displacements"), ("B_urad", b, "displacements"),
                               ("air_degC", air, "temperatures")):
        one = found[kind][name]
        assert one["range"] == pytest.approx(numpy.ptp(values), abs=1e-6), name
        assert one["in_window"] == pytest.approx(largest_within(t, values, window), abs=1e-6), name
        assert one["change"] == pytest.approx(values[-1] - values[0], abs=1e-6), name
        inside = (t >= one["window_from_min"] - 1e-9) & (t <= one["window_from_min"] + window + 1e-9)
        assert numpy.ptp(values[inside]) == pytest.approx(one["in_window"], abs=1e-6), name
    assert found["remarks"] == ["without a unit and left out: count"]


def test_the_table_the_figure_and_the_budget(compbox):
    t, x, _, _ = night(compbox)
    text = compbox.good("etve", "night.csv", "--plot", "night.svg", "-o", "night.json")
    row = next(line for line in text.splitlines() if "X_um" in line).split()
    assert float(row[1]) == pytest.approx(numpy.ptp(x), abs=6e-4)
    worst = compbox.read("night.json")["displacements"]["X_um"]["in_window"]
    assert f"for a measurement of 60 min: compbox report --budget eve-um={worst:.3g}" in text
    assert all(word in (compbox.folder / "night.svg").read_text() for word in ("X_um", "B_urad", "air_degC", "time, h"))


def test_what_iso_230_3_asks_for_is_remarked(compbox):
    compbox.write("short.csv", "time_s,X_um\n0,0\n400,1\n7200,2\n")
    assert json.loads(compbox.good("etve", "short.csv", "--json"))["remarks"] == [
        "2.00 h long; the test of ISO 230-3 takes 4 h at least",
        "has a gap of 6800 s; ISO 230-3 asks for a reading every 300 s at least",
        "has no temperature; the result of ISO 230-3 states that of the environment"]


@pytest.mark.parametrize("content, message", [
    ("time_s,T_degC\n0,20\n1,20\n", "d.csv:1: has no displacement; name its column as in 'X_um' or 'X [µm]'"),
    ("time_s,X_um\n0,20\n5,20\n5,21\n", "d.csv:4: the time 5 s comes after 5 s"),
    ("time_s,X_um\n0,20\n", "d.csv: needs at least two readings"),
    ("time_s,X_um\n0,20\n5,n/a\n", None),
    ("t,X_um\n0,20\n5,1\n", None)])
def test_refused(compbox, content, message):
    compbox.write("d.csv", content)
    sentence = compbox.refused("etve", "d.csv")
    assert message is None or sentence == message
