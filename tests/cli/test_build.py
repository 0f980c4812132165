# SPDX-License-Identifier: MIT
"""compbox build and check: what is filled in, what is refused and in which words."""

import copy
import json

import pytest

from conftest import PLC, term


def build(compbox, *terms, machine="machine.json"):
    return ("build", machine, *terms, "-o", "c.json")


def test_sums_follow_iso_names(compbox, machine):
    for name, signal in (("EXY", "Y"), ("EXZ", "Z"), ("EZX", "X"), ("EAX", "X"), ("net", "X")):
        compbox.write(name, term(name, signal))
    out = compbox.good(*build(compbox, "EZX", "EXZ", "EXY", "EAX", "net"))
    assert out.splitlines() == [
        "channel X = -(EXZ + EXY)",
        "channel Y: no term acts in Y; left out",
        "channel Z = -(EZX)",
        "X from -10 to 1010 mm: curves EZX 0 to 1000",
        "Y from -10 to 1010 mm: curves EXY 0 to 1000",
        "Z from -10 to 1010 mm: curves EXZ 0 to 1000",
        "channel X: demand -20.0 to 0.0 µm over the travel of Y, Z (limit_um 300, error_um 400)",
        "channel Z: demand -10.0 to 0.0 µm over the travel of X (limit_um 300, error_um 400)",
        "revision 1: 3 signals, 5 terms, 2 channels, coefficients 35 of 8192",
        *(f"Remark: term {name}: no channel sums it, so the box does not correct it; write it into sum of its channel "
          "in the machine file, or leave it out" for name in ("EAX", "net")),
    ]
    assert compbox.good("check", "c.json").splitlines()[0] == (
        "machine, revision 1: 3 signals, 5 terms, 2 channels, coefficients 35 of 8192")


@pytest.mark.parametrize("automatic", [None, [], "auto", "missing"])
def test_an_open_sum_may_be_written_in_several_ways(compbox, machine, automatic):
    for channel in machine["channels"]:
        channel["sum"] = automatic
        if automatic == "missing":
            del channel["sum"]
    compbox.write("machine.json", machine)
    compbox.write("t", term("EYX"))
    compbox.good(*build(compbox, "t"))
    assert [(c["name"], c["sum"]) for c in compbox.read("c.json")["channels"]] == [("Y", ["EYX"])]


def test_an_explicit_sum_stays(compbox, machine):
    machine["channels"] = [{**machine["channels"][2], "name": "lift", "sum": ["b", "a"]}]
    compbox.write("machine.json", machine)
    compbox.write("t", {"terms": term("a")["terms"] + term("b")["terms"]})
    compbox.good(*build(compbox, "t"))
    assert compbox.read("c.json")["channels"][0]["sum"] == ["b", "a"]


def test_ranges_come_from_the_curves(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    compbox.write("a", term("EZX", travel=(-190, 790)))
    spline = {"name": "EYX", "type": "bspline", "signal": "X", "degree": 1,
              "knots": [-300, -200, 100, 800, 900], "control_points": [0, 1, 2]}
    compbox.write("b", {"terms": [spline]})
    polynomial = {"name": "EXZ", "type": "polynomial", "signal": "Z", "coefficients": [1, 2],
                  "center": 50, "half_range": 50, "from": 0, "to": 100}
    compbox.write("c", {"terms": [polynomial]})
    out = compbox.good(*build(compbox, "a", "b", "c"))
    assert out.splitlines()[:3] == ["signal X: plausible from -300 to 900",
                                    "signal Y: used by no term; left out",
                                    "signal Z: plausible from -10 to 110"]


def test_a_fragment_for_another_machine(compbox):
    """Without a range nothing is known of the signals, but that is not what is wrong."""
    compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "-o", "machine.json")
    compbox.write("t", term("EZW", "W"))
    assert compbox.refused(*build(compbox, "t")) == (
        "t: the term EZW works on the signal W, which no file has; add it to the signals of "
        "machine.json, or make the term on one that is there (X)")


def test_a_volumetric_term_keeps_the_axes_that_it_takes_without_naming_them(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    vol = {"name": "vol", "type": "volumetric", "chain": "fXYZ", "errors": [],
           "outputs": ["a", "b", "c"]}
    compbox.write("t", {"terms": [vol]})
    assert compbox.refused(*build(compbox, "t")) == (
        "machine.json: signal X: set min and max (no curve gives its range)")


def test_a_range_that_nothing_tells(compbox):
    compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "-o", "machine.json")
    compbox.write("t", {"terms": [{"name": "EXX", "type": "polynomial", "signal": "X",
                                   "coefficients": [1]}]})
    assert compbox.refused(*build(compbox, "t")) == (
        "machine.json: signal X: set min and max (no curve gives its range)")


