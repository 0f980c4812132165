# SPDX-License-Identifier: MIT
"""compbox eval against an evaluation of the same file by scipy, and the box's limits in numbers."""

import math
import random

import numpy
import pytest
from scipy.interpolate import BSpline

from conftest import GANTRY, PLC, term

CURVES = ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY")


def samples(compbox, rows, names="XYZ", file="s.csv"):
    lines = ["time_s," + ",".join(names)] + [",".join(map(repr, row)) for row in rows]
    return compbox.write(file, "\n".join(lines) + "\n")


def value_of(curve, x):
    """One term of a coefficient file at x, in double precision."""
    if curve["type"] == "bspline":
        knots, degree = curve["knots"], curve["degree"]
        x = min(max(x, knots[degree]), knots[-degree - 1])
        return float(BSpline(knots, curve["control_points"], degree)(x))
    if curve["type"] == "polyline":
        return float(numpy.interp(x, curve["positions"], curve["values"]))
    u = (min(max(x, curve["from"]), curve["to"]) - curve["center"]) / curve["half_range"]
    return sum(c * u**k for k, c in enumerate(curve["coefficients"]))


def build(compbox, machine, *terms, options=()):
    compbox.write("machine.json", machine)
    names = [compbox.write(f"{i}.term", one) for i, one in enumerate(terms)]
    compbox.good("build", "machine.json", *names, *options, "-o", "c.json")
    return compbox.read("c.json")


@pytest.mark.parametrize("method", ["bspline", "bspline-lmc", "polynomial", "polyline"])
def test_init_fit_build_check_eval_agrees_with_scipy(compbox, method):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "sinumerik-840d", "-o", "machine.json")
    for name in CURVES:
        options = ["--tolerance-um", 9] if method == "bspline-lmc" else []
        compbox.good("fit", GANTRY / f"measurements/{name}.csv", "--name", name, "--signal", name[2],
                     "--method", method, "--line", "least-squares", *options, "-o", f"{name}.json")
    compbox.good("build", "machine.json", *[f"{name}.json" for name in CURVES], "-o", "c.json")
    compbox.good("check", "c.json")
    dice = random.Random(7)
    ends = [[0, 0, 0], [14300, 3000, 2500], [-9.9, 3009.9, -9.9], [14309.9, -9.9, 2509.9]]
    places = ends + [[dice.uniform(0, 14300), dice.uniform(0, 3000), dice.uniform(0, 2500)]
                     for _ in range(300)]
    samples(compbox, [[10.0 * i, *place] for i, place in enumerate(places)])
    beyond = ("s.csv: beyond the ends of a curve, which keeps its value there: 2 rows, first line 4\n")
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert (done.returncode, done.stderr) == (0, beyond)
    done = compbox("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    assert (done.returncode, done.stderr) == (0, beyond)
    built, out, raw = compbox.read("c.json"), compbox.table("out.csv"), compbox.table("raw.csv")
    assert list(out) == ["time_s", *CURVES, "comp_X_um", "comp_Y_um", "comp_Z_um"] == list(raw)
    assert out["time_s"] == [10.0 * i for i in range(len(places))]
    terms = {curve["name"]: curve for curve in built["terms"]}
    for i, place in enumerate(places):
        at = dict(zip("XYZ", place))
        want = {name: value_of(terms[name], at[terms[name]["signal"]]) for name in CURVES}
        for name in CURVES:
            # float32 of the position: half a unit in the last place of 14 300 mm, times the slope
            assert out[name][i] == pytest.approx(want[name], abs=2e-3)
            assert raw[name][i] == out[name][i]
        for axis in "XYZ":
            total = -sum(want[name] for name in CURVES if name[1] == axis)
            assert raw[f"comp_{axis}_um"][i] == pytest.approx(total, abs=4e-3)


def test_standstill_gives_the_wanted_value_rounded_to_the_register(compbox, machine):
    build(compbox, machine, term(values=[0, 77.777, -123.456]))
    samples(compbox, [[5.0 * i, 10.0 * i, 0, 0] for i in range(100)])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    out, raw = compbox.table("out.csv"), compbox.table("raw.csv")
    # Each row comes 5 s after the last one, but the box meets it with one cycle: at most 15 µm.
    for want, got in zip(raw["comp_Z_um"], out["comp_Z_um"]):
        assert abs(got - want) <= 0.005 + 1e-4
        assert abs(got / 0.01 - round(got / 0.01)) < 1e-3
    # A register of hundredths is printed in hundredths: float32's noise is not a figure.
    for row in (compbox.folder / "out.csv").read_text().splitlines()[1:]:
        assert len(row.split(",")[2].partition(".")[2]) <= 2, row


def test_slew_is_that_of_the_box_between_the_rows(compbox, machine):
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[0, 0, 0, 0], [0.03, 1000, 0, 0], [0.06, 1000, 0, 0], [0.061, 1000, 0, 0],
                      [0.121, 1000, 0, 0], [10, 1000, 0, 0]])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    # 500 µm/s: 15 µm in 30 ms, 0.5 in 1 ms; 121 ms: two cycles since the row before.
    assert compbox.table("out.csv")["comp_Z_um"] == pytest.approx(
        [0, -15, -30, -30.5, -60.5, -200], abs=1e-3)


