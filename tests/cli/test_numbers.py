# SPDX-License-Identifier: MIT
"""Numbers on the command line: what is none, or out of place, is wrong usage and one short sentence,
for every option of every command."""

import pytest

from conftest import PLC

# Options with one number each, with all else that the command requires; files are not looked at.
ABOVE_ZERO = [
    ("export", "c.json", "--format", "linuxcnc-comp", "-o", "d", "--step-mm"),
    ("export", "c.json", "--format", "linuxcnc-comp", "-o", "d", "--tolerance-um"),
    ("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t", "--tolerance-um"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--sigma-um"),
    ("join", "r.csv", "p.csv", "-o", "d.csv", "--longest-gap-s"),
    ("join", "r.csv", "p.csv", "-o", "d.csv", "--tolerance-mm"),
    ("plan", "--box", "0:1:2,0:1:2,0:1:2", "-o", "p.json", "--sigma-um"),
    ("etve", "d.csv", "--window-min"),
    ("report", "d.csv", "--period-mm"),
    ("volumetric", "d", "--chain", "fXYZ", "--name", "v", "-o", "t", "--tolerance-um"),
]
RANGES = {
    "from 0.001 to 1000": ("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t", "--branches",
                           "--reversal-mm"),
    "from 1 to 1000": ("init", "--axes", "X", "-o", "m.json", "--period-ms"),
    "from 1 to 200": ("commission", "m.json", "--offset-um"),
    "from 0.001 to 86400": ("train", "r.csv", "--name", "t", "--outputs", "a", "--inputs", "b", "-o",
                            "t", "--lags"),
    "from 0 to 10": ("train", "r.csv", "--name", "t", "--outputs", "a", "--inputs", "b", "-o", "t",
                     "--margin"),
    "from -10000 to 10000": ("volumetric", "d", "--chain", "fXYZ", "--name", "v", "-o", "t",
                             "--tool-length-mm"),
    "from 0 to 100": ("report", "d.csv", "--expansion-um-per-m-K"),
    "from -50 to 150": ("report", "d.csv", "--material-degC"),
    "0 or more": ("squareness", "--name", "C0Y", "-o", "s", "--sigma-um"),
}
WHOLE = {
    "1 to 65535": ("init", "--axes", "X", "-o", "m.json", "--port"),
    "0 to 255": ("init", "--axes", "X", "-o", "m.json", "--unit"),
    "1 to 64": ("select-inputs", "r.csv", "--outputs", "a", "--candidates", "b", "-o", "c", "--count"),
    "0 to 64": ("train", "r.csv", "--name", "t", "--outputs", "a", "--inputs", "b", "-o", "t",
                "--hidden"),
    "3 to 100000": ("plan", "--box", "0:1:2,0:1:2,0:1:2", "-o", "p.json", "--positions"),
    "5 to 1000": ("commission", "m.json", "--steps"),
    "10 to 60000": ("plc", "read", "h", "0", "--timeout-ms"),
    "1 to 2": ("plc", "read", "/dev/ttyS0", "0", "--stop-bits"),
    "1 to 3600000": ("plc", "watch", "h", "0", "--every-ms"),
    "1 to 1000000000": ("plc", "watch", "h", "0", "--count"),
    "2 to 100000000": ("plan", "--box", "0:1:2,0:1:2,0:1:2", "-o", "p.json", "--monte-carlo"),
}
ANY = [
    ("report", "d.csv", "--drop-target"),
    ("plc", "read", "h", "0", "--scale"),
    ("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t", "--zero-at"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--scale-ppm-per-degC"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--temperature-degC"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--frame-offset-mm"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--reference-point"),
    ("identify", "m.csv", "--axis", "X", "--points", "p.json", "-o", "d", "--preset"),
    ("join", "r.csv", "p.csv", "-o", "d.csv", "--time-offset-s"),
    ("plan", "--box", "0:1:2,0:1:2,0:1:2", "-o", "p.json", "--preset"),
    ("squareness", "--name", "C0Y", "-o", "s", "--square-error-urad"),
    ("squareness", "--name", "C0Y", "-o", "s", "--diagonals"),
    ("squareness", "--name", "C0Y", "-o", "s", "--ball-bar"),
    ("volumetric", "d", "--chain", "fXYZ", "--name", "v", "-o", "t", "--tool-offset-mm"),
    ("volumetric", "d", "--chain", "fXYZ", "--name", "v", "-o", "t", "--tool-direction"),
]
LISTS = {"--frame-offset-mm": 3, "--reference-point": 3, "--preset": 6, "--diagonals": 4,
         "--ball-bar": 3, "--tool-offset-mm": 3, "--tool-direction": 3}


def usage(compbox, command, value):
    """The sentence of a wrong usage, without the option's name."""
    many = LISTS.get(command[-1], 1)
    done = compbox(*command[:-1], f"{command[-1]}=" + ",".join([value] + ["1"] * (many - 1)))
    assert done.returncode == 2, (command, done.stderr)
    name, _, sentence = done.stderr.removeprefix("compbox: ").splitlines()[0].partition(": ")
    assert name == command[-1]
    return sentence


@pytest.mark.parametrize("command", ABOVE_ZERO + list(RANGES.values()) + ANY, ids=" ".join)
def test_what_is_no_finite_number(compbox, command):
    for value in ("nan", "inf", "-inf", "1e999", "0x10", "1.5x", "five"):
        sentence = usage(compbox, command, value)
        assert sentence == f"'{value}' is not a finite number", value


@pytest.mark.parametrize("command", ABOVE_ZERO, ids=" ".join)
def test_what_must_be_above_zero(compbox, command):
    for value in ("0", "-1"):
        assert usage(compbox, command, value) == f"must be above 0, not {value}"


@pytest.mark.parametrize("span", RANGES)
def test_ranges(compbox, span):
    for value in ("-10000.5", "1e300" if span != "0 or more" else "-1e-9"):
        assert usage(compbox, RANGES[span], value) == f"must be {span}, not {value}"


@pytest.mark.parametrize("span", WHOLE)
def test_whole_numbers(compbox, span):
    for value in ("-1", "1.5", "nan", "1e3", "99999999999999999999"):
        assert usage(compbox, WHOLE[span], value) == f"must be a whole number from {span}, not {value}"


def test_good_numbers_are_taken(compbox):
    """A plus sign, an exponent, and blanks after the commas of a list."""
    compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "--period-ms", "+2e1", "-o", "m.json")
    assert compbox.read("m.json")["cycle"]["period_ms"] == 20
    compbox.good("squareness", "--name", "C0Y", "--ball-bar", "300, 12, +4", "-o", "s.json")