def test_no_channel_has_a_term(compbox, machine):
    compbox.write("t", term("lift"))
    assert compbox.refused(*build(compbox, "t")) == (
        "machine.json: no term acts in any channel; write the channels' sums, or name the terms as "
        "ISO 230-1 does (EZX: towards Z, by X)")


def test_a_pair_whose_curves_ask_for_more_than_it_allows(compbox, machine):
    machine["channels"] = machine["channels"][:2]
    for channel, own in zip(machine["channels"], ("own_x", "own_y")):
        channel["sum"] = [own, "common"]
    machine["pairs"] = [{"channels": ["X", "Y"], "max_difference_um": 40}]
    compbox.write("machine.json", machine)
    for name, values in (("own_x", (0, 50, 0)), ("own_y", (0, -4, 0))):
        compbox.write(name, term(name, "X", values))
    compbox.write("common", term("common", "Z", (0, 300)))
    printed = "pairs[0]: the curves of X and Y differ by 54.0 µm at X = 500, and max_difference_um is 40: "
    assert printed in compbox.good(*build(compbox, "own_x", "own_y", "common"))
    machine["pairs"][0]["max_difference_um"] = 55
    compbox.write("machine.json", machine)
    assert "pairs[0]" not in compbox.good(*build(compbox, "own_x", "own_y", "common"))


def test_provenance_and_revision_are_kept(compbox, machine):
    machine["provenance"] = {"ordered by": "plant 2"}
    machine["revision"] = 41
    compbox.write("machine.json", machine)
    compbox.write("t", {**term(), "provenance": {"EZX": {"file": "EZX.csv"}}})
    compbox.good(*build(compbox, "t"))
    built = compbox.read("c.json")
    assert built["provenance"] == {"ordered by": "plant 2", "EZX": {"file": "EZX.csv"}}
    assert built["revision"] == 41
    compbox.good(*build(compbox, "t"), "--revision", 42)
    assert compbox.read("c.json")["revision"] == 42


def test_terms_can_be_added_to_a_built_file(compbox, machine):
    compbox.write("a", term("EZX"))
    compbox.write("b", term("EZY", "Y"))
    compbox.good(*build(compbox, "a"))
    compbox.good("build", "c.json", "b", "-o", "d.json")
    assert [t["name"] for t in compbox.read("d.json")["terms"]] == ["EZX", "EZY"]
    assert compbox.read("d.json")["channels"][0]["sum"] == ["EZX"]  # written, so it stays


SPLINE = {"name": "EZX", "type": "bspline", "signal": "X", "degree": 1,
          "knots": [0, 0, 500, 1000, 1000], "control_points": [0, 10, 0]}

