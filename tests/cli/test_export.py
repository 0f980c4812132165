# SPDX-License-Identifier: MIT
"""compbox export: each control's file read back by a parser written here from the format alone, and
applied as that control would; the sum must be what the box itself would do."""

import json
import re

import numpy
import pytest

from conftest import PLC, ROOT

DUAL = ROOT / "examples/dual-drive/coefficients.json"

# Errors in um over u in [0, 1] of each axis' travel, ascending powers.
CURVES = {"EXX": (3, -20, 55, -30), "EYX": (0, 12, -12, 4), "EZX": (-5, 0, 25, 0, -14),
          "EXY": (0, 6, -9), "EYY": (1, 30, -42, 20), "EZZ": (0, -18, 30, 11), "EXZ": (2, 0, -8)}
TRAVEL = {"X": 1000.0, "Y": 600.0, "Z": 400.0}


def curve(name, position):
    """The error in um: the value at the end beyond it."""
    travel = TRAVEL[name[2]]
    u = min(max(position, 0.0), travel) / travel
    return sum(c * u**k for k, c in enumerate(CURVES[name]))


def error(direction, place, only=None):
    """Sum of the errors in one direction, of all axes or of one."""
    return sum(curve(n, place[n[2]]) for n in CURVES
               if n[1] == direction and (only is None or n[2] == only))


@pytest.fixture
def built(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "--travel",
                 "X=1000,Y=600,Z=400", "-o", "machine.json")
    terms = [{"name": n, "type": "polynomial", "signal": n[2], "coefficients": list(c),
              "half_range": TRAVEL[n[2]], "from": 0, "to": TRAVEL[n[2]]}
             for n, c in CURVES.items()]
    compbox.write("t.json", {"terms": terms})
    compbox.good("build", "machine.json", "t.json", "-o", "c.json")
    return compbox


def export(compbox, form, *more, name="c.json"):
    """Files by name, and the losses that were printed."""
    found = json.loads(compbox.good("export", name, "--format", form, *more, "--json", "-o", "out"))
    texts = {path.split("/")[-1]: (compbox.folder / path).read_text() for path in found["files"]}
    return texts, found["losses"]


def step_error(losses, channel, over):
    """(um, mm) that export states for one table."""
    for line in losses:
        m = re.match(rf"channel {channel} over {over}: .* error (\S+) um at (\S+) mm", line)
        if m:
            return float(m[1]), float(m[2])
    raise AssertionError((channel, over, losses))


def random_places(count=200):
    dice = numpy.random.default_rng(4)
    return [{a: float(dice.uniform(0, TRAVEL[a])) for a in "XYZ"} for _ in range(count)]


# ---- LinuxCNC ----

def read_linuxcnc(text):
    """As LinuxCNC reads it: three numbers a line, the first line that is not ends the file."""
    rows = []
    for line in text.splitlines():
        words = line.split()
        try:
            rows.append(tuple(float(w) for w in words[:3]))
        except ValueError:
            break
        if len(words) < 3:
            break
    assert 2 <= len(rows) <= 256
    assert all(a[0] < b[0] for a, b in zip(rows, rows[1:]))
    return numpy.array(rows).T


