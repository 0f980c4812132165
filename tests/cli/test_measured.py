# SPDX-License-Identifier: MIT
"""compbox measured: the file that compboxd reads (tests/daemon/test_measured.py has the daemon's part)."""
import json
import re
import time

import pytest

LINE = re.compile(r"([A-Za-z0-9_.-]{1,4}) (\S+) (\d+) (\d+)")


def lines(compbox):
    return [LINE.fullmatch(line).groups() for line in (compbox.folder / "measured").read_text().splitlines()]


def test_each_call_is_one_measurement(compbox):
    before = int(time.time())
    assert "X 4.2 um, measurement 1;" in compbox.good("measured", "X", "4.2", "--file", "measured")
    compbox.good("measured", "Z", "-3", "--file", "measured")
    compbox.good("measured", "X", "-0.25", "--file", "measured")
    assert [line[:3] for line in lines(compbox)] == [("Z", "-3", "1"), ("X", "-0.25", "2")]
    assert all(before <= int(line[3]) <= time.time() for line in lines(compbox))


def test_the_count_wraps(compbox):
    compbox.write("measured", "X 1 65535 1790000000\n")
    compbox.good("measured", "X", "2", "--file", "measured")
    assert lines(compbox)[0][:3] == ("X", "2", "0")


def test_the_summary(compbox):
    found = json.loads(compbox.good("measured", "X", "4.2", "--file", "measured", "--json"))
    assert found == {"files": ["measured"], "name": "X", "um": 4.2, "count": 1, "remarks": []}


@pytest.mark.parametrize("arguments, words", [
    (["Xlong", "3"], "NAME: 'Xlong' is not a name of 1 to 4 letters and digits, as X"),
    (["X Y", "3"], "NAME: 'X Y' is not a name"),
    (["X", "3um"], "VALUE: '3um' is not a finite number"),
    (["X", "nan"], "VALUE: 'nan' is not a finite number"),
    (["X", "10001"], "VALUE: must be"),
    (["X"], "VALUE is missing")])
def test_wrong_usage(compbox, arguments, words):
    done = compbox("measured", *arguments, "--file", "measured")
    assert done.returncode == 2
    assert words in done.stderr
    assert not compbox.files()


def test_a_file_of_another_kind_is_kept(compbox):
    compbox.write("measured", "position_mm,error_um\n1,2\n")
    message = compbox.refused("measured", "X", "3", "--file", "measured")
    assert message.startswith("measured:1: is not NAME UM COUNT TIME; remove the file")
    assert (compbox.folder / "measured").read_text().startswith("position_mm")


def test_without_a_box(compbox):
    message = compbox.refused("measured", "X", "3", "--file", "no/measured")
    assert message == "no/measured: there is no folder no: start compboxd, or name its --measured file with --file"
