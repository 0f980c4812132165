# SPDX-License-Identifier: MIT
"""Fixtures of the tests of this folder."""

import pytest

from fleets import Fleet
from twins import Twin


@pytest.fixture
def plant(tmp_path):
    return Fleet(tmp_path)


@pytest.fixture
def twin():
    return Twin(1)