@pytest.mark.parametrize("trims", [False, True])
def test_linuxcnc(built, trims):
    texts, losses = export(built, "linuxcnc-comp", "--step-mm", 50, *(["--trims"] if trims else []))
    assert sorted(texts) == ["X.comp", "Y.comp", "Z.comp"]
    for axis in "XYZ":
        nominal, forward, reverse = read_linuxcnc(texts[f"{axis}.comp"])
        assert (forward == reverse).all()
        trim = forward if trims else nominal - forward  # added to what is commanded, mm
        stated, at = step_error(losses, axis, axis)
        dense = numpy.linspace(0, TRAVEL[axis], 5001)
        want = [-curve(f"E{axis}{axis}", p) for p in dense]
        missed = 1e3 * numpy.interp(dense, nominal, trim) - want
        worst = numpy.argmax(abs(missed))
        assert abs(missed[worst]) == pytest.approx(abs(stated), rel=0.02, abs=0.002)
        assert 1e3 * numpy.interp(at, nominal, trim) == pytest.approx(
            -curve(f"E{axis}{axis}", at) + stated, abs=0.002)
        assert f"largest table step error {stated:.3f} um" in texts[f"{axis}.comp"]
        inches = export(built, "linuxcnc-comp", "--step-mm", 50, "--unit", "inch",
                        *(["--trims"] if trims else []))[0][f"{axis}.comp"]
        in_mm = read_linuxcnc(texts[f"{axis}.comp"])
        assert abs(25.4 * read_linuxcnc(inches) - in_mm).max() < 1e-6 and "LINEAR_UNITS = inch" in inches
    # what a screw table cannot hold is stated: the cross errors of the other axes
    stated = [float(re.search(r"miss up to (\S+) um", line)[1]) for line in losses
              if line.startswith("channel Y: all tables")][0]
    dense = numpy.linspace(0, 1000, 2001)
    assert abs(stated) == pytest.approx(max(abs(curve("EYX", x)) for x in dense), abs=0.3)


def test_linuxcnc_directions(built):
    texts, _ = export(built, "linuxcnc-comp", "--step-mm", 100, "--lost-motion-um", "X=4")
    nominal, forward, reverse = read_linuxcnc(texts["X.comp"])
    for n, f, r in zip(nominal, forward, reverse):
        assert 1e3 * (f - n) == pytest.approx(curve("EXX", n) + 2, abs=0.002)  # where it really goes
        assert 1e3 * (r - n) == pytest.approx(curve("EXX", n) - 2, abs=0.002)


def test_lost_motion_counts_for_the_limit(built):
    """8 um at 1000 mm by the curve: with half of 6 um it is 11."""
    c = built.read("c.json")
    next(ch for ch in c["channels"] if ch["name"] == "X")["limit_um"] = 10
    built.write("c.json", c)
    remark = "channel X over X: the table goes beyond the box's limit_um of 10"
    for lost, expected in (("X=6", True), ("X=-6", True), ("X=2", False), ("Y=6", False)):
        losses = export(built, "linuxcnc-comp", "--step-mm", 50, "--lost-motion-um", lost)[1]
        assert (remark in losses) == expected, lost


def test_names_that_are_exchanged(built):
    texts, _ = export(built, "linuxcnc-comp", "--step-mm", 50, "--name", "X=Y", "--name", "Y=X")
    plain, _ = export(built, "linuxcnc-comp", "--step-mm", 50)
    assert read_linuxcnc(texts["Y.comp"]).tolist() == read_linuxcnc(plain["X.comp"]).tolist()


def test_a_step_that_needs_too_many_lines_is_refused(built):
    message = built.refused("export", "c.json", "--format", "linuxcnc-comp", "--step-mm", 1, "-o", "o")
    assert message == ("c.json: X from 0 to 1000 mm at 1 mm is 1001 points, and the table holds 2 to 256: "
                       "choose --step-mm from 3.9215686274509802 to 1000")
    assert not (built.folder / "o").exists()


@pytest.mark.parametrize("form, most", [("linuxcnc-comp", "2 to 2 points"), ("sinumerik-cec", "2 to 2 points"),
                                        ("twincat-cam", "3 points or fewer")])
def test_no_round_step_has_room(built, form, most):
    """No table is better than an empty one."""
    message = built.refused("export", "c.json", "--format", form, "--range", "X=0:750", "--at", "Y=0,Z=0",
                            "--most-points", 3 if form == "twincat-cam" else 2, "-o", "o")
    kind = f"no round step gives {most}: choose --step-mm, or another --range or --most-points"
    assert message == f"c.json: X from 0 to 750 mm: {kind}" and not (built.folder / "o").exists()


