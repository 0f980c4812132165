#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: flash and RAM of compbox-stm32f405, from the symbols of its linker script, and what must not be
in it: a heap, stdio, commands of the test image. (Double precision is kept out by -Wdouble-promotion;
libgcc itself uses it between 64-bit integers and float32.)
  memory.py NM IMAGE     prints used / limit; exit 1 beyond one or with a forbidden symbol or command
  memory.py --self-test  judges planted symbol tables; each fault must be caught"""

import pathlib
import re
import subprocess
import sys

KIB = 1024
CODE_LIMIT = 120 * KIB  # code and constants, start values of data included
RAM_LIMIT = 116 * KIB   # data, stack and guard; of 128 KiB
FORBIDDEN = re.compile(r"_?(malloc|free|calloc|realloc|sbrk)(_r)?|.*printf.*|_?exit|__libc_init_array|crash_.*")
TEST_COMMANDS = b"crash "  # as they are typed: of the test image alone


def symbols(text):
    """{name: address} of what nm prints."""
    return {fields[2]: int(fields[0], 16) for fields in map(str.split, text.splitlines())
            if len(fields) == 3}


def judge(table, content=b""):
    """Prints used / limit; true when all is well. content: all bytes of the image"""
    try:
        code = table["data_load"] - table["flash_start"] + table["data_end"] - table["data_start"]
        ram = table["retained_end"] - table["guard_start"]
    except KeyError as missing:
        print(f"the image has no symbol {missing}")
        return False
    print(f"code and constants {code:6} / {CODE_LIMIT} bytes")
    print(f"static RAM         {ram:6} / {RAM_LIMIT} bytes, stack and guard of "
          f"{table['stack_top'] - table['guard_start']} bytes included")
    wrong = [name for name in table if FORBIDDEN.fullmatch(name)]
    wrong += ["the command `crash`"] * (TEST_COMMANDS in content)
    for name in wrong:
        print(f"{name} must not be in the image")
    return code <= CODE_LIMIT and ram <= RAM_LIMIT and not wrong


RIGHT = {"flash_start": 0x8000000, "data_load": 0x8000000 + 119 * KIB, "data_start": 0x20001300,
         "data_end": 0x20001400, "guard_start": 0x20000000, "stack_top": 0x20001100,
         "retained_end": 0x20000000 + 116 * KIB, "main": 0x8000100}
FAULTS = [{"data_load": 0x8000000 + 120 * KIB}, {"retained_end": 0x20000001 + 116 * KIB}, {"malloc": 1},
          {"_sbrk": 1}, {"vsnprintf": 1}, {"_exit": 1}, {"crash_hang": 1}]


def self_test():
    if not judge(RIGHT):
        sys.exit("self-test: a right image was refused")
    for fault in FAULTS:
        if judge({**RIGHT, **fault}):
            sys.exit(f"self-test: not caught: {fault}")
    if judge(RIGHT, b"\0crash hang\0"):
        sys.exit("self-test: not caught: a command of the test image")
    print(f"self-test: {len(FAULTS) + 1} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test()
    else:
        listed = subprocess.run([sys.argv[1], sys.argv[2]], check=True, capture_output=True, text=True)
        if not judge(symbols(listed.stdout), pathlib.Path(sys.argv[2]).read_bytes()):
            sys.exit(1)
