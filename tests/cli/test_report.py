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
from uncertainty import contributions, uncertainties  # noqa: E402


def readings(seed, runs, targets, travel, both=True):
    dice = numpy.random.default_rng(seed)
    x = numpy.linspace(0, travel, targets)
    irregular = numpy.random.default_rng(targets).uniform(-0.2, 0.2, targets - 2) * x[1]
    x[1:-1] += numpy.round(irregular, 1)
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
    write_csv(compbox, from_mm + (to_mm - from_mm) * x / 1000, forward, backward, "after.csv")
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
    ("position_mm,error_um,run\n0,1,a\n1,1,a\n1,1,b\n", "d.csv: run 'b' has no reading at 0 mm; the figures need "
     "a reading of each run at each target: --drop-target 0 (1 of 2 targets remain) or --drop-run b "
     "(1 of 2 runs remain)"),
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


def test_a_remark_on_both_files_is_on_the_page_once(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, numpy.linspace(0, 1000, 11), forward, backward)
    write_csv(compbox, numpy.linspace(0, 1000, 11), forward[:4], backward[:4], "after.csv")
    compbox.good("report", "d.csv", "--after", "after.csv", "--page", "p.html")
    page = (compbox.folder / "p.html").read_text()
    assert page.count("stays hidden") == page.count("Both: the targets are 100 mm apart throughout") == 1
    assert "After: ISO 230-2 asks for 5 runs" in page


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
                     "A=20,R=9,E=9,M=9,B=1", "--uncertainty-um", "A=1,B=0.1", *BUDGET[:-1], "20")
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


BUDGET = ("--budget", "device-um=0.1,device-um-per-m=0.8,misalignment-mm=1.2,temperature-K=0.5,expansion-range=1.5,"
          "eve-um=0.8", "--expansion-um-per-m-K", "11.5", "--material-degC", "23.5")
PARTS = {"device_um": 0.1, "device_um_per_m": 0.8, "misalignment_mm": 1.2, "temperature_K": 0.5,
         "expansion_range": 1.5, "eve_um": 0.8, "expansion": 11.5, "degC": 23.5}


@pytest.mark.parametrize("seed, runs, targets, travel", [(1, 5, 11, 1000), (2, 5, 21, 2000), (3, 7, 6, 400)])
def test_uncertainty_of_each_figure(compbox, seed, runs, targets, travel):
    x, forward, backward = readings(seed, runs, targets, travel)
    write_csv(compbox, x, forward, backward)
    found = report(compbox, "d.csv", *BUDGET)["before"]["uncertainty"]
    parts = contributions(travel, **PARTS)
    assert found["contributions"]["positioning"] == pytest.approx(parts, abs=1e-9)
    across = contributions(travel, device_um=0.1, device_um_per_m=0.8, eve_um=0.8)
    assert found["contributions"]["straightness"] == pytest.approx(
        {name: across[name] for name in ("device", "environment")}, abs=1e-9)
    want = uncertainties(forward, backward, x, parts)
    assert found["figures"] == pytest.approx(want, abs=2e-4)


def test_uncertainty_of_what_was_measured(compbox):
    """One direction has no B, one run no A; angles have neither a length nor an expansion."""
    x, forward, backward = readings(4, 5, 11, 1000, both=False)
    write_csv(compbox, x, forward, None)
    found = report(compbox, "d.csv", "--budget", "eve-um=1")["before"]["uncertainty"]
    assert set(found["figures"]) == {"A+", "R+", "E+", "end-point", "least-squares", "minimum-zone"}
    assert found["contributions"]["positioning"] == {"device": None, "misalignment": None, "temperature": None,
                                                     "expansion": None, "environment": 0.6}
    write_csv(compbox, x, forward[:1], None)
    found = report(compbox, "d.csv", "--budget", "eve-um=1")["before"]["uncertainty"]
    assert set(found["figures"]) == {"E+", "end-point", "least-squares", "minimum-zone"}
    write_rtl(compbox, x, forward / 1000, None, "d.rta")
    found = report(compbox, "d.rta", "--budget", "device-um=2,eve-um=1")["before"]["uncertainty"]
    assert found["figures"]["E+"] == pytest.approx((4 + 0.4 * 0.36) ** 0.5)
    assert compbox.refused("report", "d.rta", "--budget", "misalignment-mm=1") == (
        "d.rta: holds angles; their budget has device-um and eve-um alone, in urad")


