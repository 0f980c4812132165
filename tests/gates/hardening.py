#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: how Linux programs that read a network are hardened, seen in their ELF files: position-independent,
all relocations done at the start and read-only then, no executable stack, stack protector, _FORTIFY_SOURCE.
  hardening.py PROGRAM…                   prints each program's marks; exit 1 where one is missing
  hardening.py --self-test COMPILER…      links one program without each mark; each must be caught"""

import pathlib
import re
import subprocess
import sys
import tempfile


def readelf(program, *what):
    return subprocess.run(["readelf", "-W", *what, program], check=True, capture_output=True, text=True).stdout


def marks(program):
    """{mark: whether the program has it}."""
    headers, dynamic = readelf(program, "-h", "-l"), readelf(program, "-d")
    symbols = set(re.findall(r"(__\w+)(?:@\S+)?", readelf(program, "--dyn-syms")))
    flags = " ".join(re.findall(r"\((?:FLAGS|FLAGS_1|BIND_NOW)\).*", dynamic))
    stack = re.search(r"GNU_STACK.*?(R\S*)\s+0x", headers)
    return {
        "PIE": "Type:                              DYN" in headers and " PIE" in flags,
        "RELRO": "GNU_RELRO" in headers,
        "BIND_NOW": "BIND_NOW" in flags or " NOW" in flags,
        "no executable stack": stack is not None and "E" not in stack[1],
        "stack protector": "__stack_chk_fail" in symbols,
        "_FORTIFY_SOURCE": any(re.fullmatch(r"__\w+_chk", name) for name in symbols),
    }


def check(programs):
    """Prints a line for each program; true if none lacks a mark."""
    wrong = 0
    for program in programs:
        missing = [mark for mark, there in marks(program).items() if not there]
        wrong += len(missing)
        print(f"{pathlib.Path(program).name}: " + ("lacks " + ", ".join(missing) if missing else "all marks"))
    print(f"hardening: {len(programs)} programs, {wrong} marks missing / 0 allowed")
    return bool(programs) and wrong == 0


SOURCE = """#include <stdio.h>
#include <string.h>
int main(int argc, char **argv) {
    char text[16];
    snprintf(text, sizeof text * (size_t)argc, "%s", argv[0]);
    strcpy(text + argc, argv[argc - 1]);
    return text[argc];
}
"""
RIGHT = ["-O2", "-fPIE", "-pie", "-fstack-protector-strong", "-U_FORTIFY_SOURCE", "-D_FORTIFY_SOURCE=2",
         "-Wl,-z,relro,-z,now,-z,noexecstack"]
FAULTS = {
    "PIE": ["-fno-pie", "-no-pie"],
    "RELRO": ["-Wl,-z,norelro"],
    "BIND_NOW": ["-Wl,-z,lazy"],
    "no executable stack": ["-Wl,-z,execstack"],
    "stack protector": ["-fno-stack-protector"],
    "_FORTIFY_SOURCE": ["-U_FORTIFY_SOURCE"],
}


def self_test(compiler):
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder) / "planted.c", pathlib.Path(folder) / "planted"
        source.write_text(SOURCE)
        def build(more):
            subprocess.run([*compiler, *RIGHT, "-w", *more, str(source), "-o", str(program)], check=True)
            return {mark for mark, there in marks(str(program)).items() if not there}
        if build([]):
            sys.exit(f"self-test: a hardened program is called wrong: {build([])}")
        for mark, fault in FAULTS.items():
            if build(fault) != {mark}:
                sys.exit(f"self-test: not caught alone: {mark}")
    print(f"self-test: {len(FAULTS)} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test(sys.argv[2:])
    elif not check(sys.argv[1:]):
        sys.exit(1)
