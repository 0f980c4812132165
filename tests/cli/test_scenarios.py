# SPDX-License-Identifier: MIT
"""The papers' scenarios on few machines: what comes out, and that the tools see files only."""

import json
import shutil

import pytest

from conftest import LONG, ROOT

EXAMPLES = ROOT / "examples"


def simulate(compbox, name, scenario, *options):
    """examples/NAME copied into the test's folder, with another scenario.json."""
    shutil.copytree(EXAMPLES / name, compbox.folder / name)
    compbox.write(f"{name}/scenario.json", scenario)
    compbox.good("simulate", f"{name}/scenario.json", *options, "-o", "out")
    return json.loads((compbox.folder / "out/report.json").read_text())


def scenario_of(name):
    return json.loads((EXAMPLES / name / "scenario.json").read_text())


def words_of(step, names):
    """The words of a step as a shell makes them."""
    for name, value in names.items():
        step = step.replace("$" + name, value)
    words = []
    for word in step.split():
        choices = [word]
        while "{" in choices[0]:
            choices = [c[:c.index("{")] + one + c[c.index("}") + 1:] for c in choices
                       for one in c[c.index("{") + 1:c.index("}")].split(",")]
        words += choices
    return words


def by_hand(compbox, steps, names):
    """The steps again, each as a process of its own, in other folders; measurements are left out."""
    for step in steps:
        if not step.startswith("measure"):
            compbox.good(*words_of(step, names))


def same_coefficients(one, other):
    files = [json.loads(path.read_text()) for path in (one, other)]
    for file in files:
        del file["provenance"]  # names the files
    return files[0] == files[1]


@pytest.mark.parametrize("name", sorted(path.parent.name for path in EXAMPLES.glob("*/scenario.json")))
def test_the_command_alone_tries_twenty_machines_that_the_example_does_not_show(name):
    scenario = scenario_of(name)
    shown = json.loads((EXAMPLES / name / scenario["twin"]).read_text())["seed"]
    assert len(set(scenario["seeds"]) - {shown}) >= 20


def test_dual_drive(compbox):
    scenario = scenario_of("dual-drive")
    scenario["paths"] = scenario["paths"][:1]
    report = simulate(compbox, "dual-drive", scenario, "--seeds", "1-3")
    assert list(report["reduction_percent"]) == ["X", "Y"]
    for axis, reduction in report["reduction_percent"].items():
        assert reduction > 90
        assert reduction > report["baselines"]["published-forms"][axis] + 5
        assert reduction < report["ceiling_percent"][axis] < 100
    feeds = [one["feed_mm_per_min"] for one in report["moving"]]
    assert feeds == [1000, 10000]
    slow, fast = (one["reduction_percent"]["X"] for one in report["moving"])
    assert slow > fast > 70
    assert report["moving"][0]["lead_ms"] == pytest.approx(43, abs=3)  # in lines of 30 ms
    assert report["baselines"].keys() == {"published-forms", "polyline"}


def test_dual_drive_from_its_files_alone(compbox):
    scenario = scenario_of("dual-drive")
    scenario["paths"], scenario["methods"] = scenario["paths"][:1], scenario["methods"][:1]
    scenario["moving_mm_per_min"] = []
    simulate(compbox, "dual-drive", scenario, "--seeds", "7")
    (compbox.folder / "hand").mkdir()
    by_hand(compbox, scenario["methods"][0]["steps"],
            {"seed": "out/seed-7", "machine": "dual-drive/machine.json", "out": "hand"})
    assert same_coefficients(compbox.folder / "out/seed-7/bspline/coefficients.json",
                             compbox.folder / "hand/coefficients.json")


def test_a_drive_that_is_corrected_for_the_other_side_yaws(compbox):
    """The two drives of X exchanged: the mean is the same, the stage turns twice as far."""
    scenario = scenario_of("dual-drive")
    scenario["paths"], scenario["methods"] = scenario["paths"][2:3], scenario["methods"][:1]
    scenario["moving_mm_per_min"] = []
    right = simulate(compbox, "dual-drive", scenario, "--seeds", "2")
    steps = scenario["methods"][0]["steps"]
    swap = {"X1.csv": "X2.csv", "X2.csv": "X1.csv"}
    scenario["methods"][0]["steps"] = [
        next((s.replace(a, b) for a, b in swap.items() if a in s), s) for s in steps]
    shutil.rmtree(compbox.folder / "dual-drive")
    wrong = simulate(compbox, "dual-drive", scenario, "--seeds", "2")
    assert wrong["reduction_percent"]["X"] < right["reduction_percent"]["X"] - 5


