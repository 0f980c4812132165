# SPDX-License-Identifier: MIT
"""The site's ceiling, and files that let outputs go further or elsewhere than the running one."""
import json
import signal

import pytest

import machine
from box import run, until
from machine import ACTIVE, AT_REST, ENABLE, PERIOD_S, PERMIT_RESUME, REFERENCED, STANDBY
from raw_plc import RawPlc
from test_reload import grown, hup, replace

ALL_ON = ENABLE | REFERENCED | PERMIT_RESUME


def attack(data):
    """Every value x 1000, limits of 1 m, an older revision: the file of a foreign machine."""
    data["revision"] = 0
    for term in data["terms"]:
        for key in ("control_points", "values", "coefficients"):
            if key in term:
                term[key] = [1000 * v for v in term[key]]
    for channel in data["channels"]:
        channel.update(limit_um=1e6, error_um=1e6, slew_um_per_s=1e6,
                       type="int32" if channel["type"] == "int32" else "float32")
    data["channels"][1]["plc"] = 112  # room for a float32


def wider(data):
    """A later revision, with a larger limit of Z."""
    grown(0)(data)
    data["channels"][2].update(limit_um=350)


def stats(box, condition):
    """Waits for statistics that meet the condition; out: they."""
    return until(lambda: box.stats_file.exists() and condition(box.stats) and box.stats)


def largest_um(writes):
    return max(abs(um) for w in writes for um in w.um.values())


@pytest.fixture
def active(plc, port, start_box, tmp_path):
    """Starts a box, with these options, that compensates at rest; out: it and its file."""
    plc.values = dict(AT_REST)
    boxes = []
    def start(*options):
        box = start_box(*options).__enter__()
        boxes.append(box)
        plc.wait(lambda w: w.mode == ACTIVE and abs(w.um["Z"]) > 20)
        return box, tmp_path / "coefficients.json"
    with RawPlc(plc, port):
        yield start
        for box in boxes:
            box.__exit__()


def test_a_foreign_file_is_refused_by_its_revision(plc, port, active):
    box, path = active()
    hup(box, path, port, attack)
    printed = stats(box, lambda s: s["reloads"]["refused"] == 1)["reloads"]["last"]
    assert "revision 0 is older than the running one, 7" in printed and "--allow-older" in printed
    box.stop()
    assert box.code == 0 and largest_um(plc.writes) < 301
    assert box.log.count("revision 0 is older") == 1


def test_a_foreign_file_is_pending_where_older_ones_may_come(plc, port, active):
    box, path = active("--allow-older")
    hup(box, path, port, attack)
    now = stats(box, lambda s: s["reloads"]["pending"])["reloads"]
    assert now["taken"] == now["refused"] == 0
    seen = len(plc.writes)
    plc.wait(lambda w: len(plc.writes) > seen + 40)
    assert all(w.mode == ACTIVE for w in plc.writes[seen:]) and largest_um(plc.writes) < 301
    box.stop()
    assert box.code == 0, box.log


def test_a_larger_limit_is_pending_until_enable_is_off_and_all_is_zero(stage, plc, port, active):
    box, path = active()
    hup(box, path, port, wider)
    now = stats(box, lambda s: s["reloads"]["pending"])
    assert now["revision"] == 7
    assert "channel Z: limit_um is 350, not 300" in now["reloads"]["last"]
    for _ in range(5):  # the same file again: nothing new
        box.send_signal(signal.SIGHUP)
        stage.run_for(0.1)
    seen = len(plc.writes)
    plc.control = REFERENCED | PERMIT_RESUME
    stats(box, lambda s: s["reloads"]["taken"] == 1 and s["revision"] == 8)
    plc.control = ALL_ON
    plc.wait_mode(ACTIVE)
    box.stop()
    assert box.code == 0, box.log
    zero = next(w for w in plc.writes[seen:] if w.mode == STANDBY)
    assert all(um == 0 for um in zero.um.values())
    assert box.log.count("revision 8 is pending") == 1, box.log
    assert box.log.count("revision 8 is running now") == 1
    assert box.log.index("is pending") < box.log.index("STANDBY: the PLC has not set enable") \
        < box.log.index("revision 8 is running now")
    assert not box.stats["reloads"]["pending"]


def test_another_register_is_pending(plc, port, active):
    """Y's old register goes to zero at rest, before the new one is used."""
    box, path = active()
    def elsewhere(data):
        grown(0)(data)
        data["channels"][1]["plc"] = 112
    hup(box, path, port, elsewhere)
    printed = stats(box, lambda s: s["reloads"]["pending"])["reloads"]["last"]
    assert "channel Y: plc differs from the running file's" in printed
    plc.control = REFERENCED
    stats(box, lambda s: s["reloads"]["taken"] == 1)
    plc.control = ALL_ON
    plc.wait(lambda w: w.mode == ACTIVE and w.block[12] != 0)
    assert plc.last().um["Y"] == 0
    box.stop()
    assert box.code == 0, box.log


