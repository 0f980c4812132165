#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Makes the man pages of the packages from the help of the programs.
  manual.py VERSION FOLDER SECTION PROGRAM…   FOLDER/man1/compbox.1.gz, compbox-fit.1.gz …

A help begins with "NAME: what it does" and a usage line. Headings end with a colon; options have their text two
blanks behind them or in the next line; indented lines stay as they are. A help without a description, an example
or the text of an option is an error. NAME.txt beside this script adds sections that no help has."""

import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap
import time

ADDED = pathlib.Path(__file__).parent / "manual"
TEXT_AT = 30  # CLI11's column
ENTRY = re.compile(r"  (?P<names>\S+(?: \S+)*)(?: {2,}(?P<text>\S.*))?")
LISTS = ("Positionals", "Options", "Subcommands", "Files")
ENDED = (*LISTS, "Examples")  # an indented section ends before a line that is not indented
TITLES = {"": "DESCRIPTION", "Positionals": "ARGUMENTS", "Options": "OPTIONS", "Subcommands": "COMMANDS",
          "Exit codes": "EXIT STATUS", "Examples": "EXAMPLES", "Files": "FILES"}  # in the order of a page
EVERY = {"compbox": 1, "compbox-demo": 1, "compbox-view": 1, "compboxd": 8, "fakeplc": 1, "fakept100": 1,
         "virtual-laser": 1}
ASKED = {"-h,--help": "Print the help and exit", "--version": "Print the version and exit"}


class PoorHelp(Exception):
    """What the help of a program lacks."""


def escaped(text):
    """out: text that troff prints as it is."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga")
    return "\\&" + text if text.startswith(".") else text


def filled(text):
    """out: the same of running text, in lines of a usual width."""
    return "\n".join(map(escaped, textwrap.wrap(text, 72, break_long_words=False, break_on_hyphens=False)))


def flag(name):
    return f"\\fB{escaped(name)}\\fR"


def entry_names(names):
    """in : "-o,--output F.json REQUIRED" or "--port N=1502". out: (troff of them, remarks)"""
    remarks = []
    words, required, _ = names.partition(" REQUIRED")
    if required:
        remarks.append("required")
    words, _, initial = words.partition("=") if words.startswith("-") and "…" not in words else (words, "", "")
    if initial:
        remarks.append(f"default {initial}")
    switches, _, value = words.partition(" ")
    return ", ".join(map(flag, switches.split(","))) + (f" \\fI{escaped(value)}\\fR" if value else ""), remarks


def split(line):
    """out: [names, text] of a line that begins an entry, else None. CLI11 counts bytes: long names end one blank
    before the text's column."""
    names, text = (part.decode(errors="replace") for part in (line.encode()[:TEXT_AT], line.encode()[TEXT_AT:]))
    if re.fullmatch(r"  \S.*\S ", names) and "  " not in names.strip() and text[:1].strip():
        return [names.strip(), text]
    new = ENTRY.fullmatch(line)
    return new and [new["names"], new["text"] or ""]


def entries(lines, where):
    """out: troff of a list of options, arguments or commands."""
    found = []
    for line in lines:
        if begun := split(line):
            found.append(begun)
        elif line.strip():
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
    for names, text in found:
        text = ASKED.get(names, text)
        if not text:
            raise PoorHelp(f"{where}: {names} has no text")
        names, remarks = entry_names(names)
        yield f".TP\n{names}\n" + filled(text + (f" ({', '.join(remarks)})" if remarks else ""))


def blocks(lines):
    """out: troff of each paragraph; indented lines stay as they are."""
    held, kept = [], []
    for line in [*lines, ""]:
        if kept and not line.startswith("  "):
            yield ".RS 4\n.nf\n" + "\n".join(kept) + "\n.fi\n.RE"
            kept = []
        if held and (not line or line.startswith("  ")):
            yield filled(" ".join(held))
            held = []
        if line.startswith("  "):
            kept.append(escaped(line[2:]))
        elif line:
            held.append(line)