def test_a_first_row_is_steady_state(compbox, machine):
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[-3.5, 500, 0, 0]])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert compbox.table("out.csv") == {"time_s": [-3.5], "EZX": [100], "comp_Z_um": [-100]}


def test_motors_that_are_held_together(compbox, machine):
    machine["channels"] = machine["channels"][:2]
    machine["channels"][0]["sum"], machine["channels"][1]["sum"] = ["EXX"], ["EYX"]
    machine["pairs"] = [{"channels": ["X", "Y"], "max_difference_um": 40}]
    compbox.write("machine.json", machine)
    for name, values in (("EXX", (0, 100)), ("EYX", (0, 0))):
        compbox.write(name, term(name, "X", values))
    compbox.good("build", "machine.json", "EXX", "EYX", "-o", "c.json")
    samples(compbox, [[i, 300.0 + 200 * i, 0, 0] for i in range(3)])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.stderr == ("s.csv: the motors of a pair held within their max_difference_um: "
                           "2 rows, first line 3\n")


def test_limit_and_raw(compbox, machine):
    machine["channels"][2]["limit_um"] = 50
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[i, 250.0 + 100 * i, 0, 0] for i in range(3)])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.stderr == "s.csv: a channel held at its limit_um: 2 rows, first line 3\n"
    done = compbox("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    assert done.stderr == ""
    assert compbox.table("out.csv")["comp_Z_um"] == pytest.approx([-50, -50, -50])
    assert compbox.table("raw.csv")["comp_Z_um"] == pytest.approx([-50, -70, -90], abs=1e-4)


@pytest.mark.parametrize("raw", [(), ("--raw",)])
def test_branches_follow_the_way_from_row_to_row(compbox, machine, raw):
    ways = {"positions": [0, 1000], "values": [4, 4]}
    build(compbox, machine, term(values=[0, 200], backward=ways, reversal_mm=0.5))
    way = [10, 300, 999.875, 400, 400.125, 900]
    samples(compbox, [[float(i), x, 0, 0] for i, x in enumerate(way)])
    compbox.good("eval", "c.json", "--inputs", "s.csv", *raw, "-o", "out.csv")
    # The mean at first, up, up, down, a quarter of the reversal taken back, up.
    want = [(2 + 4) / 2, 60, 199.975, 4, 0.25 * 80.025 + 0.75 * 4, 180]
    assert compbox.table("out.csv")["EZX"] == pytest.approx(want, abs=2e-3)


@pytest.mark.parametrize("profile", ["generic", "fanuc"])
def test_the_plc_of_eval_applies_what_is_written(compbox, machine, profile):
    """With `applied` the outputs are those without: fanuc goes no further from it than max_step_units."""
    results = []
    for applied in (True, False):
        for channel, plc in zip(machine["channels"], (104, 105, 106)):
            channel |= {"type": "int16", "scale": 0.1, "plc": plc}
            channel.pop("applied", None)
        machine["plc"]["profile"] = profile
        if profile == "fanuc":
            machine["plc"]["max_step_units"] = 500
        if applied:
            machine["channels"][2]["applied"] = 24
        build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
        samples(compbox, [[3.0 * i, x, 0, 0] for i, x in enumerate([1000, 1000, 0, 0, 0, 800, 800])])
        compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
        results.append(compbox.table("out.csv"))
    assert results[0] == results[1] and results[0]["comp_Z_um"][4] == 0


def test_a_demand_beyond_the_error_limit_is_reported(compbox, machine):
    machine["channels"][2].update(limit_um=50, error_um=60)
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[0, 250, 0, 0], [1, 400, 0, 0], [2, 400, 0, 0]])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.returncode == 0
    assert done.stderr == ("s.csv: a channel held at its limit_um: 2 rows, first line 3\n"
                           "s.csv: box not ACTIVE: 2 rows, first line 3: FAULT, a channel's demand "
                           "is beyond its error limit\n")
    out = compbox.table("out.csv")["comp_Z_um"]
    assert out[0] == -50 and -50 < out[1] <= -48 and out[2] == 0


