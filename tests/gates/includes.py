#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: which room may include which (docs/DESIGN.md §2). What a source includes, directly or by way of other
headers, must lie in its own room or in one that ROOMS allows. docs/DESIGN.md has the same table, docs/CODE.md
names every room.
  includes.py [ROOT]       prints how many includes were looked at, or every line that is wrong
  includes.py --self-test  plants one wrong include after the other; each must be caught"""

import fnmatch
import pathlib
import re
import sys
import tempfile

# From the ground up. A room may include itself and the rooms named behind it, all of which stand above it here:
# so there is no circle. Rooms of firmware/ and host-tools/ are named without that folder.
ROOMS = """
models            :
firmware/base     : models
firmware/wire     : models base
firmware/config   : models base wire
firmware/json     : models base wire config
firmware/signals  : models base wire config
firmware/terms    : models base wire config json signals
firmware/box      : models base wire config signals terms
firmware/load     : models base wire config json signals terms
hal               : models base wire config signals terms box
hal/linux         : models base wire config signals hal
hal/linux/files   : models base wire config signals terms box hal hal/linux
hal/linux/daemon  : models base wire config signals terms box load hal hal/linux hal/linux/files
hal/stm32f405     : models base wire hal
hal/stm32f405/app : models base wire config signals terms box load hal hal/stm32f405
hal/stm32f405/variant : models base wire config signals terms box load hal hal/stm32f405 hal/stm32f405/app
host-tools/formats        :
host-tools/command_line   : formats
host-tools/algebra        :
host-tools/metrology      : formats
host-tools/identification : formats algebra
host-tools/fitting        : models base formats algebra metrology
host-tools/test_report    : models base formats algebra metrology fitting
host-tools/regression     : algebra
host-tools/training       : formats algebra regression
host-tools/adaptation     : models formats algebra regression training
host-tools/sensors        : formats algebra regression training
host-tools/twin           : formats
host-tools/fakeplc        : formats twin
host-tools/coefficients   : models base wire config json signals terms box load formats algebra metrology \
    fitting
host-tools/export         : models base wire config json signals terms box load formats algebra metrology \
    fitting twin fakeplc coefficients
host-tools/plc            : formats fakeplc
host-tools/commission     : models base wire config json signals terms box load hal hal/linux hal/linux/files \
    formats command_line plc
host-tools/simulation     : models base wire config json signals terms box load hal formats command_line algebra \
    metrology identification fitting twin fakeplc coefficients
host-tools/box_files      : formats
host-tools/uplink         : formats command_line
host-tools/view           : models base wire config signals terms box formats command_line box_files uplink
host-tools/watch          : formats command_line box_files
host-tools/signing        : hal/linux formats
host-tools/compbox/live   : models base wire config formats command_line fakeplc plc commission watch
host-tools/compbox        : models base wire config json signals terms box load formats command_line algebra \
    metrology identification fitting test_report regression training adaptation sensors twin fakeplc \
    coefficients export simulation signing compbox/live
