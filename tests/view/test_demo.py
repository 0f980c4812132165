# SPDX-License-Identifier: MIT
"""scripts/demo --view: a mill, its box and the page, until Ctrl-C."""
import pathlib
import urllib.error
import urllib.request

import pytest

from plant import ROOT, demo

OUT = ROOT / "out/demo-view"


def left_over():
    """out: command lines of processes that name the demo's folder."""
    lines = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            lines.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except (FileNotFoundError, ProcessLookupError):
            pass  # it ended while we looked
    return [line for line in lines if "out/demo-view" in line]


def test_the_demo_shows_a_mill_and_ends_in_good_order(browser):
    with demo() as url:
        browser.look("panel")
        browser.open(url)
        browser.until_text("#mode", "ACTIVE")
        browser.until_text("#machine", "vertical mill")
        assert len(left_over()) >= 3
        for name in "XYZ":
            first = browser.channel(name)
            browser.until(f"return document.querySelector('[data-channel={name}] .value').textContent !== arguments[0]",
                          first)
        browser.open("about:blank")
    assert (OUT / "compboxd.log").read_text().rstrip().endswith("STOPPED: a stop was requested")
    assert left_over() == []
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(url, timeout=5)