def test_a_network_beyond_its_training_is_reported(compbox, machine):
    """Trained from 100 to 300 mm: held from 320 mm on, faded to nothing at 420."""
    net = {"name": "net", "type": "bpnet", "outputs": ["EZX"], "inputs": ["X"], "activation": "tansig",
           "hidden_weights": [[0.0]], "hidden_bias": [0.0], "output_weights": [[0.0]],
           "output_bias": [0.0], "linear_weights": [[0.1]], "input_min": [100], "input_max": [300]}
    build(compbox, machine, {"terms": [net]})
    samples(compbox, [[10.0 * i, x, 0, 0] for i, x in enumerate([200, 310, 330, 500])])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    assert done.stderr == (
        "s.csv: a model beyond the range it was trained on: 3 rows, first line 3\n"
        "s.csv: … so far beyond it that its outputs fade: 2 rows, first line 4\n")
    z = compbox.table("raw.csv")["comp_Z_um"]
    assert z[:2] == pytest.approx([-20, -31], abs=1e-4) and -32 < z[2] < 0 == z[3]


def test_deadband(compbox, machine):
    machine["channels"][2]["deadband_um"] = 5
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[0.9 * i, x, 0, 0] for i, x in enumerate([100, 120, 130, 110, 0, 0])])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    # 4 µm more is not written, 6 is, 4 back is not, zero always is (15 µm in the first cycle)
    assert compbox.table("out.csv")["comp_Z_um"] == pytest.approx([-20, -20, -26, -26, -11, 0],
                                                                  abs=1e-3)


def test_lead_looks_ahead_of_the_motion(compbox, machine):
    machine["cycle"]["lead_ms"] = 60
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    rows = [[0.03 * i, 100 + 0.03 * i * 100, 0, 0] for i in range(100)]  # 100 mm/s, 20 µm/s
    samples(compbox, rows)
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    out, raw = compbox.table("out.csv"), compbox.table("raw.csv")
    ahead = [r - o for r, o in zip(raw["comp_Z_um"], out["comp_Z_um"])]
    assert ahead[-20:] == pytest.approx([0.06 * 20] * 20, abs=0.02)


def test_lead_does_not_take_far_rows_for_motion(compbox, machine):
    machine["cycle"]["lead_ms"] = 60
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[i, 10.0 * i, 0, 0] for i in range(50)])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert compbox.table("out.csv")["comp_Z_um"] == pytest.approx([-2.0 * i for i in range(50)],
                                                                  abs=0.006)


def test_an_implausible_position_is_held_and_reported(compbox, machine):
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[0, 500, 0, 0], [1, 5000, 0, 0], [1.06, 600, 0, 0], [2, 600, 0, 0]])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.returncode == 0
    assert done.stderr == ("s.csv: X implausible, last value held: 1 row, first line 3: 5000 "
                           "(plausible: -10 to 1010)\n")
    assert compbox.table("out.csv")["comp_Z_um"] == pytest.approx([-100, -100, -115, -120], abs=1e-3)


def test_raw_shows_the_model_beyond_the_plausible_range(compbox, machine):
    """Also in the first row, and faster than the axis can be: the curve's end value counts."""
    machine["signals"][0].update(min=0, max=800, max_rate_per_s=100)
    build(compbox, machine, term(values=[10, 200]))
    samples(compbox, [[0, -5000, 0, 0], [1, 900, 0, 0], [2, 1e6, 0, 0], [3, 800, 0, 0]])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "raw.csv")
    assert done.returncode == 0
    assert done.stderr == ("s.csv: X implausible, the box would hold the last value: 3 rows, first "
                           "line 2: -5000 (plausible: 0 to 800)\n"
                           "s.csv: beyond the ends of a curve, which keeps its value there: 2 rows, "
                           "first line 2\n")
    out = compbox.table("raw.csv")
    assert out["EZX"] == pytest.approx([10, 181, 200, 162])
    assert out["comp_Z_um"] == [-value for value in out["EZX"]]


