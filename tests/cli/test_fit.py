# SPDX-License-Identifier: MIT
"""compbox fit as a person calls it: what it writes, what it says, what it refuses."""

import json
import math

import numpy
import pytest

from conftest import PLC

FIT = ("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t.json")


def readings(runs=1, n=21, length=2000, sigma=None, directions=False):
    """A smooth curve with a little deterministic noise, as a file."""
    names = ["position_mm", "error_um"] + ["run"] + (["direction"] if directions else [])
    names += ["sigma"] if sigma else []
    lines = [",".join(names)]
    for run in range(runs):
        for i in range(n):
            x = length * i / (n - 1)
            lost = (2.0 if run % 2 == 0 else -2.0) if directions else 0.0
            y = 20 * math.sin(x / 300) + lost + 0.3 * math.sin(37.1 * i * i + 11.3 * run)
            lines.append(",".join([f"{x}", f"{y:.4f}", str(run + 1)]
                                  + (["+1" if run % 2 == 0 else "-1"] if directions else [])
                                  + ([f"{sigma}"] if sigma else [])))
    return "\n".join(lines) + "\n"


@pytest.fixture(autouse=True)
def data(compbox):
    compbox.write("d.csv", readings(runs=3))


@pytest.mark.parametrize("option, value, sentence", [
    ("--name", "E" * 24, "'EEEEEEEEEEEEEEEEEEEEEEEE' is too long: a name has at most 23 characters"),
    ("--name", "", "a name may not be empty"),
    ("--name", "E ZX", "'E ZX' is not a name: use letters A to Z, digits and _ - . only"),
    ("--signal", "", "a name may not be empty"),
    ("--signal", "X" * 24, "is too long"),
    ("--method", "foo", "must be one of bspline, bspline-lmc, polynomial, polyline, not foo"),
    ("--line", "foo", "must be one of keep, end-point, least-squares, not foo"),
    ("--tolerance-um", "-1", "--tolerance-um: must be above 0, not -1"),
    ("--tolerance-um", "nan", "--tolerance-um: 'nan' is not a finite number"),
    ("--zero-at", "nan", "--zero-at: 'nan' is not a finite number"),
    ("--degree", "16", "--degree: must be a whole number from 1 to 15, not 16"),
    ("--degree", "6", "a B-spline has degree 1 to 5"),
])
def test_wrong_usage_is_one_sentence(compbox, option, value, sentence):
    arguments = list(FIT)
    if option in arguments:
        del arguments[arguments.index(option):arguments.index(option) + 2]
    done = compbox(*arguments, option, value)
    assert done.returncode == 2
    assert sentence in done.stderr, done.stderr
    assert not (compbox.folder / "t.json").exists()


@pytest.mark.parametrize("row, sentence", [
    ("500,1e30", "d.csv:4: an error of 1e+30 is beyond any machine; "
                 "give micrometres (microradians for angles)"),
    ("1e30,5", "d.csv:4: a position of 1e+30 mm is beyond any machine; give millimetres"),
])
def test_numbers_beyond_any_machine_are_refused(compbox, row, sentence):
    compbox.write("d.csv", f"position_mm,error_um\n0,1\n100,2\n{row}\n1000,3\n1500,4\n2000,5\n")
    assert compbox.refused(*FIT) == sentence


@pytest.mark.parametrize("rows, sentence", [
    # 0.1 nm in 5 mm: what is merged to one target may not be two readings of one run
    ("0,1\n1,1\n2,1\n2.0000001,3\n3,1\n4,1\n5,1\n",
     "d.csv:5: position 2.0000001 mm is there already in line 4 (2 mm); name the runs in a column 'run'"),
    ("0,1\n1,1\n2,1\n2,3\n3,1\n4,1\n5,1\n",
     "d.csv:5: position 2 mm is there already in line 4; name the runs in a column 'run'"),
])
def test_positions_that_are_one_target_are_refused_in_one_run(compbox, rows, sentence):
    compbox.write("d.csv", "position_mm,error_um\n" + rows)
    assert compbox.refused(*FIT) == sentence


