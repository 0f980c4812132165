# SPDX-License-Identifier: MIT
"""Files as other people's programs write them: the same readings in many dialects and code pages must
give the same figures; broken ones say where and why."""

import json

import pytest

X = [0, 100, 200, 300, 400, 500]
E = [[0.5, -1.25, 2.0, 3.5, 2.25, -0.75], [0.75, -1.0, 2.5, 3.0, 2.5, -1.0]]


def figures(compbox, content, name="d.csv", *more):
    (compbox.folder / name).write_bytes(content)
    found = json.loads(compbox.good("report", name, *more, "--json"))["before"]
    del found["file"]
    return found


def long_form(header, separator=",", comma=False, end="\n", quote=False, tail=""):
    def cell(value):
        text = str(value).replace(".", ",") if comma else str(value)
        return f'"{text}"' if quote else text
    rows = [separator.join(f'"{h}"' if quote else h for h in header) + tail]
    for r, run in enumerate(E):
        rows += [separator.join(map(cell, (x, e, r + 1))) + tail for x, e in zip(X, run)]
    return end.join(rows) + end


PLAIN = ["position_mm", "error_um", "run"]


@pytest.fixture
def reference(compbox):
    return figures(compbox, long_form(PLAIN).encode())


@pytest.mark.parametrize("content", [
    long_form(PLAIN).encode("utf-8-sig"),
    long_form(PLAIN, end="\r\n").encode(),
    long_form(PLAIN, ";", comma=True).encode(),
    long_form(PLAIN, "\t", comma=True, end="\r\n").encode(),
    long_form(PLAIN, "\t").encode(),
    long_form(PLAIN, ",", comma=True, quote=True).encode(),
    long_form(PLAIN, ";", comma=True, tail=";;").encode(),
    (long_form(PLAIN, ";") + ";;\r\n;;\r\n").encode(),
    long_form(PLAIN, "   ").encode(),
    ("# made by a program\n\n" + long_form(PLAIN)).encode(),
    long_form(PLAIN, ";", comma=True).encode("utf-16"),
    long_form(PLAIN).replace("-", "\u2212").encode(),
    ("Laser system 7\nMachine;gantry\nDate;2026-01-02\n\n" + long_form(PLAIN, ";")).encode(),
    long_form(["Position [mm]", "Deviation (µm)", "Run No."], ";").encode("cp1252"),
    long_form(["位置(mm)", "偏差(μm)", "次数"]).encode("utf-8"),
    long_form(["目标位置（毫米）", "误差（微米）", "测量次数"], "\t").encode("gbk"),
    long_form(["Zielposition (mm)", "Abweichung (µm)", "Lauf"], ";", comma=True).encode("cp1252"),
    ("Target (mm),Run 1 (um),Run 2 (um)\n" +
     "".join(f"{x},{a},{b}\n" for x, a, b in zip(X, *E))).encode(),
    ("目标(mm);第1次(微米);第2次(微米)\r\n" +
     "".join(f"{x};{a};{b}\r\n" for x, a, b in zip(X, *E)).replace(".", ",")).encode("gbk"),
], ids=["bom", "crlf", "semicolon, decimal comma", "tab, decimal comma", "tab", "quoted decimal comma",
        "empty columns", "empty rows", "blanks", "comment", "utf-16", "minus sign", "lines above",
        "windows-1252", "chinese utf-8", "chinese gbk", "german", "a column for each run", "the same in gbk"])
def test_the_same_figures(compbox, reference, content):
    assert figures(compbox, content) == reference


@pytest.mark.parametrize("unit, scale", [("mm", 1e-3), ("nm", 1e3), ("um", 1)])
def test_units_of_length(compbox, reference, unit, scale):
    rows = "".join(f"{x / 1000},{e * scale!r},{r + 1}\n" for r, run in enumerate(E)
                   for x, e in zip(X, run))
    found = figures(compbox, f"Position (m),Error ({unit}),run\n{rows}".encode())
    assert found["positioning"]["forward"]["A"] == pytest.approx(
        reference["positioning"]["forward"]["A"], rel=1e-9)


