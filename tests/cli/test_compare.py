# SPDX-License-Identifier: MIT
"""compbox build and check: parts of a file that do not belong together are named, and good files stay quiet."""

import json
import os
import re

import pytest

from conftest import GANTRY, PLC, ROOT, term

CURVES = ("EXY", "EXZ", "EYX", "EYZ", "EZX", "EZY")
ACCEPT = "; --accept-range builds the file nevertheless"


def built(compbox, *terms, options=(), machine="machine.json"):
    """Builds c.json of these fragments. Returns the remarks of build, which are those of check. Terms without a channel
    are a remark of build alone."""
    names = [compbox.write(f"{number}.json", one) for number, one in enumerate(terms)]
    printed = compbox.good("build", machine, *names, *options, "-o", "c.json").splitlines()
    checked = compbox.good("check", "c.json").splitlines()
    remarks = [line for line in printed if line.startswith("Remark: ") and "no channel sums it" not in line]
    accepted = "Remark: accepted by --accept-range: "
    assert [line for line in checked if line.startswith("Remark: ")] == [
        line if not line.startswith(accepted) else
        "Remark: " + ("" if line[len(accepted):].startswith("channel") else "term ") + line[len(accepted):]
        for line in remarks]
    return [line[len("Remark: "):] for line in remarks]


def refused(compbox, *terms, machine="machine.json"):
    """build's sentence without the file and the remedy of --accept-range."""
    names = [compbox.write(f"{number}.json", one) for number, one in enumerate(terms)]
    printed = compbox.refused("build", machine, *names, "-o", "c.json")
    assert printed.endswith(ACCEPT)
    return printed[:-len(ACCEPT)]


def only(remarks):
    assert len(remarks) == 1, remarks
    return remarks[0]


def change(compbox, what, name="machine.json"):
    file = compbox.read(name)
    what(file)
    compbox.write(name, file)


def provenance(fragment, name, **own):
    return {**fragment, "provenance": {name: own}}


# ---- ages

def test_a_signal_of_a_bus_that_is_too_old_between_two_readings(compbox, machine):
    def has(**age):
        def what(file):
            file["buses"] = [{"name": "B", "rtu": {"device": "/dev/ttyS0", "baud": 19200}, "every_ms": 1000}]
            file["signals"] = [one for one in file["signals"] if one["name"] != "T"] + [
                {"name": "T", "unit": "degC", "bus": "B", "unit_id": 1, "register": 0, "type": "int16", "min": 0,
                 "max": 90, **age}]
        change(compbox, what)
        return built(compbox, term("EZX", values=(0, 30, 0)))

    assert has() == has(max_age_ms=1001) == []
    for age in (500, 1000):
        assert only(has(max_age_ms=age)) == (
            f"signal T: the bus reads it every 1000 ms, and max_age_ms is {age}: it is missing before each reading")


# ---- demand

def test_a_demand_beyond_error_um_is_refused_and_named_by_check(compbox, machine):
    curve = term("EZX", values=(0, -900, 0))
    assert refused(compbox, curve) == (
        "machine.json: channel Z: the demand reaches 900.0 µm at X = 500, and beyond error_um 400 the box stops with "
        "a fault; check that the curves are in µm, or set limit_um and error_um to it")
    remark = only(built(compbox, curve, options=["--accept-range"]))
    assert remark.startswith("accepted by --accept-range: channel Z: the demand reaches 900.0 µm")
    printed = compbox.good("build", "machine.json", "0.json", "--accept-range", "-o", "c.json")
    assert "revision 1: 3 signals, 1 term, 1 channel, coefficients 7 of 8192, range accepted" in printed.splitlines()


def test_curves_that_are_good_alone_meet_in_a_corner(compbox, machine):
    curves = [term(name, name[2], values=(0, 250, 0)) for name in ("EZX", "EZY")]
    assert [built(compbox, one) for one in curves] == [[], []]
    assert "channel Z: the demand reaches 500.0 µm at X = 500, Y = 500" in refused(compbox, *curves)


