# SPDX-License-Identifier: MIT
"""compbox report against figures recomputed from the standard's definitions (tests/oracle/iso230_2.py),
from CSV and from laser files, and what it says about too few runs and long axes."""

import json
import re
import shutil
import subprocess
import sys

import numpy
import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests/oracle"))
from iso230_2 import figures, straightness  # noqa: E402


def readings(seed, runs, targets, travel, both=True):
    dice = numpy.random.default_rng(seed)
    x = numpy.linspace(0, travel, targets)
    base = 8 * numpy.sin(5 * x / travel) + 6 * x / travel
    forward = base + dice.normal(0, 0.7, (runs, targets))
    backward = base - 2.5 + dice.normal(0, 1.1, (runs, targets)) if both else None
    return x, numpy.round(forward, 3), None if backward is None else numpy.round(backward, 3)


def write_csv(compbox, x, forward, backward, name="d.csv"):
    rows = ["position_mm,error_um,run,direction"]
    for r, run in enumerate(forward):
        rows += [f"{p!r},{e!r},{r + 1},+1" for p, e in zip(x.tolist(), run.tolist())]
        if backward is not None:
            rows += [f"{p!r},{e!r},{r + 1},-1"
                     for p, e in reversed(list(zip(x.tolist(), backward[r].tolist())))]
    compbox.write(name, "\n".join(rows) + "\n")


def write_rtl(compbox, x, forward, backward, name="d.rtl", per_line=5):
    """Odd runs forward, even runs backward, each in the order in which it was measured."""
    lines = ["HEADER::", "TARGET DATA::", "Filetype : ISO", f"Target-count: {len(x)}", "Targets :"]
    lines += [" ".join(f"{p:.5f}" for p in x[i:i + per_line]) for i in range(0, len(x), per_line)]
    runs = []
    for r in range(len(forward)):
        runs.append(list(enumerate(forward[r], 1)))
        if backward is not None:
            runs.append(list(enumerate(backward[r], 1))[::-1])
    lines += ["Flags: 1 0", "USER-TEXT::", "Machine:m", "RUNS::", f"Run-count: {len(runs)}",
              "DEVIATIONS::", "Run Target Data:"]
    for number, run in enumerate(runs, 1):
        lines += [f"{number} {target} {value:.3f}" for target, value in run]
    (compbox.folder / name).write_bytes(("\r\n".join(lines + ["EOF::", ""])).encode())


def report(compbox, *arguments):
    return json.loads(compbox.good("report", *arguments, "--json"))


def check(found, forward, backward, x, spread=True):
    want = figures(forward, backward)
    got = found["positioning"]
    for name in ("A", "R", "E", "M", "B", "B_mean"):
        if name in want and (spread or name not in "AR"):
            assert got[name] == pytest.approx(want[name], abs=1e-9), name
        else:
            assert got[name] is None, name
    for side in ("forward", "backward"):
        assert (side in got) == (side in want)
        for name, value in want.get(side, {}).items():
            if spread or name not in "AR":
                assert got[side][name] == pytest.approx(value, abs=1e-9), (side, name)
    sides = [s.mean(axis=0) for s in (forward, backward) if s is not None]
    for line, value in straightness(x, sum(sides) / len(sides)).items():
        assert found["straightness"][line]["deviation"] == pytest.approx(value, abs=1e-6), line


@pytest.mark.parametrize("write, name", [(write_csv, "d.csv"), (write_rtl, "d.rtl")])
@pytest.mark.parametrize("seed, runs, targets, travel, both", [
    (1, 5, 11, 1000, True), (2, 5, 21, 2000, True), (3, 7, 6, 400, True), (4, 5, 11, 1000, False),
    (5, 5, 61, 14300, True)])
def test_figures(compbox, write, name, seed, runs, targets, travel, both):
    x, forward, backward = readings(seed, runs, targets, travel, both)
    x = numpy.round(x, 4)
    write(compbox, x, forward, backward)
    found = report(compbox, name)["before"]
    check(found, forward, backward, x)
    remarks = found["positioning"]["remarks"]
    assert (remarks == []) == both == found["positioning"]["conforming"]
    assert found["positioning"]["runs_forward"] == runs


def test_fewer_than_five_runs_do_not_conform(compbox):
    x, forward, backward = readings(7, 3, 11, 1000)
    write_csv(compbox, x, forward, backward)
    found = report(compbox, "d.csv")["before"]
    check(found, forward, backward, x)
    assert found["positioning"]["conforming"] is False
    assert found["positioning"]["remarks"] == [
        "ISO 230-2 asks for 5 runs in each direction, here are 3: the figures do not conform"]
    assert "the figures do not conform" in compbox.good("report", "d.csv")


