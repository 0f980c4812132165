# SPDX-License-Identifier: MIT
"""compboxd and fakeplc on a serial line: compensation arrives, and each fault of the line is survived."""
import errno
import json

import pytest

from box import Box
from fakeplc import FakePlc
from rtu_machine import coefficients
from steps import LOST

LINE = "/dev/ttyS0"


class Rig(FakePlc):
    def __init__(self, folder, data):
        map_file = folder / "map.json"
        map_file.write_text(json.dumps(data))
        super().__init__("--map", map_file, line=LINE)

    def wait_compensated(self):
        """EXX is 20 µm, so the box writes -20."""
        self.wait(lambda status: abs(status["applied_X"] + 20) < 0.1)


def start(tmp_path, data):
    config = tmp_path / "coefficients.json"
    config.write_text(json.dumps(data))
    return Box(config)


@pytest.mark.parametrize("fault, counter", [
    ("crc 3", "crc_errors"), ("noise 3 5", "noise_bytes"), ("wrong-id 3", "wrong_units"),
    ("truncate 3", "crc_errors"), ("late 45 3", "timeouts"), ("drop 2", "timeouts"),
    ("short 3 read", None), ("long 3 read", None), ("exception 4 3 read", "exceptions"),
    ("dribble 2 2", None), ("away 700", "disconnects"), ("close", "disconnects")])
def test_fault_is_survived(stage, real_path, tmp_path, fault, counter):
    data = coefficients(LINE)
    with Rig(real_path, data) as plc, start(tmp_path, data) as box:
        plc.wait_compensated()
        plc.command("fault " + fault)
        stage.run_for(1.5)
        plc.wait_compensated()
        box.stop()
    assert box.code == 0, box.log
    counted = box.stats["plc"]
    assert counter is None or counted[counter] >= 1, counted
    assert counted["replies"] > 0.5 * counted["requests"]


@pytest.mark.parametrize("skipped", [0, 1, 2])
def test_a_request_that_cannot_be_sent_is_no_retry(stage, real_path, tmp_path, skipped):
    """Which request of the cycle it is depends on how many writes worked: also the second try of one."""
    data = coefficients(LINE)
    data["cycle"]["period_ms"] = 60
    data["plc"]["transport"]["rtu"]["baud"] = 460800
    with Rig(real_path, data) as plc, start(tmp_path, data) as box:
        plc.wait_compensated()
        plc.command("fault crc 1 read")
        stage.fail("write", errno.EIO, LINE, times=1, skipped=skipped)
        stage.run_for(3)
        assert stage.failed
        plc.wait_compensated()
        box.stop()
    assert box.code == 0, box.log
    counted = box.stats["plc"]
    assert counted["disconnects"] == 1 and counted["retries"] <= 1, counted


@pytest.mark.parametrize("error, disconnects", [(errno.EINTR, 0), (errno.EAGAIN, 0), (errno.EIO, 1)])
def test_a_call_to_the_line_that_fails_once(stage, real_path, tmp_path, error, disconnects):
    data = coefficients(LINE)
    with Rig(real_path, data) as plc, start(tmp_path, data) as box:
        plc.wait_compensated()
        stage.fail("read", error, LINE, times=1)
        stage.run_for(3)
        assert stage.failed
        plc.wait_compensated()
        box.stop()
    assert box.code == 0, box.log
    assert box.stats["plc"]["disconnects"] == disconnects, box.stats["plc"]


@pytest.mark.parametrize("fault, counter", [("crc 1 read", "crc_errors"), ("crc 1 write", "crc_errors"),
                                            ("drop 1 read", "timeouts")])
def test_where_there_is_time_a_request_is_repeated_in_its_period(stage, real_path, tmp_path, fault, counter):
    """In 60 ms at 460 800 baud there is: what is spoilt or lost now and then costs no cycle. Without repetition each
    fault would cost one at least."""
    data = coefficients(LINE)
    data["cycle"]["period_ms"] = 60
    data["plc"]["transport"]["rtu"]["baud"] = 460800
    with Rig(real_path, data) as plc, start(tmp_path, data) as box:
        plc.wait_compensated()
        begin_us = stage.now_s * 1e6
        for _ in range(8):
            plc.command("fault " + fault)
            stage.run_for(0.25)
        plc.wait_compensated()
        end_us = stage.now_s * 1e6
        box.stop()
    assert box.code == 0, box.log
    counted = box.stats["plc"]
    assert counted[counter] == counted["retries"] == 8, counted
    for step in box.steps:
        if begin_us < step.read_us < end_us:
            assert step.read_ok and step.last_write not in LOST
