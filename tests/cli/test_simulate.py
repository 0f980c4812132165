# SPDX-License-Identifier: MIT
"""compbox simulate on a short gantry: report, determinism, and that no truth reaches the fit."""

import json
import re
import shutil

import pytest

from conftest import GANTRY, ROOT

SHORT_PATH = {"name": "diagonal", "from_mm": {"X": 0, "Y": 0, "Z": 0},
              "to_mm": {"X": 14300, "Y": 3000, "Z": 2500}, "along": "X", "every_mm": 1000}


@pytest.fixture
def gantry(compbox):
    """The example's files and a scenario with one path of few stops, in the test's folder."""
    for name in ("machine.json", "machine_twin.json"):
        shutil.copy(GANTRY / name, compbox.folder / name)
    shutil.copytree(GANTRY / "measurements", compbox.folder / "measurements")
    scenario = json.loads((GANTRY / "scenario.json").read_text())
    scenario["paths"] = [SHORT_PATH]
    del scenario["seeds"]  # one machine, the twin file's own
    scenario["moving_mm_per_min"] = [10000]
    compbox.write("scenario.json", scenario)
    return scenario


def simulate(compbox, *options, folder="out"):
    compbox.good("simulate", "scenario.json", *options, "-o", folder)
    return json.loads((compbox.folder / folder / "report.json").read_text())


def one_run(report, **wanted):
    return next(run for run in report["runs"] if all(run[k] == v for k, v in wanted.items()))


def faults(value, schema, root, place="report"):
    """Where a value is not as a JSON Schema says; the keywords of docs/report.schema.json."""
    if "$ref" in schema:
        schema = root["$defs"][schema["$ref"].split("/")[-1]]
    kinds = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float)}
    unknown = set(schema) - {"$schema", "$id", "$defs", "title", "description", "type", "required",
                             "additionalProperties", "properties", "items", "minItems", "const",
                             "minimum", "maximum", "exclusiveMinimum"}
    assert not unknown, f"teach this function {unknown}"
    if "const" in schema and value != schema["const"]:
        return [f"{place} is not {schema['const']}"]
    if "type" in schema and not isinstance(value, kinds[schema["type"]]):
        return [f"{place} is no {schema['type']}"]
    found = []
    if isinstance(value, dict):
        found += [f"{place} lacks {key}" for key in schema.get("required", []) if key not in value]
        for key, item in value.items():
            one = schema.get("properties", {}).get(key, schema.get("additionalProperties", {}))
            found += [f"{place} has {key}"] if one is False else faults(item, one, root, f"{place}.{key}")
    if isinstance(value, list):
        found += [f"{place} is short"] if len(value) < schema.get("minItems", 0) else []
        for i, item in enumerate(value):
            found += faults(item, schema.get("items", {}), root, f"{place}[{i}]")
    if isinstance(value, (int, float)):
        if not schema.get("minimum", value) <= value <= schema.get("maximum", value):
            found.append(f"{place} is out of range")
        if value <= schema.get("exclusiveMinimum", value - 1):
            found.append(f"{place} is out of range")
    return found


def test_report_is_as_its_schema_says(compbox, gantry):
    schema = json.loads((ROOT / "docs/report.schema.json").read_text())
    report = simulate(compbox)
    assert faults(report, schema, schema) == []
    assert faults({**report, "colour": 1}, schema, schema) == ["report has colour"]
    report["runs"][3]["Y"]["after_um"] = -1
    report["reduction_percent"]["Z"] = "much"
    assert faults(report, schema, schema) == ["report.reduction_percent.Z is no number",
                                              "report.runs[3].Y.after_um is out of range"]


