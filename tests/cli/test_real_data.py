# SPDX-License-Identifier: MIT
"""tests/bench/real_data.py, which scripts/real-data runs, on a folder with a simulated lathe."""

import subprocess
import sys

import pytest

from conftest import BIN, ROOT

sys.path.insert(0, str(ROOT / "examples/adaptive-lathe"))
import lathe  # noqa: E402  (pylint: disable=wrong-import-position)


@pytest.fixture(name="folder")
def folder_with_a_record(tmp_path):
    subprocess.run([sys.executable, lathe.__file__, "4", "10", tmp_path / "mill.csv", "--every-s", "900"], check=True)
    return tmp_path


def run(folder, *options):
    return subprocess.run([sys.executable, ROOT / "tests/bench/real_data.py", BIN / "compbox", folder, *options],
                          capture_output=True, text=True, timeout=100, check=False)


def table_of(text):
    """{row: {error: (rms, largest)}}"""
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ") and "---" not in line]
    names = rows[0] if len(rows[0]) == 2 else rows[0][1:]
    return {row[0]: {n: tuple(map(float, cell.split(" / "))) for n, cell in zip(names, row[1:])} for row in rows[1:]}


def test_the_page(folder):
    (folder / "record.json").write_text('{"title": "A mill", "probe_minutes": [60], "options": ["--hidden", "0"]}')
    done = run(folder, "--write", folder / "page.md", "--folds", "3")
    assert done.returncode == 0, done.stderr
    text = (folder / "page.md").read_text()
    assert "## A mill" in text
    assert "Runs are distinguished by `day`. Left out together: 1 to 4; 5 to 7; 8 to 10." in text
    rows = table_of(text)
    # Nothing, by hand.
    lines = [line.split(",") for line in (folder / "mill.csv").read_text().splitlines()]
    errors = [float(line[lines[0].index("error_X_um")]) for line in lines[1:]]
    rms = (sum(e * e for e in errors) / len(errors))**0.5
    assert rows["nothing"]["error_X_um"] == pytest.approx((rms, max(map(abs, errors))), abs=0.06)
    adapted = rows["**compbox, adapted**, a probe every 60 min"]["error_X_um"][0]
    assert adapted < rows["re-zero by a probe every 60 min"]["error_X_um"][0] < rms
    assert adapted < 0.8 * min(rows[name]["error_X_um"][0] for name in ("compbox, offline", "ridge with lags"))


def test_what_is_refused(folder):
    (folder / "record.json").write_text('{"outputs": ["ez_*"]}')
    assert run(folder).stderr == (f"real-data: {folder}/mill.csv: no column is called ez_*; name the errors in "
                                  "record.json\n")
    (folder / "record.json").write_text('{"run_column": "shift"}')
    assert "no column distinguishes days or runs" in run(folder).stderr
    (folder / "mill.csv").unlink()
    assert run(folder).stderr == f"real-data: {folder} has no *.csv\n"