"""
FREESTANDING = ["<float.h>", "<limits.h>", "<stdarg.h>", "<stdbool.h>", "<stddef.h>", "<stdint.h>",
                "<string.h>"]  # string.h: memcpy, memset, memcmp, which the compiler itself emits
HOSTED = ("hal/linux", "host-tools")  # with an operating system: all others have only the compiler's own headers
# The start of a program of host-tools/ reads the command line, whatever its room.
MAIN, COMMAND_LINE = "*_main.cpp", "host-tools/command_line"
# What every command includes stays light for the compiler.
LIGHT = {"host-tools/command_line/*.h": ["<%s>" % name for name in (
    "functional", "initializer_list", "iosfwd", "map", "memory", "optional", "stdexcept", "string", "type_traits",
    "utility", "vector")]}
# Libraries that one folder alone sees, behind a narrow header of its own.
ALONE = {"<CLI/*": "host-tools/command_line/*", "<ceres/*": "host-tools/regression/ceres/*",
         "<modbus*": "*/libmodbus.c*", "<mosquitto*": "host-tools/uplink/broker.cpp",
         "<sodium*": "*/signature.c*",
         "<microhttpd*": "host-tools/view/server.cpp"}
FOLDERS = ["models", "firmware", "hal", "host-tools"]
SUFFIXES = {".c", ".h", ".cpp", ".hpp", ".inl", ".inc", ".S"}
INCLUDE = re.compile(r'^\s*#\s*(?:include|import)\s*(<[^>]*>|"[^"]*"|\S+)')
ROW = re.compile(r"^\| `([\w/-]+)/` \|.*\|([^|]*)\|$", re.M)


def read_rooms(text):
    """out: {room: the rooms that it may include}, in the order of the text."""
    rooms = {}
    for line in text.strip().splitlines():
        name, _, below = line.partition(":")
        full = [next((room for room in (one, "firmware/" + one, "host-tools/" + one) if room in rooms), None)
                for one in below.split()]
        if None in full:
            sys.exit(f"{name.strip()} may include only rooms that stand above it: {below.strip()}")
        rooms[name.strip()] = full
    return rooms


def room_of(name, rooms):
    """out: the innermost room that holds the file, or None."""
    holding = [room for room in rooms if name.startswith(room + "/")]
    return max(holding, key=len, default=None)


def fits(name, pattern):
    return fnmatch.fnmatchcase(name, pattern)


def header_problem(file, room, name):
    """in : a header in <>. out: why the file must not include it, or None."""
    for library, only in ALONE.items():
        if fits(name, library) and not fits(file, only):
            return f"only {only} may"
    for pattern, light in LIGHT.items():
        if fits(file, pattern) and name not in light:
            return f"{pattern} may include only {', '.join(light)}"
    if not room.startswith(HOSTED) and name not in FREESTANDING:
        return f"{room} may include only {', '.join(FREESTANDING)}"
    return None


def reached(name, includes, seen):
    """Adds the name and whatever it includes, by any detour, to seen."""
    if name not in seen:
        seen.add(name)
        for _, one in includes.get(name, []):
            if not one.startswith("<"):
                reached(one.strip('"'), includes, seen)
    return seen


def problem(file, included, includes, rooms):
    """in : path of a source, what stands after #include. out: why that is wrong, or None."""
    room = room_of(file, rooms)
    if room is None:
        return "is in no room of tests/gates/includes.py"
    if included.startswith("<"):
        return header_problem(file, room, included)
    name = included.strip('"')
    if ".." in name or not included.startswith('"'):
        return "a path from the root of the project is needed"
    allowed = [room, *rooms[room]] + [COMMAND_LINE] * fits(file, MAIN)
    wrong = sorted(one for one in reached(name, includes, set()) if room_of(one, rooms) not in allowed)
    if not wrong:
        return None
    way = "" if name in wrong else f", which leads to {wrong[0]}"
    return f"{room} may include only {', '.join(allowed)}{way}"


def read_includes(root):
    """out: {path of a source: [(line number, what stands after #include)]}"""
    found = {}
    for path in sorted(p for folder in FOLDERS for p in (root / folder).rglob("*")):
        if path.suffix in SUFFIXES:
            lines = enumerate(path.read_text().splitlines(), 1)
            found[path.relative_to(root).as_posix()] = [
                (number, match[1]) for number, line in lines if (match := INCLUDE.match(line))]
    return found


def check_documents(root, rooms):
    """out: a line for each room that docs/DESIGN.md or docs/CODE.md does not have as ROOMS has it."""
    table = {room: re.findall(r"`([\w/]+)`", below) for room, below in ROW.findall(
        (root / "docs/DESIGN.md").read_text())}
    here = {name.strip(): below.split() for name, _, below in (
        line.partition(":") for line in ROOMS.strip().splitlines())}
    wrong = [f"docs/DESIGN.md: {room}/ may include {table.get(room)}, in tests/gates/includes.py {here.get(room)}"
             for room in {**here, **table} if table.get(room) != here.get(room)]
    if not wrong and list(table) != list(here):
        wrong.append("docs/DESIGN.md: the rooms are in another order than in tests/gates/includes.py")
    tour = (root / "docs/CODE.md").read_text()
    wrong += [f"docs/CODE.md: `{room}/` is not named" for room in rooms if f"`{room}/" not in tour]
    return wrong + [f"{room}/ of tests/gates/includes.py is not there" for room in rooms if not (root / room).is_dir()]


