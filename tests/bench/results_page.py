#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A page of docs/results/ from the report of `compbox simulate` (docs/report.md): tables, and a figure of ours
beside the paper's.
  results_page.py SCENARIO.json REPORT.json PAGE.md     writes PAGE.md, PAGE.svg and PAGE-path.svg
paper.json may have "headline": "remeasured" for a paper whose figures are remeasurements, and "curves": "X" for
figures of the curves of an axis and of key points (PAGE-curves.svg, PAGE-key-points.svg)."""

import json
import pathlib
import statistics
import subprocess
import sys
import textwrap


def table(heading, rows):
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def percent(value):
    return "–" if value is None else f"{value:.1f} %"


def median_of(report, path, method, axis, key):
    return statistics.median(run[axis][key] for run in report["runs"]
                             if run["path"] == path and run["method"] == method)


def interval(path, axis):
    """Of the median over all such machines."""
    found = path.get("reduction_percent_interval")
    return f"{found[axis][0]:.1f} to {found[axis][1]:.1f} %" if found else "–"


def headline(report):
    """Ours on one path after the other, by direction."""
    rows = []
    for name, path in report["paths"].items():
        for axis in path["reduction_percent"]:
            before = median_of(report, name, report["method"], axis, "before_um")
            after = median_of(report, name, report["method"], axis, "after_um")
            rows.append([name, axis, f"{before:.1f}", f"{after:.2f}", percent(path["reduction_percent"].get(axis)),
                         interval(path, axis)] + [
                percent(path[key].get(axis)) for key in
                ("reduction_percent_worst", "ceiling_percent", "between_percent", "remeasured_percent",
                 "noise_ceiling_percent")])
    return table(["path", "", "before µm", "after µm", "less", "median within", "worst machine", "ceiling",
                  "also between the stops", "remeasured", "its ceiling"], rows)


def methods(report, paper):
    """Every method on the first path, and the paper; by remeasurement and by the truth, or by the truth."""
    axes = list(report["reduction_percent"])
    path, own = report["path"], report["method"]
    remeasured = paper.get("headline") == "remeasured"
    keys = ["remeasured_percent"] * remeasured + ["reduction_percent"]

    def row(title, method, of=statistics.median):
        values = [[run[axis][key] for run in report["runs"] if (run["path"], run["method"]) == (path, method)]
                  for key in keys for axis in axes]
        return [title] + [percent(of(some)) for some in values]
    rows = [row(f"**{own}** (ours)", own)]
    if remeasured:
        ceilings = [report[key][axis] for key in ("noise_ceiling_percent", "ceiling_percent") for axis in axes]
        rows += [row("its worst machine", own, min), ["a perfect model"] + [percent(value) for value in ceilings]]
    rows += [row(name, name) for name in report["baselines"]]
    theirs = [percent(report["paper_percent"].get(axis)) for axis in axes]
    rows.append(["the paper, on its machine"] + theirs + ["–"] * (len(axes) * (len(keys) - 1)))
    heads = [f"{axis} remeasured" for axis in axes] * remeasured + [
        f"{axis} by the truth" if remeasured else axis for axis in axes]
    return table(["part gone on: " + path] + heads, rows)


def tolerances(scenario):
    """The tolerance of each curve by each method that has one, in a sentence each; "" without any."""
    text = ""
    for method in scenario["methods"]:
        if "tolerance_um" in method:
            text += f"{method['name']}: " + ", ".join(
                f"{curve} {um:g} µm" for curve, um in method["tolerance_um"].items()) + ". "
    return text.rstrip()


def iso(report):
    """S2's Table 7: ISO 230-2 and straightness of each axis as the laser shows them; "" without an axis' path."""
    rows = []
    for name in report["paths"]:
        own = [run for run in report["runs"] if run["path"] == name and run["method"] == report["method"]]
        axes = [axis for axis in report["reduction_percent"] if "iso_230_2" in own[0][axis]]
        for along in axes:
            def pair(key, group=along, iso=True):
                found = [[(run[group]["iso_230_2"] if iso else run[group])[f"{key}_{when}_um"] for run in own]
                         for when in ("before", "after")]
                return " → ".join(f"{statistics.median(values):.2f}" for values in found)
            rows.append([name, pair("A"), pair("R")] + [
                "–" if axis == along else pair("remeasured", axis, iso=False) for axis in report["reduction_percent"]])
    axes = [f"straightness towards {axis}" for axis in report["reduction_percent"]]
    return table(["path", "accuracy A", "repeatability R"] + axes, rows) if rows else ""


def largest(report, paper):
    """S4's definition: the largest absolute error on the path, constants included; ours beside the paper's."""
    path, rows = paper["path"], []
    for method in [report["method"]] + list(report["baselines"]):
        for axis in report["reduction_percent"]:
            before, after = (median_of(report, path, method, axis, f"largest_{when}_um")
                             for when in ("before", "after"))
            less = statistics.median(100 * (1 - run[axis]["largest_after_um"] / run[axis]["largest_before_um"])
                                     for run in report["runs"] if run["path"] == path and run["method"] == method)
            rows.append([method, axis, f"{before:.1f}", f"{after:.2f}", percent(less)])
    for axis, after in paper["after_um"].items():
        less = f"about {paper['reduction_percent'][axis]:g} %"
        rows.append(["the paper, on its machine", axis, "–", f"{after:g}", less])
    return table([path, "", "largest before µm", "after µm", "less"], rows)


def moving(report):
    rows = [[one["path"], f"{one['feed_mm_per_min'] / 1000:g}", f"{one['lead_ms']:.0f}"] +
            [f"{percent(v)}, {percent(one['reduction_percent_worst'][a])}"
             for a, v in one["reduction_percent"].items()] for one in report["moving"]]
    axes = [f"{a}: less, worst" for a in report["reduction_percent"]]
    return table(["path", "feed m/min", "lead ms"] + axes, rows)


def residual(report, paper):
    """S1's Table 1, ours beside the paper's."""
    path, rows = paper["residual_path"], []
    for method in [report["method"]] + list(report["baselines"]):
        for axis in report["reduction_percent"]:
            ours = [median_of(report, path, method, axis, key)
                    for key in ("after_um", "mean_um", "variance_um2")]
            theirs = paper["residual"].get(method, {}).get(axis)
            rows.append([method, axis] + [f"{v:.2f}" for v in ours] +
                        ([f"{v:g}" for v in theirs] if theirs else ["–"] * 3))
    return table(["model", "", "range µm", "mean µm", "variance µm²", "paper: range", "mean", "variance"], rows)


def figure(report, path, key):
    """Bars: what is left of each direction's error, in per cent: ours, the others, the paper."""
    axes = list(report["reduction_percent"])
    bars = [("ours" if name == report["method"] else name,
             {axis: median_of(report, report["path"], name, axis, key) for axis in axes})
            for name in [report["method"]] + list(report["baselines"])]
    bars.append(("the paper", report["paper_percent"]))
    data = "".join(f'"{axis}" ' + " ".join(
        f"{100 - values[axis]:.2f}" if axis in values else "NaN" for _, values in bars) + "\n"
        for axis in axes)
    colours = ["#0b6fb8", "#6a51a3", "#2e8b57", "#9aa0a6", "#bcd9ee", "#d9b44a",
               "#7a5230"][:len(bars) - 1] + ["#c8501e"]
    plots = ", ".join(f"$d using {i + 2}:xtic(1) lc rgb '{colour}' title '{name}'"
                      for i, ((name, _), colour) in enumerate(zip(bars, colours)))
    script = (f"set terminal svg size 760,380 noenhanced background '#ffffff'\nset output '{path}'\n"
              f"$d << E\n{data}E\nset style data histogram\nset style histogram cluster gap 1\n"
              "set style fill solid 0.9 border -1\nset yrange [0:*]\nset grid y\n"
              f"set ylabel 'left of the error, %'\nset title '{report['path']}: what is left, by method'\n"
              f"set key outside right\nplot {plots}\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    plain(path, path)


def paragraph(text):
    return textwrap.fill(text, 110, break_on_hyphens=False) + "\n\n"


def plain(source, target):
    """A figure of gnuplot without blanks at the ends of its lines."""
    target.write_text("\n".join(line.rstrip() for line in source.read_text().splitlines()) + "\n")


def page(scenario, report, paper, name):
    seeds = report["seeds"]
    text = f"# {report['scenario']}: results\n\n"
    text += paragraph(
        f"`scripts/report results --write {name}` makes this page. The scenario is examples/{name}/scenario.json. "
        f"The machines are {len(seeds)} twins (seeds {seeds[0]} to {seeds[-1]}) that differ in every curve. "
        "[report.md](../report.md) explains each figure. Errors are the twin's true errors. Figures are medians "
        "over the machines, and the worst machine. *Median within*: the median of all such machines, with 95 %. "
        "*Ceiling*: a compensation of the whole part that a model can "
        "explain. *Its ceiling*: the same as the remeasurement by the noisy laser would show it.")
    text += paragraph(f"Paper: {paper['source']}. {paper['result']}")
    text += f"![part of the error that is left, ours and the paper's]({name}.svg)\n\n"
    text += "## Ours and the paper's\n\n" + methods(report, paper)
    text += "\n## Every path\n\n" + headline(report)
    text += (f"\n![{report['path']}, before and after]({name}-path.svg)\n\n"
             f"True error along {report['path']} of the first machine.\n")
    if "residual" in paper:
        text += f"\n## Errors with compensation on the {paper['residual_path']}\n\n" + residual(report, paper)
        if tolerances(scenario):
            text += "\n" + paragraph("Tolerances: " + tolerances(scenario)).rstrip() + "\n"
        text += "\nThe paper's means are those of amplitudes on its machine; ours count with their sign.\n"
    if "curves" in paper:
        text += ("\n## The paper's figures 2 and 3\n\n"
                 f"![the errors of axis {paper['curves']}]({name}-curves.svg)\n\n"
                 f"Readings and curves of axis {paper['curves']}, first machine (`curves-{paper['curves']}.svg` of "
                 f"`compbox simulate --plots`).\n\n![largest residual over the number of key points]"
                 f"({name}-key-points.svg)\n\nThe paper's method on the way to its tolerances (`key-points.svg`; for "
                 "one curve `compbox fit --method bspline-lmc --plot`).\n")
    if "largest" in paper:
        text += "\n## By the paper's definition\n\n" + paragraph(
            "The largest absolute error at the stops, with the constant that an offset of the workpiece zero takes "
            "away. Our figures above are ranges; medians over the machines.") + largest(report, paper["largest"])
    if iso(report):
        text += ("\n## ISO 230-2 and straightness, before and after\n\n" + paragraph(
            "As the virtual laser shows them in its runs, in one direction of approach, µm; medians over the machines. "
            "Straightness is the range about the least-squares line. A box does not change R.") + iso(report))
    if "moving" in report:
        text += "\n## In motion\n\n" + paragraph(
            "The axes travel the path in one go; the figures include acceleration. Reading takes "
            f"{scenario['exchange_ms']['read']} ms on the wire, writing {scenario['exchange_ms']['write']} ms. The "
            f"box writes every 30 ms. {paper.get('in_motion', '')}".rstrip()) + moving(report)
    return text


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    scenario_file, report_file, out = map(pathlib.Path, sys.argv[1:])
    scenario, report = (json.loads(file.read_text()) for file in (scenario_file, report_file))
    paper = json.loads((scenario_file.parent / "paper.json").read_text())
    figure(report, out.with_suffix(".svg"),
           "remeasured_percent" if paper.get("headline") == "remeasured" else "reduction_percent")
    if "curves" in paper:
        for made, name in ((f"curves-{paper['curves']}", "curves"), ("key-points", "key-points")):
            plain(report_file.parent / "plots" / f"{made}.svg", out.with_name(f"{out.stem}-{name}.svg"))
    along = report_file.parent / "plots" / (report["path"].replace(" ", "-") + ".svg")
    plain(along, out.with_name(out.stem + "-path.svg"))
    out.write_text(page(scenario, report, paper, scenario_file.parent.name))


if __name__ == "__main__":
    main()