def sections(text):
    """in : a help after its usage line. out: [(heading, lines)]; text outside of a section has the heading \"\"."""
    found = [("", [])]
    for line in text.splitlines():
        heading = re.fullmatch(r"(positionals|options|subcommands|examples?|exit codes|files):(?: +(\S.*))?", line,
                               re.IGNORECASE)
        ended = found[-1][0] in ENDED and line and not line.startswith(" ")
        if heading:
            name = heading[1].capitalize().removesuffix("s") + "s"
            found.append((name, ["  " * (name == "Examples") + heading[2]] if heading[2] else []))
        elif ended:
            found.append(("", [line]))
        else:
            found[-1][1].append(line)
    return [(heading, lines) for heading, lines in found if any(lines)]


def page(words, section, text, version, others):
    """in : words of the command, its help, the names of pages to see also. out: troff of its page"""
    name = "-".join(words)
    first, _, rest = text.partition("\n")
    what = first.removeprefix(f"{name}: ").rstrip(".")
    usage, _, rest = rest.lstrip("\n").partition("\n")
    used = re.fullmatch(rf"usage: {' '.join(words)} (.*)", usage, re.IGNORECASE)
    if not what or not used:
        raise PoorHelp(f"{name}: the help does not begin with what it does and a usage line")
    added = ADDED / f"{name}.txt"
    found = sections(rest + ("\n" + added.read_text() if added.exists() else ""))
    if "Examples" not in dict(found):
        raise PoorHelp(f"{name}: the help has no example")
    brief = what[0].lower() + what[1:] if what[1:2].islower() else what
    day = time.strftime("%Y-%m-%d", time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))))
    lines = [f'.TH {escaped(name).upper()} {section} {day} "compbox {version}" "compbox"', ".nh", ".ad l",
             ".SH NAME", f"{escaped(name)} \\- {escaped(brief)}",
             ".SH SYNOPSIS", f".B {escaped(' '.join(words))}", escaped(used[1])]
    found = [(heading, [re.sub(r"^  (\S+)", rf"  {name}-\1({section})", line) for line in lines]
              if heading == "Subcommands" else lines) for heading, lines in found]
    for heading, title in TITLES.items():
        bodies = [line for found_heading, lines in found if found_heading == heading for line in [*lines, ""]]
        if heading == "" and not any(bodies):
            bodies = [f"{what}."]
        if any(bodies):
            items = entries(bodies, name) if heading in LISTS else blocks(bodies)
            lines += [f".SH {title}", ("\n" if heading in LISTS else "\n.PP\n").join(items)]
    lines += [".SH SEE ALSO", ",\n".join(f".BR {escaped(other)} ({place})" for other, place in others)]
    return "\n".join(lines).replace(",\n.BR", " ,\n.BR") + "\n"


def help_of(program, *words):
    done = subprocess.run([program, *words, "--help"], capture_output=True, text=True)
    if done.returncode != 0:
        raise PoorHelp(f"{program} {' '.join(words)} --help fails: {done.stderr}")
    return done.stdout


def main(version, folder, section, *programs):
    into = pathlib.Path(folder) / f"man{section}"
    shutil.rmtree(folder, ignore_errors=True)
    into.mkdir(parents=True)
    helps = {}  # words of a command: its help
    for program in programs:
        name, text = pathlib.Path(program).name, help_of(program)
        helps[name,] = text
        for heading, lines in sections(text):
            commands = [line.split()[0] for line in lines if ENTRY.fullmatch(line)] if heading == "Subcommands" else []
            helps.update({(name, command): help_of(program, command) for command in commands})
    for words, text in helps.items():
        if len(words) > 1:
            others = [(words[0], section)]
        else:
            others = [(name, place) for name, place in EVERY.items() if (name,) != words]
        troff = page(words, section, text, version, others)
        with open(into / f"{'-'.join(words)}.{section}.gz", "wb") as file:
            file.write(gzip.compress(troff.encode(), mtime=0))


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except PoorHelp as poor:
        sys.exit(f"manual.py: {poor}")
