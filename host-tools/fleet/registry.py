# SPDX-License-Identifier: MIT
"""The registry: a folder with all that is known of the fleet (docs/fleet.md, "The registry").

  registry.json            {"format": "compbox-fleet/1"}
  objects/ab/abcd….csv     contents, named by their SHA-256; they never change
  KIND/NAME.json           entries: machines, data, jobs, models, rollouts

Each file is written beside its place, synced and renamed, so a reader and a kill see the old file or the new one."""

import contextlib
import fcntl
import hashlib
import json
import os
import pathlib
import re
import tempfile

from .errors import FleetError

FORMAT = "compbox-fleet/1"
KINDS = ("machines", "data", "jobs", "models", "rollouts")
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def digest(content):
    """in: bytes. out: SHA-256, hexadecimal"""
    return hashlib.sha256(content).hexdigest()


def canonical(value):
    """out: the bytes of a JSON value that equal values share"""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def write_file(path, content):
    """Writes bytes as a whole or not at all; makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".new-")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        pathlib.Path(name).unlink(missing_ok=True)
        raise


def read_bytes(path):
    """Throws FleetError with the system's reason."""
    try:
        return pathlib.Path(path).read_bytes()
    except OSError as error:
        raise FleetError(f"{path}: {error.strerror}") from error


def read_json(path):
    """Throws FleetError with the place of what is no JSON."""
    try:
        return json.loads(read_bytes(path))
    except ValueError as error:
        raise FleetError(f"{path}: is not JSON: {error}") from error


class Registry:
    """in: the folder of a registry; create() makes a new one. Throws FleetError for any other folder."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        mark = self.folder / "registry.json"
        if not mark.exists():
            raise FleetError(f"{folder}: is no registry; `compbox fleet add` makes one")
        if read_json(mark) != {"format": FORMAT}:
            raise FleetError(f"{mark}: is not of the format {FORMAT}")

    @classmethod
    def create(cls, folder):
        """out: the registry in this folder, which is made if it is not there or is empty"""
        folder = pathlib.Path(folder)
        if not (folder / "registry.json").exists():
            if folder.exists() and any(folder.iterdir()):
                raise FleetError(f"{folder}: has other files and no registry.json; name an empty folder")
            write_file(folder / "registry.json", json.dumps({"format": FORMAT}).encode() + b"\n")
        return cls(folder)

    @contextlib.contextmanager
    def locked(self):
        """One writer at a time. Throws FleetError while another one runs; a killed writer leaves no lock."""
        with open(self.folder / "registry.json", "rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise FleetError(f"{self.folder}: another compbox fleet is writing; wait for its end") from error
            yield self

    def put(self, content, suffix):
        """in: bytes, and a suffix for the eye, as "csv". out: their hash; equal contents are stored once"""
        name = digest(content)
        path = self._object(name, suffix)
        if not path.exists():
            write_file(path, content)
        return name

    def get(self, name):
        """in: a hash. out: the bytes. Throws FleetError if they are missing or changed"""
        found = sorted((self.folder / "objects" / name[:2]).glob(name + ".*"))
        if not found:
            raise FleetError(f"{self.folder}: object {name} is missing")
        content = read_bytes(found[0])
        if digest(content) != name:
            raise FleetError(f"{found[0]}: its content is not that of its name; restore it from a copy")
        return content

    def _object(self, name, suffix):
        return self.folder / "objects" / name[:2] / f"{name}.{suffix}"

    def _entry(self, kind, name):
        assert kind in KINDS
        if not NAME.fullmatch(name):
            raise FleetError(f"'{name}' is not a name of 1 to 100 letters, digits, '.', '_' and '-'")
        return self.folder / kind / f"{name}.json"

    def has(self, kind, name):
        return self._entry(kind, name).exists()

    def read(self, kind, name):
        """out: an entry. Throws FleetError that names the known ones"""
        if not self.has(kind, name):
            known = ", ".join(self.names(kind)[:5]) or "none"
            raise FleetError(f"{self.folder}: {kind} has no {name} (it has {known})")
        return read_json(self._entry(kind, name))

    def write(self, kind, name, entry):
        write_file(self._entry(kind, name), json.dumps(entry, indent=2, sort_keys=True).encode() + b"\n")

    def names(self, kind):
        """out: the names of a kind, sorted"""
        return sorted(path.stem for path in (self.folder / kind).glob("*.json"))