def test_arc_seconds(compbox):
    rows = "".join(f"{x},{e}\n" for x, e in zip(X, E[0]))
    found = figures(compbox, f"Pos (mm);Err (arcsec)\n{rows}".replace(",", ";").encode())
    assert found["unit"] == "urad"
    assert found["straightness"]["end_point"]["deviation"] == pytest.approx(
        4.84813681 * figures(compbox, f"position_mm,error_um\n{rows}".encode())
        ["straightness"]["end_point"]["deviation"], rel=1e-6)


def test_no_header(compbox, reference):
    body = long_form(PLAIN).split("\n", 1)[1].encode()
    assert figures(compbox, body, "d.csv", "--columns", "position_mm,error_um,run") == reference
    assert compbox.refused("report", "d.csv") == (
        "d.csv:1: begins with numbers: a header line such as position_mm,error_um is missing")
    assert compbox.refused("report", "d.csv", "--columns", "position_mm,error_um") == (
        "d.csv:1: has 3 columns, but 2 were named")
    compbox.good("fit", "d.csv", "--columns", "position_mm,error_um,run", "--name", "EXX", "--signal",
                 "X", "-o", "t.json")


def rtl(decimal=".", machine="gantry", order=1):
    targets = " ".join(f"{x:.4f}" for x in X[::order])
    lines = ["HEADER::", "File Type: Linear", "TARGET DATA::", "Filetype : ISO", "Target-count: 6",
             f"Targets : {targets}", "Flags: 1", "USER-TEXT::", f"Machine:{machine}", "RUNS::",
             "Run-count: 2", "DEVIATIONS::", "Run Target Data:"]
    lines += [f"{r + 1} {i + 1} {e}" for r, run in enumerate(E) for i, e in enumerate(run[::order])]
    return "\r\n".join(lines + ["EOF::", ""]).replace(".", decimal)


@pytest.mark.parametrize("content", [rtl().encode(), rtl(",").encode(), rtl(machine="龙门铣床").encode("gbk"),
                                     rtl(machine="龙门铣床").encode("utf-8"),
                                     rtl(machine="Fräse").encode("cp1252"), rtl().encode("utf-16"),
                                     rtl().replace("\r\n", "\n").encode(),
                                     rtl().replace("EOF::", "EQUIPMENT::\r\nXL-80: 1\r\nEOF::").encode()],
                         ids=["plain", "decimal comma", "gbk", "utf-8", "windows-1252", "utf-16", "lf",
                              "another section"])
def test_laser_files(compbox, reference, content):
    assert figures(compbox, content, "d.rtl")["positioning"]["forward"] == \
        reference["positioning"]["forward"]


@pytest.mark.parametrize("change, message", [
    (("Target-count: 6", "Target-count: 7"), "d.rtl:26: Target-count is 7, but there are 6 targets"),
    (("1 3 2.0", "1 3 2.0.1"), "d.rtl:16: '2.0.1' is not a number"),
    (("1 3 2.0", "1 3"), "d.rtl:16: expected run, target and deviation"),
    (("1 3 2.0", "1 9 2.0"), "d.rtl:16: the target must be a number from 1 to 6"),
    (("200.0000", "50.0000"), "d.rtl:6: the targets must ascend (or descend), and one of them does not"),
    (("2 6 -1.0\r\nEOF::\r\n", ""), "d.rtl:24: the file ends within run 2 (5 of 6 targets), without EOF::"),
    (("-1.0\r\nEOF::\r\n", "-1"), "d.rtl:25: the file ends within a line, without EOF::"),
    (("Run Target Data:\r\n", "Run Target Data:\r\n1 1 0.5\r\n"), "d.rtl:15: target 1 is there twice in run 1")])
def test_broken_laser_files(compbox, change, message):
    (compbox.folder / "d.rtl").write_bytes(rtl().replace(*change).encode())
    assert compbox.refused("report", "d.rtl") == message