def test_rates_are_those_from_row_to_row(compbox, machine):
    machine["signals"][0]["max_rate_per_s"] = 100
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    samples(compbox, [[0, 0, 0, 0], [2, 199, 0, 0], [4, 200, 0, 0], [4.03, 250, 0, 0]])
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.stderr == ("s.csv: X implausible, last value held: 1 row, first line 5: 250 "
                           "(plausible: -10 to 1010)\n")


def test_signals_of_other_sources_are_columns_too(compbox, machine):
    """A temperature from the PLC with a scale and a zero: the table holds degrees."""
    machine["signals"].append({"name": "T1", "unit": "degC", "plc": 14, "type": "int16",
                               "scale": 0.1, "zero": -50, "min": -10, "max": 90})
    machine["channels"][2]["sum"] = ["EZX", "drift"]
    build(compbox, machine, term(), term("drift", "T1", values=[0, 100], travel=(0, 100)))
    samples(compbox, [[0, 0, 0, 0, 20.04], [1, 500, 0, 0, 30.06]], names=("X", "Y", "Z", "T1"))
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
    out = compbox.table("out.csv")
    assert out["drift"] == pytest.approx([20.04, 30.06], abs=1e-5)
    assert out["comp_Z_um"] == pytest.approx([-20.04, -40.06], abs=1e-5)


def thermal(machine, bank=False):
    """A thermometer, a lag of it or a bank of one lag, and a term of each in Z."""
    machine["signals"] += [{"name": "T1", "unit": "degC", "plc": 14, "scale": 0.1, "min": -10, "max": 90},
                           {"name": "T1_slow", "unit": "degC", "lag_of": "T1", "tau_s": 100}]
    machine["channels"][2]["sum"] = ["fast", "slow"]
    slow = term("slow", "T1_slow", values=[0, 100], travel=(0, 100))
    if bank:
        slow = {"terms": [{"name": "slow", "type": "linear",
                           "bank": {"inputs": ["T1", "X"], "tau_s": [100], "weights": [[1, 0]]}}]}
    return machine, term("fast", "T1", values=[0, 100], travel=(0, 100)), slow


NAMES = ("X", "Y", "Z", "T1")


@pytest.mark.parametrize("bank", [False, True])
@pytest.mark.parametrize("raw", [[], ["--raw"]])
@pytest.mark.parametrize("steps", [1, 7])
def test_lags_follow_the_straight_line_between_rows(compbox, machine, raw, steps, bank):
    """From 20 to 30 degC in one time constant: the lag is behind by 10 (1 - 1/e), however many rows
    the ramp has. Had the box held the first value between the rows, one step would leave 20."""
    build(compbox, *thermal(machine, bank))
    rows = [[100 * i / steps, 0, 0, 0, 20 + 10 * i / steps] for i in range(steps + 1)]
    samples(compbox, rows, NAMES)
    compbox.good("eval", "c.json", "--inputs", "s.csv", *raw, "-o", "out.csv")
    out = compbox.table("out.csv")
    assert (out["fast"][0], out["slow"][0]) == (20, 20)
    assert out["slow"][-1] == pytest.approx(20 + 10 / math.e, abs=1e-4)
    assert out["fast"][-1] == 30


def test_help_says_that_lags_go_straight(compbox):
    text = compbox.good("eval", "--help")
    assert "lags alone follow the straight line" in text


FIRST = ("the first row has no value before it to hold, but {} is implausible there: {}; "
         "start at a row that the box accepts, or use --raw")


def test_a_first_row_that_the_box_cannot_stand_in_is_refused(compbox, machine):
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    compbox.write("s.csv", "# by hand\ntime_s,X,Y,Z\n0,5000,0,0\n1,500,0,0\n")
    eval_ = ("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert compbox.refused(*eval_) == "s.csv:3: " + FIRST.format(
        "X", "5000 (plausible: -10 to 1010)")
    done = compbox(*eval_, "--raw")
    assert done.returncode == 0
    assert done.stderr == ("s.csv: X implausible, the box would hold the last value: 1 row, first "
                           "line 3: 5000 (plausible: -10 to 1010)\n"
                           "s.csv: beyond the ends of a curve, which keeps its value there: 1 row, "
                           "first line 3\n")
    assert compbox.table("out.csv")["EZX"] == [200, 100]