def test_the_budget_takes_temperature_and_coefficient_from_the_file(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_named(compbox, "d.rtl", forward, backward, x)
    warm = ("--budget", "temperature-K=0.5,expansion-range=2")
    assert compbox.refused("report", "d.rtl", *warm) == (
        "d.rtl: states no expansion coefficient, which temperature-K of the budget needs; give --expansion-um-per-m-K")
    assert compbox.refused("report", "d.rtl", "--budget", "expansion-range=2") == (
        "d.rtl: states no material temperature, which expansion-range of the budget needs; give --material-degC")
    text = (compbox.folder / "d.rtl").read_bytes()
    (compbox.folder / "d.rtl").write_bytes(text.replace(
        b"Air temp :", b"Mat temp 1 : 23.0 23.4 0\r\nMat temp 2 : 23.4 23.8 0\r\nExp coeff : 10.0 10.0 0\r\n"
        b"Air temp :"))
    found = report(compbox, "d.rtl", *warm)["before"]["uncertainty"]["contributions"]["positioning"]
    assert (found["temperature"], found["expansion"]) == (pytest.approx(3.0), pytest.approx(0.6 * 3.4 * 2))


def test_the_instrument_of_the_file_is_in_the_budget(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_named(compbox, "d.rtl", forward, backward, x)
    text = (compbox.folder / "d.rtl").read_bytes()
    (compbox.folder / "d.rtl").write_bytes(text.replace(b"Laser:Interferometer 12", b"Laser : XL-80, serial 12"))
    remark = ("U of the instrument is 0.5 um/m by the data sheet of the XL-80; a certificate is stated by "
              "device-um-per-m")
    for known, device, remarks in ("", 0.5, [remark]), (",device-um-per-m=0.8", 0.8, []):
        found = report(compbox, "d.rtl", "--budget", "eve-um=0.1" + known)["before"]
        parts = found["uncertainty"]["contributions"]
        assert parts["positioning"]["device"] == pytest.approx(device)
        assert parts["straightness"]["device"] == (pytest.approx(0.8) if known else None)
        assert found["positioning"]["remarks"] == remarks


def test_conformity_by_the_budget(compbox):
    """On the terminal, as JSON and on the page; what is stated outweighs the budget."""
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    write_csv(compbox, x, forward / 4, backward / 4, "after.csv")
    both = report(compbox, "d.csv", "--after", "after.csv", *BUDGET)["after"]
    A, U = both["positioning"]["A"], both["uncertainty"]["figures"]["A"]
    for limit, verdict in ((A + 1.01 * U, "conforms"), (A + 0.99 * U, "undecided"), (A - 0.99 * U, "undecided"),
                           (A - 1.01 * U, "does not conform")):
        if limit <= 0:
            continue
        arguments = "d.csv", "--after", "after.csv", *BUDGET, "--limit-um", f"A={limit!r}"
        found = report(compbox, *arguments)["conformity"]
        assert (found["verdict"], found["figures"][0]["uncertainty"]) == (verdict, U)
        text = compbox.good("report", *arguments, "--page", "p.html")
        assert f"U {U:.3f}: {verdict}" in text
        row = next(line for line in text.splitlines() if "accuracy A" in line).split()
        assert float(row[-1]) == pytest.approx(U, abs=6e-4)
        assert "contributions to U: device " in text
        page = (compbox.folder / "p.html").read_text()
        assert f"<td>{U:.2f}</td>" in page and "by ISO/TR 230-9 from device " in page
        assert {"conforms": "Conforms to the limits", "undecided": "Conformity is not decided",
                "does not conform": "Does not conform"}[verdict] in page
    stated = report(compbox, "d.csv", *BUDGET, "--limit-um", "A=20,B=9", "--uncertainty-um", "A=0.25")
    assert stated["conformity"]["figures"][0]["uncertainty"] == 0.25
    assert stated["conformity"]["figures"][1]["uncertainty"] == pytest.approx(0.6 * 0.8 * 0.4 ** 0.5)


def test_a_drift_as_large_as_the_scatter_is_named(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    s = numpy.median(numpy.concatenate([side.std(axis=0, ddof=1) for side in (forward, backward)]))
    for eve, named in (s * 12 ** 0.5 * 0.4, False), (s * 12 ** 0.5 * 0.6, True):
        remarks = report(compbox, "d.csv", "--budget", f"eve-um={eve}")["before"]["positioning"]["remarks"]
        drift = [remark for remark in remarks if remark.startswith(f"the drift of {eve:.2f} um is not small")]
        assert len(drift) == named


def test_what_the_budget_lacks_is_named(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    text = compbox.good("report", "d.csv", "--budget", "device-um-per-m=0.8,eve-um=1", "--page", "p.html")
    lacks = "device 0.80, environment 0.60; not stated: misalignment, temperature, expansion"
    assert "contributions to U: " + lacks in text and lacks in (compbox.folder / "p.html").read_text()


def warm(x, forward, backward, start, end, expansion=11.5):
    """The readings on a scale of START to END °C. Runs follow each other: forward, backward, forward …"""
    runs = 2 * len(forward)
    grown = [expansion * (start + (r + 0.5) / runs * (end - start) - 20) * (x - x[0]) / 1000 for r in range(runs)]
    return forward + grown[0::2], backward + grown[1::2]


def test_readings_of_a_warm_machine_at_20_degrees(compbox):
    """By options and by the file's own section; the temperature of each run is between start and end."""
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward, "cold.csv")
    want = report(compbox, "cold.csv")["before"]
    write_csv(compbox, x, *warm(x, forward, backward, 23, 23.8), "warm.csv")
    how = ("--expansion-um-per-m-K", "11.5")
    text = compbox.good("report", "warm.csv", *how, "--material-degC", "23,23.8", "--page", "p.html")
    remark = "converted to 20 °C by 11.5 um/m per K from 23.00 to 23.80 °C: 39.10 um less over the travel"
    assert remark in text and "Converted" + remark[9:] in (compbox.folder / "p.html").read_text()
    found = report(compbox, "warm.csv", *how, "--material-degC", "23,23.8")["before"]
    assert found["temperature"] == {"converted": True, "expansion_um_per_m_K": 11.5, "degC": [23, 23.8],
                                    "removed_um": pytest.approx(39.1)}
    for name in "AREMB":
        assert found["positioning"][name] == pytest.approx(want["positioning"][name], abs=1e-9), name
    exact = warm(x, forward, backward, 23, 23.8)
    write_rtl(compbox, x, numpy.round(exact[0], 3), numpy.round(exact[1], 3), "warm.rtl")
    environment(compbox, "warm.rtl", "Mat temp 1 : 23.0 23.8 0")
    found = report(compbox, "warm.rtl", *how)["before"]
    assert found["positioning"]["A"] == pytest.approx(want["positioning"]["A"], abs=2e-3)
    assert compbox.refused("report", "warm.csv", *how) == (
        "warm.csv: states no material temperature, which --expansion-um-per-m-K needs; give --material-degC")


def environment(compbox, name, *lines):
    text = (compbox.folder / name).read_bytes()
    section = "ENVIRONMENT::\r\n" + "".join(line + "\r\n" for line in lines) + "EOF::"
    (compbox.folder / name).write_bytes(text.replace(b"EOF::", section.encode()))


def test_before_and_after_have_their_own_temperatures(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, *warm(x, forward, backward, 23, 23), "b.csv")
    write_csv(compbox, x, *warm(x, forward, backward, 19, 19.4), "a.csv")
    both = report(compbox, "b.csv", "--after", "a.csv", "--expansion-um-per-m-K", "11.5", "--material-degC", "23",
                  "--after-degC", "19,19.4")
    assert both["before"]["positioning"]["A"] == pytest.approx(both["after"]["positioning"]["A"], abs=1e-9)


def test_an_expansion_is_not_corrected_twice(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_rtl(compbox, x, forward, backward)
    environment(compbox, "d.rtl", "Mat temp 1 : 23.0 23.8 0", "Exp coeff : 11.7 11.7 0")
    plain = report(compbox, "d.rtl")["before"]
    assert plain["temperature"] == {"converted": False, "converted_by_instrument": True}
    found = report(compbox, "d.rtl", "--expansion-um-per-m-K", "11.5")["before"]
    assert found["positioning"]["A"] == plain["positioning"]["A"]
    assert found["warnings"] == ["the instrument converted its readings to 20 °C already, by 11.7 um/m per K; 11.5 is "
                                 "not applied, which would correct the expansion twice"]
    assert found["warnings"][0] in compbox.good("report", "d.rtl", "--expansion-um-per-m-K", "11.5")


def test_readings_of_a_warm_machine_as_they_are_get_a_remark(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    for degC, name, named in ("23.0", "EXX", True), ("20.05", "EXX", False), ("23.0", "EZX", False):
        write_rtl(compbox, x, forward, backward)
        environment(compbox, "d.rtl", f"Mat temp 1 : {degC} {degC} 0", "Exp coeff : 0 0 0")
        remarks = report(compbox, "d.rtl", "--name", name)["before"]["positioning"]["remarks"]
        assert ("measured at 23.00 °C and not converted to 20 °C; --expansion-um-per-m-K converts" in remarks) == named
    straight = report(compbox, "d.rtl", "--name", "EZX", "--expansion-um-per-m-K", "11.5")["before"]
    assert straight["temperature"] == {"converted": False}
    write_rtl(compbox, x, forward / 1000, backward / 1000, "d.rta")
    assert compbox.refused("report", "d.rta", "--expansion-um-per-m-K", "11.5") == (
        "d.rta: holds angles, which do not expand; leave --expansion-um-per-m-K out")


def test_fit_takes_readings_of_a_warm_machine_at_20_degrees(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    how = ("--signal", "X", "--method", "polyline")
    warm_at = ("--expansion-um-per-m-K", "11.5", "--material-degC", "23,23.8")
    write_csv(compbox, x, forward, backward, "cold.csv")
    compbox.good("fit", "cold.csv", "--name", "EXX", *how, "-o", "cold.json")
    write_csv(compbox, x, *warm(x, forward, backward, 23, 23.8), "warm.csv")
    text = compbox.good("fit", "warm.csv", "--name", "EXX", *how, *warm_at, "-o", "warm.json")
    assert "converted to 20 °C by 11.5 um/m per K from 23.00 to 23.80 °C: 39.10 um less over the travel" in text
    cold, found = compbox.read("cold.json"), compbox.read("warm.json")
    assert found["terms"][0]["values"] == pytest.approx(cold["terms"][0]["values"], abs=1e-4)
    assert found["provenance"]["EXX"]["temperature"] == {
        "converted": True, "expansion_um_per_m_K": 11.5, "degC": [23, 23.8], "removed_um": pytest.approx(39.1)}
    assert "temperature" not in cold["provenance"]["EXX"]
    assert compbox.refused("fit", "warm.csv", "--name", "EZX", *how, *warm_at, "-o", "t.json") == (
        "warm.csv: EZX is no error along its axis, so no scale expands it; leave --expansion-um-per-m-K out")
    write_rtl(compbox, x, forward, backward)
    environment(compbox, "d.rtl", "Mat temp 1 : 23.0 23.0 0", "Exp coeff : 0 0 0")
    assert "measured at 23.00 °C and not converted to 20 °C" in compbox.good(
        "fit", "d.rtl", "--name", "EXX", *how, "-o", "t.json")


def test_a_missing_reading_is_named_with_what_to_drop(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    lines = (compbox.folder / "d.csv").read_text().splitlines()
    target = x[3]
    kept = [line for line in lines if not line.startswith(f"{target!r},") or not line.endswith(",3,-1")]
    assert len(kept) == len(lines) - 1
    compbox.write("gap.csv", "\n".join(kept) + "\n")
    assert compbox.refused("report", "gap.csv") == (
        f"gap.csv: run '3' backward has no reading at {target:g} mm; the figures need a reading of each run at each "
        f"target: --drop-target {target:g} (10 of 11 targets remain) or --drop-run 3 (8 of 10 runs remain)")
    others = numpy.arange(11) != 3
    found = report(compbox, "gap.csv", "--drop-target", f"{target:g}")["before"]
    check(found, forward[:, others], backward[:, others], x[others])
    runs = numpy.arange(5) != 2
    check(report(compbox, "gap.csv", "--drop-run", "3")["before"], forward[runs], backward[runs], x)
    write_csv(compbox, x, forward[:2], backward[:2], "after.csv")
    both = report(compbox, "gap.csv", "--after", "after.csv", "--drop-run", "3")
    assert (both["before"]["positioning"]["runs_forward"], both["after"]["positioning"]["runs_forward"]) == (4, 2)
    assert compbox.refused("report", "gap.csv", "--drop-run", "9") == "gap.csv: has no run '9'"
    assert compbox.refused("report", "gap.csv", "--drop-target", "5") == "gap.csv: has no target at 5 mm"
    assert compbox.refused("report", "gap.csv", "--drop-run", "1,2,3,4,5") == (
        "gap.csv: has no readings beside those that are dropped")


def drift_remark(um, unit="um"):
    return f"the first target, 0 mm, read {um} {unit} more at the end: drift of the measurement"


def test_the_first_target_once_more_at_the_end_is_the_drift(compbox):
    """In a table it is a run of its own; in a laser file also the last reading of the last run."""
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    want = report(compbox, "d.csv")["before"]
    again = forward[0][0] + 1.25
    text = (compbox.folder / "d.csv").read_text()
    compbox.write("d.csv", text + f"0,{again!r},end,+1\n")
    found = report(compbox, "d.csv")["before"]
    assert found["drift"] == {"target_mm": 0, "first": forward[0][0], "again": pytest.approx(again),
                              "change": pytest.approx(1.25)}
    assert {**found["positioning"], "remarks": []} == {**want["positioning"], "remarks": []}
    assert drift_remark("+1.25") in found["positioning"]["remarks"]
    assert drift_remark("+1.25") in compbox.good("report", "d.csv")
    write_rtl(compbox, x, forward, backward)
    text = (compbox.folder / "d.rtl").read_bytes()
    last = f"10 1 {backward[-1][0]:.3f}\r\n"
    (compbox.folder / "d.rtl").write_bytes(text.replace(last.encode(), f"{last}10 1 {again:.3f}\r\n".encode()))
    assert report(compbox, "d.rtl")["before"]["drift"]["change"] == pytest.approx(1.25)
    check(report(compbox, "d.rtl")["before"], forward, backward, x)
    compbox.good("fit", "d.rtl", "--name", "EXX", "--signal", "X", "-o", "t.json")
    (compbox.folder / "d.rtl").write_bytes(text.replace(b"Run-count: 10", b"Run-count: 11").replace(
        b"EOF::", f"11 1 {again:.3f}\r\nEOF::".encode()))
    assert report(compbox, "d.rtl")["before"]["drift"]["change"] == pytest.approx(1.25)


def test_the_drift_is_in_the_budget(compbox):
    x, forward, backward = readings(12, 5, 11, 1000)
    write_csv(compbox, x, forward, backward)
    text = (compbox.folder / "d.csv").read_text()
    compbox.write("d.csv", text + f"0,{forward[0][0] - 0.5!r},end,+1\n")
    for eve, want in (0.2, 0.5), (0.9, 0.9):
        found = report(compbox, "d.csv", "--budget", f"eve-um={eve}")["before"]["uncertainty"]
        assert found["contributions"]["positioning"]["environment"] == pytest.approx(0.6 * want)


@pytest.mark.parametrize("targets, period, remark", [
    (numpy.linspace(0, 1000, 11), None, "the targets are 100 mm apart throughout"),
    (numpy.linspace(0, 1000, 11), 10, "the targets meet the period of 10 mm at nearly one phase"),
    (numpy.linspace(0, 1000, 11), 16, None),
    (numpy.array([0, 100, 250, 330, 480, 560, 700, 810, 930, 1000.0]), 10, "the targets meet the period of 10 mm"),
    (numpy.array([0, 103.1, 207.7, 296.2, 405.4, 498.8, 602.3, 709.6, 794.5, 901.2]), 10, None),
    (numpy.array([0, 103.1, 207.7, 296.2, 405.4, 498.8, 602.3, 709.6, 794.5, 901.2]), None, None)])
def test_targets_that_hide_a_period_are_remarked(compbox, targets, period, remark):
    _, forward, backward = readings(12, 5, len(targets), 1000)
    write_csv(compbox, targets, forward, backward)
    known = () if period is None else ("--period-mm", period)
    remarks = report(compbox, "d.csv", *known)["before"]["positioning"]["remarks"]
    assert [text.startswith(remark or "-") for text in remarks] == ([True] if remark else [])


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
    (("--budget", "laser=1"), "--budget: 'laser' is no input of a budget; the inputs are device-um, device-um-per-m, "
     "misalignment-mm, temperature-K, expansion-range, eve-um"),
    (("--budget", "eve-um=-1"), "--budget: 'eve-um=-1' must be one number, zero or more"),
    (("--material-degC", "20,21,22"), "--material-degC: takes one temperature, or those at the start and at the end"),
    (("--budget", "eve-um=1,2"), "--budget: 'eve-um=1,2' must be one number, zero or more"),
])
def test_an_option_without_its_output_is_refused(compbox, options, sentence):
    (compbox.folder / "a.csv").write_text("position_mm,error_um\n0,1\n100,2\n")
    done = compbox("report", "a.csv", *options)
    assert (done.returncode, done.stderr.splitlines()[0]) == (2, "compbox: " + sentence)
