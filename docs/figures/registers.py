#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Draws the register map of `compbox init --axes X,Y,Z --profile sinumerik-840d` as SVG.
  registers.py COMPBOX"""

import json
import subprocess
import sys

INIT = "init --axes X,Y,Z --profile sinumerik-840d --host 192.168.0.10 -o -"
ROW, TOP = 22, 78
BITS = {"int16": 1, "uint16": 1}
COLOURS = {"count": "#f3f4f6", "control": "#fdeee2", "position": "#dbe8f7", "applied": "#e4f3e6", "value": "#fff3d6"}


def entries(machine):
    """out: [(address, registers, text, kind)] of both blocks of a machine file."""
    plc = machine["plc"]
    for block in (plc["read"], plc["write"]):
        if block.get("counters"):
            yield block["start"], 1, "count", "count"
            yield block["start"] + block["count"] - 1, 1, "count", "count"
    for key, text in (("plc_heartbeat", "PLC heartbeat"), ("control", "control word"), ("status", "status of the box"),
                      ("box_heartbeat", "box heartbeat")):
        yield plc[key], 1, text, "control"
    for signal in machine["signals"]:
        yield signal["plc"], BITS.get(signal["type"], 2), f"position {signal['name']}", "position"
    for channel in machine["channels"]:
        size = BITS.get(channel["type"], 2)
        yield channel["applied"], size, f"applied {channel['name']}", "applied"
        yield channel["plc"], size, f"offset {channel['name']}", "value"
        tangent = channel.get("tangent")
        if tangent:
            yield tangent["slope_plc"], 2, f"slope (tanβ) of {channel['name']}", "value"
            yield tangent["reference_plc"], 2, f"position (P0) of {channel['name']}", "value"


def column(block, all_entries, x):
    """out: SVG of one block, and its lowest edge."""
    first, last = block["start"], block["start"] + block["count"] - 1
    parts, y, at = [], TOP, first
    inside = sorted(entry for entry in all_entries if first <= entry[0] <= last)
    for address, size, text, kind in [*inside, (last + 1, 0, "", "")]:
        if address > at:
            name = f"{at}" if address == at + 1 else f"{at} … {address - 1}"
            parts.append(cell(x, y, name, "spare", "#ffffff", "#888888"))
            y += ROW
        if not size:
            break
        name = f"{address}" if size == 1 else f"{address}, {address + size - 1}"
        parts.append(cell(x, y, name, text, COLOURS[kind], "#1a1a1a"))
        y, at = y + ROW, address + size
    return parts, y


def cell(x, y, address, text, fill, ink):
    return (f'<rect x="{x}" y="{y}" width="270" height="{ROW}" fill="{fill}" stroke="#6b7680" stroke-width="0.8"/>'
            f'<text x="{x - 8}" y="{y + 16}" text-anchor="end" fill="#555555">{address}</text>'
            f'<text x="{x + 10}" y="{y + 16}" fill="{ink}">{text}</text>')


def svg(machine):
    found = list(entries(machine))
    left, low = column(machine["plc"]["read"], found, 110)
    right, lower = column(machine["plc"]["write"], found, 520)
    height = max(low, lower) + 20
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 820 {height}" width="820" height="{height}" '
            'font-family="Helvetica, Arial, sans-serif" font-size="13" role="img" '
            'aria-label="Register map of a three-axis machine on a SINUMERIK 840D">')
    return "\n".join([
        head, "<!-- SPDX-License-Identifier: MIT. Made by docs/figures/registers.py. -->",
        f'<rect width="820" height="{height}" rx="8" fill="#ffffff"/>',
        '<g font-size="14" font-weight="bold"><text x="110" y="30">The box reads (function 3)</text>'
        '<text x="520" y="30">The box writes (function 16)</text></g>',
        '<g font-size="12" fill="#555555"><text x="110" y="50">The PLC program fills these registers.</text>'
        '<text x="520" y="50">The PLC program moves the axes by these.</text></g>',
        '<g font-size="12" fill="#555555" text-anchor="end"><text x="102" y="70">address</text>'
        '<text x="512" y="70">address</text></g>',
        *left, *right, "</svg>", ""])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    done = subprocess.run([sys.argv[1], *INIT.split()], capture_output=True, text=True, check=True)
    print(svg(json.loads(done.stdout)), end="")
