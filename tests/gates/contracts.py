#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: a function whose body has 15 lines or more has a comment directly above its definition, or above its
declaration in a header of its room. A room that is not in CEILINGS has no function without one; a ceiling
only falls.
  contracts.py [ROOT]       prints used / limit of each room of CEILINGS, and each function beyond a limit
  contracts.py --list ROOM  prints the functions of a room that lack a comment
  contracts.py --self-test  checks planted functions; each that lacks a comment must be found"""

import pathlib
import re
import sys

LINES = 15
FOLDERS = ("models", "firmware", "hal", "host-tools", "tests/support")
SUFFIXES = (".c", ".cpp", ".h")
# Functions without a comment, by room.
CEILINGS = {}

SKIPPED = re.compile(r"//[^\n]*|/\*.*?\*/|R\"\((?:.*?)\)\"|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'"
                     r"|^[ \t]*#(?:\\\n|[^\n])*", re.S | re.M)
SCOPE = re.compile(r"(?:^|\s)(?:namespace|class|struct|union)\b[^()=]*$|extern \"\"$")
NAME = re.compile(r"((?:\w+::)*~?\w+|operator *\S+?)\s*\(")


def blank(match):
    return re.sub(r"[^\n]", " ", match[0])


def without_comments(text):
    """out: the text of the same length and lines, with blanks for comments, strings and preprocessor lines."""
    code = SKIPPED.sub(lambda match: '""' + blank(match)[2:] if match[0][0] == '"' else blank(match), text)
    code = re.sub(r"\b(?:public|protected|private):(?!:)", blank, code)
    return re.sub(r"(?<=\w)\{[^{};]*\}", blank, code)  # initialisers


def functions(text):
    """in : the text of a source that clang-format formatted
    out: (name, line, lines of the body) of each function that is defined in it; lambdas belong to theirs"""
    code, scopes, begin, function = without_comments(text), [], 0, None
    for match in re.finditer(r"[{};]", code):
        head, at = code[begin:match.start()], match.start()
        inside = function is not None
        if match[0] == "{":
            scopes.append(bool(SCOPE.search(head.strip())) and not inside)
            name = NAME.search(re.sub(r"\btemplate <[^\n]*>|\[\[\w+\]\]|__attribute__\(\(.*?\)\)", blank, head))
            if not inside and not scopes[-1] and all(scopes[:-1]) and name and not re.search(
                    r"[^=!<>]=[^=]", head[:name.start()]):
                function = (name[1], code.count("\n", 0, begin + len(head) - len(head.lstrip())) + 1, at, len(scopes))
        elif match[0] == "}":
            if inside and len(scopes) == function[3]:
                yield function[0], function[1], code.count("\n", function[2], at) - 1
                function = None
            if scopes:
                scopes.pop()
        if function is None:
            begin = match.end()


def commented(lines, line):
    """out: whether a comment ends directly above the line (from 1), with blank preprocessor lines passed over."""
    above = lines[line - 2].strip() if line > 1 else ""
    return above.endswith("*/") or above.startswith("//")


def declared(name, headers):
    """out: whether a header declares the name in a block of lines that begins with a comment."""
    last = re.escape(name.split("::")[-1])
    for lines in headers:
        for number, line in enumerate(lines, 1):
            if not re.search(rf"(?<![\w.>]){last}\(", line) or re.match(r"\s*(//|/?\*|return\b)", line):
                continue
            while number > 1 and not re.search(r"^\s*$|[{}]$", lines[number - 2]) and not commented(lines, number):
                number -= 1
            if commented(lines, number):
                return True
    return False


def missing(sources):
    """in : {path: text} of one room
    out: a line of text for each function of LINES lines and more without a comment"""
    texts = {path: text.split("\n") for path, text in sources.items()}
    headers = [lines for path, lines in texts.items() if path.endswith(".h")]
    for path, text in sorted(sources.items()):
        for name, line, length in functions(text):
            if length >= LINES and not commented(texts[path], line):
                if not declared(name, headers + ([texts[path]] if "::" in name else [])):
                    yield f"{path}:{line}: {name} has {length} lines and no contract above it"


def rooms(root):
    """out: {room: {path: text}} of all folders with sources."""
    found = {}
    for path in sorted(p for folder in FOLDERS for p in (root / folder).rglob("*") if p.suffix in SUFFIXES):
        name = path.relative_to(root)
        found.setdefault(name.parent.as_posix(), {})[name.as_posix()] = path.read_text()
    return found


def check(found, ceilings):
    """out: a line for each room below a ceiling, a line for each mistake, and the number of functions measured."""
    wrong, used, count = [], [], 0
    for room, sources in found.items():
        here, ceiling = list(missing(sources)), ceilings.get(room, 0)
        count += sum(length >= LINES for text in sources.values() for _, _, length in functions(text))
        used += [f"contracts: {room}: {len(here)} / {ceiling} functions without"] if ceiling else []
        wrong += here if len(here) > ceiling else []
    wrong += [f"{room} of CEILINGS is not there" for room in ceilings if room not in found]
    return used, wrong, count


LONG, SHORT = "{\n" + "    a();\n" * LINES + "}\n", "{\n" + "    a();\n" * (LINES - 1) + "}\n"
# A source beside the header a.h, and the functions that lack a comment in it.
HEADER = "/* Public. */\nint public_one(int a);\nint public_two(int a);\n\nint bare(int a);\n"
PLANTED = (
    ("static int f(int a) " + SHORT, []), ("static int f(int a) " + LONG, ["f"]),
    ("/* in : a\n * out: b */\nstatic int f(int a) " + LONG, []), ("// in: a\nint f(int a) " + LONG, []),
    ("/* Of g. */\nint g(void) {\n}\n\nint f(int a) " + LONG, ["f"]),
    ("/* Elsewhere. */\n\nint f(int a) " + LONG, ["f"]),
    ("int public_one(int a) " + LONG + "int public_two(int a) " + LONG, []), ("int bare(int a) " + LONG, ["bare"]),
    ("namespace {\nint f(const char *a = \"{\",\n      int b) " + LONG + "}\n", ["f"]),
    ("struct S {\n// Adds.\nS operator+(S b) const " + LONG + "S operator=(S b) " + LONG + "};\n", ["operator="]),
    ("struct S {\n  // Makes.\n  int make();\n};\nint S::make() " + LONG, []),
    ("class C {\n  public:\n    /* Adds. */\n    int f(int a) " + LONG + "};\n", []),
    ("S::S(int a) : a_(a), b_{a} " + LONG, ["S::S"]),
    ("int f(void) {\n    auto g = [] " + LONG + "    return 1;\n}\n", ["f"]),
    ("static const struct key keys[] = {\n" + "    {A(1)},\n" * LINES + "};\n", []),
    ("enum { A = B(1),\n" + "C,\n" * LINES + "};\n/* D. */\nextern \"C\" {\nint f(void) " + LONG + "}\n", ["f"]),
    ("#define F(a) { \\\n    (\nint f(int a) /* { */ " + LONG, ["f"]),
)


def self_test():
    for text, names in PLANTED:
        found = [line.split()[1] for line in missing({"a.c": text, "a.h": HEADER})]
        if found != names:
            sys.exit(f"contracts.py: {text!r} gave {found}, not {names}")
    room = {"models": {"a.c": PLANTED[1][0]}}
    for ceilings, bad in (({"models": 1}, False), ({}, True), ({"models": 1, "gone": 1}, True)):
        if bool(check(room, ceilings)[1]) != bad:
            sys.exit(f"contracts.py: one function without was judged wrong under {ceilings}")
    print(f"{len(PLANTED) + 3} of {len(PLANTED) + 3} planted sources judged right")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    if sys.argv[1:2] == ["--list"]:
        print("\n".join(missing(rooms(pathlib.Path("."))[sys.argv[2]])))
        return 0
    found = rooms(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
    used, wrong, count = check(found, CEILINGS)
    print("\n".join(used + wrong + [f"contracts: {count} functions of {LINES} lines and more in {len(found)} rooms, "
                                    f"{len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