def test_the_step_is_chosen_to_meet_the_tolerance(built):
    texts, losses = export(built, "linuxcnc-comp", "--tolerance-um", 0.5)
    for axis in "XYZ":
        assert abs(step_error(losses, axis, axis)[0]) <= 0.5
        nominal, _, _ = read_linuxcnc(texts[f"{axis}.comp"])
        wider = export(built, "linuxcnc-comp", "--step-mm", 2.5 * (nominal[1] - nominal[0]))[1]
        assert abs(step_error(wider, axis, axis)[0]) > 0.5  # no much wider step would have done
    _, losses = export(built, "linuxcnc-comp", "--tolerance-um", 0.00001)
    assert any("does not reach the tolerance" in line for line in losses)


# ---- SINUMERIK ----

def read_sinumerik(text, header, value):
    """Assignments of a SINUMERIK file: {name: {index: value}}; `value` is the table's variable."""
    lines = text.splitlines()
    assert lines[0] == header and lines[1] == "CHANDATA(1)" and lines[-1] == "M17"
    found = {}
    for line in lines[2:-1]:
        if line.startswith(";"):
            continue
        m = re.fullmatch(r"(\$A[AN]_\w+)\[([^\]]+)\]=(?:\((\w+)\)|(-?[\d.]+))", line)
        assert m, line
        assert m[2] not in found.setdefault(m[1], {}), line
        found[m[1]][m[2]] = m[3] or float(m[4])
    assert value in found
    return found


def points_of(found, value, key, settings):
    """Positions and values of one table, which must be equidistant and whole."""
    step, low, high = (found[f"{value}_{s}"][settings] for s in ("STEP", "MIN", "MAX"))
    table = {k: v for k, v in found[value].items() if key(k) is not None}
    count = len(table)
    values = [v for _, v in sorted((key(k), v) for k, v in table.items())]
    assert sorted(key(k) for k in table) == list(range(count))
    assert low + (count - 1) * step == pytest.approx(high, abs=1e-6)
    assert found[f"{value}_IS_MODULO"][settings] == 0
    return numpy.array([low + k * step for k in range(count)]), numpy.array(values)


def test_lec(built):
    texts, losses = export(built, "sinumerik-lec", "--step-mm", 70)  # 1000 is no multiple of 70
    found = read_sinumerik(texts["AX_EEC.INI"], "%_N_AX_EEC_INI", "$AA_ENC_COMP")
    for axis in "XYZ":
        x, v = points_of(found, "$AA_ENC_COMP",
                         lambda k: int(k.split(",")[1]) if k.endswith(f",{axis}1") else None,
                         f"0,{axis}1")
        assert x[-1] >= TRAVEL[axis]
        for p in numpy.linspace(0, TRAVEL[axis], 333):
            # a positive value moves the axis in the negative direction
            applied = -1e3 * numpy.interp(p, x, v)
            bound = abs(step_error(losses, axis, axis)[0]) * 1.02 + 0.002
            assert applied == pytest.approx(-curve(f"E{axis}{axis}", p), abs=bound)


def cec_sum(found, place, forward=True):
    """What all tables add to each axis, um, while every axis moves forward or backward."""
    total = dict.fromkeys(("X1", "Y1", "Z1"), 0.0)
    for t in found["$AN_CEC_STEP"]:
        if found["$AN_CEC_DIRECTION"][t] == (-1 if forward else 1):
            continue
        assert found["$AN_CEC_MULT_BY_TABLE"][t] == 0
        x, v = points_of(found, "$AN_CEC",
                         lambda k: int(k.split(",")[1]) if k.split(",")[0] == t else None, t)
        position = place[found["$AN_CEC_INPUT_AXIS"][t][0]]
        total[found["$AN_CEC_OUTPUT_AXIS"][t]] -= 1e3 * numpy.interp(position, x, v)
    return total


