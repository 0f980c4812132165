#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: every function and table of the product that other objects can see has a user in the product. A symbol
is in use if an object of the product refers to it, or if the sources of its own object, where a call may be
inlined, or those that only the microcontroller's compiler sees name it. Tests do not count. Inline functions and
templates are not seen.
  unused.py ROOT BUILD           BUILD: its folder, with compile_commands.json; prints each unused symbol
  unused.py --self-test CC CXX   compiles planted symbols; each unused one must be found, and no other"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

FOLDERS = ("models", "firmware", "hal", "host-tools")
# Who uses them is no object and no source of the product.
ALLOWED = {
    "main": "the C library",
}
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"", re.S)


def product_objects(root, build):
    """out: ({object: its sources}, the sources that no object of this build is made of)"""
    objects, compiled = {}, set()
    for entry in json.loads((build / "compile_commands.json").read_text()):
        source = pathlib.Path(entry["file"])
        if source.suffix not in (".c", ".cpp"):
            continue  # a precompiled header
        base = build if build in source.parents else root
        if base not in source.parents or source.relative_to(base).parts[0] not in FOLDERS:
            continue
        sources = [source]
        if "Unity" in source.parts:
            sources = [pathlib.Path(file) for file in re.findall(r'#include "([^"]+\.cpp)"', source.read_text())]
        made = entry.get("output") or re.search(r" -o (\S+)", entry["command"])[1]
        if made.startswith("tests/world/"):
            continue  # the daemon once more, for the simulated world
        objects[pathlib.Path(entry["directory"]) / made] = sources
        compiled.update(sources)
    everything = {path for folder in FOLDERS for path in (root / folder).rglob("*.c*") if path.suffix in (".c", ".cpp")}
    return objects, sorted(everything - compiled)


def lines_of(*command, text=None):
    return subprocess.run(command, input=text, check=True, capture_output=True, text=True).stdout.splitlines()


def demangled(names):
    """out: {name: as in the source}; of a constructor's and a destructor's several symbols the same"""
    names = sorted(names)
    return dict(zip(names, lines_of("c++filt", text="\n".join(names))))


def defined(objects):
    """out: {symbol that others can see: its object}; inline functions and templates are left out"""
    for line in lines_of("nm", "-A", "--defined-only", *objects):
        place, _, rest = line.rpartition(":")
        _, letter, symbol = rest.split()
        if letter in "TDRB":
            yield symbol, pathlib.Path(place)


def needed(objects):
    """out: every symbol that code or data of the objects refers to, a table of virtual functions among them"""
    for line in lines_of("objdump", "-r", *objects):
        fields = line.split()
        if len(fields) == 3 and fields[1].startswith("R_"):
            yield re.split("[+-]", fields[2])[0]


def is_named(name, path):
    """Whether the source uses the name: clang-format indents every use, and no definition outside a class."""
    code = COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), path.read_text())
    return re.search(rf"^(?:[ \t]|.*[=({{,&] *).*?\b{name}\b", code, re.M) is not None


def unused(objects, elsewhere):
    """in : objects: {object: its sources}; elsewhere: more sources whose uses count
    out: (symbol as in the source, its object) of each symbol without a user"""
    place_of = dict(defined(objects))
    used = set(needed(objects))
    written = demangled(used | place_of.keys())
    used = {written[symbol] for symbol in used}
    for symbol in sorted(place_of.keys() - used):
        name = re.sub(r"\[abi:\w+\]|<.*>", "", written[symbol].split("(")[0]).split("::")[-1]
        if written[symbol] in used or name in ALLOWED or name == "operator" or not name.isidentifier():
            continue
        if not any(is_named(name, path) for path in [*objects[place_of[symbol]], *elsewhere]):
            yield written[symbol], place_of[symbol]


def check(root, build):
    objects, elsewhere = product_objects(root, build)
    missing = [str(path) for path in objects if not path.exists()]
    if missing or not objects:
        print(f"unused: not built, build everything first: {', '.join(missing) or build}")
        return False
    found = list(unused(objects, elsewhere))
    for symbol, place in found:
        print(f"{' '.join(path.name for path in objects[place])}: {symbol} is used by no line of the product: "
              "remove it, or move it to tests/support")
    print(f"unused: {len(objects)} objects, {len(found)} symbols without a user / 0 allowed")
    return not found


PLANTED = {
    "a.c": "int used_by_b(void);\nint used_here(void);\nint dead(void);\nint by_the_mcu(void);\n"
           "extern const int dead_table[2];\n"
           "int used_by_b(void) {\n    return used_here();\n}\nint used_here(void) {\n    return 2; /* dead() */\n}\n"
           "int dead(void) {\n    return 1;\n}\nint by_the_mcu(void) {\n    return 1;\n}\n"
           "const int dead_table[2] = {1};\n",
    "b.h": "struct thing {\n    int gone(int x);\n};\n",
    "b.cpp": "#include \"b.h\"\nextern \"C\" int used_by_b();\nnamespace n {\nint alive(int x);\nint alive(int x) {\n"
             "    return x;\n}\n}\nint thing::gone(int x) {\n    return x;\n}\n"
             "int main() {\n    return n::alive(used_by_b());\n}\n",
    "mcu.c": "int start(void) {\n    return by_the_mcu();\n}\n",
}


def self_test(c, cxx):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, text in PLANTED.items():
            (folder / file).write_text(text)
        objects = {folder / "a.o": [folder / "a.c"], folder / "b.o": [folder / "b.cpp"]}
        for compiler, (made, sources) in zip((c, cxx), objects.items()):
            subprocess.run([compiler, "-O2", "-c", str(sources[0]), "-o", str(made)], check=True)
        found = sorted(symbol for symbol, _ in unused(objects, [folder / "mcu.c"]))
        if found != ["dead", "dead_table", "thing::gone(int)"]:
            sys.exit(f"self-test: found {found}")
    print("self-test: 3 planted symbols, all found")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test(*sys.argv[2:4])
    elif not check(*(pathlib.Path(path).resolve() for path in sys.argv[1:3])):
        sys.exit(1)
