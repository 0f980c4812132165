# SPDX-License-Identifier: MIT
"""Runs the programs that compute."""

import os
import subprocess

from .errors import FleetError


def compbox(*arguments, folder=None):
    """in: a command and its arguments. out: what it printed. Throws FleetError with its sentence."""
    program = os.environ.get("COMPBOX_PROGRAM", "compbox")
    try:
        done = subprocess.run([program, *map(str, arguments)], cwd=folder, capture_output=True, encoding="utf-8")
    except OSError as error:
        raise FleetError(f"{program}: {error.strerror}; install the package compbox") from error
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise FleetError(f"compbox {arguments[0]}: {lines[0].removeprefix('compbox: ')}")
    return done.stdout


def version():
    """out: "compbox 1.2.3", a part of each job"""
    return compbox("--version").strip()
