# SPDX-License-Identifier: MIT
"""What the tests of `compbox fleet` share."""

import importlib.util
import json
import os
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host-tools"), str(ROOT / "tests/fleet")]  # the package itself, and twins
specification = importlib.util.spec_from_file_location("cli_conftest", ROOT / "tests/cli/conftest.py")
cli = importlib.util.module_from_spec(specification)
specification.loader.exec_module(cli)

os.environ["COMPBOX_PROGRAM"] = str(cli.BIN / "compbox")
from fleet import machines  # noqa: E402
from fleet.registry import Registry  # noqa: E402
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


    def add_lathes(self, count):
        """Adds machines m000, m001 … of different twins, each with a record of five days; in this process."""
        machine_file(self)
        registry = Registry.create(self.folder / "registry")
        for number in range(count):
            name = f"m{number:03}"
            self.write("record.csv", Twin(number).record(5))
            machines.add(registry, name, self.folder / "machine.json", ["error_X_um"],
                         ["--inputs", "T1,T2", "--hidden", "0"], "lathe")
            machines.add_record(registry, name, self.folder / "record.csv")

    def models(self):
        """out: {name of a model: its bytes}"""
        registry = Registry(self.folder / "registry")
        return {name: registry.get(name) for name in registry.names("models")}


@pytest.fixture
def plant(tmp_path):
    return Fleet(tmp_path)


@pytest.fixture
def twin():
    return Twin(1)
