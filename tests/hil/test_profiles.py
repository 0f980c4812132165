# SPDX-License-Identifier: MIT
"""Each profile for a few seconds, with the faults that differ most; scripts/report hil-profiles has the rest."""
import pytest

import profiles

SCAN_S = 0.01


@pytest.mark.parametrize("profile", profiles.PROFILES)
def test_a_profile_in_real_time(profile):
    short = [(command, end) for command, end in profiles.LASTING if command in profiles.SHORT]
    assert len(short) == len(profiles.SHORT)
    found = profiles.measure(profile, 2, lasting=short, once=["fault drop", "fault close"])
    assert profiles.complaints(found) == []
    assert found["stats"]["cycles"] > 100 and found["stats"]["stopped"]
    for times in found["faults"].values():
        # From what was applied then (12 um, less where the PLC took a stopped box for lost) at 50 um/s.
        assert times["zero_s"] >= (times["from_um"] - profiles.NEAR_UM) / 50 - SCAN_S, times


def test_a_fault_that_goes_unnoticed_is_a_complaint():
    """The measurement can fail: a row of the log in which nothing happens."""
    row = {"time_s": "0", "event": "command fault drop", "status": "1", "control": "3", "box_heartbeat": "7"}
    row |= {f"{kind}_{a}_um": "-12" for kind in ("applied", "commanded") for a in "XYZ"}
    rows = [dict(row, time_s=str(i * 0.008), event=row["event"] if i == 0 else "") for i in range(50)]
    times = profiles.reaction(rows, "fault drop", None)
    assert times["zero_s"] is None
    found = {"profile": "fanuc", "cyclictest": {"late": 0}, "steady": {"overruns": 3, "stalls": 3}, "code": 0,
             "faults": {"fault drop": times}}
    assert len(profiles.complaints(found)) == 2
    assert len(profiles.stood(found)) == 1
