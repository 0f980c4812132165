#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes docs/commands.md: the help of each program and command.
  commands.py BIN        prints the page
  commands.py BIN PAGE   prints the first difference from the page; exit code 1 if there is one"""

import pathlib
import re
import subprocess
import sys

OTHERS = ("compboxd", "compbox-view", "fakeplc", "fakept100", "virtual-laser")
HEAD = """# Commands

Each command prints this text with `--help`. `scripts/docs --commands` writes this page from it, and a test
compares them. Exit codes: 0 done, 1 the input is bad (the message names file, line and column), 2 wrong usage.

"""


def help_of(program, *words):
    done = subprocess.run([program, *words, "--help"], capture_output=True, text=True, timeout=60)
    if done.returncode:
        sys.exit(f"{program} {' '.join(words)} --help: exit code {done.returncode}: {done.stderr}")
    return re.sub(r"[ \t]+$", "", done.stdout, flags=re.M).strip("\n")


def command_names(text):
    """in: the help of compbox. out: its commands, in its order."""
    listed = re.split(r"^(?:Subcommands|SUBCOMMANDS):\n", text, flags=re.M)[1].split("\n\n")[0]
    return re.findall(r"^  ([a-z][a-z-]*) ", listed, re.M)


def page(folder):
    """in: the folder of the programs. out: the text of the page"""
    whole = help_of(folder / "compbox")
    parts = [("compbox", whole)]
    parts += [(f"compbox {name}", help_of(folder / "compbox", name)) for name in command_names(whole)]
    parts += [(name, help_of(folder / name)) for name in OTHERS]
    return HEAD + "\n\n".join(f"## {name}\n\n```text\n{text}\n```" for name, text in parts) + "\n"


def difference(made, there):
    """out: one sentence about the first line that differs, or None."""
    lines, theirs = made.split("\n"), there.split("\n")
    for number, (line, their) in enumerate(zip(lines, theirs), 1):
        if line != their:
            return f"line {number} is {their!r}, the programs print {line!r}: run scripts/docs --commands"
    return None if len(lines) == len(theirs) else "another number of lines: run scripts/docs --commands"


if __name__ == "__main__":
    made = page(pathlib.Path(sys.argv[1]).resolve())
    if len(sys.argv) < 3:
        print(made, end="")
        sys.exit(0)
    wrong = difference(made, pathlib.Path(sys.argv[2]).read_text())
    print(f"{sys.argv[2]}: {wrong}" if wrong else f"{made.count(chr(10))} lines compared")
    sys.exit(1 if wrong else 0)
