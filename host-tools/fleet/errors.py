# SPDX-License-Identifier: MIT
"""Errors that a person can cause."""


class FleetError(Exception):
    """One sentence with the place and the remedy; exit code 1."""
