# SPDX-License-Identifier: MIT
"""What the tests of `compbox fleet` share."""

import importlib.util
import json
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host-tools"), str(ROOT / "tests/fleet")]  # the package itself, and twins
specification = importlib.util.spec_from_file_location("cli_conftest", ROOT / "tests/cli/conftest.py")
cli = importlib.util.module_from_spec(specification)
specification.loader.exec_module(cli)

from twins import Twin, machine_file  # noqa: E402

ADD = ("--outputs", "error_X_um", "--train", "--inputs T1,T2 --hidden 0", "--type", "lathe")


class Fleet(cli.Compbox):
    """compbox in one folder, and `compbox fleet` with its registry there."""

    def fleet(self, *words):
        return self.good("fleet", *words)

    def refusal(self, *words):
        """Bad input: its sentence; the registry stays as it is."""
        before = self.everything()
        done = self("fleet", *words)
        assert done.returncode == 1 and done.stderr.startswith("compbox: ") and done.stderr.count("\n") == 1, done
        assert self.everything() == before
        return done.stderr[len("compbox: "):-1]

    def everything(self):
        return {str(path): path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}

    def status(self):
        return {row["machine"]: row for row in json.loads(self.fleet("status", "--json"))}

    def entry(self, kind, name):
        return self.read(f"registry/{kind}/{name}.json")

    def add_lathe(self, name, twin, days=12, **how):
        """Adds a machine of this twin with one record."""
        if not (self.folder / "machine.json").exists():
            machine_file(self)
        self.fleet("add", name, "machine.json", *ADD)
        self.add_record(name, twin, days, **how)

    def add_record(self, name, twin, days, **how):
        self.write("record.csv", twin.record(days, **how))
        return self.fleet("record", name, "record.csv")


@pytest.fixture
def plant(tmp_path):
    return Fleet(tmp_path)


@pytest.fixture
def twin():
    return Twin(1)
