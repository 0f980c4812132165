# SPDX-License-Identifier: MIT
"""Only completed cycles feed the daemon's watchdogs: systemd and the hardware watchdog."""
import errno
import signal

import pytest

from box import until
from frames import frame_of
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc

WATCH_S = 0.5  # of systemd
SYSTEMD = {"NOTIFY_SOCKET": "/run/systemd/notify", "WATCHDOG_USEC": str(int(WATCH_S * 1e6))}


@pytest.fixture
def watchdog(stage):
    return stage.watchdog()


def test_systemd_is_fed_at_half_of_its_time(stage, plc, port, start_box):
    with RawPlc(plc, port), start_box(env=SYSTEMD) as box:
        plc.wait_mode(ACTIVE)
        assert stage.notified[0] == "READY=1" and stage.notified.count("READY=1") == 1
        stage.run_for(10 * WATCH_S)
        assert 15 <= stage.notified.count("WATCHDOG=1") <= 21
        box.stop()


def test_what_systemds_full_queue_refuses_is_sent_again(stage, plc, port, start_box):
    """READY, a feed, the status and a stop. The next feed comes too late, the others would not come again."""
    stage.fail("send", errno.EAGAIN, "systemd", times=3)
    with RawPlc(plc, port) as server, start_box(env=SYSTEMD) as box:
        plc.wait_mode(ACTIVE)
        stage.run_for(1)
        assert len(stage.failed) == 3 and stage.notified.count("READY=1") == 1
        stage.fail("send", errno.EAGAIN, "systemd", times=1)
        until(lambda: len(stage.failed) == 4, every_s=0.01)
        fed = stage.notified.count("WATCHDOG=1")
        stage.run_for(0.06)
        assert stage.notified.count("WATCHDOG=1") == fed + 1
        stage.fail("send", errno.EAGAIN, "systemd")
        seen, server.answering = len(stage.notified), False
        stage.run_for(10)                   # until the mode stays
        stage.heal()
        until(lambda: any(text.startswith("STATUS=") for text in stage.notified[seen:]))
        stage.fail("send", errno.EAGAIN, "systemd")
        box.send_signal(signal.SIGTERM)
        stage.run_for(0.1)
        stage.heal()
        box.wait()
    assert sum(text.startswith("STOPPING=1") for text in stage.notified) == 1


def test_the_status_names_a_function_that_the_plc_refuses(stage, plc, port, start_box):
    """Also before that changes the mode, and no longer once it is there."""
    plc.values, refused = dict(AT_REST), [False]

    def without_fc16(request, reply):
        refuses = refused[0] and request.function == 16
        return [frame_of(request, bytes([request.function | 0x80, 1]))] if refuses else None

    def last():
        return next(text for text in reversed(stage.notified) if text.startswith("STATUS="))
    with RawPlc(plc, port, without_fc16), start_box(env=SYSTEMD) as box:
        plc.wait_mode(ACTIVE)
        until(lambda: "STATUS=ACTIVE" in last())
        refused[0] = True
        until(lambda: "the PLC does not have function 16" in last(), every_s=0.01)
        first = next(text for text in stage.notified if "function 16" in text)
        assert first.startswith("STATUS=ACTIVE"), stage.notified
        refused[0] = False
        until(lambda: "function 16" not in last())
        box.stop()


def test_a_plc_that_is_not_there_is_no_reason_to_be_killed(stage, start_box):
    with start_box(env=SYSTEMD) as box:
        until(lambda: stage.notified.count("WATCHDOG=1") >= 3)
        box.stop()


def test_a_loop_that_hangs_feeds_nobody(stage, plc, port, start_box, watchdog):
    """Only the loop's thread stands still; the normal thread goes on."""
    fed = stage.written[watchdog]
    with RawPlc(plc, port), start_box("--watchdog", watchdog, env=SYSTEMD) as box:
        plc.wait_mode(ACTIVE)
        until(lambda: fed)
        stage.stall(2.5, "compboxd-loop")
        stage.run_for(1)                # what was completed before still counts when it is time to feed
        seen = len(stage.notified), len(fed)
        stage.run_for(1.4)
        assert (len(stage.notified), len(fed)) == seen
        stage.run_for(1)
        assert "WATCHDOG=1" in stage.notified[seen[0]:] and len(fed) > seen[1]
        box.stop()


def test_a_slow_disk_is_no_reason_to_be_killed(stage, plc, port, start_box, watchdog):
    """The normal thread writes files and the log; it stands still, and the loop goes on."""
    fed = stage.written[watchdog]
    with RawPlc(plc, port), start_box("--watchdog", watchdog, env=SYSTEMD) as box:
        plc.wait_mode(ACTIVE)
        stage.stall(5, "compboxd")
        seen = len(stage.notified), len(fed)
        stage.run_for(4.9)
        assert set(stage.notified[seen[0]:]) == {"WATCHDOG=1"}
        assert len(stage.notified) - seen[0] >= 15 and len(fed) - seen[1] >= 8
        plc.wait_mode(ACTIVE)
        box.stop()
    assert box.code == 0, box.log


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_a_clean_end_disarms_the_watchdog_and_a_kill_does_not(stage, plc, port, start_box, watchdog, end):
    fed = stage.written[watchdog]
    with RawPlc(plc, port), start_box("--watchdog", watchdog) as box:
        plc.wait_mode(ACTIVE)
        until(lambda: len(fed) >= 2)
        box.stop(end)
    assert fed.endswith(b"V") == (end == signal.SIGTERM)
    assert set(fed[:-1]) == {0}


@pytest.mark.parametrize("threads, sentence", [(1, "the thread that feeds the watchdogs: Operation not permitted"),
                                               (2, "--priority 99 is not permitted"), (9, "/nowhere/lags: cannot be")])
def test_a_start_that_fails_leaves_the_watchdog_disarmed(stage, start_box, watchdog, threads, sentence):
    """A typing mistake must not reset the machine again and again. in : so many threads can be started"""
    words = ["--state", "/nowhere/lags"] if threads == 9 else ["--priority", "99"]
    with start_box("--watchdog", watchdog, *words) as box:
        stage.fail("pthread_create", errno.EPERM, skipped=threads)
        box.wait()
    assert box.code == 1 and sentence in box.log
    assert stage.written[watchdog] == b"V"


@pytest.mark.parametrize("most_s, words", [(15, "/dev/watchdog: resets the machine after 15 s, not 60"), (60, None)])
def test_what_the_watchdog_makes_of_its_timeout_is_reported(stage, start_box, most_s, words):
    with start_box("--watchdog", stage.watchdog(most_s=most_s), "--watchdog-timeout", "60") as box:
        stage.run_for(0.5)
        box.stop()
    assert (words in box.log) if words else ("resets the machine" not in box.log), box.log


def test_a_watchdog_that_is_not_there_is_reported(plc, port, start_box):
    with RawPlc(plc, port), start_box("--watchdog", "/nowhere/watchdog") as box:
        plc.wait_mode(ACTIVE)
        box.stop()
    assert "/nowhere/watchdog: no hardware watchdog: No such file or directory" in box.log
