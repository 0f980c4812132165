# SPDX-License-Identifier: MIT
"""Signatures of coefficient files in minisign's format: by `compbox sign` and `verify` where this compbox has them,
else by Debian's minisign. No cryptography of our own."""

import functools
import pathlib
import re
import subprocess
import tempfile

from . import tools
from .errors import FleetError


@functools.lru_cache
def has_own():
    """out: whether this compbox signs"""
    return bool(re.search(r"^  sign ", tools.compbox("--help"), re.M))


def _minisign(*arguments):
    try:
        return subprocess.run(["minisign", *map(str, arguments)], capture_output=True, text=True,
                              stdin=subprocess.DEVNULL)
    except OSError as error:
        raise FleetError("minisign is missing; install the package minisign") from error


def signed(text, key, comment):
    """in: a coefficient file; path of a secret key without a password. out: the text of its signature"""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "coefficients.json"
        file.write_text(text)
        if has_own():
            tools.compbox("sign", file, "--key", pathlib.Path(key).resolve())
        else:
            done = _minisign("-S", "-s", key, "-m", file, "-t", comment)
            if done.returncode:
                raise FleetError(f"{key}: does not sign: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
        return (pathlib.Path(folder) / "coefficients.json.minisig").read_text()


def is_signed(text, signature, keys):
    """in: a file and its signature; a folder of NAME.pub. out: whether one of the keys made it"""
    publics = sorted(pathlib.Path(keys).glob("*.pub"))
    if not publics:
        raise FleetError(f"{keys}: has no key NAME.pub")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "coefficients.json"
        file.write_text(text)
        (pathlib.Path(folder) / "coefficients.json.minisig").write_text(signature)
        if has_own():
            try:
                tools.compbox("verify", file, "--keys", pathlib.Path(keys).resolve())
            except FleetError:
                return False
            return True
        return any(_minisign("-V", "-q", "-p", public, "-m", file).returncode == 0 for public in publics)