def test_the_same_in_a_backward_run_and_in_columns(compbox):
    """There the later line has the smaller position."""
    up = "".join(f"{x},1,a,+1\n" for x in (0, 1, 2, 3))
    compbox.write("d.csv", "position_mm,error_um,run,direction\n" + up +
                  "3,1,a,-1\n2.0000001,3,a,-1\n2,1,a,-1\n0,1,a,-1\n")
    assert compbox.refused(*FIT) == ("d.csv:8: position 2 mm is there already in line 7 (2.0000001 mm), "
                                     "in the same run")
    compbox.write("d.csv", "position_mm,Run 1 (um),Run 2 (um)\n0,1,1\n2,1,1\n2.0000001,3,3\n3,1,1\n")
    assert compbox.refused(*FIT) == ("d.csv:4: position 2.0000001 mm is there already in line 3 (2 mm), "
                                     "in the same run")


def test_the_same_in_a_laser_file(compbox):
    compbox.write("d.rtl", "HEADER::\nTARGET DATA::\nTarget-count: 4\nTargets :\n"
                  " 0 100 100.00001 200\nRUNS::\nRun-count: 1\nDEVIATIONS::\n"
                  "1 4 0.1\n1 3 -1.5\n1 2 2.25\n1 1 0\nEOF::\n")
    assert compbox.refused("fit", "d.rtl", *FIT[2:]) == (
        "d.rtl:11: position 100 mm is there already in line 10 (100.00001 mm), in the same run")


def test_nearly_equal_positions_of_two_runs_are_one_target(compbox):
    rows = [f"{x},{x % 3},1\n" for x in range(8)] + [f"{x + 1e-7},{x % 3 + 0.5},2\n" for x in range(8)]
    compbox.write("d.csv", "position_mm,error_um,run\n" + "".join(rows))
    assert "positions, runs          8, 2" in compbox.good(*FIT)


@pytest.mark.parametrize("value", ["0", "-2.5"])
@pytest.mark.parametrize("runs", [1, 3])
def test_a_column_of_one_value_is_noticed_and_has_no_impossible_noise(compbox, value, runs):
    rows = [f"{100 * i},{value},{run}\n" for run in range(runs) for i in range(7)]
    compbox.write("d.csv", "position_mm,error_um,run\n" + "".join(rows))
    done = compbox(*FIT)
    sentence = f"every reading is {value} um, which no measurement gives; check the column"
    assert (done.returncode, done.stderr) == (0, f"compbox: d.csv: {sentence}\n")
    found = compbox.read("t.json")["provenance"]["EZX"]
    assert found["warnings"] == [sentence]
    assert found["noise"] == 0.001


def test_readings_without_noise_have_the_least_that_an_instrument_has(compbox):
    """As a program makes them; the warning and the file name one figure."""
    rows = [f"{100 * i},{2 * i}\n" for i in range(7)]
    compbox.write("d.csv", "position_mm,error_um\n" + "".join(rows))
    for line in ("keep", "end-point"):  # all zero once the line is off, but not in the file
        printed = compbox(*FIT, "--line", line).stderr
        assert "about 0.001 um is assumed" in printed and "every reading" not in printed
        assert compbox.read("t.json")["provenance"]["EZX"]["noise"] == 0.001


@pytest.mark.parametrize("sigma, sentence", [
    ("0", "d.csv:2: sigma must be above zero, not 0"),
    ("1e30", "d.csv:2: a sigma of 1e+30 is outside 1e-06 to 1e+06; give it in the error's unit"),
])
def test_an_impossible_sigma_is_refused(compbox, sigma, sentence):
    compbox.write("d.csv", readings(sigma=sigma))
    assert compbox.refused(*FIT) == sentence


def test_a_signal_of_another_axis_is_noticed(compbox):
    def warned(name, signal):
        done = compbox("fit", "d.csv", "--name", name, "--signal", signal, "-o", "t.json")
        assert done.returncode == 0
        return "by its name an error of axis" in done.stderr
    assert warned("EZX", "Y")
    assert not warned("EZX", "X") and not warned("EZX", "x1")
    assert not warned("bow", "Y") and not warned("EQX", "Y")