REFUSED = {  # terms.json: message
    "missing": (None, "t: cannot open the file (No such file or directory)"),
    "not JSON": ("{\"terms\": [", "t:1:11: is not valid JSON here"),
    "empty": ("", "t:1:1: is not valid JSON here"),
    "a list": ("[]", "t: must be a JSON object"),
    "duplicate key": ('{"terms": [], "terms": []}',
                      "t: the key 'terms' is given twice in one object"),
    "unknown key": ({"terms": [], "channels": []}, "t: a term file: the key 'channels' is unknown"),
    "no terms": ({"signals": []}, "t: has no terms"),
    "terms no list": ({"terms": {}}, "t: terms must be an array"),
    "term no object": ({"terms": [1]}, "t: terms[0] must be an object"),
    "no name": ({"terms": [{"type": "polyline"}]}, "t: terms[0]: name is missing or not a text"),
    "number too large": ('{"terms": [{"name": "a", "values": [1e400]}]}',
                         "t: holds a number or text that cannot be read"),
    "NaN": ('{"terms": [{"name": "a", "values": [NaN]}]}', "t:1:37: is not valid JSON here"),
    "same name twice": ({"terms": term()["terms"] * 2},
                        "t: the term EZX is already in this file; give one of them another name "
                        "or leave one out"),
    "knots out of order": ({"terms": [{**SPLINE, "knots": [0, 0, 1100, 1000, 1000]}]},
                           "t: terms[0].knots[3]: 1000 is below the knot before it (1100) "
                           "(EZX)"),
    "unknown signal": (term(signal="Q"),
                       "t: the term EZX works on the signal Q, which no file has; add it to the "
                       "signals of machine.json, or make the term on one that is there (X, Y, Z)"),
    "unknown input": ({"terms": [{"name": "T", "type": "linear", "inputs": ["X", "T9"],
                                  "weights": [1, 1]}]},
                      "t: the term T works on the signal T9, which no file has; add it to the "
                      "signals of machine.json, or make the term on one that is there (X, Y, Z)"),
    "unknown lag": ({**term(), "signals": [{"name": "slow", "unit": "degC", "lag_of": "T9",
                                            "tau_s": 60}]},
                    't: signals[0].lag_of: no signal is called "T9" (slow)'),
    "signal clash": ({**term(), "signals": [{"name": "X"}]},
                     "t: the signal X is already in machine.json; give one of them another name "
                     "or leave one out"),
    "provenance clash": ({**term(), "provenance": {"site": 2}},
                         "t: provenance.site differs from another file's"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_fragments(compbox, machine, case):
    content, message = REFUSED[case]
    machine["provenance"] = {"site": 1}
    compbox.write("machine.json", machine)
    if content is not None:
        compbox.write("t", content)
    assert compbox.refused(*build(compbox, "t")) == message


def test_a_name_in_two_files_names_both(compbox, machine):
    compbox.write("a", term("EZX"))
    compbox.write("b", term("EZX"))
    assert compbox.refused(*build(compbox, "a", "b")) == (
        "b: the term EZX is already in a; give one of them another name or leave one out")
    assert compbox.refused(*build(compbox, "a", "a")) == "a: is given more than once"


def test_two_fragments_share_a_lag_that_is_the_same(compbox, machine):
    """Two networks trained with the same --lags."""
    machine["signals"].append({"name": "T", "unit": "degC", "plc": 20, "min": 0, "max": 90})
    compbox.write("machine.json", machine)
    lag = {"name": "T_lag60", "unit": "degC", "lag_of": "T", "tau_s": 60}
    other = {"name": "T_lag9", "unit": "degC", "lag_of": "T", "tau_s": 9}

    def fragment(name, *signals):
        compbox.write(name, {"signals": list(signals), "terms": [
            {"name": name, "type": "linear", "inputs": [one["name"] for one in signals],
             "weights": [1] * len(signals)}]})
    fragment("EXX", lag, other)
    fragment("EYY", dict(lag, tau_s=60.0))
    compbox.good(*build(compbox, "EXX", "EYY"))
    assert [one["name"] for one in compbox.read("c.json")["signals"]][3:] == ["T", "T_lag60", "T_lag9"]
    fragment("EYY", other, dict(lag, tau_s=61))
    assert compbox.refused(*build(compbox, "EXX", "EYY")) == (
        "EYY: the signal T_lag60 is already in EXX; give one of them another name or leave one out")
    fragment("EYY", lag, lag)
    assert "is already in this file" in compbox.refused(*build(compbox, "EYY"))


def test_outputs_are_names_too(compbox, machine):
    compbox.write("a", term("vol_x"))
    compbox.write("b", {"terms": [{"name": "vol", "type": "bpnet", "outputs": ["vol_x"]}]})
    assert compbox.refused(*build(compbox, "a", "b")).startswith("b: the term vol_x is already in a")


def test_bad_machine_files(compbox, machine):
    compbox.write("t", term())
    compbox.write("machine.json", term())
    assert compbox.refused(*build(compbox, "t")) == (
        "machine.json: is not a machine file (format is missing; see compbox init)")
    compbox.write("machine.json", "[1]")
    assert compbox.refused(*build(compbox, "t")) == "machine.json: must be a JSON object"
    compbox.write("machine.json", {**machine, "colour": "red"})
    assert compbox.refused(*build(compbox, "t")) == "machine.json: colour: unknown key"
    wrong = copy.deepcopy(machine)
    wrong["channels"][2]["sum"] = ["EZX", "EZY"]
    compbox.write("machine.json", wrong)
    assert compbox.refused(*build(compbox, "t")) == (
        'machine.json: channels[0].sum[1]: no term has an output "EZY"')


def test_an_old_file_survives_a_refusal(compbox, machine):
    compbox.write("t", term())
    compbox.good(*build(compbox, "t"))
    compbox.write("t", term(signal="Q"))
    compbox.refused(*build(compbox, "t"))  # compares every file before and after


def test_too_many_coefficients(compbox, machine):
    for i in range(3):
        compbox.write(f"t{i}", term(f"EZ{'XYZ'[i]}", values=[k % 7 for k in range(1000)]))
    compbox.good(*build(compbox, "t0", "t1"))
    message = compbox.refused(*build(compbox, "t0", "t1", "t2"))
    assert message.startswith("t2: terms[0]: ") and message.endswith("(EZZ)")


# What the box's own loader says, word for word, is tested at the loader; here: file and exit code.
@pytest.mark.parametrize("content, message", [
    (None, "c.json: cannot open the file (No such file or directory)"),
    ("", "c.json: the file is empty"),
    ("{", "c.json: "),
    ("\x00" * 100, "c.json: "),
    ("x" * 200000, "c.json: the file has 200000 bytes, more than the 131040 that the box holds"),
], ids=["missing", "empty", "cut short", "zeros", "too large"])
def test_check_refuses(compbox, content, message):
    if content is not None:
        compbox.write("c.json", content)
    assert compbox.refused("check", "c.json").startswith(message)


def test_check_names_line_and_column(compbox, machine):
    compbox.write("t", term())
    compbox.good(*build(compbox, "t"))
    text = (compbox.folder / "c.json").read_text().replace('"period_ms": 30', '"period_ms": 0')
    compbox.write("c.json", text)
    line = text[:text.index('"period_ms": 0')].count("\n") + 1
    message = compbox.refused("check", "c.json")
    assert message.startswith("c.json: cycle.period_ms: ")
    assert f", line {line}, column " in message


@pytest.mark.parametrize("arguments", [[], ["nonsense"], ["build"], ["build", "m"], ["check"],
                                       ["eval"], ["simulate"], ["check", "a", "b"],
                                       ["build", "m", "t", "--revision", "-1", "-o", "c"],
                                       ["build", "m", "t", "--revision", "0x10", "-o", "c"]])
def test_wrong_usage(compbox, arguments):
    assert compbox(*arguments).returncode == 2


@pytest.mark.parametrize("command", ["init", "fit", "build", "check", "eval", "simulate"])
def test_help_has_an_example(compbox, command):
    assert f"compbox {command} " in compbox.good(command, "--help").split("Example:")[1]


def checked(compbox, profile, **plc):
    """What check says of a machine with three channels."""
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", profile, "--travel", "X=500,Y=500,Z=500", "-o",
                 "machine.json")
    machine = compbox.read("machine.json")
    machine["plc"].update(plc)
    compbox.write("machine.json", machine)
    for number, axis in enumerate("XYZ"):
        compbox.write(f"{number}.json", term("E" + axis + "X", travel=(0, 500)))
    compbox.good(*build(compbox, "0.json", "1.json", "2.json"))
    return json.loads(compbox.good("check", "c.json", "--json"))["plc"], compbox.good("check", "c.json")


def test_check_says_how_often_a_fanuc_control_is_updated(compbox):
    figures, text = checked(compbox, "fanuc")
    assert figures["functions"] == [3, 16, 23]
    assert (figures["handshake_ms"], figures["update_ms"]) == (32, 96)
    assert figures["least_lead_ms"] == 15 + 64
    assert figures["channels"]["X"] == {
        "limit_units": 3000, "slew_um_per_s": 500, "step_um_per_period": 15, "step_um_per_update": 48,
        "most_units": 9999, "largest_step_um": 999.8, "slew_most_um_per_s": 999.7}
    assert text.splitlines()[1:] == [
        "fanuc: function codes 3, 16, 23; fc3+fc16 reads 32 of at most 125 registers and writes 10 of 121",
        "the NC takes one value after the other, about 32 ms each: an axis is updated every 96 ms",
        *[f"channel {axis}: ±3000 units of ±9999, at most 500 µm/s: 15 µm in a period, 48 µm in an update "
          "(the NC takes 999.8 µm at once; a slew above 999.7 µm/s is lowered)" for axis in "XYZ"],
        "lead: at least 79 ms and the exchange; the file has 0 ms",
        "X from -10 to 510 mm: curves EXX 0 to 500, EYX 0 to 500, EZX 0 to 500",
        *[f"channel {axis}: demand -10.0 to 0.0 µm over the travel of X (limit_um 300, error_um 400)"
          for axis in "XYZ"]]
    figures, text = checked(compbox, "fanuc", axes_at_once=True)
    assert (figures["update_ms"], figures["least_lead_ms"]) == (32, 47)
    assert "the NC takes all values in one handshake, about 32 ms each: " in text


@pytest.mark.parametrize("applied, limit_um, remark", [(True, 999, False), (False, 499.9, False), (False, 500, True)])
def test_check_says_where_a_fanuc_control_has_to_take_values_in_time(compbox, applied, limit_um, remark):
    checked(compbox, "fanuc")
    file = compbox.read("c.json")
    file["channels"][1].update(limit_um=limit_um, error_um=1000)
    if not applied:
        del file["channels"][1]["applied"]
    compbox.write("c.json", file)
    printed = ("channel Y: that the NC never sees a change above 999.8 µm at once holds only while it takes a value "
            "every 1 s; give the channel an applied register, or a limit_um of 499.9 at most")
    reported = json.loads(compbox.good("check", "c.json", "--json"))
    assert reported.get("remarks", []) == ([printed] if remark else [])
    assert ("Remark: " + printed in compbox.good("check", "c.json").splitlines()) == remark


def test_check_says_what_an_840d_allows(compbox):
    figures, text = checked(compbox, "sinumerik-840d")
    assert figures["functions"] == [1, 2, 3, 4, 5, 6, 15, 16] and figures["clients"] == 1
    assert figures["deadband_um"] == 0.1 and "handshake_ms" not in figures
    assert text.splitlines()[1].endswith("; one client at a time")
    assert text.splitlines()[2] == (
        "channel X: ±30000 units, at most 500 µm/s: 15 µm in a period, 15 µm in an update")


@pytest.mark.parametrize("command, sentence", [
    (("build", "machine.json", "readings.csv", "-o", "c.json"), "readings.csv:1:1: is not valid JSON here; compbox fit "
     "makes such a file of a measurement"),
    (("check", "readings.csv"), "readings.csv: is not a coefficient file; compbox fit makes such a file of a "
     "measurement"),
    (("check", "EZX"), "EZX: the key format is missing (of a term file, make a coefficient file with compbox build)"),
])
def test_a_file_of_another_kind_gets_the_command_that_is_missing(compbox, machine, command, sentence):
    (compbox.folder / "readings.csv").write_text("Nominal (in),Error (thou)\n0,1\n")
    compbox.write("EZX", term("EZX"))
    assert compbox.refused(*command).startswith(sentence)
    assert not (compbox.folder / "c.json").exists()


def adapted(name="X_adapted", of="EXX", **more):
    return {"terms": [{"name": name, "type": "adapt", "of": of, "probe": {"value": "probe_x", "count": "probe_x_n"},
                       "bias_max_um": 30, "gain_max": 0.5, "step_max_um": 5, "drift_um_per_sqrt_h": 6,
                       "gain_drift_per_sqrt_h": 0.5, "sigma_um": 1.5, **more}]}


def probed_machine(compbox):
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", "generic", "--travel", "X=1000,Z=1000", "--probe", "X",
                 "-o", "machine.json")
    compbox.write("EXX.json", term("EXX", "X", values=(0, 14, 0)))


