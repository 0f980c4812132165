# SPDX-License-Identifier: MIT
import os
import sys

import pytest

HERE = os.path.dirname(__file__)
sys.path[:0] = [HERE, os.path.join(HERE, "../hil")]  # the machine and its laws are there

import box as box_module  # noqa: E402
import machine  # noqa: E402
import plc as plc_module  # noqa: E402
from stage import File, Stage  # noqa: E402


@pytest.fixture(autouse=True)
def stage():
    with Stage() as world:
        yield world


@pytest.fixture
def tmp_path(stage):
    """A folder on the simulated disk."""
    folder = File("/box")
    folder.mkdir()
    return folder


@pytest.fixture
def real_path(tmp_path_factory):
    """A folder on the real disk, for fakeplc's files."""
    return tmp_path_factory.mktemp("real")


@pytest.fixture
def port():
    return 502


@pytest.fixture
def plc():
    return plc_module.Plc()


@pytest.fixture
def start_box(tmp_path, port):
    """Makes a Box for the PLC on `port`; change edits the coefficient file."""
    def start(*arguments, change=None, **how):
        config = machine.write_coefficients(tmp_path / "coefficients.json", port, change)
        return box_module.Box(config, *arguments, **how)
    return start


def fc23(data):
    data["plc"]["exchange"] = "fc23"


@pytest.fixture(params=["fc3+fc16", "fc23"])
def exchange(request):
    """Both ways to exchange, as an edit of the coefficient file."""
    return fc23 if request.param == "fc23" else (lambda data: None)
