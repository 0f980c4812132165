#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs the PLC program of docs/plc on a trace of fakeplc: same inputs, same outputs?

usage: scl_replay.py PROGRAM.scl TRACE.csv   (exit 0: in every scan)

The program is translated to Python, statement by statement; what it has beyond assignments, IF, FOR
and the few functions below is refused. Columns of the trace: inputs `in_*`, registers that the box
wrote `reg_*`, what the NC answers `put_done`, and what fakeplc made of it `out_*`. They agree within
0.002 um (0.005 where a slope is in it), 0.002 mm and a thousandth of a slope: positions are whole
0.0001 mm in the program."""
import csv
import re
import sys

FUNCTIONS = {
    "ABS": "abs", "MAX": "max", "LIMIT": "limit", "DINT_TO_REAL": "real", "WORD_TO_INT": "int",
    "INT_TO_WORD": "word", "REAL_TO_DINT": "nearest",
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
                v[name.strip()] = [None] + [zero] * 3 if kind.startswith("ARRAY") else zero
    constants = re.search(r"^CONST\n(.*?)^END_CONST", text, re.M | re.S).group(1)
    for name, value in re.findall(r"(\w+) := ([^;]+);", constants):
        v[name] = float(value)
    return v


def main():
    program, trace = sys.argv[1:]
    text = open(program).read()
    code = compile(translate(text[text.index("\nBEGIN\n") + 7:text.index("END_FUNCTION_BLOCK")]),
                   program, "exec")
    v, reg, worst, scans, sets, acting = variables(text), {}, {}, 0, 0, 0
    for row in csv.DictReader(open(trace)):
        row = {key: float(value) for key, value in row.items()}
        for key, value in row.items():
            if key.startswith("reg_"):
                reg[key[4:]] = int(value)
        for name in ("first_scan", "enable_key", "permit_key", "reset_key", "referenced", "nc_fresh"):
            v[name] = bool(row["in_" + name])
        v["dt_s"] = row["in_dt_s"]
        v["position"] = [None] + [int(row[f"in_position_{a}"]) for a in "XYZ"]
        v["put_Done"], v["put_Error"] = bool(row["put_done"]), False
        for a in "XYZ":
            reg.setdefault(f"applied_{a}", 0), reg.setdefault(f"signal_{a}", 0)
        axis_before = v["put_axis"]
        exec(code, {"v": v, "reg": reg, "real": real, "nearest": nearest, "word": word, "limit": limit})
        sets += v["put_axis"] > 0 and axis_before == 0
        scans += 1
        ours = {"size_count": v["size_count"], "box_alive": v["box_alive"], "torn": v["torn_for_long"],
                "put_axis": v["put_axis"],
                "plc_heartbeat": reg.get("plc_heartbeat", 0),
                "read_count_first": reg["read_count_first"], "read_count_last": reg["read_count_last"]}
        if v["put_axis"]:
            ours |= {"set_um": v["set_um"], "set_slope": v["set_slope"] * 1e6,
                     "set_reference": v["set_reference"] * 1e-4}
        for i, a in enumerate("XYZ", 1):
            ours |= {f"wanted_{a}": v["wanted_um"][i], f"control": reg["control"],
                     f"size_acts_{a}": v["size_acts"][i], f"size_alarm_{a}": v["size_alarm"][i]}
        for key, value in ours.items():
            off = abs(float(value) - row["out_" + key])
            worst[key] = max(worst.get(key, 0), off)
            assert off <= (0.05 + 1e-3 * abs(value) if key == "set_slope" else
                           5e-3 if key == "set_um" else 2e-3), (
                    f"scan {scans}: {key} is {value}, fakeplc has {row['out_' + key]}")
        acting += any(v["size_acts"][1:])
    assert scans > 1000 and sets > 300 and acting > 100, (scans, sets, acting)
    print(f"{scans} scans, {sets} sets, a size acts in {acting}; largest differences: " +
          ", ".join(f"{key} {value:.1e}" for key, value in worst.items()))


if __name__ == "__main__":
    main()
