#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Plants one fault after the other into a copy of the sources, builds compbox-stm32f405 from it and runs
tests of the image: one of them has to fail. Without a fault all have to pass.

  planted_faults.py ROOT [NAME…]    all faults, or those whose names contain one of the words"""
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from planted_faults import main  # noqa: E402

ROOT = pathlib.Path(sys.argv[1]).resolve()
SLOTS = ["test_boot.py::test_the_newest_good_slot_runs"]
CRASHES = ["test_boot.py::test_a_fault_is_recorded_and_the_box_restarts_into_standby"]
BITS = ["test_plc.py::test_compensation_arrives_while_the_axes_move"]

# name, file, what stands there (once), what is planted, tests of which one must fail
FAULTS = [
    ("image: the older slot runs", "firmware/load/slot.c", "slots[i].revision <= slots[newest].revision",
     "slots[i].revision > slots[newest].revision",
     SLOTS),
    ("image: a refused file ends the search", "hal/stm32f405/app/load.c",
     "if (states[other] == CB_SLOT_WHOLE &&", "if (states[other] != CB_SLOT_WHOLE &&",
     SLOTS),
    ("image: the status register says nothing", "hal/stm32f405/app/standby.c", "CB_REASON_NO_FILE << 8", "0",
     ["test_boot.py::test_without_a_file_the_plc_is_informed_in_its_status_register"]),
    ("image: the guard is not armed", "hal/stm32f405/guard.c", "ctrl, MPU_ENABLE_WITH_DEFAULT_MAP)", "ctrl, 0)",
     CRASHES),
    ("image: a fault's frame is not read", "hal/stm32f405/fault.c", "fault->pc = frame[6];", "", CRASHES),
    ("image: the canary is not looked at", "hal/stm32f405/box_hal.c", "if (!cb_guard_intact()) ",
     "if (!cb_guard_intact() && cb_guard_stack_used() == 0) ",
     ["test_boot.py::test_a_stack_at_its_end_is_seen_in_the_next_cycle"]),
    ("image: a restart forgets the loss", "hal/stm32f405/app/main.c", "= cb_start_was_fault(app.cause)", "= false",
     ["test_faults.py::test_a_processor_fault_while_active_ends_in_standby_until_permitted"]),
    ("image: no request is repeated", "firmware/wire/rtu_dialog.h", "CB_RTU_TRIES = 8,", "CB_RTU_TRIES = 1,",
     ["test_faults.py::test_where_there_is_time_a_request_is_repeated_in_its_period"]),
    ("image: another clock in the trace", "hal/stm32f405/app/dump.c", "put_time(line, app->box.life.now_us);",
     "put_time(line, app->cycle.tick_us);", BITS),
    ("image: a lost module's term stays", "hal/stm32f405/app/bus.c", "break; /* the turn counts as silent */",
     "hand_over(app);", ["test_bus.py"]),
]


def build(source, log):
    """Builds the image of a copy of the sources."""
    if not (source / "build/stm32f405").exists():
        subprocess.run(["cmake", "--preset", "stm32f405"], cwd=source, check=True, stdout=log, stderr=log)
    subprocess.run(["cmake", "--build", "build/stm32f405", "--target", "compbox-stm32f405", "compbox-stm32f405-test"],
                   cwd=source, check=True, stdout=log, stderr=log)


def run(source, tests, log):
    """out: pytest's exit code: 0 passed, 1 a test failed."""
    env = dict(os.environ, IMAGE=str(source / "build/stm32f405/bin/compbox-stm32f405.elf"),
               TEST_IMAGE=str(source / "build/stm32f405/bin/compbox-stm32f405-test.elf"),
               HOST_BIN=str(ROOT / "build/host/bin"), PYTHONDONTWRITEBYTECODE="1")
    return subprocess.run([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests],
                          cwd=source / "tests/hil/stm32f405", env=env, stdout=log, stderr=log).returncode


if __name__ == "__main__":
    sys.exit(main(FAULTS, build, run))
