#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: who may include whom (docs/DESIGN.md). Every #include of a source must be allowed here.
  includes.py [ROOT]       prints how many includes were looked at, or every line that is wrong
  includes.py --self-test  plants one wrong include after the other; each must be caught"""

import fnmatch
import pathlib
import re
import sys
import tempfile

FREESTANDING = ["<float.h>", "<limits.h>", "<stdarg.h>", "<stdbool.h>", "<stddef.h>", "<stdint.h>",
                "<string.h>"]  # string.h: memcpy, memset, memcmp, which the compiler itself emits
CORE = ["models/*", "firmware/*"]
TOOLS = "host-tools/"
FORMATS = [TOOLS + "formats/*"]
# From measurement files to a coefficient file: no way to the twin's truth, not even by a detour.
FILES_ONLY = [TOOLS + "compbox/" + name for name in (
    "fit_files.*", "build.*", "merge.*", "term_names.*", "load.*", "machine_file.*",
    "curve_range.*", "pair_remarks.*", "evaluate.*", "evaluate_remarks.*")]

# The first pattern that fits a file gives all that it may include. "<*>": any system header.
RULES = [
    ("models/*", ["models/*"] + FREESTANDING),
    ("firmware/*", CORE + FREESTANDING),
    # The cycle is the one piece of hal/ that knows the box; a target's program joins the two.
    ("hal/cycle.[ch]", CORE + ["hal/hal.h", "hal/cycle.h"] + FREESTANDING),
    ("hal/hal.h", FREESTANDING),
    ("hal/rtu_exchange.[ch]", ["hal/hal.h", "hal/rtu_exchange.h", "firmware/wire/rtu_dialog.h"] + FREESTANDING),
    ("hal/linux/daemon/*", CORE + ["hal/hal.h", "hal/cycle.h", "hal/linux/*", "<*>"]),
    # firmware/wire/modbus.h and the like turn bytes into numbers and know nothing of the box.
    ("hal/linux/*", ["hal/hal.h", "hal/rtu_exchange.h", "hal/linux/*", "firmware/wire/modbus.h", "firmware/wire/rtu_*.h",
                     "firmware/signals/can.h", "firmware/signals/canopen.h", "<*>"]),
    # What the console says and what the flash holds is about the box.
    ("hal/stm32f405/app/*", CORE + ["hal/hal.h", "hal/cycle.h", "hal/stm32f405/*"] + FREESTANDING),
    ("hal/stm32f405/*", ["hal/hal.h", "hal/rtu_exchange.h", "hal/stm32f405/*", "firmware/wire/modbus.h",
                         "firmware/wire/rtu_*.h"] + FREESTANDING),
    # What every command includes stays light for the compiler.
    (TOOLS + "command_line/*.h", [TOOLS + "command_line/*"] + ["<%s>" % name for name in (
        "functional", "initializer_list", "map", "memory", "optional", "stdexcept", "string", "type_traits",
        "utility", "vector")]),
    (TOOLS + "command_line/*", FORMATS + [TOOLS + "command_line/*", "<*>"]),
    # The truth about the simulated machine lives in twin/; it shares nothing with the box, and
    # neither the PLC nor what fits and trains may reach into the other side.
    (TOOLS + "formats/*", FORMATS + ["<*>"]),
    (TOOLS + "twin/*_main.cpp", FORMATS + [TOOLS + "twin/*", TOOLS + "command_line/*", "<*>"]),
    (TOOLS + "twin/*", FORMATS + [TOOLS + "twin/*", "<*>"]),
    (TOOLS + "fakeplc/*_main.cpp", FORMATS + [TOOLS + folder + "/*" for folder in (
        "twin", "fakeplc", "command_line")] + ["<*>"]),
    (TOOLS + "fakeplc/*", FORMATS + [TOOLS + "twin/*", TOOLS + "fakeplc/*", "<*>"]),
    *[(one, CORE + FORMATS + FILES_ONLY + [TOOLS + "fitting/*", "<*>"]) for one in FILES_ONLY],
    # Commissioning is the box itself before a live PLC: the Linux target's wire, and no twin.
    (TOOLS + "compbox/commission_live.cpp", CORE + FORMATS + ["hal/hal.h", "hal/cycle.h",
        "hal/linux/*", TOOLS + "compbox/commission_*", "<*>"]),
    (TOOLS + "compbox/commission_*", CORE + FORMATS + [TOOLS + "compbox/commission_*", "<*>"]),
    (TOOLS + "compbox/*", CORE + ["hal/hal.h", "hal/cycle.h", TOOLS + "*", "<*>"]),
    (TOOLS + "*", CORE + FORMATS + [TOOLS + folder + "/*" for folder in (
        "algebra", "metrology", "fitting", "identification", "training")] + ["<*>"]),
]
# Libraries that one folder alone sees, behind a narrow header of its own.
ALONE = {"<CLI/*": TOOLS + "command_line/*", "<ceres/*": TOOLS + "training/ceres/*"}
FOLDERS = ["models", "firmware", "hal", "host-tools"]
SUFFIXES = {".c", ".h", ".cpp", ".hpp", ".inl", ".inc", ".S"}
INCLUDE = re.compile(r'^\s*#\s*(?:include|import)\s*(<[^>]*>|"[^"]*"|\S+)')


def fits(name, pattern):
    return fnmatch.fnmatchcase(name, pattern)


def problem(file, included):
    """in : path of a source, what stands after #include. out: why that is wrong, or None."""
    name = included if included.startswith("<") else included.strip('"')
    for library, only in ALONE.items():
        if fits(name, library) and not fits(file, only):
            return f"includes {included}, but only {only} may"
    for pattern, allowed in RULES:
        if fits(file, pattern):
            if ".." not in name and any(fits(name, a) for a in allowed):
                return None
            return f"includes {included}, but {pattern} may include only {', '.join(allowed)}"
    return "no rule of tests/gates/includes.py covers this file"