def check(root):
    """Prints every wrong line and a summary; true if there is none."""
    rooms, includes = read_rooms(ROOMS), read_includes(root)
    wrong = check_documents(root, rooms)
    for file, lines in includes.items():
        for number, included in lines:
            reason = problem(file, included, includes, rooms)
            if reason:
                wrong.append(f"{file}:{number}: includes {included}: {reason}")
    count = sum(len(lines) for lines in includes.values())
    print("\n".join(wrong + [f"include directions: {len(rooms)} rooms, {len(includes)} files, {count} includes, "
                             f"{len(wrong)} wrong / 0 allowed"]))
    return not wrong and count > 0


RIGHT = [
    ("models/a.c", '#include "models/a.h"'), ("firmware/wire/a.c", '#include "models/ppoly.h"'),
    ("firmware/config/config.h", '#include "firmware/base/limits.h"'), ("hal/hal.h", "#include <stdint.h>"),
    ("firmware/signals/can.h", '#include "firmware/config/config.h"'),
    ("hal/linux/can.h", '#include "firmware/signals/can.h"'),
    ("hal/cycle.h", '#include "firmware/box/box.h"'), ("hal/linux/daemon/main.c", '#include "firmware/load/load.h"'),
    ("hal/linux/libmodbus.c", "#include <modbus/modbus.h>"), ("host-tools/fitting/a.cpp", "#include <vector>"),
    ("host-tools/compbox/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/command_line/a.cpp", "#include <CLI/CLI.hpp>"),
    ("host-tools/twin/a_main.cpp", '#include "host-tools/command_line/command_line.h"'),
]
FAULTS = [
    ("models/a.c", '#include "firmware/base/limits.h"'), ("models/a.c", "#include <math.h>"),
    ("models/a.h", "#  include <stdio.h>"), ("models/deep/a.c", "#include <stdlib.h>"),
    ("models/a.c", "#include HEADER"), ("models/a.c", '#include "models/../firmware/base/error.h"'),
    ("models/a.c", '#include "a.h"'), ("firmware/a.c", '#include "models/num.h"'),
    ("firmware/base/a.c", '#include "hal/hal.h"'), ("firmware/box/a.c", "#include <time.h>"),
    ("firmware/base/a.h", '#include "firmware/wire/modbus.h"'),
    ("firmware/wire/a.h", '#include "firmware/config/config.h"'),
    ("firmware/config/a.c", '#include "firmware/box/limiter.h"'),
    ("firmware/config/a.c", '#include "firmware/json/json.h"'),
    ("firmware/json/a.c", '#include "firmware/signals/signals.h"'),
    ("firmware/signals/a.c", '#include "firmware/json/json.h"'),
    ("firmware/terms/a.c", '#include "firmware/load/sections.h"'),
    ("firmware/box/a.c", '#include "firmware/load/load.h"'),
    ("firmware/box/a.c", '#include "tests/support/fault.h"'), ("hal/cycle.c", '#include "firmware/load/load.h"'),
    ("hal/hal.h", '#include "firmware/load/load.h"'), ("hal/linux/tcp.c", '#include "firmware/box/box.h"'),
    ("hal/linux/tick.c", '#include "hal/cycle.h"'),  # which leads to the box
    ("hal/stm32f405/time.c", '#include "hal/linux/can.h"'), ("hal/stm32f405/a.c", '#include "firmware/signals/can.h"'),
    ("hal/linux/main.c", '#include "hal/linux/daemon/loop.h"'),
    ("hal/linux/daemon/load.c", '#include "host-tools/formats/json.h"'),
    ("hal/stm32f405/uart.c", "#include <stdio.h>"), ("hal/stm32f405/app/dump.c", "#include <stdio.h>"),
    ("hal/other/a.c", "#include <stdio.h>"),
    ("host-tools/twin/a.cpp", '#include "models/bspline.h"'), ("host-tools/other/a.cpp", "#include <vector>"),
    ("host-tools/fakeplc/a.cpp", '#include "firmware/wire/number.h"'),
    ("host-tools/fitting/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/formats/a.h", '#include "host-tools/fitting/fit.h"'),
    ("host-tools/training/a.cpp", '#include "hal/hal.h"'),
    ("host-tools/coefficients/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/commission/a.cpp", '#include "host-tools/twin/machine.h"'),
    ("host-tools/compbox/a.cpp", '#include "hal/linux/tcp.h"'),
    ("host-tools/compbox/cmd_eval.cpp", '#include "host-tools/plc/machine.h"'),
    ("host-tools/compbox/cmd_eval.cpp", "#include <CLI/CLI.hpp>"),
    ("host-tools/twin/a_main.cpp", "#include <CLI/App.hpp>"),
    ("host-tools/command_line/command_line.h", "#include <CLI/CLI.hpp>"),
    ("host-tools/command_line/command_line.h", "#include <iostream>"),
    ("host-tools/command_line/a.cpp", '#include "host-tools/coefficients/load.h"'),
    ("host-tools/twin/heat.cpp", '#include "host-tools/command_line/command_line.h"'),
    ("host-tools/training/train.cpp", "#include <ceres/ceres.h>"), ("hal/linux/tcp.c", "#include <modbus/modbus.h>"),
    ("host-tools/plc/libmodbus.h", "#include <modbus/modbus.h>"),
    ("host-tools/view/site.cpp", "#include <microhttpd.h>"),
]
# In the documents: what stands there, and what is planted instead.
DOCUMENT_FAULTS = [
    ("docs/DESIGN.md", "`models` `base` `wire` |", "`models` `wire` |"),
    ("docs/DESIGN.md", "| `firmware/json/`", "| `firmware/text/`"),
    ("docs/DESIGN.md", "| `hal/` |", "| hal |"), ("docs/CODE.md", "`firmware/box/`", "`firmware/boxes/`"),
    ("docs/DESIGN.md", "| `firmware/wire/` | x | `models` `base` |\n", ""),
]


