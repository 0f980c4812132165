# SPDX-License-Identifier: MIT
"""Each profile with every fault of fakeplc that lasts; scripts/report hil-profiles does it in real time."""
import csv
import json

import pytest

import profiles
from box import Box
from fakeplc import FakePlc
from profiles import AT_REST_MM, LASTING, NEAR_UM

SCAN_S = 0.01


def values(status, kind):
    return [status[f"{kind}_{axis}"] for axis in "XYZ"]


def at_work(status):
    """ACTIVE, standing, and the machine has what the box wants there."""
    pairs = zip(values(status, "applied"), values(status, "commanded"))
    return (status["mode"] == 1 and status["alive"] == 1 and status["moving"] == 0 and
            int(status["control"]) & 3 == 3 and all(abs(a - c) <= NEAR_UM and abs(c) > 5 for a, c in pairs))


def at_zero(status):
    return all(abs(um) <= NEAR_UM for um in values(status, "applied"))


@pytest.mark.parametrize("profile", profiles.PROFILES)
def test_each_fault_takes_the_offsets_to_zero_and_its_end_brings_them_back(stage, real_path, tmp_path, profile):
    data, log, config = profiles.coefficients(profile, 1502), real_path / "plc.csv", tmp_path / "coefficients.json"
    (real_path / "map.json").write_text(json.dumps(data))
    config.write_text(json.dumps(data))
    with FakePlc("--map", real_path / "map.json", "--log", log) as plc, Box(config) as box:
        plc.command(f"move X={AT_REST_MM} Y={AT_REST_MM} Z={AT_REST_MM} feed=15000")
        plc.wait(at_work)
        for command, end in LASTING:
            plc.command(command)
            plc.wait(at_zero)
            if end:
                plc.command(end)
                stage.run_for(0.1)      # the next command comes in a scan of its own
            plc.wait(at_work)
        stopped_s = plc.status()["time_s"]
        stage.stall(3)
        plc.wait(at_zero)
        plc.wait(at_work)
        box.stop()
        plc.command("status")
    rows = list(csv.DictReader(log.read_text().splitlines()))
    found = {command: profiles.reaction(rows, command, end) for command, end in LASTING}
    found["stopped"] = profiles.reaction(rows, stopped_s, stopped_s + 3)
    assert profiles.complaints({"profile": profile, "code": box.code, "faults": found}) == []
    for command, times in found.items():
        # From what was applied then at 50 um/s; a PLC that restarts begins at zero.
        assert command == "restart" or times["zero_s"] >= (times["from_um"] - NEAR_UM) / 50 - SCAN_S, (command, times)


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
