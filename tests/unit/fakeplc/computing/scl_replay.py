#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs a PLC program of compbox export on a trace of fakeplc: same inputs, same outputs?

usage: scl_replay.py PROGRAM.scl REGISTERS.scl TRACE.csv   (exit 0: in every scan)

The program is translated to Python, statement by statement; what it has beyond assignments, IF, FOR
and the few functions below is refused. Columns of the trace: inputs `in_*`, registers that the box
wrote `w*` and that fakeplc shows `r*`, both by their address, what the NC answers `put_done`, and what
fakeplc made of it `out_*`, channels counted from 1. The data block gives registers their names. Offsets
that are shown agree within one increment, all other registers are the same, and the rest agrees within
0.002 um where the axis is: positions are whole 0.0001 mm in the program."""
import csv
import re
import sys

FUNCTIONS = {
    "ABS": "abs", "MAX": "max", "LIMIT": "limit", "DINT_TO_REAL": "real", "WORD_TO_INT": "int",
    "INT_TO_WORD": "word", "REAL_TO_DINT": "nearest", "INT_TO_REAL": "real", "REAL_TO_INT": "nearest",
}


def real(x):
    assert -(1 << 31) <= x < 1 << 31, f"{x} is more than a DINT holds"
    return float(x)


def nearest(x):
    return int(real(round(x)))


def word(x):
    return x & 0xFFFF


def limit(low, x, high):
    return min(max(x, low), high)


def expression(text):
    text = re.sub(r'"CompBoxRegisters"\.(\w+)', r"reg['\1']", text)
    text = re.sub(r"\b(MN|IN\d?|MX) *:=", "", text)
    text = re.sub(r"16#([0-9A-F]+)", r"0x\1", text)
    text = re.sub(r"(reg\['\w+'\]) AND (0x\w+)", r"(\1 & \2)", text)
    text = re.sub(r"(reg\['\w+'\]) OR (0x\w+)", r"(\1 | \2)", text)
    for name, python in FUNCTIONS.items():
        text = re.sub(rf"\b{name}\(", f"{python}(", text)
    text = re.sub(r"put\.(Done|Error)", r"put_\1", text)
    text = text.replace("<>", "!=")
    text = re.sub(r"(?<![:<>!=])=(?!=)", "==", text)
    for word_, python in (("AND", "and"), ("OR", "or"), ("NOT", "not"), ("MOD", "%"),
                          ("TRUE", "True"), ("FALSE", "False")):
        text = re.sub(rf"\b{word_}\b", python, text)
    return re.sub(r"\b(?!reg\b|real\b|int\b|and\b|or\b|not\b|True\b|False\b|abs\b|max\b|limit\b|word\b|"
                  r"nearest\b)(?<!')([A-Za-z_]\w*)(?!')\b(?!\()", r"v['\1']", text)


def translate(body):
    """SCL statements to Python."""
    body = re.sub(r"//[^\n]*", "", body)
    body = re.sub(r"put\(.*?\);", "", body, flags=re.S)
    lines, depth = [], 0
    pattern = re.compile(r"IF (.*?) THEN|ELSIF (.*?) THEN|(ELSE)|(END_IF;)|FOR (\w+) := (.*?) TO (.*?) DO|"
                         r"(END_FOR;)|([\w.\"\[\]]+) := (.*?);", re.S)
    at = 0
    body = body.strip()
    while at < len(body):
        match = pattern.match(body, at)
        assert match, f"not a statement this can run: {body[at:at + 60]!r}"
        condition, other, else_, end_if, counter, low, high, end_for, target, value = match.groups()
        put = lambda text: lines.append("    " * depth + " ".join(text.split()))
        if condition:
            put(f"if {expression(condition)}:"); depth += 1
        elif other:
            depth -= 1; put(f"elif {expression(other)}:"); depth += 1
        elif else_:
            depth -= 1; put("else:"); depth += 1
        elif counter:
            put(f"for v['{counter}'] in range({expression(low)}, {expression(high)} + 1):"); depth += 1
        elif end_if or end_for:
            depth -= 1
        else:
            put(f"{expression(target)} = {expression(value)}")
        at = match.end()
        while at < len(body) and body[at].isspace():
            at += 1
    return "\n".join(lines)


def variables(text):
    """The declared variables at zero, constants at their value."""
    v = {}
    for section in re.findall(r"^VAR\w*\n(.*?)^END_VAR", text, re.M | re.S):
        for names, kind in re.findall(r"^\s*([\w, ]+?) *: *([^;]+);", re.sub("//.*", "", section), re.M):
            for name in names.split(","):
                zero = 0.0 if kind.endswith("REAL") else False if kind.endswith("BOOL") else 0
                count = re.match(r"ARRAY\[1\.\.(\d+)\]", kind)
                v[name.strip()] = [None] + [zero] * int(count[1]) if count else zero
    constants = re.search(r"^CONST\n(.*?)^END_CONST", text, re.M | re.S).group(1)
    for name, value in re.findall(r"(\w+) := ([^;]+);", constants):
        v[name] = float(value)
    return v


def registers(text):
    """{name: (address, type)} of a data block."""
    return {name: (int(at), kind) for name, kind, at in
            re.findall(r"^ +(\w+) : (WORD|INT|DINT|REAL); +// register (\d+)", text, re.M)}


def number(words, address, kind):
    """The number of a type at an address; None where the trace has no such register."""
    if f"{words[0]}{address}" not in words[1]:
        return None
    high = int(words[1][f"{words[0]}{address}"])
    if kind == "WORD":
        return high
    if kind == "INT":
        return high - (high >> 15 << 16)
    value = high << 16 | int(words[1][f"{words[0]}{address + 1}"])
    return value - (value >> 31 << 32)


def run_scan(code, v, reg, row):
    """One scan of the program: inputs of the row, then its statements."""
    for name in ("first_scan", "enable_key", "permit_key", "reset_key", "referenced", "nc_fresh"):
        v[name] = bool(row["in_" + name])
    v["dt_s"] = row["in_dt_s"]
    for i in range(1, len(v["position"])):
        v["position"][i] = int(row[f"in_position_{i}"])
    v["put_Done"], v["put_Error"] = bool(row["put_done"]), False
    exec(code, {"v": v, "reg": reg, "real": real, "nearest": nearest, "word": word, "limit": limit})


def results(v):
    """What fakeplc has as `out_*`."""
    ours = {"size_count": v["size_count"], "box_alive": v["box_alive"], "torn": v["torn_for_long"],
            "put_axis": v["put_axis"]}
    if "probe_again" in v:
        ours["probe_again"] = v["probe_again"]
    if v["put_axis"]:
        ours |= {"set_slope": v["set_slope"] * 1e6, "set_reference": v["set_reference"] * 1e-4}
    for i in range(1, len(v["wanted_um"])):
        ours |= {f"wanted_{i}": v["wanted_um"][i], f"size_acts_{i}": v["size_acts"][i],
                 f"size_alarm_{i}": v["size_alarm"][i]}
    return ours


def at_axis_um(set_um, slope, reference_mm, position_mm):
    return set_um + 1e3 * slope * (position_mm - reference_mm)


# A step of slope or P0 is what makes 0.25 um, of a way that is whole 0.0001 mm in the program: such
# differences add up from set to set, but never where the axis is.
ALLOWED = {"set_slope": 20, "set_reference": 0.02}


def main():
    program, block, trace = sys.argv[1:]
    text = open(program).read()
    code = compile(translate(text[text.index("\nBEGIN\n") + 7:text.index("END_FUNCTION_BLOCK")]),
                   program, "exec")
    places = registers(open(block).read())
    v, reg, worst, scans, sets, acting = variables(text), dict.fromkeys(places, 0), {}, 0, 0, 0
    probes = 0
    shown = [name for name in sorted(places, key=places.get) if name.startswith("signal_")]
    for row in csv.DictReader(open(trace)):
        row = {key: float(value) for key, value in row.items()}
        for name, (address, kind) in places.items():
            written = number(("w", row), address, kind)
            reg[name] = reg[name] if written is None else written
        v |= {name: int(row[f"in_signal_{s}"]) for s, name in enumerate(shown) if name in v}
        for s, name in enumerate(shown):       # the deviation that fakeplc shows, in um
            stem = name.removeprefix("signal_")
            if f"in_{stem}_done" in row:
                v[stem + "_done"] = bool(row[f"in_{stem}_done"])
                v[stem + "_um"] = row[f"in_signal_{s}"] * 0.01
                probes += v[stem + "_done"]
        axis_before = v["put_axis"]
        run_scan(code, v, reg, row)
        sets += v["put_axis"] > 0 and axis_before == 0
        scans += 1
        for name, (address, kind) in places.items():
            theirs = number(("r", row), address, kind)
            assert theirs is None or abs(reg[name] - theirs) <= name.startswith("applied_"), (
                f"scan {scans}: register {name} is {reg[name]}, fakeplc has {theirs}")
        if v["put_axis"] and not axis_before:
            at = row[f"in_position_{v['put_axis']}"] * 1e-4
            ours, theirs = (at_axis_um(*numbers, at) for numbers in (
                (v["set_um"], v["set_slope"], v["set_reference"] * 1e-4),
                (row["out_set_um"], row["out_set_slope"] * 1e-6, row["out_set_reference"])))
            assert abs(ours - theirs) <= 2e-3, f"scan {scans}: a set makes {ours} um, fakeplc's {theirs}"
        for key, value in results(v).items():
            off = abs(float(value) - row["out_" + key])
            worst[key] = max(worst.get(key, 0), off)
            assert off <= ALLOWED.get(key, 2e-3) + 1e-3 * (key == "set_slope") * abs(value), (
                f"scan {scans}: {key} is {value}, fakeplc has {row['out_' + key]}")
        acting += any(v["size_acts"][1:])
    assert scans > 1000 and sets > 300 and acting > 100, (scans, sets, acting)
    assert probes > 10 or not any(key.endswith("_done") and key != "put_done" for key in row), probes
    print(f"{scans} scans, {sets} sets, {probes} probes, a size acts in {acting}; largest differences: " +
          ", ".join(f"{key} {value:.1e}" for key, value in worst.items()))


if __name__ == "__main__":
    main()
