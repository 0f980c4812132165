# SPDX-License-Identifier: MIT
"""A wrong use of an option is one sentence and the exit code 2. What systemd passes counts only for this process."""
import pytest

from box import run
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc

NUMBER = "must be a whole number from 1 to 99, not"
CEILING = "must be a number from 0.001 to 1000000, not"
WRONG = [(["--priority", text], f'--priority {NUMBER} "{text}"')
         for text in ("", "a", "-5", "5x", "0", "100", "99999999999999999999999")]
WRONG += [(["--most-um", text], f'--most-um {CEILING} "{text}"')
          for text in ("", "a", "-1", ":", "1.2.3", "1x", "0.0001", "1e7", "1" * 64)]
WRONG += [(["--cycles", "99999999999999999999999"], "--cycles must be a whole number"),
          (["--cpu-latency", "maybe"], '--cpu-latency must be on or off, not "maybe"'),
          (["--clock", "wall"], '--clock must be monotonic or boottime, not "wall"'),
          (["--cpu", "4096"], "--cpu must be a whole number from 0 to"),
          (["--stats"], "--stats needs a value"), (["--check=1"], '"--check=1": this option takes no value'),
          (["-Z"], "unknown option -Z"), (["--zero"], "unknown or ambiguous option --zero"),
          (["more"], '"more" belongs to no option'), ([], "--config")]


@pytest.mark.parametrize("arguments,sentence", WRONG)
def test_a_wrong_option_is_one_sentence(arguments, sentence):
    code, printed = run(*arguments)
    assert code == 2
    assert printed.startswith("compboxd: ") and sentence in printed
    assert printed.count("\n") == 1


def test_two_names_of_one_file_are_refused(stage, tmp_path):
    config, other = tmp_path / "c.json", tmp_path / "other"
    config.write_text("{}")
    other.symlink_to(config)
    for arguments in (["--record", config], ["--state", other], ["--stats", "/new", "--record", "/new"]):
        code, printed = run("--config", config, *arguments)
        assert code == 2
        assert "name the same file" in printed
    stage.watchdog("/dev/null")
    assert "same file" not in run("--config", config, "--record", "/dev/null", "--stats", "/dev/null", "--check")[1]


@pytest.mark.parametrize("switch", [("--cpu-latency", "on"), ("--cpu-latency", "off"), ("--clock", "monotonic"),
                                    ("--clock", "boottime"), ("--most-um", "1e3"), ("--cpu", "0")])
def test_each_value_of_a_switch_runs(plc, port, start_box, switch):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(*switch) as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log


@pytest.mark.parametrize("path,heard", [("/run/notify", True), ("@notify", True), ("notify", False),
                                        ("/" + "n" * 200, False)])
def test_systemd_hears_the_box_at_a_good_address(stage, plc, port, start_box, path, heard):
    plc.values = dict(AT_REST)
    with RawPlc(plc, port), start_box(env={"NOTIFY_SOCKET": path}) as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    assert bool(stage.notified) == heard


@pytest.mark.parametrize("pid,fed", [(None, True), ("4711", True), ("1", False)])
def test_systemds_watchdog_is_fed_by_its_own_process(stage, plc, port, start_box, pid, fed):
    plc.values = dict(AT_REST)
    env = {"NOTIFY_SOCKET": "/run/notify", "WATCHDOG_USEC": "1000000"}
    if pid:
        env["WATCHDOG_PID"] = pid
    with RawPlc(plc, port), start_box(env=env) as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(5)
        box.stop()
    assert any("WATCHDOG=1" in text for text in stage.notified) == fed
