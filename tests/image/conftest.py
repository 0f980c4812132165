# SPDX-License-Identifier: MIT
import pathlib
import socket
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import guest as guest_module  # noqa: E402


@pytest.fixture(scope="session")
def port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="session")
def fresh_disk(tmp_path_factory, port):
    disk = tmp_path_factory.mktemp("disk") / "disk.img"
    guest_module.make_disk(disk, port)
    return disk


@pytest.fixture(scope="module")
def machine(tmp_path_factory, fresh_disk, port):
    """A control on the host, the image before it, and both at work."""
    folder = tmp_path_factory.mktemp("guest")
    disk = folder / "disk.img"
    disk.write_bytes(fresh_disk.read_bytes())
    with guest_module.FakePlc(port, folder) as plc, guest_module.Guest(disk, folder) as guest:
        yield plc, guest
        print(guest.text)  # shown where a test failed
