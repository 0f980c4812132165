# SPDX-License-Identifier: MIT
"""Files that people have: other units, words, lines and programs. Each is read right or refused with a
sentence; none gives wrong figures in silence."""

import json
import math

import pytest

X = [0, 100, 200, 300, 400, 500]
E = [0.5, -1.5, 2.0, 3.5, 2.5, -1.0]  # µm


def read(compbox, text, *more, name="d.csv", encoding="utf-8"):
    """The mean at each position and the unit, by report: range of the mean error M, unit."""
    (compbox.folder / name).write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return json.loads(compbox.good("report", name, *more, "--json"))["before"]


def means(found, direction="forward"):
    return found["positioning"][direction]["mean"]


def refused(compbox, text, *more, name="d.csv"):
    (compbox.folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return compbox.refused("report", name, *more)


def table(header, x_scale=1.0, e_scale=1.0, separator=",", rows=None):
    lines = [header] + [f"{x * x_scale!r}{separator}{e * e_scale!r}" for x, e in rows or zip(X, E)]
    return "\n".join(lines) + "\n"


# ---- units

@pytest.mark.parametrize("position, x_scale, error, e_scale", [
    ("in", 1 / 25.4, "µin", 1 / 0.0254), ("Inch", 1 / 25.4, "inch", 1 / 25400), ("Zoll", 1 / 25.4, "thou", 1 / 25.4),
    ("m", 1e-3, "mil", 1 / 25.4), ("cm", 0.1, "microns", 1), ("英寸", 1 / 25.4, "微米", 1)])
def test_lengths(compbox, position, x_scale, error, e_scale):
    found = read(compbox, table(f"Position ({position}),Error ({error})", x_scale, e_scale))
    assert found["unit"] == "um" and means(found) == pytest.approx(E, rel=1e-9)
    assert found["positioning"]["targets_mm"] == pytest.approx(X, rel=1e-9)


@pytest.mark.parametrize("unit, urad", [
    ("deg", 17453.292519943295), ("°", 17453.292519943295), ("arcmin", 290.88820866572158),
    ("arc sec", 4.84813681109536), ("″", 4.84813681109536), ("Winkelsekunden", 4.84813681109536), ("mrad", 1e3),
    ("µrad", 1), ("µm/m", 1), ("mm/m", 1e3), ("gon", 15707.963267948966)])
def test_angles(compbox, unit, urad):
    found = read(compbox, table(f"Pos [mm],Error [{unit}]", e_scale=1 / urad))
    assert found["unit"] == "urad" and means(found) == pytest.approx(E, rel=1e-9)


def test_units_in_a_second_header_line(compbox):
    text = "Position;Abweichung;Lauf\nmm;µm;-\n" + "".join(f"{x};{str(e).replace('.', ',')};1\n" for x, e in zip(X, E))
    assert means(read(compbox, text, encoding="cp1252")) == E
    assert means(read(compbox, text.replace("mm;µm;-", "[mm];[µm];"))) == E
    assert means(read(compbox, "Messprotokoll\n\n" + text)) == E


def test_units_of_an_option(compbox):
    bare = table("Position,Abweichung")
    assert means(read(compbox, bare, "--unit", "mm,um")) == E
    assert means(read(compbox, table("Position,Abweichung", 1 / 25.4, 1 / 25400), "--unit", "inch")) == pytest.approx(E)
    assert refused(compbox, bare) == (
        "d.csv:1: the column 'Position' has no unit; append it, as in 'Position (mm)', or give --unit mm,um (position, "
        "error)")
    assert "no unit" in refused(compbox, bare, "--unit", "um")  # of the error alone
    assert refused(compbox, bare, "--unit", "furlong").startswith("--unit: 'furlong' must be the unit of the error, or")


@pytest.mark.parametrize("header, message", [
    ("Position (mm),Error (div)", "the column 'Error (div)' has a unit that is not known; known are mm, um, nm"),
    ("Position (mm),Error (V)", "the column 'Error (V)' has a unit that is not known"),
    ("Position (V),Error (um)", "the column 'Position (V)' has a unit that is not known"),
    ("Position (deg),Error (arcsec)", "the positions are angles; rotary axes are not read yet"),
    ("Position (mm),Position (m),Error (um)", None)])
def test_units_that_are_refused(compbox, header, message):
    if message is None:
        text = header + "\n0,0,1\n100,0.1,2\n"
        assert refused(compbox, text) == "d.csv:1: has the columns position_mm and position_m; keep one of them"
    else:
        assert refused(compbox, table(header)).startswith("d.csv:1: " + message)


# ---- nominal and measured position

def soll_ist(header, separator=";", comma=True, sign=1.0):
    rows = "".join(f"{x:.4f}{separator}{x + sign * e / 1000:.4f}\n" for x, e in zip(X, E))
    return header + "\n" + (rows.replace(".", ",") if comma else rows)


@pytest.mark.parametrize("header", [
    "Soll [mm];Ist [mm]", "Sollposition (mm);Istposition (mm)", "Soll-Position [mm];Ist-Position [mm]",
    "Consigne (mm);Mesuré (mm)", "Nominale [mm];Misurato [mm]", "目标位置(mm);实际位置(mm)", "Target [mm];Measured [mm]",
    "Nominal (mm);Actual (mm)"])
def test_measured_less_nominal(compbox, header):
    assert means(read(compbox, soll_ist(header))) == pytest.approx(E, abs=1e-9)


def test_nominal_and_measured_without_units(compbox):
    assert means(read(compbox, soll_ist("Soll;Ist"), "--unit", "mm")) == pytest.approx(E, abs=1e-9)
    assert "the column 'Soll' has no unit" in refused(compbox, soll_ist("Soll;Ist"))
    assert means(read(compbox, soll_ist("Soll;Ist\nmm;mm"))) == pytest.approx(E, abs=1e-9)


def test_a_number_of_the_point_beside_the_nominal_position(compbox):
    rows = "".join(f"{i};{x};{x + e / 1000:.4f}\n" for i, (x, e) in enumerate(zip(X, E), 1))
    assert means(read(compbox, "Pos. (mm);Soll (mm);Ist (mm)\n" + rows)) == pytest.approx(E, abs=1e-9)


def test_runs_of_measured_positions(compbox):
    rows = "".join(f"{x};{x + e / 1000:.4f};{x - e / 1000:.4f}\n" for x, e in zip(X, E))
    found = read(compbox, "Soll (mm);Ist 1 vorwärts (mm);Ist 1 rückwärts (mm)\n" + rows)
    assert means(found) == pytest.approx(E, abs=1e-9)
    assert means(found, "backward") == pytest.approx([-e for e in E], abs=1e-9)


@pytest.mark.parametrize("content, message", [
    ("Soll (mm);Ist (mm)\n0;0\n100;3\n200;-1\n300;2\n", "the measured position does not follow the nominal one"),
    ("Soll (mm);Ist (mm)\n0;0\n100;3.937\n200;7.874\n", "the measured position does not follow the nominal one"),
    ("Soll (mm);Ist (mm);Abweichung (µm)\n0;0.001;-1\n100;100.002;-2\n200;200.001;-1\n",
     "the error is the nominal less the measured position; compbox takes measured less nominal")])
def test_positions_that_do_not_fit(compbox, content, message):
    assert refused(compbox, content).startswith("d.csv:1: " + message)


def test_a_deviation_that_agrees_with_the_measured_position(compbox):
    text = "Soll (mm);Ist (mm);Abweichung (µm)\n0;0.001;1\n100;100.002;2\n200;200.001;1\n"
    assert means(read(compbox, text)) == [1, 2, 1]


def test_a_reading_in_micrometres_is_a_deviation(compbox):
    assert means(read(compbox, table("Soll (mm),Messwert (µm)"))) == E


# ---- runs and directions

@pytest.mark.parametrize("forward, backward, encoding", [
    ("vorwärts", "rückwärts", "utf-8"), ("vorwärts", "rückwärts", "cp1252"), ("vorwärts", "rückwärts", "utf-16"),
    ("VORWÄRTS", "RÜCKWÄRTS", "utf-8-sig"), ("vorwaerts", "rueckwaerts", "utf-8"), ("vorwarts", "ruckwarts", "ascii"),
    ("hin", "zurück", "cp1252"), ("aller", "retour", "utf-8"), ("avanti", "indietro", "utf-8"),
    ("ida", "vuelta", "utf-8"), ("↑", "↓", "utf-8"), ("pos", "neg", "utf-8"), ("正向", "负向", "utf-8")])
def test_directions(compbox, forward, backward, encoding):
    rows = "".join(f"{x},{e + d},Lauf 1,{w}\n" for w, d in ((forward, 0), (backward, 1)) for x, e in zip(X, E))
    found = read(compbox, "Position [mm],Abweichung [um],Lauf,Richtung\n" + rows, encoding=encoding)
    assert means(found) == E and means(found, "backward") == [e + 1 for e in E]


@pytest.mark.parametrize("forward, backward", [
    ("Lauf 1 vorwärts [µm]", "Lauf 1 rückwärts [µm]"), ("vorwärts 1 [µm]", "rückwärts 1 [µm]"),
    ("vorwärts [µm]", "rückwärts [µm]"), ("Abweichung vorwärts [µm]", "Abweichung rückwärts [µm]"),
    ("Run 1 + (um)", "Run 1 - (um)"), ("Messung 1 hin (um)", "Messung 1 zurück (um)")])
def test_a_column_for_each_direction(compbox, forward, backward):
    rows = "".join(f"{x};{e};{e + 1}\n" for x, e in zip(X, E))
    found = read(compbox, f"Position [mm];{forward};{backward}\n" + rows)
    assert means(found) == E and means(found, "backward") == [e + 1 for e in E]


# ---- lines, code pages, foreign files

@pytest.mark.parametrize("end", ["\r", "\r\n", "\n", "\r\r\n"])
def test_line_ends(compbox, end):
    text = table("position_mm,error_um").replace("\n", end)
    assert means(read(compbox, text.encode())) == E
    laser = LASER.replace("\n", end)
    assert means(read(compbox, laser.encode(), name="d.rtl")) == E


@pytest.mark.parametrize("content, message", [
    (b"PK\x03\x04\x14\x00xl/workbook.xml", "is a workbook of Excel (.xlsx): save it as CSV"),
    (b"PK\x03\x04mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
     "is a workbook of LibreOffice (.ods): save it as CSV"),
    (b"PK\x03\x04other", "is a ZIP archive or a workbook: unpack it, or save it as CSV"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1....", "is a workbook of an old Excel (.xls): save it as CSV"),
    (b"%PDF-1.7 ...", "is a PDF: export the readings as CSV or .rtl"),
    (b"<html><table>", "is a page in HTML, not a table: save it as CSV"),
    (b"\x1f\x8b\x08...", "is compressed (gzip): unpack it first")])
def test_files_that_are_no_text(compbox, content, message):
    for name in ("d.csv", "d.rtl"):
        assert refused(compbox, content, name=name) == f"{name}: {message}"


# ---- laser files

LASER = ("HEADER::\nFile type  : rtl\nOwner      : Linear\nTARGET DATA::\nFiletype  : ISO\nTarget-count: 6\n"
         "Targets :\n" + " ".join(map(str, X))
         + "\nFlags: 0 1 2 0\nUSER-TEXT::\nMachine:m\nRUNS::\nRun-count:1\nDEVIATIONS::\n"
         "Run Target Data:\n" + "".join(f"1 {i} {e}\n" for i, e in enumerate(E, 1)) + "ENVIRONMENT::\n"
         "Air temp   : 20.337280 20.384956 0\nMat temp 1 : 20.203292 20.321342 0\n"
         "Mat temp 2 : -10.000000 -10.000000 0\nExp coeff  : 11.700000 11.700000 0\nEOF::\n")
NO_KIND = LASER.replace("File type  : rtl\nOwner      : Linear\n", "")


@pytest.mark.parametrize("name", ["d.rtl", "d.RTL", "d.rts", "d.txt", "d", "d.csv"])
def test_a_laser_file_is_known_by_its_content(compbox, name):
    assert means(read(compbox, LASER, name=name)) == E


def test_the_kind_of_a_laser_file(compbox):
    angular = LASER.replace("rtl", "rta").replace("Linear", "Angular")
    for name in ("d.rta", "d.txt"):
        found = read(compbox, angular, name=name)
        assert found["unit"] == "urad" and means(found) == [1000 * e for e in E]
    assert means(read(compbox, NO_KIND, name="d.rts")) == E
    assert refused(compbox, NO_KIND, name="d.txt") == (
        "d.txt: states neither in its header nor by its name whether it holds lengths or angles: give --unit um or "
        "--unit mrad")
    assert means(read(compbox, NO_KIND, "--unit", "mm", name="d.txt")) == [1000 * e for e in E]
    assert refused(compbox, LASER, name="d.rta") == (
        "d.rta: holds lengths by its header and angles by its name: give --unit um or --unit mrad")
    assert "rotary axis" in refused(compbox, LASER.replace("Linear", "Rotary").replace(": rtl", ": x"), name="d.rtx")


def test_the_environment_is_printed_and_kept(compbox):
    compbox.write("d.rtl", LASER)
    line = "air 20.3 to 20.4 °C, material 20.2 to 20.3 °C, readings converted to 20 °C by 11.7 um/m per K"
    assert line in compbox.good("report", "d.rtl")
    assert line in compbox.good("fit", "d.rtl", "--name", "EXX", "--signal", "X", "-o", "t.json")
    found = compbox.read("t.json")["provenance"]["EXX"]["environment"]
    assert found["material_compensated"] and found["expansion_um_per_m_K"] == 11.7
    assert found["air_degC"] == [20.337, 20.385] and len(found["material_degC"]) == 1


# ---- exports as programs write them: each right, or refused with a sentence

ODD = {
    "Excel, German: semicolon, decimal comma, CRLF, BOM":
        ("\ufeffPosition [mm];Abweichung [µm]\r\n0,000;0,5\r\n100,000;-1,5\r\n200,000;2,0\r\n", [0.5, -1.5, 2]),
    "Excel, French: semicolon, accents": ("Position (mm);Écart (µm)\r\n0;0,5\r\n100;-1,5\r\n200;2\r\n", [0.5, -1.5, 2]),
    "LibreOffice: quoted texts": ('"Position (mm)","Error (µm)"\n0,0.5\n100,-1.5\n200,2\n', [0.5, -1.5, 2]),
    "LibreOffice, Italian: tab": ("Quota nominale\tErrore (µm)\n0\t0,5\n100\t-1,5\n",
                                  "d.csv:1: there is no column 'position_mm'"),
    "XL-80 CARTO-like CSV with lines above":
        ("Title,Linear test\nMachine,Mill\n\nTarget (mm),Run 1 (µm),Run 2 (µm)\n0,0.5,0.7\n100,-1.5,-1.3\n200,2,2.2\n",
         [0.6, -1.4, 2.1]),
    "Agilent 5529A-like: tab, lines above":
        ("5529A Metrology\tLinear\nAxis:\tX\nNominal (mm)\tRun 1 + (um)\tRun 1 - (um)\n0\t0.5\t1.5\n100\t-1.5\t-0.5\n",
         [0.5, -1.5]),
    "API-like: Position, Bidirectional Avg Error":
        ("Position (mm)\tBidirectional Avg Error (um)\n0\t0.5\n100\t-1.5\n", "d.csv:1: there is no column 'error_um'"),
    "Status Pro-like: inch": ("Target [in];Deviation [mil]\n0;0.02\n4;-0.06\n", [0.508, -1.524]),
    "oscilloscope: time and volts":
        ("Time [s],CH1 [V]\n0,0.1\n1e-3,0.2\n", "d.csv:1: there is no column 'position_mm'"),
    "trailing separators": ("Position (mm);Error (um);;\n0;0.5;;\n100;-1.5;;\n;;;\n", [0.5, -1.5]),
    "thousands with a point":
        ("Position [mm];Abweichung [µm]\n0;0,5\n500;1,5\n1.000;2,5\n1.500;3,5\n",
         "d.csv:4:1: '1.000' and '0,5' of line 2 have different decimal marks: write all numbers with one mark, and "
         "without thousands"),
    "thousands with a comma":
        ("Position [mm]\tError [um]\n0\t0.5\n500\t1.5\n1,000\t2.5\n", "d.csv:4:1: '1,000' and '0.5'"),
    "thousands with point and comma": ("Position [mm];Error [um]\n0;0,5\n1.000,0;1,5\n", "d.csv:3:1: '1.000,0' is not"),
    "thousands with an apostrophe": ("Position [mm];Error [um]\n0;0.5\n1'000;1.5\n", "d.csv:3:1: '1'000' is not a"),
    "thousands with a blank": ("Position [mm];Error [um]\n0;0.5\n1 000;1.5\n", "d.csv:3:1: '1 000' is not a finite"),
    "NaN": ("Position [mm];Error [um]\n0;0.5\n100;NaN\n", "d.csv:3:5: 'NaN' is not a finite number"),
    "dashes": ("Position [mm];Error [um]\n0;0.5\n100;---\n", "d.csv:3:5: '---' is not a finite number"),
    "#N/A of Excel": ("Position [mm];Error [um]\n0;0.5\n100;#N/A\n", "d.csv:3:5: '#N/A' is not a finite number"),
    "an empty cell": ("Position [mm];Error [um];Run\n0;0.5;1\n100;;1\n", "d.csv:3:5: a number is missing here"),
    "an empty cell of a run":
        ("Target [mm];Run 1 [um];Run 2 [um]\n0;1;2\n100;2;\n200;1;1\n", "d.csv:3:7: a number is missing here"),
    "a position twice":
        ("Position [mm];Error [um]\n0;0.5\n100;1\n100;1.5\n", "d.csv:4: position 100 mm is there already"),
    "comments": ("# laser\nPosition [mm];Error [um]\n# first\n0;0.5\n100;-1.5\n", [0.5, -1.5]),
    "tabs and blanks": ("Position [mm]\t Error [um] \n 0 \t 0.5 \n100\t -1.5\n", [0.5, -1.5]),
    "swapped columns": ("Error [um];Position [mm]\n0.5;0\n-1.5;100\n", [0.5, -1.5]),
    "units in the cells": ("Position;Error\n0 mm;0.5 um\n100 mm;1 um\n", "d.csv:1: the column 'Position' has no unit"),
    "a line of means below":
        ("Position [mm];Error [um]\n0;0.5\n100;1\nMean;0.75\n", "d.csv:4:1: 'Mean' is not a finite"),
    "a second table below": ("Position [mm];Error [um]\n0;0.5\n100;1\n\nPosition [mm];Error [um]\n0;1\n",
                             "d.csv:5:15: 'Error [um]' is not a finite number"),
    "a column of text": ("Position [mm];Error [um];Remark\n0;0.5;ok\n100;-1.5;ok\n", [0.5, -1.5]),
    "two errors": ("Position [mm];Error [um];Deviation [um]\n0;1;2\n100;2;3\n",
                   "d.csv:1: the column 'Deviation [um]' holds the error too; keep one of these columns"),
    "an error in two units": ("Position [mm];Error [um];Error [mm]\n0;1;0.001\n100;2;0.002\n",
                              "d.csv:1: has the columns error_um and error_mm; keep one of them"),
    "Position X": ("Position X [mm];Error [um]\n0;0.5\n100;-1.5\n", [0.5, -1.5]),
    "two axes": ("Position X [mm];Position Y [mm];Error [um]\n0;0;0.5\n0;100;-1.5\n",
                 "d.csv:1: the column 'Position Y [mm]' holds the position too; keep one of these columns"),
    "a line of units that is none": ("Position;Error\nfoo;bar\n0;1\n", "d.csv:1: the column 'Position' has no unit"),
    "a header over two lines": ("Position [mm];Run 1;\n;forward [um];backward [um]\n0;1;2\n",
                                 "d.csv:2: has 3 columns, the header has 2"),
    "a broken quote": ('Position [mm],Error [um]\n0,"0.5\n100,1\n', "d.csv:2: has 1 column, the header has 2"),
    "seconds of arc by two strokes":
        ("Position [mm];Error ['']\n0;1\n100;2\n", "d.csv:1: the column 'Error ['']' has a"),
}


@pytest.mark.parametrize("name", list(ODD))
def test_odd_files(compbox, name):
    content, expected = ODD[name]
    if isinstance(expected, str):
        assert refused(compbox, content).startswith(expected)
    else:
        assert means(read(compbox, content)) == pytest.approx(expected, rel=1e-9)


# ---- tables of other commands

def test_units_in_brackets_in_tables_of_train(compbox):
    rows = [(i, 20 + i / 10, 3 * i / 10 + (i % 3) * 0.01) for i in range(60)]
    compbox.write("plain.csv", "time_s,T1,err\n" + "".join(f"{t},{a!r},{e!r}\n" for t, a, e in rows))
    compbox.write("units.csv", "time [min];T1 [°F];err [mm]\n" +
                  "".join(f"{t / 60!r};{a * 1.8 + 32!r};{e / 1000!r}\n" for t, a, e in rows))
    compbox.write("second.csv", "time;T1;err\ns;°C;µm\n" + "".join(f"{t};{a!r};{e!r}\n" for t, a, e in rows))
    found = []
    for name in ("plain.csv", "units.csv", "second.csv"):
        compbox.good("train", name, "--inputs", "T1", "--outputs", "err",
                     "--hidden", "0", "--name", "net", "-o", name + ".json")
        found.append(compbox.read(name + ".json")["terms"][0]["bank"])
    for other in found[1:]:
        assert other["input_min"] == pytest.approx(found[0]["input_min"], rel=1e-5)
        assert other["weights"][0] == pytest.approx(found[0]["weights"][0], rel=1e-3, abs=1e-3)


def test_units_in_brackets_in_tables_of_identify(compbox):
    names = [f"d{a}{p}" for p in "123" for a in "xyz"]
    rows = [[50 * i] + [(i * (k + 2)) % 7 / 1000 for k in range(9)] for i in range(8)]
    compbox.write("mm.csv", "position [m]," + ",".join(f"{n} [mm]" for n in names) + "\n" +
                  "".join(",".join(map(repr, [r[0] / 1000] + r[1:])) + "\n" for r in rows))
    compbox.write("um.csv", "position_mm," + ",".join(f"{n}_um" for n in names) + "\n" +
                  "".join(",".join(map(repr, [r[0]] + [1000 * v for v in r[1:]])) + "\n" for r in rows))
    compbox.good("plan", "--box=-300:300:3,-200:200:3,-100:150:3", "-o", "plan.json")
    tables = []
    for name in ("mm", "um"):
        compbox.good("identify", name + ".csv", "--axis", "X", "--points", "plan.json", "-o", name)
        tables.append(compbox.table(f"{name}/EXX.csv"))
    assert tables[0]["position_mm"] == pytest.approx(tables[1]["position_mm"])
    assert tables[0]["error_um"] == pytest.approx(tables[1]["error_um"], abs=1e-9)


def test_two_columns_that_differ_by_their_unit_only(compbox):
    compbox.write("d.csv", "X [mm];X [V];err\n" + "".join(f"{i};{i};{i % 3}\n" for i in range(20)))
    message = compbox.refused("train", "d.csv", "--inputs", "X", "--outputs", "err",
                              "--hidden", "1", "--name", "n", "-o", "t.json")
    assert message == "d.csv:1: the columns 'X' and 'X [V]' have one name; rename one of them"


def test_very_many_positions_are_averaged_in_cells_and_stated(compbox):
    """Beyond 20 000 positions; the curve is that of the positions themselves to a fraction of its noise."""
    n = 60000
    noise = [((i * 7919) % 1009 / 1009 - 0.5) for i in range(n)]  # even, standard deviation 0.289
    def error(x):
        return 8 * math.sin(x / 300) + 3 * math.sin(x / 41)
    compbox.write("d.csv", "position_mm,error_um\n" +
                  "".join(f"{i / 30:.4f},{error(i / 30) + noise[i]:.4f}\n" for i in range(n)))
    text = compbox.good("fit", "d.csv", "--name", "EXX", "--signal", "X", "--band", "b.csv", "-o", "t.json")
    assert "60000 readings, averaged in cells of 0.1 mm (changes the curve by" in text
    assert "readings within cells, and residuals" in text
    found = compbox.read("t.json")["provenance"]["EXX"]
    assert found["averaged_in_cells"]["readings"] == n and found["averaged_in_cells"]["largest_change_of_curve"] < 0.001
    assert found["noise"] == pytest.approx(0.289 / 3**0.5, rel=0.1)  # three readings in each cell
    band = compbox.table("b.csv")
    assert max(abs(c - error(x)) for x, c in zip(band["position_mm"], band["curve_um"])) < 0.15
    assert band["position_mm"][0] == 0 and band["position_mm"][-1] == pytest.approx((n - 1) / 30, abs=1e-3)


def test_runs_of_very_many_positions_keep_their_offsets(compbox):
    """Two runs at the same positions, one lower by 2 µm at its end: evened out, as with few positions."""
    n = 25000
    rows = "".join(f"{i / 10},{math.sin(i / 3000) + (i * 7919 + r * 31) % 101 / 1000 + r * 2 * i / n:.4f},{r}\n"
                   for r in (0, 1) for i in range(n))
    compbox.write("d.csv", "position_mm,error_um,run\n" + rows)
    text = compbox.good("fit", "d.csv", "--name", "EXX", "--signal", "X", "-o", "t.json")
    assert "each run's own offset and slope were evened out" in text and "50000 readings" in text


def test_a_run_from_above_without_a_direction_gets_the_remedy(compbox):
    (compbox.folder / "a.csv").write_text("Soll;Ist;Lauf\nmm;mm;\n0;0,001;1\n50;50,002;1\n50;50,001;2\n0;0,002;2\n")
    assert compbox.refused("report", "a.csv") == (
        "a.csv:6: positions must ascend within a run, but 0 mm comes after 50 mm; list them upwards, or mark a "
        "backward run in a column 'direction' with -1")
