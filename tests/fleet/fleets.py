# SPDX-License-Identifier: MIT
"""What the tests of `compbox fleet` share: a plant with its registry, and one whose boxes run an old model."""

import importlib.util
import json
import os
import pathlib
import shutil
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host-tools"), str(ROOT / "tests/fleet")]  # the package itself, and twins
specification = importlib.util.spec_from_file_location("cli_conftest", ROOT / "tests/cli/conftest.py")
cli = importlib.util.module_from_spec(specification)
specification.loader.exec_module(cli)

os.environ["COMPBOX_PROGRAM"] = str(cli.BIN / "compbox")
from boxes import Box  # noqa: E402
from fleet import engines, machines, rollout, site, training  # noqa: E402
from fleet.registry import Registry, write_file  # noqa: E402
from twins import TRUTH, Twin, machine_file  # noqa: E402

WORN = (5.5, -1.5)  # um/K: the machines have drifted from TRUTH
COUNT, POISONED = 100 if cli.LONG else 40, ("m017", "m024", "m031")
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


class Plant(Fleet):
    """Machines whose boxes run an old model, each with a record of its wear and a candidate."""

    def make(self, count):
        self.prepare(count)
        self.train_all(count)

    def prepare(self, count):
        (self.folder / "keys").mkdir()
        self.good("keygen", "plant")
        (self.folder / "plant.pub").rename(self.folder / "keys/plant.pub")
        machine_file(self)
        self.add_lathe("first", Twin(1000))
        self.fleet("train", "first", "--workers", 1)
        [old] = self.models().values()
        self.write("old.json", rollout.with_revision(old.decode(), 7))
        shutil.rmtree(self.folder / "registry")
        registry = Registry.create(self.folder / "registry")
        for number in range(count):
            name = f"m{number:03}"
            shift_um = 30 if name in POISONED else 0
            self.write("record.csv", Twin(number, WORN).record(3, compensated=TRUTH, shift_um=shift_um))
            machines.add(registry, name, self.folder / "machine.json", ["error_X_um"], ADD[3].split(), "lathe")
            machines.add_record(registry, name, self.folder / "record.csv")
            site.add_running(registry, name, self.folder / "old.json")
            place = self.folder / "boxes" / name / "coefficients.json"
            write_file(place, (self.folder / "old.json").read_bytes())

    def train_all(self, count, address=None):
        registry = Registry(self.folder / "registry")
        rows = training.plan(registry, [], True)
        ended = training.train(registry, rows, engines.dask(address) if address else engines.here(2), lambda *_: None)
        assert len(ended["trained"]) == count

    def boxes(self, truth=WORN):
        folders = sorted((self.folder / "boxes").iterdir())
        return {one.name: Box(one, Twin(int(one.name[1:]), truth), self.folder / "keys") for one in folders}

    def state(self):
        [path] = (self.folder / "registry/rollouts").glob("*.json")  # and none that is being written
        return json.loads(path.read_text())

    def set_without(self, names):
        """Takes these machines out of the registry."""
        for name in names:
            (self.folder / f"registry/machines/{name}.json").unlink()