def write(root, sources):
    for file, text in sources:
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text(text + "\n")


def documents():
    """out: the sources of documents and folders as ROOMS has them."""
    lines = [line.partition(":") for line in ROOMS.strip().splitlines()]
    rows = [f"| `{room.strip()}/` | x | {' '.join(f'`{one}`' for one in below.split())} |" for room, _, below in lines]
    names = " ".join(f"`{room.strip()}/`" for room, _, _ in lines)
    return [("docs/DESIGN.md", "\n".join(rows)), ("docs/CODE.md", names)] + [
        (room.strip() + "/README", "") for room, _, _ in lines]


def verdict(sources):
    with tempfile.TemporaryDirectory() as folder:
        write(pathlib.Path(folder), documents() + sources)
        return check(pathlib.Path(folder))


def self_test():
    if not verdict(RIGHT):
        sys.exit("self-test: right includes were refused")
    for fault in FAULTS:
        if verdict([r for r in RIGHT if r[0] != fault[0]] + [fault]):
            sys.exit(f"self-test: not caught: {fault[0]}: {fault[1]}")
    for file, before, after in DOCUMENT_FAULTS:
        text = dict(documents())[file]
        if before not in text or verdict(RIGHT + [(file, text.replace(before, after))]):
            sys.exit(f"self-test: not caught: {file}: {after!r} for {before!r}")
    print(f"self-test: {len(FAULTS) + len(DOCUMENT_FAULTS)} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    elif not check(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")):
        sys.exit(1)