def check(root):
    """Prints every wrong line and a summary; true if there is none."""
    files = includes = wrong = 0
    for path in sorted(p for folder in FOLDERS for p in (root / folder).rglob("*")):
        if path.suffix not in SUFFIXES:
            continue
        files += 1
        file = path.relative_to(root).as_posix()
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            includes += 1
            reason = problem(file, match.group(1))
            if reason:
                wrong += 1
                print(f"{file}:{number}: {reason}")
    print(f"include directions: {files} files, {includes} includes, {wrong} wrong / 0 allowed")
    return wrong == 0 and includes > 0


RIGHT = [
    ("models/a.c", '#include "models/a.h"'), ("firmware/a.c", '#include "models/ppoly.h"'),
    ("hal/cycle.c", '#include "firmware/box/box.h"'), ("hal/linux/daemon/main.c", '#include "firmware/box/box.h"'),
    ("hal/linux/tcp.c", "#include <modbus.h>"), ("host-tools/fitting/a.cpp", "#include <vector>"),
    ("host-tools/compbox/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/command_line/a.cpp", "#include <CLI/CLI.hpp>"),
    ("host-tools/twin/a_main.cpp", '#include "host-tools/command_line/command_line.h"'),
    ("host-tools/compbox/commission_live.cpp", '#include "hal/linux/box_hal.h"'),
]
FAULTS = [
    ("models/a.c", '#include "firmware/base/limits.h"'), ("models/a.c", "#include <math.h>"),
    ("models/a.h", "#  include <stdio.h>"), ("models/deep/a.c", "#include <stdlib.h>"),
    ("models/a.c", "#include HEADER"), ("models/a.c", '#include "models/../firmware/box/box.h"'),
    ("firmware/a.c", '#include "hal/hal.h"'), ("firmware/a.c", "#include <time.h>"),
    ("hal/hal.h", '#include "firmware/box/box.h"'), ("hal/linux/tcp.c", '#include "firmware/box/box.h"'),
    ("hal/linux/tick.c", '#include "hal/cycle.h"'), ("hal/linux/main.c", '#include "firmware/box/box.h"'),
    ("hal/linux/daemon/main.c", '#include "tests/support/plc.h"'),
    ("hal/linux/daemon/load.c", '#include "host-tools/formats/json.h"'),
    ("hal/stm32f405/uart.c", "#include <stdio.h>"),
    ("hal/stm32f405/app/dump.c", "#include <stdio.h>"),
    ("hal/stm32f405/usart.c", '#include "firmware/box/box.h"'), ("hal/other.c", "#include <stdint.h>"),
    ("host-tools/twin/a.cpp", '#include "models/bspline.h"'),
    ("host-tools/fakeplc/a.cpp", '#include "firmware/wire/number.h"'),
    ("host-tools/fitting/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/formats/a.h", '#include "host-tools/fitting/fit.h"'),
    ("host-tools/training/a.cpp", '#include "hal/hal.h"'),
    ("host-tools/compbox/fit_files.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/compbox/commission_live.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/compbox/cmd_eval.cpp", '#include "hal/linux/tcp.h"'),
    ("host-tools/compbox/build.h", '#include "host-tools/compbox/scenario.h"'),
    ("host-tools/compbox/cmd_eval.cpp", "#include <CLI/CLI.hpp>"),
    ("host-tools/twin/a_main.cpp", "#include <CLI/App.hpp>"),
    ("host-tools/command_line/command_line.h", "#include <CLI/CLI.hpp>"),
    ("host-tools/command_line/command_line.h", "#include <iostream>"),
    ("host-tools/command_line/a.cpp", '#include "host-tools/compbox/load.h"'),
    ("host-tools/twin/heat.cpp", '#include "host-tools/command_line/command_line.h"'),
    ("host-tools/training/train.cpp", "#include <ceres/ceres.h>"),
]


def verdict(sources):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for file, text in sources:
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text + "\n")
        return check(root)


def self_test():
    if not verdict(RIGHT):
        sys.exit("self-test: right includes were refused")
    for fault in FAULTS:
        if verdict([r for r in RIGHT if r[0] != fault[0]] + [fault]):
            sys.exit(f"self-test: not caught: {fault[0]}: {fault[1]}")
    print(f"self-test: {len(FAULTS)} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    elif not check(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")):
        sys.exit(1)