def test_every_channel_has_its_range_beside_its_limits(compbox, machine):
    built(compbox, term("EZX", values=(0, 30, -50, 0)), term("EXX", values=(0, 5, 0)))
    lines = compbox.good("check", "c.json").splitlines()
    assert "channel Z: demand -30.0 to 50.0 µm over the travel of X (limit_um 300, error_um 400)" in lines
    assert "X from -10 to 1010 mm: curves EZX 0 to 1000, EXX 0 to 1000" in lines
    figures = json.loads(compbox.good("check", "c.json", "--json"))
    assert figures["demand"]["Z"] == {"low_um": -30, "high_um": 50, "home_um": 0, "limit_um": 300, "error_um": 400}
    assert figures["curves"]["EZX"] == {"signal": "X", "from": 0, "to": 1000, "travel_from": -10, "travel_to": 1010}
    done = json.loads(compbox.good("build", "machine.json", "0.json", "1.json", "--json", "-o", "c.json"))
    assert done["demand"] == figures["demand"] and done["range_accepted"] is False


def test_both_branches_count(compbox, machine):
    curve = term("EZX", values=(0, 10, 0))
    curve["terms"][0].update(reversal_mm=0.1, backward={"positions": [0, 500, 1000], "values": [0, 410, 0]})
    assert "the demand reaches 410.0 µm at X = 500" in refused(compbox, curve)


def test_a_product_is_searched_at_each_temperature_and_position(compbox, machine):
    """K0 = 2 µm/K from 20 °C, and 11 µm/m/K over 1000 mm: 110 + 60 µm at 30 °C."""
    machine["signals"].append({"name": "T", "unit": "degC", "plc": 20, "type": "int16", "scale": 0.1, "min": 10,
                               "max": 30})
    machine["channels"][0]["sum"] = ["K0", "growth"]
    compbox.write("machine.json", machine)
    thermal = {"terms": [
        {"name": "K0", "type": "linear", "inputs": ["T"], "weights": [2], "constant": -40},
        {"name": "slope", "type": "linear", "inputs": ["T"], "weights": [0.011], "constant": -0.22},
        {"name": "growth", "type": "product", "term": "slope", "signal": "X"}]}
    assert built(compbox, thermal) == []
    demand = json.loads(compbox.good("check", "c.json", "--json"))["demand"]["X"]
    assert demand["high_um"] == pytest.approx(0, abs=1e-4) and demand["alone_signals"] == ["T"]
    assert (demand["alone_low_um"], demand["alone_high_um"]) == pytest.approx((-20 - 111.1, 20 + 111.1), abs=0.1)
    change(compbox, lambda file: file["signals"][-1].update(max=90))
    assert "channel X: the demand reaches 917.7 µm at X = 1010, T = 90" in only(built(compbox, thermal))


def test_a_volumetric_term_is_searched_in_space(compbox, machine):
    """A roll of 400 µrad at one X, and 1000 mm of Y from its reference point: 400 µm in Z."""
    roll = term("EAX", "X", values=(0, 0, 0, 0, 400, 0, 0, 0))
    change(compbox, lambda file: file["signals"][2].update(max=400))
    vol = {"name": "vol", "type": "volumetric", "chain": "fXYZ", "errors": ["EAX"], "outputs": ["vx", "vy", "vz"]}
    printed = refused(compbox, {"terms": [*roll["terms"], vol]})
    assert re.search(r"channel Z: the demand reaches 404\.0 µm at X = 571\.4\d*, Y = 1010, Z = ", printed)