def test_one_run_has_no_spread(compbox):
    x, forward, backward = readings(8, 1, 11, 1000)
    write_csv(compbox, x, forward, backward)
    check(report(compbox, "d.csv")["before"], forward, backward, x)


def test_axes_over_2000_mm_have_a_rule_of_their_own(compbox):
    """One run in each direction, targets every 250 mm on average: E, M and B, no A, no R."""
    x, forward, backward = readings(9, 1, 59, 14300)
    write_csv(compbox, x, forward, backward)
    found = report(compbox, "d.csv")["before"]
    check(found, forward, backward, x, spread=False)
    assert found["positioning"]["conforming"] is True
    assert found["positioning"]["remarks"] == [
        "axis over 2000 mm with fewer than 5 runs: E, M and B only, A and R take 5 runs over 2000 mm "
        "of the working range"]
    x, forward, backward = readings(9, 3, 20, 14300)  # too far apart
    write_csv(compbox, x, forward, backward)
    found = report(compbox, "d.csv")["before"]
    check(found, forward, backward, x, spread=False)
    assert found["positioning"]["conforming"] is False
    assert found["positioning"]["remarks"][0] == "axes over 2000 mm need targets every 250 mm on average"


def test_too_few_targets(compbox):
    x, forward, backward = readings(10, 5, 4, 300)
    write_csv(compbox, x, forward, backward)
    assert report(compbox, "d.csv")["before"]["positioning"]["remarks"] == [
        "ISO 230-2 asks for 5 targets per metre, and 5 at least"]


def test_targets_that_descend(compbox):
    """An axis measured from 0 to -800: run 1 goes in the negative direction."""
    x, forward, backward = readings(11, 5, 9, 800)
    write_rtl(compbox, -x, backward, forward)
    found = report(compbox, "d.rtl")["before"]
    check(found, forward[:, ::-1], backward[:, ::-1], -x[::-1])