def test_a_first_row_without_an_essential_sensor_is_refused(compbox, machine):
    machine, *terms = thermal(machine)
    machine["signals"][-2]["essential"] = True
    build(compbox, machine, *terms)
    samples(compbox, [[0, 0, 0, 0, 850]], NAMES)
    assert compbox.refused("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv") == (
        "s.csv:2: " + FIRST.format("T1", "850 (plausible: -10 to 90)"))


def test_a_sensor_that_the_box_runs_without_may_be_missing_at_first(compbox, machine):
    """Then nothing was held, and that is not reported."""
    build(compbox, *thermal(machine))
    samples(compbox, [[0, 0, 0, 0, 850], [1, 0, 0, 0, 850], [2, 0, 0, 0, 20], [3, 0, 0, 0, 850]], NAMES)
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.returncode == 0
    assert done.stderr == (
        "s.csv: T1 implausible and no value before it, its terms are left out: 2 rows, first line 2: "
        "850 (plausible: -10 to 90)\n"
        "s.csv: T1 implausible, last value held: 1 row, first line 5: 850 (plausible: -10 to 90)\n")
    out = compbox.table("out.csv")
    assert out["comp_Z_um"][:2] == [0, 0]
    assert out["slow"][2:] == [20, 20]  # it starts settled on the first value that there is


def test_a_column_named_like_a_lag_is_not_taken_and_that_is_reported(compbox, machine):
    build(compbox, *thermal(machine))
    samples(compbox, [[0, 0, 0, 0, 20, 80], [100, 0, 0, 0, 20, 80]], (*NAMES, "T1_slow"))
    done = compbox("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv")
    assert done.returncode == 0
    assert done.stderr == ("s.csv: column T1_slow is not used: the box computes T1_slow itself, a lag "
                           "of T1\n")
    assert compbox.table("out.csv")["slow"] == [20, 20]


REFUSED = {
    "missing": (None, "s.csv: cannot open the file (No such file or directory)"),
    "empty": ("", "s.csv: is empty: a header line is missing"),
    "no rows": ("time_s,X,Y,Z\n", "s.csv: has a header but no rows"),
    "no time": ("X,Y,Z\n1,2,3\n", "s.csv:1: there is no column 'time_s' (there are X, Y, Z)"),
    "no Y": ("time_s,X,Z\n1,2,3\n", "s.csv:1: there is no column 'Y' (there are time_s, X, Z)"),
    "header below a comment": ("# by hand\n\ntime_s,X,Z\n1,2,3\n",
                               "s.csv:3: there is no column 'Y' (there are time_s, X, Z)"),
    "control character": ("time_s,X,Y,Z\n1,2,\0\x1b,4\n", "s.csv:2:5: '??' is not a finite number"),
    "long text": ("time_s,X,Y,Z\n1,2," + 99 * "x" + ",4\n",
                  "s.csv:2:5: '" + 40 * "x" + "…' is not a finite number"),
    "text": ("time_s,X,Y,Z\n1,2,x,4\n", "s.csv:2:5: 'x' is not a finite number"),
    "nan": ("time_s,X,Y,Z\n1,2,nan,4\n", "s.csv:2:5: 'nan' is not a finite number"),
    "short row": ("time_s,X,Y,Z\n1,2,3\n", "s.csv:2: has 3 columns, the header has 4"),
    "time back": ("time_s,X,Y,Z\n1,2,3,4\n0.5,2,3,4\n",
                  "s.csv:3: time_s must rise by at least a microsecond from row to row"),
    "same time": ("time_s,X,Y,Z\n\n1,2,3,4\n1,2,3,4\n",
                  "s.csv:4: time_s must rise by at least a microsecond from row to row"),
    "gap": ("time_s,X,Y,Z\n1,2,3,4\n90000,2,3,4\n",
            "s.csv:3: time_s is more than a day after the row before"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_samples(compbox, machine, case):
    build(compbox, machine, term())
    content, message = REFUSED[case]
    if content is not None:
        compbox.write("s.csv", content)
    assert compbox.refused("eval", "c.json", "--inputs", "s.csv", "-o", "out.csv") == message


@pytest.mark.parametrize("rows, x", [
    ('"1,000","500"', None), ('"-12,345",500', None), ('"1,000,000",500', None),
    ('"1,000","0,5"', 1), ('"1,0",500', 1), ('"0,500","1,000"', 0.5), ('"1,0000",1', 1)])
def test_a_quoted_comma_that_may_be_of_thousands_is_no_guess(compbox, machine, rows, x):
    """A spreadsheet in English writes 1000 so: a thousandth of it would be taken without a word."""
    build(compbox, machine, term(values=[0, 1000]), options=["--accept-range"])
    compbox.write("s.csv", f"sep=,\ntime_s,X,Y,Z\n0,{rows},0\n")
    call = ("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
    if x is None:
        number = rows.split('"')[1]
        assert compbox.refused(*call) == (
            f"s.csv:3:3: '{number}' may have a decimal comma or be in thousands: write it without a comma")
    else:
        compbox.good(*call)
        assert compbox.table("out.csv")["EZX"] == pytest.approx([x])


def test_columns_that_are_not_asked_for_may_hold_anything(compbox, machine):
    build(compbox, machine, term(values=[0, 200]), options=["--accept-range"])
    compbox.write("s.csv", 'time_s,note,X,Y,Z,serial\n0,"by hand, hot",500,0,0,1e999\n1,,600,0,0,nan\n')
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "out.csv")
    assert compbox.table("out.csv")["EZX"] == pytest.approx([100, 120])


def test_a_bad_coefficient_file(compbox, machine):
    samples(compbox, [[0, 0, 0, 0]])
    compbox.write("c.json", "{}")
    assert compbox.refused("eval", "c.json", "--inputs", "s.csv", "-o", "o").startswith("c.json: ")


def test_output_is_exact_and_repeatable(compbox, machine):
    build(compbox, machine, term(values=[0, math.pi, 1 / 3]))
    samples(compbox, [[i, 1.7 * i, 0, 0] for i in range(200)])
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "a.csv")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "b.csv")
    assert (compbox.folder / "a.csv").read_bytes() == (compbox.folder / "b.csv").read_bytes()
    for text in (compbox.folder / "a.csv").read_text().splitlines()[1].split(","):
        assert float(numpy.float32(text)) == pytest.approx(float(text), rel=1e-7)
    assert "-0" not in (compbox.folder / "a.csv").read_text().splitlines()[1].split(",")