def nine_line():
    """With the plans of the example, which take a while to find."""
    scenario = scenario_of("nine-line")
    scenario["once"] = [step for step in scenario["once"] if not step.startswith("plan")]
    text = json.dumps(scenario)
    for axis in "XYZ":
        text = text.replace(f"$once/{axis}.plan.json", f"$here/{axis}.plan.json")
    scenario = json.loads(text)
    scenario["paths"], scenario["moving_mm_per_min"] = scenario["paths"][:1], []
    return scenario


@pytest.mark.parametrize("axis", "XYZ" if LONG else "X")
def test_the_committed_plans_are_what_the_scenario_plans(compbox, axis):
    steps = scenario_of("nine-line")["once"]
    (step,) = (step for step in steps if step.startswith("plan") and f"--axis {axis}" in step)
    compbox.good(*step.replace("$once/", "").split())
    made = json.loads((compbox.folder / f"{axis}.plan.json").read_text())
    assert made == json.loads((EXAMPLES / f"nine-line/{axis}.plan.json").read_text())
    assert f"    compbox {step.replace('$once/', '')}\n" in (EXAMPLES / "nine-line/README.md").read_text()


def test_nine_line(compbox):
    scenario = nine_line()
    report = simulate(compbox, "nine-line", scenario, "--seeds", "4")
    for axis in "XYZ":
        assert report["reduction_percent"][axis] > 85
        assert report["reduction_percent"][axis] < report["ceiling_percent"][axis] < 100
        assert report["reduction_percent"][axis] > report["baselines"]["traditional"][axis]
    lines = sorted(path.name for path in (compbox.folder / "out/seed-4/X").iterdir())
    assert lines == [f"P{p}{d}.rtl" for p in "123" for d in "xyz"]
    names = {"seed": "out/seed-4", "once": "out", "here": "nine-line", "out": "hand"}
    (compbox.folder / "hand").mkdir()
    shutil.copy(compbox.folder / "out/seed-4/improved/diagonals.csv", compbox.folder / "hand")
    by_hand(compbox, scenario["methods"][0]["steps"], names)
    assert same_coefficients(compbox.folder / "out/seed-4/improved/coefficients.json",
                             compbox.folder / "hand/coefficients.json")


def test_squareness_and_roll_are_found(compbox):
    """Squareness belongs to the middle of the travels, where the identified angles are zero on average: what the twin's
    angles are there (their slopes by half the travel) is part of it."""
    scenario = nine_line()
    scenario["methods"] = scenario["methods"][:1]
    simulate(compbox, "nine-line", scenario, "--seeds", "5")
    twin = json.loads((EXAMPLES / "nine-line/machine_twin.json").read_text())

    def in_the_middle(name):
        error = twin["errors"][name]
        return error.get("offset_urad", 0) + error.get("slope_urad_per_mm", 0) * travel(name) / 2

    def travel(name):
        return twin["axes"][name[2]]["travel_mm"][1]

    steps = [step for step in scenario["methods"][0]["steps"] if step.startswith("volumetric")]
    names = {"out": "out/seed-5/improved"}
    report = json.loads(compbox.good(*words_of(steps[-1], names), "--json"))
    found = report["diagonals"]["found_urad"]
    # The Z axis carries the tool 150 mm in front of its way: its roll counts as squareness.
    rise = twin["errors"]["ECZ"]["slope_urad_per_mm"] * 150
    for name, angles, more in (("C0Y", ["ECX"], 0), ("B0Z", ["EBX", "EBY"], -rise), ("A0Z", ["EAX", "EAY"], 0)):
        expected = twin["squareness_urad"][name] + sum(map(in_the_middle, angles)) + more
        assert found[name]["value"] == pytest.approx(expected, abs=3), name
    for name in ("EAX", "EBY"):
        rise = twin["errors"][name]["slope_urad_per_mm"] * travel(name)
        assert found[name]["value"] == pytest.approx(rise, abs=0.15 * abs(rise)), name
    assert report["diagonals"]["hidden"] == ["ECZ"]
