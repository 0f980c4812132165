# SPDX-License-Identifier: MIT
"""One HTML page about the fleet, with pictures inside: before and after, by machine, the worst ten."""

import html

from . import machines, rollout
from .residuals import figures

WIDTH, HEIGHT, EDGE = 900, 260, 50  # of a picture, px
BEFORE, AFTER, BOUND = "#9aa5b1", "#1f6fb2", "#c0392b"
STYLE = """body{font:15px sans-serif;max-width:60em;margin:2em auto;color:#222}table{border-collapse:collapse}
td,th{padding:.2em .8em;border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child,td:last-child
{text-align:left}svg{max-width:100%}"""


def rows_of(registry):
    """out: for each machine with a measured residual its name, the latest roll-out's before_um, after_um and bound_um
    of its worst probe, and state; after_um is None as long as no probe came. Without a roll-out before_um is that of
    its newest record."""
    rows = {}
    for row in machines.status(registry):
        measured = [one["rms_um"] for one in row["measured"].values() if one["rms_um"] is not None]
        if measured:
            rows[row["machine"]] = {"machine": row["machine"], "before_um": max(measured), "after_um": None,
                                    "bound_um": None, "state": "drifts" if row["drifts"] else "-"}
    states = [registry.read("rollouts", name) for name in registry.names("rollouts")]
    for name, part in sorted(((name, part) for state in states for name, part in state["machines"].items()
                              if part["state"] != "waiting"), key=lambda one: one[1]["revision"]):
        probe = max(part["bound_um"], key=lambda one: part["before_um"].get(one, 0))
        rows[name] = {"machine": name, "before_um": part["before_um"][probe], "bound_um": part["bound_um"][probe],
                      "after_um": figures(part["seen_um"].get(probe, []))["rms_um"], "state": part["state"]}
    return sorted(rows.values(), key=lambda row: (-left_um(row), row["machine"]))


def left_um(row):
    """out: what a machine leaves now: after a roll-out that it passed, else before it"""
    return row["after_um"] if row["state"] == "good" else row["before_um"]


def picture(rows, wide):
    """in: rows in the order from left to right; wide: bars with names, else points. out: SVG of before, after, bound"""
    most = max((value for row in rows for value in (row["before_um"], row["after_um"], row["bound_um"]) if value),
               default=1.0)
    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="residuals, um">']

    def x(place):
        return EDGE + (WIDTH - EDGE) * (place + 0.5) / len(rows)

    def y(um):
        return (HEIGHT - EDGE) * (1 - um / most) + 10

    for k in range(5):
        um = most * k / 4
        parts.append(f'<line x1="{EDGE}" x2="{WIDTH}" y1="{y(um):.1f}" y2="{y(um):.1f}" stroke="#ddd"/>'
                     f'<text x="{EDGE - 6}" y="{y(um) + 4:.1f}" font-size="12" text-anchor="end">{um:.1f}</text>')
    size = (WIDTH - EDGE) / len(rows) / 4
    for place, row in enumerate(rows):
        for side, (um, colour) in enumerate(((row["before_um"], BEFORE), (row["after_um"], AFTER))):
            if um is None:
                continue
            if wide:
                parts.append(f'<rect x="{x(place) + (side - 1) * size:.1f}" y="{y(um):.1f}" width="{size:.1f}" '
                             f'height="{y(0) - y(um):.1f}" fill="{colour}"/>')
            else:
                parts.append(f'<circle cx="{x(place):.1f}" cy="{y(um):.1f}" r="2.5" fill="{colour}"/>')
        if row["bound_um"] is not None:
            parts.append(f'<line x1="{x(place) - size:.1f}" x2="{x(place) + size:.1f}" y1="{y(row["bound_um"]):.1f}" '
                         f'y2="{y(row["bound_um"]):.1f}" stroke="{BOUND}"/>')
        if wide:
            parts.append(f'<text x="{x(place):.1f}" y="{HEIGHT - 12}" font-size="12" text-anchor="middle">'
                         f'{html.escape(row["machine"])}</text>')
    return "".join(parts) + "</svg>"


def table(rows):
    def cell(value):
        return f"<td>{'-' if value is None else f'{value:.2f}'}</td>"
    lines = [f"<tr><td>{html.escape(row['machine'])}</td>{cell(row['before_um'])}{cell(row['after_um'])}"
             f"{cell(row['bound_um'])}<td>{row['state']}</td></tr>" for row in rows]
    return ("<table><tr><th>machine</th><th>before, um</th><th>after, um</th><th>bound, um</th><th>state</th></tr>"
            + "".join(lines) + "</table>")


def page(registry):
    """out: the page, HTML; the same registry gives the same bytes"""
    rows = rows_of(registry)
    states = [registry.read("rollouts", name) for name in registry.names("rollouts")]
    said = [f"<p>Roll-out {one['id']}: {one['state']}, " + ", ".join(
        f"{number} {name}" for name, number in sorted(rollout.counts(one).items())) +
        (f". {html.escape(one['why'])}" if one["why"] else "") + "</p>" for one in states]
    legend = (f'<p>rms of the probes: <b style="color:{BEFORE}">before</b>, <b style="color:{AFTER}">after</b> the '
              f'roll-out; <b style="color:{BOUND}">bound</b>: 2 sigma of the forecast, or 1.5 times before</p>')
    by_before = sorted(rows, key=lambda row: (-row["before_um"], row["machine"]))
    drifting = sum(row["drifts"] for row in machines.status(registry))
    parts = ["<h1>Fleet</h1>", f"<p>{len(registry.names('machines'))} machines, {drifting} drift.</p>", *said]
    if rows:
        parts += ["<h2>Before and after</h2>", legend, picture(by_before, False), "<h2>The worst ten</h2>",
                  picture(rows[:10], True), table(rows[:10]), "<h2>By machine</h2>",
                  table(sorted(rows, key=lambda row: row["machine"]))]
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Fleet</title><style>{STYLE}</style>'
            f"</head><body>{''.join(parts)}</body></html>\n")