def test_report(compbox, gantry):
    report = simulate(compbox)
    assert report["format"] == "compbox-report/1"
    assert report["seeds"] == [2015] and report["method"] == "bspline"
    assert list(report["baselines"]) == ["bspline-lmc", "bspline-S1-tolerance", "bspline-lmc-1um", "bspline-1um",
                                          "polynomial", "polyline"]
    assert report["baselines"]["bspline-S1-tolerance"] == report["reduction_percent"]
    assert report["paper_percent"] == {"X": 91.2, "Y": 91.2, "Z": 95.1}
    run = one_run(report, method="bspline")
    assert run["stops"] == 16 and set(run["coefficient_count"]) == set(gantry["curves"])
    for axis in "XYZ":
        figures = run[axis]
        percent = 100 * (1 - figures["after_um"] / figures["before_um"])
        assert figures["reduction_percent"] == pytest.approx(percent, abs=1e-2)
        assert report["reduction_percent"][axis] == figures["reduction_percent"]
        assert report["reduction_percent"][axis] > 90
        assert report["reduction_percent"][axis] > report["baselines"]["polynomial"][axis]
        assert 90 < report["noise_ceiling_percent"][axis] < 100
    assert "cycles" not in report and "in_motion" not in report


def test_median_and_worst_of_several_machines(compbox, gantry):
    gantry["methods"] = gantry["methods"][:1]
    compbox.write("scenario.json", gantry)
    report = simulate(compbox, "--seeds", "3-5")
    assert report["seeds"] == [3, 4, 5]
    for axis in "XYZ":
        values = sorted(run[axis]["reduction_percent"] for run in report["runs"])
        assert report["reduction_percent"][axis] == pytest.approx(values[1])
        assert report["reduction_percent_worst"][axis] == pytest.approx(values[0])
    assert "reduction_percent_interval" not in report, "three machines bound no median"


def test_the_same_again(compbox, gantry):
    gantry["methods"] = gantry["methods"][:1]
    compbox.write("scenario.json", gantry)
    first, second = simulate(compbox, folder="a"), simulate(compbox, folder="b")
    text = json.dumps(first).replace("a/seed", "b/seed")
    assert json.loads(text) == second


def test_no_truth_reaches_the_fit(compbox, gantry):
    """The machine is exchanged behind the measurements: the coefficients stay, bit for bit, and
    are worth nothing on the other machine."""
    gantry["methods"] = gantry["methods"][:1]
    compbox.write("scenario.json", gantry)
    right = simulate(compbox, folder="right")
    twin = compbox.read("machine_twin.json")
    compbox.write("machine_twin.json", {**twin, "seed": 7})
    wrong = simulate(compbox, folder="wrong")
    files = [compbox.folder / folder / f"seed-{seed}/bspline/coefficients.json"
             for folder, seed in (("right", 2015), ("wrong", 7))]
    assert files[0].read_bytes() == files[1].read_bytes()
    for axis in "XYZ":
        assert right["reduction_percent"][axis] > 90
        assert wrong["reduction_percent"][axis] < 50


def test_coefficients_are_those_of_fit_and_build(compbox, gantry):
    simulate(compbox)
    for name in gantry["curves"]:
        compbox.good("fit", f"measurements/{name}.csv", "--name", name, "--signal", name[2], "--line",
                     "least-squares", "-o", f"{name}.json")
    compbox.good("build", "machine.json", *[f"{name}.json" for name in gantry["curves"]], "-o", "c.json")
    own = json.loads((compbox.folder / "out/seed-2015/bspline/coefficients.json").read_text())
    by_hand = compbox.read("c.json")
    for one in (own, by_hand):
        del one["provenance"]  # names the files
    assert own == by_hand


def test_a_wrong_sign_makes_the_machine_worse(compbox, gantry):
    gantry["methods"] = gantry["methods"][:1]
    compbox.write("scenario.json", gantry)
    machine = compbox.read("machine.json")
    machine["channels"][2]["sign"] = -1
    compbox.write("machine.json", machine)
    report = simulate(compbox)
    assert report["reduction_percent"]["Z"] == pytest.approx(-100, abs=3)
    assert report["reduction_percent"]["X"] > 90