ADAPT = {"name": "X_adapted", "type": "adapt", "of": "warm", "probe": {"value": "probe_x", "count": "probe_x_n"},
         "measures": "whole", "bias_max_um": 30, "gain_max": 0.5, "step_max_um": 15, "drift_um_per_sqrt_h": 6,
         "gain_drift_per_sqrt_h": 0.5, "sigma_um": 1.5, "min_interval_s": 60}


def adaptive(compbox, **changed):
    """A file with one channel: a thermometer's term, adapted by a probe. Minutes lie between the rows: a cycle of 300
    ms computes a tenth of the steps of one of 30 ms."""
    compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "-o", "machine.json")
    data = compbox.read("machine.json")
    data["cycle"]["period_ms"] = 300
    data["plc"]["heartbeat_timeout_ms"] = 2000
    data["signals"][0].update(min=0, max=100)
    data["channels"][0].update(limit_um=300, error_um=400, slew_um_per_s=500)
    data["signals"] += [
        {"name": "T1", "unit": "degC", "can": "0x181", "offset": 0, "type": "int16le", "scale": 0.01, "min": -50,
         "max": 90},
        {"name": "probe_x", "unit": "um", "can": "0x182", "offset": 0, "type": "float32le", "min": -500, "max": 500},
        {"name": "probe_x_n", "unit": "1", "can": "0x182", "offset": 4, "type": "uint16le", "min": 0, "max": 65535}]
    data["terms"] = [{"name": "warm", "type": "linear", "inputs": ["T1"], "weights": [1], "constant": -20},
                     {**ADAPT, **changed}]
    data["channels"][0]["sum"] = ["X_adapted"]
    return compbox.write("a.json", data)


def test_build_says_nothing_of_an_adapted_model(compbox):
    """Its model is in no sum, but it is in use; so are the probe's signals."""
    data = compbox.read(adaptive(compbox))
    compbox.write("terms.json", {"signals": [], "terms": data.pop("terms")})
    compbox.write("machine.json", {**data, "terms": []})
    assert "Remark" not in compbox.good("build", "machine.json", "terms.json", "-o", "c.json")
    assert compbox.read("c.json")["channels"][0]["sum"] == ["X_adapted"]