def test_a_unit_that_does_not_go_with_the_name_is_noticed(compbox):
    def warning(name, unit):
        compbox.write("d.csv", readings(runs=3).replace("error_um", f"error_{unit}"))
        done = compbox("fit", "d.csv", "--name", name, "--signal", "X", "-o", "t.json")
        assert done.returncode == 0
        return done.stderr.partition("d.csv: ")[2].strip()
    assert warning("EAX", "um") == "EAX is by its name an angle, but the readings are in um"
    assert warning("EXX", "urad") == "EXX is by its name no angle, but the readings are in urad"
    assert warning("ECX", "urad") == "" == warning("EZX", "um") == warning("pitch", "um")


def test_one_run_says_that_the_noise_is_unknown(compbox):
    compbox.write("d.csv", readings(runs=1))
    assert "the noise could not be measured" in compbox(*FIT).stderr
    compbox.write("d.csv", readings(runs=1, sigma=0.3))
    assert "could not be measured" not in compbox(*FIT).stderr


def test_a_tolerance_that_is_not_reached_is_written_and_reported(compbox):
    done = compbox(*FIT, "--method", "polynomial", "--tolerance-um", "0.001")
    assert done.returncode == 0
    assert "did not converge" in done.stderr
    assert compbox.read("t.json")["provenance"]["EZX"]["converged"] is False
    compbox.good(*FIT, "--tolerance-um", "0.01")
    found = compbox.read("t.json")["provenance"]["EZX"]
    assert found["converged"] is True and abs(found["residuals"]["worst"]) <= 0.01


def test_a_tolerance_buys_fewer_knots_only_where_they_are_wanted(compbox):
    def found(*options):
        out = compbox.good(*FIT, *options)
        assert "from best estimate" in out
        return compbox.read("t.json")["provenance"]["EZX"]

    free, wide, few = found(), found("--tolerance-um", "3"), found("--tolerance-um", "3", "--fewest-knots")
    for key in ("coefficients", "residuals", "from_best_estimate"):
        assert wide[key] == free[key]
    assert few["coefficients"] < free["coefficients"]
    assert few["from_best_estimate"]["rms"] > 3 * free["from_best_estimate"]["rms"]
    assert "--fewest-knots" in compbox(*FIT, "--fewest-knots").stderr


def test_lmc_states_its_residual_by_key_points(compbox):
    compbox.good(*FIT, "--method", "bspline-lmc", "--tolerance-um", "2", "--plot", "f.svg")
    found = compbox.read("t.json")["provenance"]["EZX"]
    steps = found["residual_by_key_points"]
    assert [count for count, _ in steps] == list(range(steps[0][0], found["key_points"] + 1))
    assert steps[-1][1] <= 2 < min(um for _, um in steps[:-1])
    plot = (compbox.folder / "f.svg").read_text()
    assert "key points" in plot and "largest residual" in plot
    compbox.good(*FIT, "--plot", "f.svg")
    assert "key points" not in (compbox.folder / "f.svg").read_text()


def test_lmc_says_when_its_points_run_out(compbox):
    done = compbox(*FIT, "--method", "bspline-lmc", "--tolerance-um", "0.001")
    assert done.returncode == 0
    assert "did not converge: with all 21 points as key points" in done.stderr
    assert compbox.read("t.json")["provenance"]["EZX"]["converged"] is False


@pytest.mark.parametrize("degree", [1, 2, 5])
def test_lmc_takes_as_many_coefficients_as_the_box(compbox, degree):
    compbox.write("d.csv", "position_mm,error_um\n" + "".join(f"{i},{(37 * i * i) % 101}\n" for i in range(1030)))
    done = compbox(*FIT, "--method", "bspline-lmc", "--tolerance-um", "0.001", "--degree", degree)
    assert done.returncode == 0
    assert len(compbox.read("t.json")["terms"][0]["control_points"]) == 1024
    assert "did not converge: with 1024 points as key points" in done.stderr


def test_lmc_refuses_positions_that_the_box_cannot_distinguish(compbox):
    rows = "".join(f"{100000 + 0.0004 * i:.4f},{i * i % 7}\n" for i in range(40))
    compbox.write("d.csv", "position_mm,error_um\n" + rows)
    assert compbox.refused(*FIT, "--method", "bspline-lmc") == (
        "d.csv: positions near 100000 mm are too close together for the box to distinguish")


