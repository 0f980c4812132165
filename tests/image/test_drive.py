# SPDX-License-Identifier: MIT
"""The drive of the power cuts does what it is for: it keeps what was flushed, and loses the rest."""
import random

import pytest

from drive import SECTOR, Drive

OLD, NEW, NEWER = (bytes([byte]) * SECTOR for byte in b"on2")


@pytest.fixture
def drive(tmp_path):
    (tmp_path / "disk").write_bytes(OLD * 64)
    drive = Drive(tmp_path / "disk", tmp_path)
    drive.power_on()
    return drive


def test_what_was_written_is_read_whether_flushed_or_not(drive):
    drive.write(SECTOR, NEW * 2)
    assert drive.read(0, 4 * SECTOR) == OLD + NEW * 2 + OLD
    drive.flush()
    drive.write(2 * SECTOR, NEWER)
    assert drive.read(0, 4 * SECTOR) == OLD + NEW + NEWER + OLD


def test_a_cut_loses_the_cache_and_nothing_that_was_flushed(drive):
    drive.write(0, NEW * 8)
    drive.flush()
    drive.write(8 * SECTOR, NEW * 8, fua=True)
    drive.write(0, NEWER * 32)
    assert drive.power_cut(random.Random(1), survives=0) == (32, 32)
    drive.power_on()
    assert drive.read(0, 64 * SECTOR) == NEW * 16 + OLD * 48


def test_a_write_with_fua_does_not_flush_the_others(drive):
    drive.write(0, NEW)
    drive.write(SECTOR, NEW, fua=True)
    drive.power_cut(random.Random(1), survives=0)
    assert drive.medium[:2 * SECTOR] == OLD + NEW


def test_any_version_of_each_sector_may_survive(drive):
    drive.write(0, NEW * 64)
    drive.write(0, NEWER * 64)
    cached, lost = drive.power_cut(random.Random(1), survives=0.7)
    left = [bytes(drive.medium[i:i + SECTOR]) for i in range(0, 64 * SECTOR, SECTOR)]
    assert all(left.count(version) > 10 for version in (OLD, NEW, NEWER))
    assert cached == 64 and lost == 64 - left.count(NEWER)


def test_what_no_drive_would_do_is_refused(drive):
    assert drive.write(100, NEW) and drive.write(0, b"x") and drive.write(64 * SECTOR, NEW)