def test_a_box_in_standby_that_hears_no_plc_keeps_it_pending(plc, port, start_box, tmp_path):
    """What the PLC holds, and whether it has set enable, is unknown."""
    with start_box() as box:
        until(lambda: box.steps)
        hup(box, tmp_path / "coefficients.json", port, wider)
        stats(box, lambda s: s["reloads"]["pending"] and s["mode"] == "STANDBY")
        plc.control = REFERENCED
        with RawPlc(plc, port):
            stats(box, lambda s: s["reloads"]["taken"] == 1)
            box.stop()
    assert box.code == 0, box.log


@pytest.mark.parametrize("taken", [True, False])
def test_a_newer_file_replaces_the_pending_one(plc, port, active, taken):
    box, path = active()
    hup(box, path, port, wider)
    stats(box, lambda s: s["reloads"]["pending"])
    z = machine.wanted_um(AT_REST)["Z"]
    def worse(data):
        grown(0)(data)
        data["channels"][2].update(limit_um=-1)
    hup(box, path, port, grown(20) if taken else worse)
    last = stats(box, lambda s: not s["reloads"]["pending"])["reloads"]
    assert last["taken"] == taken and last["refused"] == (not taken)
    if taken:
        plc.wait(lambda w: abs(w.um["Z"] - z + 20) < 0.1)
    plc.control = REFERENCED
    plc.wait_mode(STANDBY)
    box.stop()
    assert box.code == 0 and box.stats["reloads"]["taken"] == taken, box.log


def test_the_same_revision_with_another_content_may_come(plc, port, active):
    box, path = active()
    def same(data):
        grown(20)(data)
        data["revision"] = 7
    z = machine.wanted_um(AT_REST)["Z"]
    replace(path, port, same)
    plc.wait(lambda w: abs(w.um["Z"] - z + 20) < 0.1)
    box.stop()
    assert "revision 7 is running now" in box.log


def test_an_older_one_may_come_where_that_is_permitted(plc, port, active):
    box, path = active("--allow-older")
    def older(data):
        grown(20)(data)
        data["revision"] = 6
    replace(path, port, older)
    stats(box, lambda s: s["reloads"]["taken"] == 1 and s["revision"] == 6)
    box.stop()
    assert box.code == 0, box.log


def test_no_output_is_beyond_the_ceiling_nor_faster(plc, port, active):
    box, path = active("--most-um", "40", "--most-um-per-s", "60.5")
    wanted = machine.wanted_um(AT_REST)
    assert abs(wanted["Z"]) > 60
    plc.wait(lambda w: abs(w.um["Z"]) > 39.9)
    plc.wait(lambda w: w.reason == 9)  # at its limit
    hup(box, path, port, grown(0))
    now = stats(box, lambda s: s["reloads"]["taken"] == 1)
    box.stop()
    assert box.code == 0, box.log
    assert largest_um(plc.writes) <= 40.0001
    for a, b in zip(plc.writes, plc.writes[1:]):
        assert all(abs(b.um[c] - a.um[c]) <= 60.5 * 2 * PERIOD_S + 0.11 for c in b.um)
    assert now["ceiling"] == {"um": 40, "um_per_s": 60.5, "lowers": "X, Y, Z"}
    assert box.log.count("s: the site's ceiling lowers the limits of X, Y, Z\n") == 1
    assert "revision 8 is running now; the site's ceiling lowers the limits of X, Y, Z" in box.log
    assert "no site ceiling" not in box.log


@pytest.mark.parametrize("options, printed", [
    ([], "no site ceiling for sizes and rates: the coefficient file alone limits them; set "
         "--most-um and --most-um-per-s"),
    (["--most-um", "1000"], "no site ceiling for rates: the coefficient file alone limits them; "
                            "set --most-um-per-s"),
    (["--most-um-per-s=1e3"], "no site ceiling for sizes: the coefficient file alone limits them; "
                              "set --most-um"),
    (["--most-um", "300", "--most-um-per-s", "500"], None)])
def test_one_line_says_what_has_no_ceiling(start_box, options, printed):
    with start_box(*options, "--cycles", "2") as box:
        box.wait()
    lines = [line for line in box.log.splitlines() if "ceiling" in line]
    assert len(lines) == (1 if printed else 0), lines
    assert printed is None or lines[0].endswith(printed)
    assert box.stats["ceiling"]["lowers"] == ""


@pytest.mark.parametrize("word", ["", "0", "-1", "+1", "1e9", "nan", "inf", "0x10", " 1", "1 ", "1,5",
                                  "1e", "10um", "0.0001", "1" * 70])
def test_a_ceiling_that_is_no_number_is_exit_2(tmp_path, port, word):
    path = machine.write_coefficients(tmp_path / "c.json", port)
    for option in ("--most-um", "--most-um-per-s"):
        code, printed = run("--config", path, f"{option}={word}")
        assert code == 2
        assert printed == f'compboxd: {option} must be a number from 0.001 to 1000000, not "{word}"\n'


def test_a_check_reads_the_file_under_the_ceiling(tmp_path, port):
    path = machine.write_coefficients(tmp_path / "c.json", port)
    assert run("--config", path, "--check", "--most-um", "1") == (0, "")
    assert json.loads(path.read_text())["channels"][0]["limit_um"] == 300