def test_statistics_and_log_go_into_the_report(compbox, gantry):
    gantry["methods"] = gantry["methods"][:1]
    compbox.write("scenario.json", gantry)
    spread = {"count": 3, "min": 1.0, "mean": 2.0, "p50": 2.0, "p99": 3.0, "max": 3.0}
    history = [(0, "STANDBY", "not yet"), (1, "ACTIVE", "all is well"), (5, "HOLD", "lost"),
               (6, "ACTIVE", "all is well"), (7, "RAMP", "a stop was requested"),
               (8, "STOPPED", "a stop was requested")]
    compbox.write("stats.json", {"cycles": 800, "overruns": 1, "period_us": 30000,
                                 "jitter_us": spread, "exchange_us": spread, "secret": 1,
                                 "history": [dict(zip(("time_s", "mode", "reason"), entry))
                                             for entry in history]})
    header = ("time_s,X_mm,Y_mm,displacement_X_um,error_before_X_um,error_after_X_um,control,status,"
              "event\n")
    rows = [f"{i},{10 * min(i, 4)},0,0,{(0, 8, 0, 8, 0, 0)[i]},{(0, 2, 0, 2, 0, 0)[i]},11,1,\n"
            for i in range(6)]
    compbox.write("plc.csv", header + "".join(rows))
    out = compbox.good("simulate", "scenario.json", "--stats", "stats.json", "--log", "plc.csv",
                       "--plots", "-o", "out")
    report = json.loads((compbox.folder / "out/report.json").read_text())
    assert (report["cycles"], report["overruns"], report["period_us"]) == (800, 1, 30000)
    assert report["jitter_us"] == spread == report["exchange_us"]
    assert "secret" not in report
    schema = json.loads((ROOT / "docs/report.schema.json").read_text())
    assert faults(report, schema, schema) == []
    assert report["in_motion"]["duration_s"] == 4
    assert report["in_motion"]["feed_mm_per_min"] == 600
    # 8, 0, 8, 0 about its line 7.6 - 1.6 i: 8 - 1.6 is the most, at the ends of the stretch
    assert report["in_motion"]["before_um"]["X"] == pytest.approx(4 * report["in_motion"]["after_um"]["X"])
    assert "800 cycles of 30.0 ms, 1 overrun\n" in out
    assert "at 5.0 s HOLD: lost\n" in out and "stop was requested" not in out
    plots = compbox.folder / "out/plots"
    for name in ("diagonal.svg", "compensation-over-time.svg"):
        assert (plots / name).read_text().startswith("<?xml") and "</svg>" in (plots / name).read_text()


def test_the_figures_of_curves_and_key_points(compbox, gantry):
    """S1's figures 2 and 3: the curves of an axis, the residual over the number of key points."""
    compbox.good("simulate", "scenario.json", "--plots", "-o", "out")
    plots = {path.name: path.read_text() for path in (compbox.folder / "out/plots").glob("*.svg")}
    for axis in {curve[-1] for curve in gantry["curves"]}:
        for curve in gantry["curves"]:
            assert (f">{curve}<" in plots[f"curves-{axis}.svg"]) == (curve[-1] == axis)
    assert ("key-points.svg" in plots) == any("lmc" in method["name"] for method in gantry["methods"])


