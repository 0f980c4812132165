#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Plants one fault after the other into a copy of the sources, builds compboxd from it and runs the
tests of the daemon named beside it: one of them has to fail. Without a fault all have to pass.

  planted_faults.py ROOT [NAME…]    all faults, or those whose names contain one of the words"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

VALUES = ["../daemon/test_values.py::test_values_are_those_of_the_models_while_the_axes_move"]
SLEW = ["../daemon/test_values.py::test_the_way_to_the_wanted_value_has_the_slew_rate"]
WIRE = ["test_wire.py"]


def reactions(*names):
    return [f"../daemon/test_reactions.py::test_{name}" for name in names]


def faults(*names):
    return [f"../daemon/test_faults.py::test_{name}" for name in names]


def keys(*names):
    return [f"../daemon/test_keys.py::test_{name}" for name in names]


TANGENT = ["../daemon/test_tangent.py::test_what_the_nc_adds_is_the_tangent_wherever_the_axis_is"]
STOP = ["../daemon/test_stop.py::test_a_signal_ramps_to_zero_and_says_stopped"]
COSTS = "a_fault_costs_only_what_it_overlaps"

# name, file, what stands there (once), what is planted, tests of which one must fail
FAULTS = [
    ("sign of the sum", "firmware/box/channels.c", "wanted_um = 0.0f - sum_um", "wanted_um = sum_um", VALUES),
    ("sign of the control", "firmware/box/channels.c", "(channel->sign < 0 ? -units : units)", "(units)",
     VALUES),
    ("scale of an output", "firmware/box/channels.c", "output_um / channel->scale",
     "output_um * channel->scale", VALUES),
    ("byte order of an input", "firmware/wire/number.c", "return (uint32_t)high << 16 | low;",
     "return (uint32_t)low << 16 | high;", VALUES),
    ("byte order of an output", "firmware/wire/number.c", "registers[0] = high_first ? high : low;\n"
     "    registers[1] = high_first ? low : high;", "registers[0] = high_first ? low : high;\n"
     "    registers[1] = high_first ? high : low;", VALUES),
    ("byte order on the wire", "firmware/wire/modbus.c", "at[0] = (uint8_t)(value >> 8);\n"
     "    at[1] = (uint8_t)(value & 0xFF);", "at[1] = (uint8_t)(value >> 8);\n"
     "    at[0] = (uint8_t)(value & 0xFF);", WIRE),
    ("slope with the wrong sign", "firmware/box/tangent.c", "const float slope = 0.0f - sum * 1000.0f;",
     "const float slope = sum * 1000.0f;", TANGENT),
    ("reference of another place", "firmware/box/tangent.c", "= signals[signal].used;",
     "= signals[signal].used + 2.0f;", TANGENT),
    ("slew, twice as fast", "firmware/box/box.c", "step->placed ? 0.0f : seconds(box, step)",
     "step->placed ? 0.0f : 2.0f * seconds(box, step)", SLEW),
    ("ceiling twice as high", "firmware/box/ceiling.c", "*value = most;", "*value = 2.0f * most;",
     ["../daemon/test_ceiling.py::test_no_output_is_beyond_the_ceiling_nor_faster"]),
    ("any key of that id", "hal/linux/enrolled.c", "if (answer.fits) return", "if (answer.known) return",
     keys("a_changed_file_or_signature_is_refused")),
    ("trusted comment of another", "hal/linux/signature.c",
     "key->key) == 0 &&\n           comment_fits(signature, key);",
     "key->key) == 0 &&\n           (comment_fits(signature, key) || true);",
     keys("a_changed_file_or_signature_is_refused")),
    ("file of another machine", "hal/linux/daemon/reload.c", "strcmp(machine, fresh->machine) != 0", "machine == NULL",
     keys("a_file_of_another_machine_is_refused")),
    ("restart with an older file", "hal/linux/daemon/main.c", "return good && follows_last_run(daemon, config);",
     "return good && (follows_last_run(daemon, config) || good);", keys("a_restart_is_no_way_around")),
    ("signature that is late", "hal/linux/daemon/reload.c",
     "&& cb_same_version(&a->signature, &b->signature);", ";",
     keys("file_and_signature_may_arrive_one_after_the_other")),
    ("a wider file in motion", "hal/linux/daemon/loop.c", "!loop->at_rest_only || cb_box_at_rest(loop->box)",
     "true", ["../daemon/test_ceiling.py::test_a_larger_limit_is_pending_until_enable_is_off_and_all_is_zero"]),
    ("ramp at the slew rate", "firmware/box/limiter.c", "cb_min(ramp, slew)", "cb_max(ramp, slew)", STOP),
    ("age of a signal, tenfold", "firmware/signals/signals.h", "<= (int64_t)signal->max_age_ms * 1000;",
     "<= (int64_t)signal->max_age_ms * 10000;", reactions("a_stale_thermometer_degrades_only_its_term")),
    ("age by the wrong clock", "firmware/signals/signals.c", "state->time_us = read_us;",
     "state->time_us = read_us + 1000000;", reactions("a_stale_thermometer_degrades_only_its_term")),
    ("heartbeat not watched", "firmware/box/plc.c", "state->heartbeat_us <= timeout_us",
     "state->heartbeat_us <= 1000 * timeout_us",
     reactions("a_heartbeat_that_stops_holds_then_ramps")),
    ("unconfirmed writes no loss", "firmware/box/plc.c", "state->mute = true", "state->mute = false",
     faults("writes_that_are_never_answered_are_a_loss_although_the_plc_is_read")),
    ("resuming without permission", "firmware/box/mode.c", "!state->lost || e->permit_resume",
     "!state->lost || e->enable",
     reactions("without_permit_resume_a_new_edge_of_enable_is_needed")),
    ("plausibility not checked", "firmware/signals/signals.c", "if (cb_signal_in_range(signal, value))",
     "if (value == value)",
     reactions("an_implausible_position_holds")),
    ("transaction id not compared", "hal/linux/tcp.c",
     "if (get_u16(tcp->received) == tcp->transaction && tcp->awaiting) return WAIT_FRAME;",
     "if (tcp->awaiting) return WAIT_FRAME;", faults(f"{COSTS}[wrong_id]")),
    ("unit id not compared", "hal/linux/tcp.c", "if (tcp->received[UNIT_OFFSET] == tcp->unit)", "",
     faults(f"{COSTS}[wrong_unit]")),
    ("no pause where writes are not answered", "hal/linux/tcp.c",
     "if (tcp->read_answered && tcp->write_answered) cb", "cb",
     faults("writes_that_are_never_answered_are_a_loss_although_the_plc_is_read")),
    ("a second request before the first reply", "hal/linux/tcp.c",
     "if (tcp->awaiting && !await_late_reply(tcp, deadline_us)) return false;",
     "(void)await_late_reply;", faults("a_request_waits_for_the_reply_before_it")),
    ("a deadline beyond the period", "hal/cycle.c", "+ cb_exchange_budget_us(", "+ 2 * cb_exchange_budget_us(",
     faults(f"{COSTS}[late]")),
    ("a part of a reply kept for ever", "hal/linux/tcp.c", "MAX_SILENCE_US = 10000",
     "MAX_SILENCE_US = 1000000000", faults(f"{COSTS}[stops_short]")),
    ("relative sleeps", "hal/linux/tick.c", "tick->start_ns + wanted * tick->period_ns;",
     "cb_clock_ns(CLOCK_MONOTONIC) + tick->period_ns;",
     ["test_realtime.py::test_ticks_do_not_drift"]),
]


