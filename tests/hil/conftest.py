# SPDX-License-Identifier: MIT
import os
import sys
import tempfile

import pytest

sys.path.insert(0, os.path.dirname(__file__))

import box as box_module  # noqa: E402
import machine  # noqa: E402
import plc as plc_module  # noqa: E402
import realtime  # noqa: E402


@pytest.fixture(autouse=True, scope="session")
def unhurried():
    """The test itself holds Python's lock, for which the PLC's thread waits."""
    realtime.run_before_others()


@pytest.fixture(scope="session")
def lines():
    """Where serial lines appear: a device is below /dev and has at most 63 characters."""
    with tempfile.TemporaryDirectory(prefix="compbox-", dir="/dev/shm") as folder:
        yield folder


@pytest.fixture
def port():
    return box_module.free_port()


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


def libmodbus(data):
    data["plc"]["transport"]["tcp"]["client"] = "libmodbus"


@pytest.fixture(params=["compbox fc3+fc16", "compbox fc23", "libmodbus fc3+fc16", "libmodbus fc23"])
def way(request):
    """Both clients with both ways to exchange, as an edit of the coefficient file."""
    client, exchange_of_it = request.param.split()

    def edit(data):
        data["plc"]["transport"]["tcp"]["client"] = client
        data["plc"]["exchange"] = exchange_of_it
    return edit


@pytest.fixture(params=["fc3+fc16", "fc23"])
def exchange(request):
    """Both ways to exchange, as an edit of the coefficient file."""
    return fc23 if request.param == "fc23" else (lambda data: None)