def test_branches_zero_and_band(compbox):
    compbox.write("d.csv", readings(runs=6, directions=True))
    assert "--branches keeps both" in compbox(*FIT).stderr
    out = compbox.good(*FIT, "--branches", "--reversal-mm", "0.2", "--zero-at", "1000",
                       "--line", "end-point", "--band", "band.csv")
    assert "backward branch" in out and "zero at" in out
    term = compbox.read("t.json")["terms"][0]
    assert term["reversal_mm"] == 0.2
    assert set(term["backward"]) == {"degree", "knots", "control_points"}
    found = compbox.read("t.json")["provenance"]["EZX"]
    assert found["branches"] == "forward and backward"
    assert found["line"] == "end-point" and "line_slope_per_mm" in found
    assert found["zero_at_mm"] == 1000 and found["backward"]["coefficients"] >= 4
    band = compbox.table("band.csv")
    middle = band["position_mm"].index(1000)
    assert abs(band["curve_um"][middle]) < 1e-4
    assert band["backward_um"][middle] == pytest.approx(-4, abs=0.5)
    assert all(0 < sigma < 1 for sigma in band["sigma_um"] + band["backward_sigma_um"])


def test_branches_reach_the_box(compbox):
    compbox.write("d.csv", readings(runs=6, directions=True))
    compbox.good(*FIT, "--branches", "--reversal-mm", "1")
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel",
                 "X=2000,Y=1000,Z=1000", "-o", "m.json")
    compbox.good("build", "m.json", "t.json", "-o", "c.json")
    compbox.write("s.csv", "time_s,X,Y,Z\n0,0,0,0\n1,900,0,0\n2,1000,0,0\n3,1100,0,0\n4,1000,0,0\n")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "-o", "o.csv")
    values = compbox.table("o.csv")["EZX"]
    assert values[2] - values[4] == pytest.approx(4, abs=0.5)


def test_kept_slope_is_reported(compbox):
    compbox.good(*FIT)
    assert compbox.read("t.json")["provenance"]["EZX"]["line"] == "keep"


@pytest.mark.parametrize("options, sentence", [
    (("--zero-at", "2001"), "d.csv: was measured from 0 to 2000 mm; the curve cannot be zero at 2001 mm"),
    (("--branches",), "d.csv: has no positions reached forward and backward; "
                      "--branches needs a column direction with both"),
])
def test_what_the_file_does_not_carry_is_refused(compbox, options, sentence):
    assert compbox.refused(*FIT, *options) == sentence


def test_a_reversal_needs_branches(compbox):
    assert compbox(*FIT, "--reversal-mm", "0.2").returncode == 2


def test_plots_are_made(compbox):
    compbox.write("d.csv", readings(runs=4, directions=True))
    for options in ((), ("--branches",), ("--method", "polynomial")):
        compbox.good(*FIT, *options, "--plot", "f.svg")
        text = (compbox.folder / "f.svg").read_text()
        assert "<svg" in text and "readings backward" in text
        assert ("curve backward" in text) == ("--branches" in options)


def test_the_least_squares_line_is_the_plain_one_that_report_states(compbox):
    x = [0, 100, 200, 300, 400, 450, 460, 470, 1000]  # an uneven raster: a weighted line differs
    y = [0.1, 3.0, 7.2, 8.9, 13.5, 14.0, 18.0, 17.5, 22.0]
    compbox.write("m.csv", "position_mm,error_um\n" + "".join(f"{a},{b}\n" for a, b in zip(x, y)))
    compbox.good("fit", "m.csv", "--name", "EZX", "--signal", "X", "--line", "least-squares", "-o",
                 "t.json")
    found = compbox.read("t.json")["provenance"]["EZX"]
    slope, offset = numpy.polyfit(numpy.array(x) - 500.0, y, 1)
    assert found["line_slope_per_mm"] == pytest.approx(slope, rel=1e-4)
    assert found["line_offset"] == pytest.approx(offset, rel=1e-4)
    report = json.loads(compbox.good("report", "m.csv", "--json"))["before"]["straightness"]
    slope_urad = 1000 * found["line_slope_per_mm"]
    assert report["least_squares"]["slope_urad"] == pytest.approx(slope_urad, rel=1e-4)