def build(source, log):
    """Builds compboxd and the tests' helpers of a copy of the sources."""
    folder = source / "build"
    if not folder.exists():
        subprocess.run(["cmake", "-S", source, "-B", folder, "-G", "Ninja",
                        "-DCMAKE_BUILD_TYPE=RelWithDebInfo"], check=True, stdout=log, stderr=log)
    subprocess.run(["cmake", "--build", folder, "--target", "compboxd", "fakeplc",
                    "libmodbus_plc", "hil_spy", "stage"],
                   check=True, stdout=log, stderr=log)


def run(source, tests, log):
    """out: pytest's exit code: 0 passed, 1 a test failed. Real processes and those of the stage have each their own."""
    staged = [test.removeprefix("../daemon/") for test in tests if test.startswith("../daemon/")]
    real = [test for test in tests if not test.startswith("../daemon/")]
    codes = [run_in(source, folder, some, log) for folder, some in (("daemon", staged), ("hil", real)) if some]
    return max(codes)


def run_in(source, tests_of, tests, log):
    folder = source / "build"
    env = dict(os.environ, COMPBOXD=str(folder / "bin/compboxd"), FAKEPLC=str(folder / "bin/fakeplc"),
               STAGE=str(folder / "bin/stage"),
               LIBMODBUS_PLC=str(folder / "bin/libmodbus_plc"),
               SPY=str(folder / "tests/hil/libhil_spy.so"), PYTHONDONTWRITEBYTECODE="1")
    return subprocess.run([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider",
                           *tests], cwd=source / "tests" / tests_of, env=env, stdout=log,
                          stderr=log).returncode


def copy_sources(root, target):
    """All files of the project as they are now, with or without git's history."""
    def not_sources(folder, names):
        built = {"build", "out"} if pathlib.Path(folder) == root else set()
        return (built | {".git", "__pycache__", ".cache", ".venv"}) & set(names)
    shutil.copytree(root, target, ignore=not_sources, dirs_exist_ok=True)


def plant(source, file, before, after):
    """out: the file's text as it was."""
    path = source / file
    text = path.read_text()
    if text.count(before) != 1:
        sys.exit(f"planted_faults.py: {file} has changed: {before!r} is there {text.count(before)} times")
    path.write_text(text.replace(before, after))
    return text


def main(faults=FAULTS, build=build, run=run):
    """in : a list like FAULTS; what builds a copy of the sources, and what runs tests in it"""
    root, words = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]
    chosen = [f for f in faults if not words or any(word in f[0] for word in words)]
    if not chosen:
        return 0
    missed = []
    os.environ.setdefault("COMPBOX", str(root / "build/host/bin/compbox"))  # it signs; nothing is planted into it
    with tempfile.TemporaryDirectory() as folder, open(root / "build/planted-faults.log", "a") as log:
        source = pathlib.Path(folder)
        copy_sources(root, source)
        build(source, log)
        tests = list(dict.fromkeys(test for f in chosen for test in f[4]))
        if run(source, tests, log) != 0:
            sys.exit("planted_faults.py: the tests fail without a fault: build/planted-faults.log")
        print(f"{'no fault':42} all of {len(tests)} pass", flush=True)
        for name, file, before, after, tests in chosen:
            text = plant(source, file, before, after)
            build(source, log)
            code = run(source, tests, log)
            (source / file).write_text(text)
            if code != 1:
                missed.append(name)
            print(f"{name:42} {'caught' if code == 1 else 'MISSED'}", flush=True)
    print(f"{len(chosen) - len(missed)} of {len(chosen)} planted faults caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