def test_a_term_that_adapts_stands_for_its_model(compbox):
    probed_machine(compbox)
    compbox.write("adapt.json", adapted())
    out = compbox.good(*build(compbox, "EXX.json", "adapt.json"))
    assert "channel X = -(X_adapted)" in out
    assert "no channel sums it" not in out
    # |y - m| <= bias_max + gain_max |m|
    assert ("channel X: demand -14.0 to 0.0 µm over the travel of X (limit_um 300, error_um 400); probes may move it "
            "by up to 37.0 µm more") in out
    built = compbox.read("c.json")
    assert [s["name"] for s in built["signals"]] == ["X", "Z", "probe_x", "probe_x_n"]
    assert built["plc"]["request"] == compbox.read("machine.json")["plc"]["request"]
    compbox.good("check", "c.json")
    figures = json.loads(compbox.good(*build(compbox, "EXX.json", "adapt.json"), "--json"))["demand"]["X"]
    assert figures["adapted_um"] == 37


def test_what_probes_may_add_is_compared_with_the_limit(compbox):
    probed_machine(compbox)
    compbox.write("adapt.json", adapted(bias_max_um=290))
    assert ("Remark: channel X: probes may move its demand of 14.0 µm by up to 297.0 µm more, and the box ends at "
            "limit_um 300; raise it, or lower bias_max_um and gain_max") in compbox.good(
                *build(compbox, "EXX.json", "adapt.json"))


def test_a_probe_without_its_signals_is_refused(compbox):
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", "generic", "--travel", "X=1000,Z=1000",
                 "-o", "machine.json")
    compbox.write("EXX.json", term("EXX", "X"))
    compbox.write("adapt.json", adapted())
    assert "probe_x" in compbox.refused(*build(compbox, "EXX.json", "adapt.json"))