REFUSED = [
    ({"format": "x"}, "scenario.json: is not a scenario (format is not compbox-scenario/1)"),
    ({"colour": 1}, "scenario.json: the scenario: the key 'colour' is unknown"),
    ({"kind": "magic"}, "scenario.json: kind: there is no 'magic' (there are "),
    ({"directions": "XQ"}, "scenario.json: directions: letters of XYZ"),
    ({"moving_mm_per_min": [0]}, "scenario.json: moving_mm_per_min must be from 0.001 to 10000000"),
    ({"exchange_ms": {"read": -1}}, "scenario.json: exchange_ms: must be 0 to 1000"),
    ({"steps": ["fly $out"]}, "scenario.json: step 'fly $out': "),
    ({"steps": ["fit $there/EZX.csv"]}, "scenario.json: steps: there is no '$there'"),
    ({"steps": ["measure laser"]}, "scenario.json: step 'measure laser': -o is missing"),
    ({"steps": ["simulate scenario.json"]},
     "scenario.json: step 'simulate scenario.json': 'simulate' is not a step: a "
     "step is measure or a command that computes, such as fit or build"),
    ({"methods": [{"name": "a", "steps": ["measure laser -o $out"], "degree": 3}]},
     "scenario.json: methods[]: a has steps and a recipe"),
    ({"paths": [{**SHORT_PATH, "figure": "beauty"}]},
     "scenario.json: paths[].figure must be straightness, range or axis"),
    ({"twin": "no.json"}, "no.json: cannot open the file (No such file or directory)"),
    ({"machine": "no.json"}, "no.json: cannot open the file (No such file or directory)"),
    ({"measurements": "no"}, "no/EXY.csv: cannot open the file (No such file or directory)"),
    ({"curves": ["EZX", "bump"]}, "scenario.json: 'bump' is not an ISO 230-1 name such as EZX"),
    ({"curves": []}, "scenario.json: needs at least one curve, method and path, and feed_mm_per_min > 0"),
    ({"feed_mm_per_min": 0},
     "scenario.json: needs at least one curve, method and path, and feed_mm_per_min > 0"),
    ({"methods": [{"name": "magic"}]}, "scenario.json: there is no method or line 'magic' "
     "(there are bspline, bspline-lmc, polynomial, polyline)"),
    ({"paths": [{**SHORT_PATH, "along": "Q"}]}, "scenario.json: paths[].along must be X, Y or Z"),
    ({"paths": [{**SHORT_PATH, "every_mm": 0}]},
     "scenario.json: the path diagonal needs every_mm > 0 and a travel along X"),
    ({"paths": [{**SHORT_PATH, "to_mm": {"X": 0}}]},
     "scenario.json: the path diagonal needs every_mm > 0 and a travel along X"),
]


@pytest.mark.parametrize("change, message", REFUSED)
def test_bad_scenarios(compbox, gantry, change, message):
    compbox.write("scenario.json", {**gantry, **change})
    printed = compbox.refused("simulate", "scenario.json", "-o", "out")
    assert printed == message or message.endswith((" ", ": ")) and printed.startswith(message)
    assert not (compbox.folder / "out/report.json").exists()


def test_a_target_outside_the_travel(compbox, gantry):
    path = {**SHORT_PATH, "to_mm": {"X": 15000, "Y": 3000, "Z": 2500}}
    compbox.write("scenario.json", {**gantry, "paths": [path]})
    assert "15000" in compbox.refused("simulate", "scenario.json", "-o", "out")


def test_a_box_that_may_not_start(compbox, gantry):
    """The positions' registers are not those of the twin's PLC program: signals stay implausible."""
    machine = compbox.read("machine.json")
    machine["signals"][0].update(min=20000, max=30000)
    compbox.write("machine.json", machine)
    assert re.match(r"scenario\.json: seed \d+, method [\w-]+, path \w+: out/\S+/coefficients\.json: "
                    r"the box does not become ACTIVE \(it is in STANDBY: ",
                    compbox.refused("simulate", "scenario.json", "-o", "out"))


def test_an_exchange_that_does_not_fit_into_a_cycle(compbox, gantry):
    """24 of the 30 ms are there for it, as in compboxd."""
    compbox.write("scenario.json", {**gantry, "exchange_ms": {"read": 13, "write": 12}})
    assert compbox.refused("simulate", "scenario.json", "-o", "out").endswith(
        "the box does not become ACTIVE (it is in STANDBY: the PLC answers readings but confirms no write)")


@pytest.mark.parametrize("options", [["--seeds", "x"], ["--seeds", "5-3"], ["--seeds", "1-2-3"],
                                     ["--seeds", "-4"], ["--plots"]])
def test_wrong_usage(compbox, gantry, options):
    assert compbox("simulate", "scenario.json", *options).returncode == 2


def test_without_a_folder_nothing_is_left(compbox, gantry):
    before = sorted(compbox.folder.iterdir())
    assert "bspline" in compbox.good("simulate", "scenario.json")
    assert sorted(compbox.folder.iterdir()) == before