def test_a_network_is_swept_and_what_is_not_covered_is_named(compbox, machine):
    for number in (1, 2):
        machine["signals"].append({"name": f"T{number}", "unit": "degC", "plc": 20 + number, "type": "int16",
                                   "scale": 0.1, "min": -10, "max": 90})
    compbox.write("machine.json", machine)
    net = {"name": "net", "type": "bpnet", "inputs": ["T1", "T2"], "outputs": ["error_X_um"], "activation": "tansig",
           "hidden_weights": [[0.1, -0.1]], "hidden_bias": [0], "output_weights": [[100]], "output_bias": [0],
           "input_min": [15, 15], "input_max": [35, 35]}
    assert built(compbox, {"terms": [net]}) == []
    text = compbox.good("check", "c.json")
    line = next(one for one in text.splitlines() if one.startswith("channel X: demand"))
    assert line.startswith("channel X: demand 0.0 to 0.0 µm at rest; -9")
    assert line.endswith("with one of 2 signals alone over its range (limit_um 300, error_um 400), "
                         "combinations of these are not covered")
    net["output_weights"] = [[1000]]  # thermometers warm up together: one of them alone proves nothing
    assert built(compbox, {"terms": [net]}) == []
    net["output_bias"] = [5000]
    assert "channel X: the demand reaches 5000.0 µm at T1 = 20, T2 = 20" in refused(compbox, {"terms": [net]})


# ---- travel

def test_metres_that_were_given_as_mm(compbox, machine):
    change(compbox, lambda file: file["signals"][0].update(max=5010))
    curve = term("EZX", values=(0, 3, 0), travel=(0, 1))
    assert refused(compbox, curve) == (
        "0.json: EZX is a curve from 0 to 1 mm, and X goes from -10 to 5010; measure the whole travel, check that its "
        "positions are in mm, or correct min and max")
    only(built(compbox, curve, options=["--accept-range"]))


def test_a_measurement_may_end_a_tenth_before_the_travel(compbox, machine):
    assert built(compbox, term("EZX", travel=(90, 910))) == []
    assert "EZX is a curve from 200 to 1000 mm" in refused(compbox, term("EZX", travel=(200, 1000)))
    assert "EZX is a curve from 0 to 880 mm" in refused(compbox, term("EZX", travel=(0, 880)))


