# SPDX-License-Identifier: MIT
"""compbox simulate with a scenario of parts: days pass, the tools get files and nothing else, and the
slower cycle of the simulation changes nothing that matters."""

import copy
import json
import shutil

import pytest
from conftest import ROOT
from test_simulate import faults

EXAMPLE = ROOT / "examples/bpnet-840d"
LAGS = "--lags 600,2400 --lag-only spindle_rpm --squares spindle_rpm"
INPUTS = "X,Z,TX_nut,TX_guide,TZ_nut,TZ_guide,spindle_rpm,spindle_load_percent"
TRAIN = (f"train $seed/data.csv --record $record --inputs {INPUTS} {LAGS} --slope X:TX_nut --hidden 0 "
         "--margin 3 --outputs error_X_um,error_Y_um,error_Z_um --run-column run --name net "
         "-o $out/net.json")


def part(name, rpm=3000, feed=600):
    return {"part": name, "spindle_rpm": rpm, "feed_mm_per_min": feed, "depth_mm": 1.0}


def work(minutes, rpm=0, travel=0):
    return {"minutes": minutes, "spindle_rpm": rpm, "travel_mm_per_min": travel}


def small():
    """A scenario of a few parts of 2 x 3 x 3 points."""
    full = json.loads((EXAMPLE / "scenario.json").read_text())
    scenario = {key: full[key] for key in ("format", "kind", "twin", "machine", "probe", "paper_percent")}
    scenario["name"] = "small"
    for key in ("twin", "machine"):
        scenario[key] = str(EXAMPLE / scenario[key])
    scenario["surfaces"] = [dict(s, columns=3, rows=3) for s in full["surfaces"]]
    scenario["days"] = {
        "first": {"work": [part("1"), work(20, 4000, 3000), part("2", 5000), work(30), part("3", 2000),
                           work(15, 6000, 1000), part("4", 4500), work(40, 2500, 4000), part("5")]},
        "second": {"air": {"mean_degC": 22}, "work": [work(25, 3500, 2000), part("6", 4000), work(20),
                                                      part("7", 2500)]},
        "cold": {"air": {"mean_degC": 12}, "work": "second"}}
    scenario["protocols"] = [{
        "name": "practical", "train": {"day": "first"}, "judge": {"day": "second"},
        "outside": [{"day": "cold"}],
        "steps": ["join $record $probe --longest-gap-s 2 --signals " + INPUTS + ",Y -o $seed/data.csv"],
        "methods": [
            {"name": "memory", "steps": [TRAIN, "build $machine $out/net.json -o $out/coefficients.json"]},
            {"name": "mean-only", "mean_only": True}]}]
    return scenario


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The small scenario, run once; folder and report."""
    from conftest import Compbox
    compbox = Compbox(tmp_path_factory.mktemp("parts"))
    compbox.write("scenario.json", small())
    compbox.good("simulate", "scenario.json", "--seeds", "7", "-o", "out")
    return compbox, json.loads((compbox.folder / "out/report.json").read_text())


def test_the_report(run):
    _, report = run
    schema = json.loads((ROOT / "docs/report.schema.json").read_text())
    assert faults(report, schema, schema) == []
    assert report["method"] == "memory" and report["seeds"] == [7]
    own = report["reduction_percent"]
    assert own["largest"] > 40 and own["largest"] > report["baselines"]["mean-only"]["largest"]
    assert own["largest"] <= report["ceiling_percent"]["largest"]
    assert report["paper_percent"] == {"largest": 59.1}
    judged, = (r for r in report["runs"] if r["method"] == "memory" and r["path"] == "second")
    assert judged["stops"] == 2 * 2 * 9  # parts, surfaces, points
    lengths = [judged["errors"][a]["before_um"] for a in ("X", "Y", "Z", "largest")]
    assert max(lengths[:3]) <= lengths[3] <= sum(lengths[:3])
    assert report["protocols"]["practical"]["outside"]["cold"]["reduction_percent"]["largest"] > 0


def test_the_tools_get_files_and_nothing_else(run):
    compbox, _ = run
    made = compbox.folder / "out/seed-7/practical"
    for name in ("record.csv", "probe.csv"):
        shutil.copy(made / name, compbox.folder / name)
    assert (made / "probe.csv").read_text().startswith("time_s,run,error_X_um,error_Y_um,error_Z_um\n")
    names = {"$seed": ".", "$out": ".", "$record": "record.csv", "$probe": "probe.csv",
             "$machine": str(EXAMPLE / "machine.json")}
    protocol = small()["protocols"][0]
    for step in protocol["steps"] + protocol["methods"][0]["steps"]:
        for name, path in names.items():
            step = step.replace(name, path)
        compbox.good(*step.split())
    again = compbox.read("coefficients.json")
    assert again == json.loads((made / "memory/coefficients.json").read_text())


def test_the_training_record_has_no_compensation(run):
    compbox, _ = run
    lines = (compbox.folder / "out/seed-7/practical/record.csv").read_text().splitlines()
    names = lines[0].split(",")
    for axis in "XYZ":
        at = names.index(f"comp_{axis}_um")
        assert {float(line.split(",")[at]) for line in lines[1:]} == {0.0}


def test_the_slower_cycle_changes_nothing_that_matters(run):
    """The pace of the simulation against 30 ms of the box, 8 ms of the PLC and 4 ms of the NC."""
    compbox, _ = run
    scenario = small()
    scenario["days"] = {"first": {"work": [part("1", 5000)]}, "second": {"work": [work(3, 6000, 5000),
                                                                           part("6", 4000, 300)]}}
    protocol = scenario["protocols"][0]
    del protocol["outside"]
    made = compbox.folder / "out/seed-7/practical/memory/coefficients.json"
    protocol["steps"], protocol["methods"] = [], [{"name": "same", "steps": [
        f"build $machine {made.parent}/net.json -o $out/coefficients.json"]}]
    after = {}
    for name, pace in (("slow", {}), ("real", {"period_ms": 30, "scan_ms": 8, "interpolation_ms": 4})):
        compbox.write("pace.json", dict(scenario, pace=pace))
        compbox.good("simulate", "pace.json", "--seeds", "7", "-o", name)
        report = json.loads((compbox.folder / name / "report.json").read_text())
        after[name] = [report["runs"][0]["errors"][a] for a in ("X", "Y", "Z", "largest")]
    for slow, real in zip(after["slow"], after["real"]):
        assert slow["before_um"] == pytest.approx(real["before_um"], abs=1.0)
        assert slow["after_um"] == pytest.approx(real["after_um"], abs=1.0)


def changed(*path_and_value):
    def change(scenario):
        *path, last, value = path_and_value
        for key in path:
            scenario = scenario[key]
        scenario[last] = value
    return change


REFUSED = {
    "unknown key": (changed("speed", 1), "the key 'speed' is unknown"),
    "no such kind": (changed("kind", "part"), "kind: there is no 'part' (there are paths, parts)"),
    "no such day": (changed("protocols", 0, "judge", {"day": "third"}),
                    "protocols[].judge: there is no day 'third'"),
    "no such part": (changed("protocols", 0, "train", {"day": "first", "parts": ["9"]}),
                     "protocols[].train: that day has no part '9'"),
    "no such surface": (changed("protocols", 0, "train", {"day": "first", "surfaces": ["top"]}),
                        "protocols[].train: there is no surface 'top'"),
    "no such work": (changed("days", "cold", "work", "third"),
                     "days.cold.work: there is no work of a day 'third'"),
    "descending": (changed("surfaces", 0, "x_mm", [3, 2]),
                   "surfaces[]: x_mm must be [from, to], ascending"),
    "no method": (changed("protocols", 0, "methods", []), "protocols[]: needs at least one method"),
    "neither": (changed("protocols", 0, "methods", [{"name": "a"}]),
                "protocols[].methods[]: needs steps, or mean_only"),
    "far away": (changed("surfaces", 0, "x_mm", [700, 900]), "X 850 mm is outside the travel 0 to 800 mm"),
    "a step that fails": (changed("protocols", 0, "steps", ["join a.csv b.csv -o c.csv"]),
                          "step 'join a.csv b.csv -o c.csv': a.csv:"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(compbox, case):
    change, message = REFUSED[case]
    scenario = copy.deepcopy(small())
    change(scenario)
    compbox.write("scenario.json", scenario)
    assert message in compbox.refused("simulate", "scenario.json")