def test_before_and_after_side_by_side(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    write_rtl(compbox, x, numpy.round(forward / 4, 3), numpy.round(backward / 4, 3), "after.rtl")
    both = report(compbox, "d.csv", "--after", "after.rtl")
    check(both["after"], numpy.round(forward / 4, 3), numpy.round(backward / 4, 3), x)
    text = compbox.good("report", "d.csv", "--after", "after.rtl", "--plot", "f.svg", "-o", "r.json")
    row = next(line for line in text.splitlines() if "accuracy A" in line).split()
    assert float(row[2]) == pytest.approx(both["before"]["positioning"]["A"], abs=6e-4)
    assert float(row[3]) == pytest.approx(both["after"]["positioning"]["A"], abs=6e-4)
    assert float(row[4]) == pytest.approx(75, abs=0.5)
    assert compbox.read("r.json") == both
    svg = (compbox.folder / "f.svg").read_text()
    assert all(word in svg for word in ("d.csv", "after.rtl", "±2s forward", "mean backward", "runs"))


@pytest.mark.parametrize("from_mm, to_mm, printed", [(0, 1000, False), (20, 990, False), (0, 800, True),
                                                  (-100, 1000, True)])
def test_before_and_after_over_another_travel(compbox, from_mm, to_mm, printed):
    """Half the travel halves most figures without any compensation."""
    x, forward, backward = readings(14, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    write_csv(compbox, numpy.linspace(from_mm, to_mm, 11), forward, backward, "after.csv")
    both = report(compbox, "d.csv", "--after", "after.csv")
    want = [f"measured from {from_mm} to {to_mm} mm, before from 0 to 1000 mm: "
            "what is less is not by the compensation alone"] if printed else []
    assert both["after"]["positioning"]["remarks"] == want
    assert both["before"]["positioning"]["remarks"] == []
    assert ("what is less" in compbox.good("report", "d.csv", "--after", "after.csv")) == printed


def test_angles(compbox):
    x, forward, backward = readings(13, 5, 11, 1000)
    write_rtl(compbox, x, forward / 1000, backward / 1000, "d.rta")  # mrad, three decimals
    found = report(compbox, "d.rta")["before"]
    assert found["unit"] == "urad"
    check(found, 1000 * numpy.round(forward / 1000, 3), 1000 * numpy.round(backward / 1000, 3), x)


@pytest.mark.parametrize("content, message", [
    ("", "d.csv: is empty: a header line is missing"),
    ("position_mm,error_um\n", "d.csv: has a header but no rows"),
    ("position_mm,error_um\n0,1\n", "d.csv: needs at least two positions"),
    ("position_mm,error\n0,1\n1,2\n", "d.csv:1: the column 'error' has no unit; "
     "append it, as in 'error (um)', or give --unit mm,um (position, error)"),
    ("position_mm,error_um\n0,1\n0,2\n", "d.csv:3: position 0 mm is there already in line 2; name the "
     "runs in a column 'run'"),
    ("position_mm,error_um,run\n0,1,a\n1,1,a\n0,1,b\n", "d.csv: run 'b' has 1 of the 2 targets; the "
     "figures need a reading of each run at each"),
    ("position_mm,error_um,direction\n0,1,left\n1,1,left\n", "d.csv:2: direction 'left' is neither +1 "
     "(forward) nor -1 (backward)"),
    ("0,1\n1,2\n", "d.csv:1: begins with numbers: a header line such as position_mm,error_um is "
     "missing")])
def test_refused(compbox, content, message):
    compbox.write("d.csv", content)
    assert compbox.refused("report", "d.csv", "--plot", "f.svg") == message


def test_files_in_two_units_are_not_compared(compbox):
    x, forward, backward = readings(1, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    write_rtl(compbox, x, forward, backward, "a.rta")
    assert compbox.refused("report", "d.csv", "--after", "a.rta") == "a.rta: is in another unit than d.csv"


def test_help(compbox):
    assert "compbox report " in compbox.good("report", "--help").split("Example:")[1]


@pytest.mark.parametrize("header, message", [
    ("位置,误差",
     "the column '位置' has no unit; append it, as in '位置 (mm)', or give --unit mm,um (position, error)"),
    ("Position (mm),Error",
     "the column 'Error' has no unit; append it, as in 'Error (um)', or give --unit mm,um (position, error)")])
def test_a_column_without_its_unit_is_named(compbox, header, message):
    compbox.write("m.csv", header + "\n0,1\n100,2\n")
    assert compbox.refused("report", "m.csv") == "m.csv:1: " + message


def test_a_slope_is_named_by_its_unit(compbox):
    for unit, key, slope in ("um", "slope_urad", 20), ("urad", "slope_urad_per_mm", 0.02):
        compbox.write("m.csv", f"position_mm,error_{unit}\n0,1\n100,3\n")
        found = json.loads(compbox.good("report", "m.csv", "--json"))["before"]["straightness"]
        for line in "end_point", "least_squares", "minimum_zone":
            assert list(found[line]) == ["deviation", key]
            assert found[line][key] == pytest.approx(slope)


def write_named(compbox, name, forward, backward, x, machine="Fräse <Größe 5> & Co"):
    """A laser file with the particulars that a page shows, in Windows-1252."""
    write_rtl(compbox, x, forward, backward, name)
    text = (compbox.folder / name).read_bytes().decode()
    text = text.replace("Machine:m", f"Machine:{machine}\r\nDate:2026-03-17\r\nBy:Jürgen Müßig\r\nAxis:X")
    text = text.replace("EOF::", "EQUIPMENT::\r\nLaser:Interferometer 12\r\nENVIRONMENT::\r\n"
                                 "Air temp : 20.1 20.4 0\r\nEOF::")
    (compbox.folder / name).write_bytes(text.encode("cp1252"))


def test_a_page_has_the_particulars_of_the_files_and_is_escaped(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_named(compbox, "EXX_before.rtl", forward, backward, x)
    write_named(compbox, "EXX_after.rtl", forward / 4, backward / 4, x)
    compbox.good("report", "EXX_before.rtl", "--after", "EXX_after.rtl", "--page", "p.html",
                 "--limit-um", "A=20,B=1", "--uncertainty-um", "A=1,B=0.1", "--number", "P<1>")
    page = (compbox.folder / "p.html").read_text()
    for text in ("Positioning of axis X, EXX", "Fräse &lt;Größe 5&gt; &amp; Co", "Jürgen Müßig", "2026-03-17",
                 "Interferometer 12", "air 20.1 to 20.4 °C", "EXX_before.rtl", "EXX_after.rtl", "P&lt;1&gt;",
                 "11 from 0 to 1000 mm", "5 forward, 5 backward", "<svg", "size: A4", "ISO 14253-1"):
        assert text in page, text
    assert "<Größe" not in page and "P<1>" not in page
    assert "http" not in page.split("</svg>")[1] and "<script" not in page and "<link" not in page
    both = report(compbox, "EXX_before.rtl", "--after", "EXX_after.rtl")
    for when in "before", "after":
        for name in "AREMB":
            assert f"<td>{both[when]['positioning'][name]:.2f}</td>" in page


def test_an_option_outweighs_the_file(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_named(compbox, "d.rtl", forward, backward, x)
    compbox.good("report", "d.rtl", "--page", "p.html", "--name", "EZX", "--operator", "Zoë")
    page = (compbox.folder / "p.html").read_text()
    assert "Zoë" in page and "Müßig" not in page
    assert "Straightness of axis X in Z, EZX" in page and "Minimum zone" in page
    assert "The measurement uncertainty is not stated." in page


def test_many_targets_go_to_a_second_page(compbox):
    for targets, more in (21, 0), (41, 1):
        x, forward, backward = readings(3, 5, targets, 2000)
        write_csv(compbox, x, forward, backward)
        compbox.good("report", "d.csv", "--page", "p.html")
        assert (compbox.folder / "p.html").read_text().count('class="long more"') == more


def printed_pages(folder, page):
    """out: width and height in mm of each page that Chromium prints."""
    subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'browser'}",
                    "--print-to-pdf=page.pdf", page], cwd=folder, check=True, capture_output=True, timeout=120)
    pdf = (folder / "page.pdf").read_bytes()
    boxes = re.findall(rb"/MediaBox *\[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert len(boxes) == len(re.findall(rb"/Type */Page\b", pdf))
    return [tuple(round(float(side) / 72 * 25.4) for side in box) for box in boxes]


@pytest.mark.skipif(not shutil.which("chromium"), reason="scripts/test --system installs Chromium")
def test_a_full_page_prints_on_one_A4_and_more_targets_on_two(compbox):
    """With two measurements, limits and all figures. A run is turned for two warnings more."""
    for targets, turned, warnings, pages in (26, False, 1, 1), (27, False, 1, 2), (20, True, 3, 1), (26, True, 3, 2):
        x, forward, backward = readings(12, 5, targets, 1000)
        forward[2] *= -1 if turned else 1
        write_named(compbox, "EXX_before.rtl", forward, backward, x)
        write_named(compbox, "EXX_after.rtl", 2 * forward, 2 * backward, x)
        compbox.good("report", "EXX_before.rtl", "--after", "EXX_after.rtl", "--page", "p.html", "--limit-um",
                     "A=20,R=9,E=9,M=9,B=1", "--uncertainty-um", "A=1,B=0.1")
        page = (compbox.folder / "p.html").read_text()
        assert page.count('class="warning"') == warnings
        assert page.count('class="long more"') == pages - 1, "a page that overflows breaks where its writer decides"
        assert printed_pages(compbox.folder, "p.html") == [(210, 297)] * pages


def test_conformity(compbox):
    """Limits around the figure: the uncertainty counts against whoever proves."""
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    A = figures(forward, backward)["A"]
    for limit, uncertainty, verdict in ((A + 1.1, 1, "conforms"), (A + 0.9, 1, "undecided"),
                                        (A - 0.9, 1, "undecided"), (A - 1.1, 1, "does not conform"),
                                        (A + 0.1, None, "conforms"), (A - 0.1, None, "does not conform")):
        known = ("--uncertainty-um", f"A={uncertainty}") if uncertainty else ()
        found = report(compbox, "d.csv", "--limit-um", f"A={limit}", *known)["conformity"]
        assert found["verdict"] == found["figures"][0]["verdict"] == verdict
    assert compbox.refused("report", "d.csv", "--limit-um", "Q=1").startswith("d.csv: 'Q' is no figure")
    done = compbox("report", "d.csv", "--limit-um", "A=-1")
    assert done.returncode == 2 and "must be one number above zero" in done.stderr


def test_a_turned_run_is_named(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    forward[2] *= -1
    write_csv(compbox, x, forward, backward)
    found = report(compbox, "d.csv")["before"]["warnings"]
    assert len(found) == 1 and found[0].startswith("run 3 forward is the mirror image of the other runs")
    assert found[0] in compbox.good("report", "d.csv")
    fit = compbox("fit", "d.csv", "--name", "EXX", "--signal", "X", "-o", "t.json")
    assert fit.returncode == 0 and found[0] in fit.stderr


def test_a_doubled_error_after_compensation_is_named(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    for factor, named in (2, True), (1, False), (0.1, False), (-1, False):
        write_csv(compbox, x, numpy.round(factor * forward, 3), numpy.round(factor * backward, 3), "a.csv")
        text = compbox.good("report", "d.csv", "--after", "a.csv")
        assert ("a.csv: the compensation acts the wrong way round" in text) == named, factor


@pytest.mark.parametrize("options, sentence", [
    (("--machine", "mill 3"), "texts such as --machine and --operator are for --page F.html"),
    (("--page", "x.pdf"), "--page: 'x.pdf': a page is written as .html; print it to PDF in a browser"),
    (("--uncertainty-um", "A=1"), "--uncertainty-um: it needs --limit-um or --page"),
])
def test_an_option_without_its_output_is_refused(compbox, options, sentence):
    (compbox.folder / "a.csv").write_text("position_mm,error_um\n0,1\n100,2\n")
    done = compbox("report", "a.csv", *options)
    assert (done.returncode, done.stderr.splitlines()[0]) == (2, "compbox: " + sentence)