def test_metres_where_the_travel_is_that_of_the_curves(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    assert only(built(compbox, term("EZX", travel=(0, 5)))) == (
        "term EZX is a curve from 0 to 5 mm, and X goes from -10 to 15; are its positions metres instead of mm?")
    assert built(compbox, term("EZX", travel=(0, 5000))) == []
    assert "EYX is a curve from 0 to 5 mm" in refused(compbox, term("EZX", travel=(0, 5000)),
                                                      term("EYX", travel=(0, 5)))


def test_a_curve_that_no_channel_uses_may_cover_anything(compbox, machine):
    assert built(compbox, term("EZX"), term("spare", travel=(0, 1))) == []


# ---- the reference point

def test_a_laser_zero_shifts_the_tool_when_compensation_is_enabled(compbox, machine):
    curve = term("EZX", values=(50, 60, 55))
    assert only(built(compbox, curve)) == (
        "channel Z: the demand at X = 0 is -50.0 µm, so the tool moves when compensation is enabled there; fit the "
        "curves with --zero-at the reference point, or set home_mm in the machine file's provenance to it")
    assert built(compbox, term("EZX", values=(8, 18, 13))) == []


def test_home_is_stated_by_the_machine_file_or_by_the_fit(compbox, machine):
    curve = term("EZX", values=(60, 40, 0))
    assert "at X = 0 is -60.0 µm" in only(built(compbox, curve))
    assert built(compbox, provenance(curve, "EZX", zero_at_mm=1000)) == []
    change(compbox, lambda file: file.update(provenance={"home_mm": {"X": 1000}}))
    assert built(compbox, curve) == []
    change(compbox, lambda file: file.update(provenance={"home_mm": {"X": 500}}))
    assert "at X = 500 is -40.0 µm" in only(built(compbox, provenance(curve, "EZX", zero_at_mm=1000)))
    change(compbox, lambda file: file.update(provenance={"home_mm": {"X": 1000, "W": 0}}))
    assert only(built(compbox, curve)) == (
        "provenance.home_mm: W is no place on the travel of an axis of this file; name positions, with numbers in mm")
    change(compbox, lambda file: file.update(provenance={"home_mm": {"X": 4290}}))
    assert "provenance.home_mm: X is no place on the travel" in only(built(compbox, curve))


def test_the_demo_starts_near_zero(compbox):
    """The start of the demo's machine is the home of its machine file and the zero of its curves."""
    home = compbox.read(GANTRY / "machine.json")["provenance"]["home_mm"]
    script = (ROOT / "packaging/compbox-demo").read_text()
    assert home == json.loads((GANTRY / "machine_twin.json").read_text())["start_mm"]
    assert home == {axis: float(mm) for axis, mm in re.findall(
        r"\[([XYZ])\]=(\d+)", re.search(r"home_mm=\((.*)\)", script)[1])}
    assert '--zero-at "${home_mm[${curve:2}]}"' in script
    for name in CURVES:
        compbox.good("fit", GANTRY / f"measurements/{name}.csv", "--name", name, "--signal", name[2], "--line",
                     "least-squares", "--zero-at", home[name[2]], "-o", f"{name}.json")
    printed = compbox.good("build", GANTRY / "machine.json", *[f"{name}.json" for name in CURVES], "-o", "c.json")
    assert "Remark" not in printed + compbox.good("check", "c.json")
    demand = json.loads(compbox.good("check", "c.json", "--json"))["demand"]
    assert [abs(demand[axis]["home_um"]) < 0.01 for axis in "XYZ"] == [True] * 3


# ---- mistakes of every kind: what is changed, and what is reported

def signal(**what):
    return lambda file: file["signals"][0].update(what)


def channel(number=2, **what):
    return lambda file: file["channels"][number].update(what)


def thermometer(file):
    file["signals"].append({"name": "T", "unit": "degC", "plc": 20, "type": "int16", "scale": 0.1, "min": 0, "max": 50})


def both(*changes):
    return lambda file: [one(file) for one in changes]


def growth(*, environment, of="T"):
    """EXX and a thermal term of the same channel, which is zero at 20 °C."""
    thermal = {"name": "error_X_um", "type": "linear", "inputs": [of], "weights": [1], "constant": -20}
    return {"terms": [*term("EXX")["terms"], thermal],
            "provenance": {"EXX": {"unit": "um", "environment": environment}}}


WAVE = (0, 10, -7, 8, 3, 0)
MISTAKES = {  # change of the machine file, fragments, what the one remark contains
    "an error of Z on the signal X": (None, [term("EZZ", "X")], "term EZZ: an error of axis Z works on the signal X"),
    "a straightness of another axis": (None, [term("EZY", "X")], "fit it with --signal Y, or name it EZX"),
    "a position's error on a thermometer": (
        thermometer, [term("EZX", "T", travel=(0, 50))],
        "term EZX: an error by the position of X works on T, whose unit is degC"),
    "an angle whose column was error_um": (
        None, [term("EZX"), provenance(term("EAX"), "EAX", unit="um")],
        "term EAX: its data are in µm, but EAX is an angle in µrad; name the column error_urad"),
    "a straightness whose column was error_urad": (
        None, [provenance(term("EZX"), "EZX", unit="urad")],
        "term EZX: its data are in µrad, but EZX is a displacement in µm"),
    "an angle in a sum": (channel(sum=["EAX"]), [term("EAX")], "channel Z: it sums EAX, an angle in µrad, as µm"),
    "an error of another direction": (
        channel(sum=["EYX"]), [term("EYX")], "channel Z: it sums EYX, an error in the direction Y"),
    "the file of another error": (
        None, [provenance(term("EZX"), "EZX", data="EYX.csv")],
        "term EZX: it was fitted to EYX.csv; fit it to the file of EZX, or name the term EYX"),
    "one file under two names": (
        None, [term("EZX", values=WAVE), term("EYX", values=WAVE)],
        "terms EZX and EYX: the same curve, number by number"),
    "an axis in inches": (signal(unit="inch"), [term("EZX")], "signal X: a linear axis with the unit inch"),
    "an axis in µm": (signal(unit="um"), [term("EZX")], "signal X: a linear axis with the unit um"),
    "a linear axis in degrees": (signal(unit="deg"), [term("EZX")], "signal X: a linear axis with the unit deg"),
    "a register that cannot hold the travel": (
        signal(type="int16"), [term("EZX")],
        "signal X: its register holds -3.2768 to 3.2767 mm, but its range is -10 to 1010; check its scale and type"),
    "a scale of µm for one of mm": (signal(scale=1e-7), [term("EZX")], "signal X: its register holds -214.748 to"),
    "an unsigned position": (
        both(signal(type="uint32", min=-510, max=510)), [term("EZX", travel=(-500, 500), values=(0, 0, 10, 0, 0))],
        "signal X: its register holds 0 to"),
    "a limit in mm": (channel(limit_um=0.3), [term("EZX", values=(0, 0.6, 0))], "limit_um 0.3 is less than"),
    "a limit in nm": (channel(limit_um=300000, error_um=400000), [term("EZX")],
                      "channel Z: limit_um 300000 is 300 mm"),
    "a limit below the demand": (channel(limit_um=8), [term("EZX")],
                                 "channel Z: the demand reaches 10.0 µm at X = 500, and the box ends at limit_um 8"),
    "errors in mm": (None, [term("EZX", values=(0, 0.02, 0.01, 0))],
                     "channel Z: the demand is 0.02 µm at most; check that the errors are in µm, not mm"),
    "a dead band above the demand": (channel(deadband_um=20), [term("EZX")], "deadband_um 20 is more than the whole"),
    "a register unit above the demand": (channel(scale=100), [term("EZX")],
                                         "one unit of its register is 100 µm, more than the whole demand"),
    "a slew rate in mm/s": (channel(slew_um_per_s=0.5), [term("EZX", values=(0, 100, 0))],
                            "at slew_um_per_s 0.5 its range of 100.0 µm takes 200 s; it is a rate in µm/s"),
    "positions in µm": (None, [term("EZX", travel=(0, 1e6), values=(0, 1000, 0))],
                        "EZX is a curve from 0 to 1e+06 mm, and X goes from -10 to 1010; check its positions"),
    "the curve of a longer axis": (None, [term("EZX", travel=(0, 3000), values=(0, 10, 0))],
                                   "check its positions, and that it is the curve of this axis"),
    "a term and a volumetric term that holds it": (
        channel(0, sum=["EXX", "vx"]),
        [{"terms": [*term("EXX")["terms"], {"name": "vol", "type": "volumetric", "chain": "fXYZ", "errors": ["EXX"],
                                            "outputs": ["vx", "vy", "vz"]}]}],
        "channel X: it sums EXX and vx, which holds EXX already; leave EXX out of sum"),
    "motors of a pair with opposite signs": (
        both(channel(0, sum=["a"]), channel(1, sum=["a"], sign=-1),
             lambda file: file.update(pairs=[{"channels": ["X", "Y"], "max_difference_um": 20}])), [term("a")],
        "pairs[0]: X has sign 1 and Y has sign -1, so one motor of the stage would move against the other"),
    "a pair that may differ by everything": (
        both(channel(0, sum=["a"]), channel(1, sum=["a"]),
             lambda file: file.update(pairs=[{"channels": ["X", "Y"], "max_difference_um": 20000}])), [term("a")],
        "pairs[0]: max_difference_um 20000 lets X and Y differ by a whole limit_um (300)"),
    "two motors without a pair": (
        both(channel(0, name="Y1", sum=["a"]), channel(1, name="Y2", sum=["a"])), [term("a")],
        "channels Y1 and Y2: no pair limits their difference; if they move one stage, add them to pairs"),
    "motors of a pair with curves of opposite signs": (
        both(channel(0, sum=["a"]), channel(1, sum=["b"]),
             lambda file: file.update(pairs=[{"channels": ["X", "Y"], "max_difference_um": 20}])),
        [term("a", values=(0, 40, 0)), term("b", values=(0, -40, 0))],
        "pairs[0]: the curves of X and Y differ by 80.0 µm at X = 500"),
    "motors of a pair with different limits": (
        both(channel(0, sum=["a"]), channel(1, sum=["a"], limit_um=30),
             lambda file: file.update(pairs=[{"channels": ["X", "Y"], "max_difference_um": 20}])), [term("a")],
        "pairs[0]: X has limit_um 300 and slew_um_per_s 500, but Y has 30 and 500"),
    "two axes in one register": (
        lambda file: file["signals"][1].update(plc=file["signals"][0]["plc"]), [term("EZX")],
        "signals X and Y: both are read from the register 8; give each axis its own"),
    "a tangent by another axis": (
        lambda file: (file["plc"]["write"].update(counters=True, start=99, count=40), file["channels"][2].update(
            tangent={"signal": "Y", "slope_plc": 120, "slope_type": "int32", "slope_scale": 1e-9,
                     "slope_limit": 0.001, "slope_slew_per_s": 0.01, "reference_plc": 122,
                     "reference_type": "int32", "reference_scale": 0.0001})), [term("EZX")],
        "channel Z: its tangent is by the position of Y"),
    "positions of a volumetric term in another order": (
        None, [{"terms": [*term("EXX")["terms"], {"name": "vol", "type": "volumetric", "chain": "fXYZ",
                                                  "errors": ["EXX"], "outputs": ["vx", "vy", "vz"],
                                                  "positions": ["X", "Z", "Y"]}]}],
        "volumetric term of vx: its position of Y is the signal Z; correct the order"),
    "a temperature that the instrument corrected": (
        thermometer, [growth(environment={"expansion_um_per_m_K": 11.7, "material_degC": [[23.1, 23.4]]})],
        "channel X: EXX was measured with the instrument's correction of the material's temperature (11.7 µm/m/K), "
        "and error_X_um corrects by temperature again"),
    "an expansion in the curve and in the model": (
        thermometer, [growth(environment={"expansion_um_per_m_K": 0, "material_degC": [[24.5, 24.6]]})],
        "channel X: EXX was measured at 24.5 degC without the instrument's correction"),
    "a thermometer's range that is a fault": (
        both(thermometer, channel(0, sum=["K"])),
        [{"terms": [{"name": "K", "type": "linear", "inputs": ["T"], "weights": [20], "constant": -400}]}],
        "channel X: the demand reaches 600.0 µm at T = 50, and beyond error_um 400 the box stops with a fault"),
}
REFUSED = {
    "errors in nm": (None, [term("EZX", values=(0, 10000, 0))], "the demand reaches 10000.0 µm at X = 500"),
    "a curve over kelvin": (both(thermometer, channel(0, sum=["K"])),
                            [term("K", "T", travel=(280, 320))],
                            "0.json: K is a curve from 280 to 320 degC, and T goes from 0 to 50; check the unit"),
    "a curve of the machine's other end": (None, [term("EZX", travel=(-1000, 0), values=(0, 100, 0))],
                                           "0.json: EZX is a curve from -1000 to 0 mm"),
    "the curve of a shorter axis": (None, [term("EZX", travel=(0, 600))], "EZX is a curve from 0 to 600 mm"),
    "positions in inches": (None, [term("EZX", travel=(0, 39.37))], "EZX is a curve from 0 to 39.37 mm"),
    "a slope that was kept": (None, [term("EZX", values=(0, 1500))], "the demand reaches 1500.0 µm at X = 1000"),
    "a dead travel between two files": (None, [term("EZX"), term("EZY", "Y", travel=(0, 0.9))], "1.json: EZY is a "),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_gets_one_remark(compbox, machine, case):
    what, terms, printed = MISTAKES[case]
    change(compbox, what or (lambda file: None))
    assert printed in only(built(compbox, *terms))


@pytest.mark.parametrize("case", REFUSED)
def test_a_mistake_is_refused(compbox, machine, case):
    what, terms, printed = REFUSED[case]
    change(compbox, what or (lambda file: None))
    assert printed in refused(compbox, *terms)
    assert printed.split(": ")[-1] in only(built(compbox, *terms, options=["--accept-range"]))


@pytest.mark.parametrize("environment", [{}, {"expansion_um_per_m_K": 0}, {"material_degC": [[24, 24]]},
                                         {"expansion_um_per_m_K": 0, "material_degC": [[20.3, 20.4]]}, 7])
def test_an_environment_that_proves_nothing_is_quiet(compbox, machine, environment):
    change(compbox, thermometer)
    assert built(compbox, growth(environment=environment)) == []


def test_every_refusal_counts(compbox, machine):
    printed = refused(compbox, term("EZX", travel=(0, 1)), term("EZY", "Y", travel=(0, 1)))
    assert printed.startswith("0.json: EZX is a curve") and printed.endswith(" (1 more like it)")
    assert len(built(compbox, *[term(f"EZ{axis}", axis, travel=(0, 1)) for axis in "XY"],
                     options=["--accept-range"])) == 2


@pytest.mark.parametrize("name", ["sinumerik-law", "dual-drive"])
def test_the_coefficient_files_of_the_examples_are_quiet(compbox, name):
    assert "Remark" not in compbox.good("check", ROOT / f"examples/{name}/coefficients.json")


def test_check_needs_no_second_reading_and_no_number_of_provenance(compbox, machine):
    """A pipe can be read once; the box skips provenance, whatever its numbers."""
    built(compbox, term("EZX"))
    change(compbox, lambda file: file.update(provenance={"huge": "1e999"}), "c.json")
    text = (compbox.folder / "c.json").read_text().replace('"1e999"', "1e999")
    compbox.write("c.json", text)
    pipe = compbox.folder / "pipe"
    os.mkfifo(pipe)
    if os.fork() == 0:
        pipe.write_text(text)
        os._exit(0)
    assert compbox.good("check", "pipe") == compbox.good("check", "c.json")
    os.wait()


# ---- files

def test_build_writes_over_nothing_that_it_reads(compbox, machine):
    compbox.write("t.json", term("EZX"))
    (compbox.folder / "linked.json").symlink_to("machine.json")
    os.link(compbox.folder / "t.json", compbox.folder / "hard.json")
    for output in ("machine.json", "./machine.json", compbox.folder / "machine.json", "linked.json", "t.json",
                   "hard.json"):
        assert compbox.refused("build", "machine.json", "t.json", "-o", output) == (
            f"{output}: was read by this very command: give what it writes another name")
    os.link(compbox.folder / "t.json", compbox.folder / "t.svg")
    assert compbox.refused("build", "machine.json", "t.json", "--plot", "t.svg", "-o", "c.json") == (
        "t.svg: was read by this very command: give the figure another name")
    assert compbox("build", "machine.json", "t.json", "--plot", "c.svg", "-o", "c.svg").returncode == 2


def test_plot_shows_the_demand_of_each_channel(compbox, machine):
    terms = [compbox.write(f"{name}.json", term(name, name[2])) for name in ("EZX", "EZY", "EXX")]
    compbox.good("build", "machine.json", *terms, "--plot", "d.svg", "-o", "c.json")
    text = (compbox.folder / "d.svg").read_text()
    for title in ("machine: demand of the compensation over the travel, revision 1", "channel Z over X",
                  "channel Z over Y", "channel X over X", "demand, µm", "X, mm", "limit_um 300", "error_um 400",
                  "all positions of the other axes", "at Y = 0"):
        assert title in text, title
    done = json.loads(compbox.good("build", "machine.json", *terms, "--plot", "figures", "--json", "-o", "c.json"))
    assert done["files"] == ["c.json", "figures/X.svg", "figures/Z.svg"]
    assert "channel X" not in (compbox.folder / "figures/Z.svg").read_text()


def test_no_figure_without_a_position(compbox, machine):
    change(compbox, both(thermometer, channel(0, sum=["K"])))
    compbox.write("t.json", {"terms": [{"name": "K", "type": "linear", "inputs": ["T"], "weights": [1]}]})
    assert compbox.refused("build", "machine.json", "t.json", "--plot", "d.svg", "-o", "c.json") == (
        "d.svg: no channel depends on a position; leave --plot out")
