# SPDX-License-Identifier: MIT
import shutil
import signal
import subprocess

import pytest

from browser import HERE, Browser
from plant import ROOT, View, mill, write_file  # and with it the folder of box.py
from box import Box


@pytest.fixture(scope="session")
def axe():
    """axe-core of package-lock.json, from npm."""
    folder = ROOT / "build/view"
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(HERE / name, folder)
    subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=folder, check=True,
                   capture_output=True)
    return folder / "node_modules/axe-core/axe.min.js"


@pytest.fixture(scope="session")
def browser():
    one = Browser()
    yield one
    one.close()


@pytest.fixture
def plc():
    with mill() as running:
        yield running


@pytest.fixture
def box(plc, tmp_path):
    file = write_file(tmp_path, plc.port)
    with Box(file, "--snapshot", tmp_path / "snapshot.json", "--events", tmp_path / "events.jsonl") as running:
        plc.wait(lambda status: status["mode"] == 1)
        yield running
        running.process.send_signal(signal.SIGCONT)
        running.process.terminate()
        print(running.process.communicate(timeout=30)[1])


@pytest.fixture
def page(box, tmp_path, browser):
    """The page of a box that compensates, on a panel."""
    with View(tmp_path, 0, "--record", tmp_path / "record.csv") as view:
        browser.look("panel")
        browser.open(view.url)
        browser.view = view
        browser.until_text("#mode", "ACTIVE")
        yield browser
        browser.open("about:blank")
