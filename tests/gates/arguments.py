#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: the compiler compares the arguments of cb_fail (firmware/json/reader.h) with its sentence. The build is the
check; this proves that it would fail.
  arguments.py --self-test ROOT CC   plants one wrong call after the other; each must fail to compile"""

import subprocess
import sys

SOURCE = """#include "firmware/json/reader.h"
bool fault(struct cb_loader *loader, uint32_t at, const char *text, float number, uint64_t wide);
bool fault(struct cb_loader *loader, uint32_t at, const char *text, float number, uint64_t wide) {
    (void)text, (void)number, (void)wide;
    return cb_fail(loader, CB_ERROR_RANGE, at, %s);
}
"""
GOOD = '"%o is outside %s to %u", at, text, at'
PLANTED = ['"no signal is called %o", text', '"the key %s is missing", at', '"room for %u", text', '"above %u", number',
           '"%o is above %o", at', '"%u rows", wide', '"empty", at', '"%v is not known", at', '"%o", (void *)loader']


def compiled(root, cc, call):
    """out: the compiler's exit code and what it printed."""
    command = [cc, "-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", root, "-x", "c", "-"]
    done = subprocess.run(command, input=SOURCE % call, capture_output=True, text=True)
    return done.returncode, done.stderr


def main():
    root, cc = sys.argv[2:]
    code, printed = compiled(root, cc, GOOD)
    if code:
        sys.exit(f"arguments.py: a correct call does not compile: {printed}")
    for call in PLANTED:
        code, printed = compiled(root, cc, call)
        if not code or "format" not in printed:
            sys.exit(f"arguments.py: cb_fail(…, {call}) was not caught")
    print(f"{len(PLANTED)} of {len(PLANTED)} planted mistakes caught")


if __name__ == "__main__":
    main()
