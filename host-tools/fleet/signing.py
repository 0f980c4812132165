# SPDX-License-Identifier: MIT
"""Signatures of coefficient files by `compbox sign` and `verify` (docs/signing.md)."""

import contextlib
import pathlib
import tempfile

from . import tools

FILE = "coefficients.json"


@contextlib.contextmanager
def folder_with(text):
    """A folder for the time of the block, with a coefficient file."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / FILE).write_text(text, encoding="utf-8")
        yield pathlib.Path(folder)


def signed(text, key):
    """in: a coefficient file; path of a secret key without a password. out: the text of its signature"""
    with folder_with(text) as folder:
        return tools.compbox("sign", FILE, "--key", pathlib.Path(key).resolve(), "-o", "-", folder=folder)


def verify(text, signature, keys):
    """in: a file and its signature; a folder of NAME.pub. Throws FleetError unless one of the keys made it."""
    with folder_with(text) as folder:
        (folder / f"{FILE}.minisig").write_text(signature, encoding="utf-8")
        tools.compbox("verify", FILE, "--keys", pathlib.Path(keys).resolve(), folder=folder)