def test_cec_holds_the_whole_file(built):
    texts, losses = export(built, "sinumerik-cec", "--tolerance-um", 0.05, "--first-table", 3)
    found = read_sinumerik(texts["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    assert sorted(map(int, found["$AN_CEC_STEP"])) == list(range(3, 10))  # seven curves
    for place in random_places():
        total = cec_sum(found, place)
        for axis in "XYZ":
            assert total[f"{axis}1"] == pytest.approx(-error(axis, place), abs=0.16)
    missed = [float(re.search(r"miss up to (\S+) um", x)[1]) for x in losses if "all tables" in x]
    assert len(missed) == 3 and 0 < max(map(abs, missed)) < 0.16


def test_cec_directions_names_and_sign(built):
    texts, _ = export(built, "sinumerik-cec", "--lost-motion-um", "X=6", "--step-mm", 10)
    found = read_sinumerik(texts["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    place = {"X": 730.0, "Y": 310.0, "Z": 90.0}
    assert cec_sum(found, place)["X1"] == pytest.approx(-error("X", place) - 3, abs=0.1)
    assert cec_sum(found, place, False)["X1"] == pytest.approx(-error("X", place) + 3, abs=0.1)
    turned, _ = export(built, "sinumerik-cec", "--step-mm", 10, "--sign", "-1", "--name", "X=MX1")
    other = read_sinumerik(turned["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    assert set(other["$AN_CEC_OUTPUT_AXIS"].values()) == {"MX1", "Y1", "Z1"}
    t = next(t for t, axis in other["$AN_CEC_INPUT_AXIS"].items()
             if axis == "Z1" == other["$AN_CEC_OUTPUT_AXIS"][t])
    assert 1e3 * other["$AN_CEC"][f"{t},40"] == pytest.approx(-curve("EZZ", 400), abs=0.001)


# ---- HEIDENHAIN ----

def read_com(text, name):
    """A TNC table: columns where their names stand; an empty cell is None."""
    lines = text.split("\n")
    assert lines[0] == f"BEGIN {name} MM" and lines[-2:] == ["[END]", ""]
    starts = [(m.group(), m.start()) for m in re.finditer(r"\S+", lines[1])]
    assert [n for n, _ in starts[:3]] == ["NR", "AXISPOS", "BACKLASH"]
    ends = [s for _, s in starts[1:]] + [None]
    rows = []
    for k, line in enumerate(lines[2:-2]):
        cells = [line[s:e].strip() for (_, s), e in zip(starts, ends)]
        assert cells[0] == str(k)
        rows.append({n: float(c) if c else None for (n, _), c in zip(starts[1:], cells[1:])})
    return rows


def test_heidenhain(built):
    texts, losses = export(built, "heidenhain-com", "--step-mm", 25, "--lost-motion-um", "X=5")
    assert any("write the control's .CMA table by hand" in line for line in losses)
    assert ".CMA" in texts["EXPORT.TXT"]
    assert built("export", "c.json", "--format", "heidenhain-com", "--unit", "inch", "-o", "o").returncode == 2
    assert sorted(texts) == ["EXPORT.TXT", "X.COM", "Y.COM", "Z.COM"]
    tables = {a: read_com(texts[f"{a}.COM"], f"{a}.COM") for a in "XYZ"}
    assert list(tables["X"][0]) == ["AXISPOS", "BACKLASH", "X", "Y", "Z"]
    assert list(tables["Y"][0]) == ["AXISPOS", "BACKLASH", "X", "Y"]
    for row in tables["X"]:
        x = row["AXISPOS"]
        assert 1e3 * row["X"] == pytest.approx(curve("EXX", x) + 2.5, abs=0.002)
        assert 1e3 * row["BACKLASH"] == pytest.approx(curve("EXX", x) - 2.5, abs=0.002)
        assert 1e3 * row["Z"] == pytest.approx(curve("EZX", x), abs=0.002)
    assert all(row["BACKLASH"] is None for row in tables["Y"])
    for line in losses:
        assert line in texts["EXPORT.TXT"]


# ---- TwinCAT, S4 ----

def read_cam(text):
    rows = [tuple(map(float, line.split(","))) for line in text.split("\n") if line]
    master, slave = numpy.array(rows).T
    assert all(numpy.diff(master) > 0)
    return master, slave


def s4(x, y):
    """The paper's cams in mm, from its formulas."""
    Xx1, Xx2 = -0.714 - 1.028 * x, -4.347 - 0.733 * x
    Yy4, Yy5 = -5.9153 - 0.537 * y, -1.8825 - 0.732 * y
    Yx = -2.8263 + 0.5518 * x - 0.0033 * x**2
    Xy = 1.424 - 0.2278 * y + 0.0279 * y**2 - 0.0004 * y**3 + 1.803e-6 * y**4
    return {"X1": x - 1e-3 * (Xx1 + Xy), "X2": x - 1e-3 * (Xx2 + Xy),
            "Y4": y - 1e-3 * (Yy4 + Yx), "Y5": y - 1e-3 * (Yy5 + Yx)}


@pytest.mark.parametrize("formula, path", [
    ("Y=X", lambda x: x),
    ("Y = 60 + 50*sin(pi*X/60)", lambda x: 60 + 50 * numpy.sin(numpy.pi * x / 60)),
    ("Y=-(X-60)^2/60+100", lambda x: -(x - 60) ** 2 / 60 + 100)])
def test_cams_of_a_dual_drive_table(compbox, formula, path):
    formula = formula.replace("Y = ", "Y=")
    texts, losses = export(compbox, "twincat-cam", "--path", formula, "--range", "X=0:120",
                           "--tolerance-um", 0.2, name=DUAL)
    assert sorted(texts) == ["EXPORT.TXT", "X1.csv", "X2.csv", "Y4.csv", "Y5.csv"]
    dense = numpy.linspace(0, 120, 4001)
    for name in ("X1", "X2", "Y4", "Y5"):
        master, slave = read_cam(texts[f"{name}.csv"])
        assert (master[0], master[-1]) == (0, 120)
        missed = [1e3 * (numpy.interp(x, master, slave) - s4(x, path(x))[name]) for x in dense]
        assert max(map(abs, missed)) <= 0.202
        stated = [float(re.search(r"error (\S+) um", x)[1]) for x in losses
                  if x.startswith(f"channel {name}:")][0]
        assert max(map(abs, missed)) == pytest.approx(abs(stated), rel=0.05, abs=0.003)
    assert "right on this path only" in texts["EXPORT.TXT"]


def test_a_cam_path_from_a_file(compbox):
    compbox.write("path.csv", "X,Y\n0,10\n40,50\n120,20\n")
    texts, _ = export(compbox, "twincat-cam", "--path", "path.csv", "--step-mm", 10, name=DUAL)
    master, slave = read_cam(texts["Y5.csv"])
    assert list(master) == list(range(0, 121, 10))
    for x, y in zip(master, slave):
        assert y == pytest.approx(s4(x, numpy.interp(x, [0, 40, 120], [10, 50, 20]))["Y5"], abs=2e-6)


# ---- what cannot be put into a table ----

def test_signals_that_are_no_position_must_be_held(built):
    c = built.read("c.json")
    c["signals"].append({"name": "T1", "unit": "degC", "plc": 14, "min": 0, "max": 60})
    c["terms"] += [{"name": "grow", "type": "linear", "inputs": ["T1"], "weights": [0.5],
                    "constant": -10},
                   {"name": "slope", "type": "linear", "inputs": ["T1"], "weights": [0.001],
                    "constant": -0.02},
                   {"name": "stretch", "type": "product", "term": "slope", "signal": "X"}]
    next(ch for ch in c["channels"] if ch["name"] == "X")["sum"] += ["grow", "stretch"]
    built.write("c.json", c)
    call = ("export", "c.json", "--format", "linuxcnc-comp", "-o", "out")
    assert built.refused(*call) == ("c.json: a table cannot follow the signal T1: say at which value it shall "
                                    "hold, --at T1=…")
    texts, losses = export(built, "linuxcnc-comp", "--at", "T1=30", "--step-mm", 50)
    nominal, forward, _ = read_linuxcnc(texts["X.comp"])
    for n, f in zip(nominal, forward):
        assert 1e3 * (f - n) == pytest.approx(curve("EXX", n) + 5 + 0.01 * n, abs=0.003)
    assert "tables hold T1 at 30" in losses


def test_branches_of_direction(built):
    """EXX differs by 4 um at x = 0 and 8 um at 1000 mm: C+ is the curve, C- lies lower."""
    c = built.read("c.json")
    exx = next(t for t in c["terms"] if t["name"] == "EXX")
    up = list(CURVES["EXX"])
    down = [up[0] - 4, up[1] - 4, *up[2:]]
    exx |= {"reversal_mm": 0.5, "backward": {"coefficients": down, "half_range": 1000, "from": 0,
                                            "to": 1000}}
    built.write("c.json", c)
    texts, losses = export(built, "linuxcnc-comp", "--step-mm", 20)
    nominal, forward, reverse = read_linuxcnc(texts["X.comp"])
    for n, f, r in zip(nominal, forward, reverse):
        assert 1e3 * (f - n) == pytest.approx(curve("EXX", n), abs=0.003)
        assert 1e3 * (r - n) == pytest.approx(curve("EXX", n) - 4 - 4 * n / 1000, abs=0.003)
    texts, _ = export(built, "sinumerik-cec", "--step-mm", 10)
    found = read_sinumerik(texts["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    place = {"X": 730.0, "Y": 310.0, "Z": 90.0}
    assert cec_sum(found, place)["X1"] == pytest.approx(-error("X", place), abs=0.1)
    assert cec_sum(found, place, False)["X1"] == pytest.approx(-error("X", place) + 6.92, abs=0.1)
    texts, _ = export(built, "heidenhain-com", "--step-mm", 25)
    for row in read_com(texts["X.COM"], "X.COM"):
        x = row["AXISPOS"]
        assert 1e3 * row["X"] == pytest.approx(curve("EXX", x), abs=0.003)
        assert 1e3 * row["BACKLASH"] == pytest.approx(curve("EXX", x) - 4 - x / 250, abs=0.003)
    remark = "channel X over X: the table goes beyond the box's limit_um of 6"
    for limit_um, expected in ((6, True), (9, False)):  # 8 um forward at 1000 mm, 4 um in the mean
        next(ch for ch in c["channels"] if ch["name"] == "X")["limit_um"] = limit_um
        built.write("limited.json", c)
        assert (remark in export(built, "linuxcnc-comp", "--step-mm", 20, name="limited.json")[1]) == expected
    texts, losses = export(built, "sinumerik-lec", "--step-mm", 25)
    assert "channel X over X: forward and backward differ; the table holds their mean" in losses
    assert built.refused("export", "c.json", "--format", "linuxcnc-comp", "--lost-motion-um", "X=4",
                         "-o", "o") == (
        "c.json: the curve of channel X has branches, which hold the lost motion already; leave out "
        "--lost-motion-um X")
    found = read_sinumerik(texts["AX_EEC.INI"], "%_N_AX_EEC_INI", "$AA_ENC_COMP")
    assert 1e3 * found["$AA_ENC_COMP"]["0,20,X1"] == pytest.approx(curve("EXX", 500) - 3, abs=0.003)


def test_a_volumetric_term_is_taken_apart_and_the_rest_is_stated(built):
    c = built.read("c.json")
    c["terms"] += [{"name": "ECX", "type": "polynomial", "signal": "X", "coefficients": [0, 40],
                    "half_range": 1000, "from": 0, "to": 1000},
                   {"name": "vol", "type": "volumetric", "outputs": ["vx", "vy", "vz"],
                    "chain": "fXYZ", "errors": ["ECX"]}]
    next(ch for ch in c["channels"] if ch["name"] == "X")["sum"] += ["vx"]
    built.write("c.json", c)
    texts, losses = export(built, "sinumerik-cec", "--at", "X=0,Y=200", "--tolerance-um", 0.05)
    found = read_sinumerik(texts["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    # E_x = -ECX(x) y: with X held at 0 the table over Y has nothing of it, that over X has y = 200
    place = {"X": 500.0, "Y": 200.0, "Z": 100.0}
    assert cec_sum(found, place)["X1"] == pytest.approx(-error("X", place) + 0.02 * 200, abs=0.16)
    stated = [re.search(r"miss up to (\S+) um.*X (\S+), Y (\S+),", x) for x in losses
              if x.startswith("channel X: all tables")][0]
    missed, x, y = (float(stated[k]) for k in (1, 2, 3))
    assert missed == pytest.approx(4e-5 * x * (y - 200), abs=0.2)
    assert abs(missed) > 15  # up to 40 urad over 400 mm


def test_the_tool_length_is_no_axis(built):
    c = built.read("c.json")
    c["signals"].append({"name": "L", "unit": "mm", "plc": 14, "min": 0, "max": 500})
    c["terms"] += [{"name": "EBX", "type": "polynomial", "signal": "X", "coefficients": [0, 40],
                    "half_range": 1000, "from": 0, "to": 1000},
                   {"name": "vol", "type": "volumetric", "outputs": ["vx", "vy", "vz"],
                    "chain": "XYZf", "errors": ["EBX"], "tool_length": "L"}]
    next(ch for ch in c["channels"] if ch["name"] == "X")["sum"] += ["vx"]
    built.write("c.json", c)
    call = ("export", "c.json", "--format", "sinumerik-cec", "-o", "out")
    assert built.refused(*call).startswith("c.json: a table cannot follow the signal L")
    texts, _ = export(built, "sinumerik-cec", "--at", "L=200", "--tolerance-um", 0.05)
    found = read_sinumerik(texts["NC_CEC.INI"], "%_N_NC_CEC_INI", "$AN_CEC")
    assert set(found["$AN_CEC_INPUT_AXIS"].values()) == {"X1", "Y1", "Z1"}
    # E_x = EBX(x) (z - L); x stands in the middle, where the tables hold it
    place = {"X": 500.0, "Y": 10.0, "Z": 20.0}
    assert cec_sum(found, place)["X1"] == pytest.approx(-error("X", place) + 0.02 * 180, abs=0.2)


def test_no_table_fits(compbox):
    compbox.good("init", *PLC, "--axes", "XY", "--profile", "generic", "--travel", "X=100,Y=100", "-o", "m")
    compbox.write("t", {"terms": [{"name": "EYX", "type": "polyline", "signal": "X",
                                   "positions": [0, 100], "values": [0, 9]}]})
    compbox.good("build", "m", "t", "-o", "c.json")
    assert compbox.refused("export", "c.json", "--format", "linuxcnc-comp", "-o", "o").startswith(
        "c.json: no channel has an error that depends on its own axis")


@pytest.mark.parametrize("options, message", [
    (("linuxcnc-comp", "--range", "Q=0:1"), "c.json: has no signal 'Q' (--range)"),
    (("linuxcnc-comp", "--at", "Q=1"), "c.json: has no signal 'Q' to be set (it has X, Y, Z)"),
    (("linuxcnc-comp", "--lost-motion-um", "Q=1"), "c.json: has no channel 'Q' (--lost-motion-um)"),
    (("linuxcnc-comp", "--axis", "Q=X"), "c.json: has no channel 'Q' (--axis)"),
    (("linuxcnc-comp", "--at", "Y=6000"), "c.json: Y 6000 is outside -10 to 610 (--at)"),
    (("twincat-cam", "--at", "Y=6000,Z=0"), "c.json: Y 6000 is outside -10 to 610 (--at)"),
    (("linuxcnc-comp", "--axis", "X=C"),
     "c.json: channel X moves an axis in mm, and C is no position in mm (--axis)"),
    (("twincat-cam", "--path", "path.csv", "--range", "X=0:500", "--at", "Z=0"),
     "path.csv: has X from 0 to 400 only, and --range asks for 0 to 500"),
    (("twincat-cam", "--path", "path.csv", "--path", "Y=X", "--at", "Z=0"),
     "path.csv:1: Y has a formula already (--path)"),
    (("linuxcnc-comp", "--axis", "X=Q"), "c.json: has no signal 'Q' to be set (it has X, Y, Z)"),
    (("twincat-cam",), 'c.json: channel X depends on Y: give it along the path, --path "Y=formula of X", '
     "or a fixed value, --at Y=…"),
    (("twincat-cam", "--path", "Y=X*", "--at", "Z=0"),
     "the formula 'X*' cannot be read at character 3: a number, X or ( was expected"),
    (("twincat-cam", "--path", "Y=tin(X)", "--at", "Z=0"),
     "the formula 'tin(X)' cannot be read at character 1: 'tin' is neither X nor a function"),
    (("twincat-cam", "--path", "Y=2*X", "--at", "Z=0"),
     "c.json: at X 310 the path has Y 620, outside -10 to 610"),
    (("twincat-cam", "--path", "no.csv", "--at", "Z=0"),
     "no.csv: cannot open the file (No such file or directory)"),
    (("twincat-cam", "--path", "down.csv", "--at", "Z=0"),
     "down.csv:3: X must ascend, since a cam has one slave position for each master position"),
    (("twincat-cam", "--path", "Y=sqrt(0-X-1)", "--at", "Z=0"),
     "c.json: at X 0 the path has Y -nan, outside -10 to 610")])
def test_refused(built, options, message):
    built.write("down.csv", "X,Y\n5,1\n4,2\n")
    built.write("path.csv", "X,Y\n0,1\n400,2\n")
    if "X=C" in options:
        c = built.read("c.json")
        c["signals"].append({"name": "C", "unit": "deg", "plc": 14, "min": 0, "max": 360})
        built.write("c.json", c)
    reported = built.refused("export", "c.json", "--format", *options, "--step-mm", 10, "-o", "o")
    assert reported.replace("Y nan", "Y -nan") == message


@pytest.mark.parametrize("wrong", [
    [], ["--format", "fanuc"], ["--format", "sinumerik-lec", "--lost-motion-um", "X=1"],
    ["--format", "twincat-cam", "--lost-motion-um", "X=1"],
    ["--format", "linuxcnc-comp", "--step-mm", "0"], ["--format", "linuxcnc-comp", "--range", "X=5"],
    ["--format", "linuxcnc-comp", "--range", "X=5:1"], ["--format", "linuxcnc-comp", "--at", "X"],
    ["--format", "linuxcnc-comp", "--sign", "2"], ["--format", "linuxcnc-comp", "--name", "=q"],
    ["--format", "linuxcnc-comp", "--name", "X=A", "--name", "Y=A"],
    ["--format", "linuxcnc-comp", "--name", "X=A", "--name", "X=B"],
    ["--format", "linuxcnc-comp", "--name", "X=Y"], ["--format", "heidenhain-com", "--name", "Z=X"],
    ["--format", "sinumerik-lec", "--name", "X=Y1"], ["--format", "sinumerik-cec", "--name", "Z=X1"],
    ["--format", "sinumerik-cec", "--trims"], ["--format", "linuxcnc-comp", "--first-table", "3"],
    ["--format", "heidenhain-com", "--master", "Y"], ["--format", "linuxcnc-comp", "--path", "Y=X"],
    ["--format", "sinumerik-lec", "--pmc-base", "100"], ["--format", "linuxcnc-comp", "--pmc-base", "1"],
    ["--format", "plc-db", "--tolerance-um", "1"], ["--format", "plc-db", "--trims"],
    ["--format", "twincat-cam", "--path", "Y=X", "--at", "Z=0", "--name", "X=A"],
    ["--format", "twincat-cam", "--path", "Y=X", "--at", "Z=0", "--range", "Y=0:100"],
    ["--format", "linuxcnc-comp", "--range", "X=0:100,X=0:200"],
    ["--format", "linuxcnc-comp", "--axis", "X=X", "--axis", "X=Y"],
    ["--format", "linuxcnc-comp", "--at", "Z=0", "--at", "Z=1"],
    ["--format", "twincat-cam", "--path", "Y=X", "--at", "Z=0", "--sign", "-1"],
    ["--format", "plc-program", "--sign", "-1"],
    ["--format", "twincat-cam", "--path", "Y=X", "--path", "Y=2*X", "--at", "Z=0"],
    ["--format", "twincat-cam", "--path", "a.csv", "--path", "b.csv", "--at", "Z=0"]])
def test_wrong_usage(built, wrong):
    assert built("export", "c.json", *wrong, "-o", "o").returncode == 2


def test_help(compbox):
    assert "compbox export " in compbox.good("export", "--help").split("Example:")[1]
