#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: what the portable core needs from outside, and whether it keeps state, seen in its objects.
  symbols.py NM LIBRARY…               every undefined symbol must be on the list below (no heap, no
                                       stdio, no libm, no double precision), no object may have
                                       writable data
  symbols.py --self-test NM COMPILER…  compiles one fault after the other; each must be caught"""

import pathlib
import re
import subprocess
import sys
import tempfile

ALLOWED = {
    "cb_assertion_failed",  # of the target (firmware/base/assert.h)
    # what a freestanding compiler emits by itself
    "memcpy", "memset", "memmove", "memcmp",
    "__aeabi_memcpy", "__aeabi_memcpy4", "__aeabi_memcpy8", "__aeabi_memset", "__aeabi_memset4",
    "__aeabi_memset8", "__aeabi_memclr", "__aeabi_memclr4", "__aeabi_memclr8", "__aeabi_memmove",
    # 64-bit integers, and between them and float32 (exact or correctly rounded)
    "__aeabi_ldivmod", "__aeabi_uldivmod", "__aeabi_lmul", "__aeabi_llsl", "__aeabi_llsr",
    "__aeabi_lasr", "__aeabi_l2f", "__aeabi_ul2f", "__aeabi_f2lz", "__aeabi_f2ulz",
}
WRITABLE = "dDbBcCsSgG"  # nm's letters for data and bss, and their small sections
WHY = [
    (r"__aeabi_(d\w*|cd\w*|u?i2d|u?l2d|f2d)|__\w+df\d?$|__\w*df[sd]i$", "double precision"),
    (r"(m|c|re)alloc|free|_sbrk|aligned_alloc", "the heap"),
    (r"\w*(printf|scanf)|puts|putchar|f(open|close|read|write)", "stdio"),
    (r"(sin|cos|tan|asin|acos|atan2?|sinh|cosh|tanh|exp2?|expm1|log(2|10|1p)?|pow|sqrt|cbrt|hypot|"
     r"floor|ceil|round|trunc|rint|l?lround|nearbyint|fabs|fmod|fm(in|ax|a)|ldexp|frexp)f?", "libm"),
    (r"time|clock\w*|gettimeofday", "a clock"),
]


def reason(symbol):
    for pattern, what in WHY:
        if re.fullmatch(pattern, symbol):
            return what
    return "not on the list of what the core may need"


def symbols(nm, libraries):
    """All (library(object), letter, symbol) of the libraries."""
    for library in libraries:
        lines = subprocess.run([nm, "-A", library], check=True, capture_output=True, text=True)
        for line in lines.stdout.splitlines():
            place, _, rest = line.rpartition(":")
            fields = rest.split()
            if len(fields) >= 2:
                yield place, fields[-2], fields[-1]


def check(nm, libraries):
    """Prints every wrong symbol and a summary; true if there is none."""
    table = list(symbols(nm, libraries))
    defined = {symbol for _, letter, symbol in table if letter not in "Uw"}
    needed, wrong = set(), 0
    for place, letter, symbol in table:
        if letter in WRITABLE:
            print(f"{place}: {symbol} is global mutable state")
            wrong += 1
        elif letter in "Uw" and symbol not in defined:
            needed.add(symbol)
            if symbol not in ALLOWED:
                print(f"{place}: needs {symbol}: {reason(symbol)}")
                wrong += 1
    print(f"core symbols: {len(defined)} defined, {wrong} wrong / 0 allowed; needs from outside: "
          + (", ".join(sorted(needed)) or "nothing"))
    return wrong == 0 and bool(defined)


RIGHT = """#include <stdint.h>
#include <string.h>
static const float table[] = {1.0f, 2.0f};
float f(float x, int64_t a, int64_t b, char *to, const char *from);
float f(float x, int64_t a, int64_t b, char *to, const char *from) {
    memcpy(to, from, (uint32_t)a);
    return x * table[b & 1] + (float)(a / b);
}
"""
FAULTS = {
    "heap": "void *malloc(unsigned); void *f(unsigned n); void *f(unsigned n) { return malloc(n); }",
    "free": "void free(void *); void f(void *p); void f(void *p) { free(p); }",
    "stdio": "int printf(const char *, ...); void f(int x); void f(int x) { printf(\"%d\", x); }",
    "double": "float f(float x); float f(float x) { return (float)(x * 1.1); }",
    "double compare": "int f(float x); int f(float x) { return x > 0.1; }",
    "double from integer": "double f(int x); double f(int x) { return x; }",
    "libm": "float tanhf(float); float f(float x); float f(float x) { return tanhf(x); }",
    "libm, builtin": "float f(float x); float f(float x) { return __builtin_floorf(x) + 1.0f; }",
    "clock": "long time(long *); long f(void); long f(void) { return time(0); }",
    "state": "int f(void); int f(void) { static int n; return ++n; }",
    "initialised state": "int g = 3; int f(void); int f(void) { return g++; }",
}


def verdict(nm, compiler, source):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "planted.c"
        path.write_text(source)
        made = path.with_suffix(".o")
        subprocess.run(compiler + ["-O2", "-c", str(path), "-o", str(made)], check=True)
        return check(nm, [str(made)])


def self_test(nm, compiler):
    if not verdict(nm, compiler, RIGHT):
        sys.exit("self-test: a right object was refused")
    for name, source in FAULTS.items():
        if verdict(nm, compiler, source):
            sys.exit(f"self-test: not caught: {name}")
    print(f"self-test: {len(FAULTS)} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test(sys.argv[2], sys.argv[3:])
    elif not check(sys.argv[1], sys.argv[2:]):
        sys.exit(1)