def probed_days(compbox, wrong=0.0, days=2, every_min=60):
    """A table of minutes: the error, whose bias and gain wander, is probed; out: the error of each row."""
    dice, wrongs = random.Random(5), random.Random(6)
    bias, gain, count, probed, errors, rows = 4.0, 0.2, 65500, 0.0, [], []
    for minute in range(days * 1440):
        warm = 14 * math.sin(2 * math.pi * minute / 1440) + 6 * math.sin(2 * math.pi * minute / 317)
        bias += 0.12 * dice.gauss(0, 1)
        gain += 0.001 * dice.gauss(0, 1)
        errors.append(bias + (1 + gain) * warm)
        if minute % every_min == every_min // 2:
            count = (count + 1) % 65536
            probed = errors[-1] + dice.gauss(0, 1.5)
            if wrongs.random() < wrong:
                probed += wrongs.choice((-100, 100))
        rows.append([60 * minute, 0.0, 20 + warm, probed, count])
    samples(compbox, rows, ("X", "T1", "probe_x", "probe_x_n"))
    return numpy.array(errors)


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))


def test_an_adapted_term_follows_the_probe_columns_of_a_table(compbox):
    adaptive(compbox)
    errors = probed_days(compbox)
    compbox.good("eval", "a.json", "--inputs", "s.csv", "-o", "out.csv")
    out = compbox.table("out.csv")
    static, adapted = rms(errors - out["warm"]), rms(errors - out["X_adapted"])
    assert static > 3.4 and adapted < 2.5, (static, adapted)
    assert numpy.max(numpy.abs(numpy.add(out["X_adapted"], out["comp_X_um"]))) < 0.51
    away = numpy.abs(numpy.array(out["X_adapted"]) - out["warm"])
    assert numpy.all(away <= 30 + 0.5 * numpy.abs(out["warm"]))
    assert out["X_adapted"][29] == out["warm"][29], "nothing before the first probe"


def test_the_sigma_of_an_adapted_term_holds(compbox):
    """Two sigmas hold the error of nine rows in ten or more, and the sigma grows from probe to probe."""
    adaptive(compbox, drift_um_per_sqrt_h=1, gain_drift_per_sqrt_h=0.05)
    errors = probed_days(compbox)
    done = compbox("eval", "a.json", "--inputs", "s.csv", "--sigma", "-o", "out.csv")
    assert (done.returncode, done.stderr) == (0, "")
    out = compbox.table("out.csv")
    sigma = numpy.array(out["sigma_X_adapted"])
    late = numpy.arange(len(sigma)) > 300
    held = numpy.abs(errors - out["X_adapted"]) <= 2 * sigma
    assert 0.9 < numpy.mean(held[late]) <= 1, numpy.mean(held[late])
    assert numpy.all(numpy.diff(sigma[300:329:7]) != 0) and sigma[630] < sigma[629], sigma[625:635]
    assert numpy.allclose(sigma, out["sigma_comp_X_um"], rtol=1e-6)
    assert max(out["sigma_warm"]) == 0, "no sigma is known of the model alone"


def test_wrong_probes_of_a_table_cost_little(compbox):
    adaptive(compbox)
    errors = probed_days(compbox, days=4)
    compbox.good("eval", "a.json", "--inputs", "s.csv", "--raw", "-o", "right.csv")
    probed_days(compbox, wrong=0.05, days=4)
    compbox.good("eval", "a.json", "--inputs", "s.csv", "--raw", "-o", "wrong.csv")
    right = rms(errors - compbox.table("right.csv")["X_adapted"])
    wrong = rms(errors - compbox.table("wrong.csv")["X_adapted"])
    assert right < 2.5 and wrong < 1.25 * right, (right, wrong)


def test_a_residual_probe_of_a_table_counts_with_the_output(compbox):
    adaptive(compbox, measures="residual")
    rows = [[60.0 * k, 0.0, 20, 3.0, k // 2] for k in range(8)]  # the error is 3 more than the output, again and again
    samples(compbox, rows, ("X", "T1", "probe_x", "probe_x_n"))
    compbox.good("eval", "a.json", "--inputs", "s.csv", "-o", "out.csv")
    adapted = compbox.table("out.csv")["X_adapted"]
    assert adapted[0] == 0 and 0 < adapted[3] < adapted[5] < adapted[7]
