#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: nothing of the real system can be reached from the simulated compboxd (tests/world/). Its object may call the
renamed functions of calls.txt and a few pure ones of libc, and its variables are in sections that a restart puts back.
  world_calls.py OBJECT CALLS OBJDUMP   prints how many calls are renamed, or each symbol and section that is wrong
  world_calls.py --self-test            plants each mistake; all must be caught"""

import re
import subprocess
import sys

# They depend on their arguments alone. getopt_long keeps its place in its own variables, which the daemon sets.
# zlib's allocate in the daemon's own memory. libsodium's verify; its start reads random bytes, on which no answer
# depends.
PURE = set("""memcmp memcpy memmove memset strchr strcmp strcspn strerror strlen strncmp strncpy strspn strtof strtol
    strtoll strtoull snprintf vsnprintf __isoc99_sscanf dirname sigaddset sigemptyset sigfillset
    fnmatch getopt_long optarg opterr optind optopt deflate deflateInit2_
    sodium_init sodium_base642bin sodium_bin2base64 sodium_base64_encoded_len crypto_generichash
    crypto_sign_verify_detached""".split())
# Of the compiler and the linker.
OTHERS = {"_GLOBAL_OFFSET_TABLE_", "__cyg_profile_func_enter", "__cyg_profile_func_exit"}


def undefined(dump):
    return set(re.findall(r"\*UND\*\s+[0-9a-f]+ (?:\.hidden )?(\S+)$", dump, re.M)) - {""}


def variables(dump):
    """out: the sections of variables that are not empty; tables of constants that the linker relocates are none"""
    found = re.findall(r"^ +\d+ (\S+) +([0-9a-f]+) .*\n +(.*)$", dump, re.M)
    return {name for name, size, flags in found if int(size, 16) > 0 and "ALLOC" in flags and
            "READONLY" not in flags and not name.startswith(".data.rel.ro")}


def faults(dump, calls):
    """in : what `objdump -ht` prints; the text of calls.txt. out: a sentence for each mistake"""
    listed = {line for line in calls.split("\n") if line and not line.startswith("#")}
    used = undefined(dump)
    renamed = {name[len("world_"):] for name in used if name.startswith("world_")}
    for name in sorted(used - PURE - OTHERS - {"world_" + name for name in listed}):
        yield f"{name}: the simulated daemon would call the real one; add it to tests/world/calls.txt"
    for name in sorted(listed - renamed):
        yield f"{name}: the daemon does not call it; remove it from tests/world/calls.txt"
    for name in sorted(variables(dump) - {"world_data", "world_bss"}):
        yield f"{name}: a restart does not put back this section; rename it in tests/world/CMakeLists.txt"


def self_test():
    dump = ("  1 world_bss 00000010  0  0  0  2**5\n                  ALLOC\n"
            "  2 .data.rel.ro 00000010  0  0  0  2**5\n                  CONTENTS, ALLOC, LOAD, RELOC, DATA\n"
            "0000000000000000         *UND*\t0000000000000000 world_poll\n"
            "0000000000000000         *UND*\t0000000000000000 memcpy\n")
    planted = {
        "real one": (dump + "0000000000000000         *UND*\t0000000000000000 gettimeofday\n", "poll"),
        "does not call": (dump, "poll\nopen"),
        "put back": (dump + "  3 .tbss 00000010  0  0  0  2**5\n                  ALLOC, THREAD_LOCAL\n", "poll")}
    if list(faults(dump, "# c\npoll\n")):
        sys.exit("a sound object is refused")
    for words, (text, calls) in planted.items():
        found = list(faults(text, calls))
        if len(found) != 1 or words not in found[0]:
            sys.exit(f"not caught: {words}: {found}")
    print(f"{len(planted)} planted mistakes, each caught")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    image, calls, objdump = sys.argv[1:]
    dump = subprocess.run([objdump, "-ht", image], check=True, capture_output=True, text=True).stdout
    text = open(calls).read()
    wrong = list(faults(dump, text))
    print("\n".join(wrong) or f"{len(re.findall('^[a-z_]', text, re.M))} calls renamed, {len(PURE)} pure ones allowed")
    sys.exit(bool(wrong))


main()
