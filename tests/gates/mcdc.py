#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Judges MC/DC (scripts/report mcdc): each condition of a decision has two executed vectors that show its independent
effect, or its reason beside it: a comment `MC/DC: reason` behind it, or on the lines directly above it.
  mcdc.py ROOT SHOWN   SHOWN: what llvm-cov-19 show --show-mcdc printed. Prints a table by room and each condition
                       that is not driven; fails where one has no reason, or where the page has other figures
  mcdc.py --self-test  judges planted decisions"""

import collections
import contextlib
import io
import pathlib
import re
import sys
import tempfile

ROOMS = ("models", "firmware/base", "firmware/wire", "firmware/config", "firmware/json", "firmware/signals",
         "firmware/terms", "firmware/box", "firmware/load", "hal", "hal/linux", "hal/linux/files", "hal/linux/daemon",
         "hal/stm32f405", "hal/stm32f405/app")
PAGE = "docs/results/mcdc.md"  # states the figures of these parts, each the rooms that fit
PARTS = {"`models/` and `firmware/`": "models|firmware/.*", "`hal/` and `hal/stm32f405/`": "hal(/stm32f405.*)?",
         "`hal/linux/`": "hal/linux", "`hal/linux/files/`": "hal/linux/files",
         "`hal/linux/daemon/`": "hal/linux/daemon"}

DECISION = re.compile(r"MC/DC Decision Region \((\d+):(\d+)\) to \((\d+):(\d+)\)")
CONDITION = re.compile(r"Condition C(\d+) --> \((\d+):(\d+)\)")
VECTOR = re.compile(r"\d+ (\{ .* = . +\})")
PAIR = re.compile(r"C(\d+)-Pair: (.*)$")
REASON = re.compile(r"/\*[ *]*MC/DC: (.*?)\*/", re.S)


class Decision:
    """What all its instances showed; an inline function has one in each file that calls it."""

    def __init__(self, end):
        self.end, self.starts, self.driven, self.vectors = end, [], set(), set()


def decisions(shown):
    """in : the text of llvm-cov show
    out: {(file, line, column): Decision}"""
    found, file, at = {}, None, None
    for line in shown.split("\n"):
        if line.startswith("/") and line.endswith(":"):
            file = line[:-1]
        elif match := DECISION.search(line):
            begin_line, begin, end_line, end = map(int, match.groups())
            at = found.setdefault((file, begin_line, begin), Decision((end_line, end)))
            starts = []
        elif at and (match := CONDITION.search(line)):
            starts.append((int(match[2]), int(match[3])))
            at.starts = max(at.starts, starts, key=len)
        elif at and (match := VECTOR.search(line)):
            at.vectors.add(match[1])
        elif at and (match := PAIR.search(line)) and match[2].startswith(("covered", "constant")):
            at.driven.add(int(match[1]))
    return found


def text_of(lines, start, end):
    """out: the source between two places (line, column from 1), on one line, without what joins it to the next"""
    rows = lines[start[0] - 1:end[0]]
    rows[-1] = rows[-1][:end[1] - 1]
    rows[0] = rows[0][start[1] - 1:]
    text = " ".join(" ".join(re.sub(r"/\*.*?(\*/|$)", "", row) for row in rows).split())
    text = re.sub(r"(\s|&&|\|\||!|\()+$", "", text)
    while text.count(")") > text.count("(") and text.endswith(")"):
        text = text[:-1].rstrip()
    return text


def reasons(text):
    """out: {line: (its comment's line, reason)} of the lines that a comment with a reason is beside"""
    found = {}
    for match in REASON.finditer(text):
        first, last = (text.count("\n", 0, place) + 1 for place in match.span())
        begin = text.rfind("\n", 0, match.start()) + 1
        alone = not text[begin:match.start()].strip()
        found[last + 1 if alone else first] = (first, " ".join(match[1].replace("\n *", " ").split()))
    return found


def judge(root, shown):
    """out: {room: [driven, all, reasons]}, a text for each condition with a reason, and one for each that is wrong"""
    table, given, wrong = collections.defaultdict(lambda: [0, 0, 0]), [], collections.defaultdict(list)
    by_file = collections.defaultdict(list)
    for (file, line, column), decision in sorted(decisions(shown).items()):
        by_file[pathlib.Path(file).relative_to(root).as_posix()].append(decision)
    for file, found in by_file.items():
        room, text = str(pathlib.PurePosixPath(file).parent), (root / file).read_text()
        lines, beside, used = text.split("\n"), reasons(text), set()
        for decision in found:
            for number, start in enumerate(decision.starts, 1):
                table[room][1] += 1
                if number in decision.driven:
                    table[room][0] += 1
                    continue
                end = (decision.starts + [decision.end])[number]
                place = f"{file}:{start[0]}: {text_of(lines, start, end)}"
                if start[0] in beside:
                    used.add(start[0])
                    table[room][2] += 1
                    given.append(f"{place}\n    {beside[start[0]][1]}")
                    continue
                vectors = "".join(f"\n    {vector}" for vector in sorted(decision.vectors)) or "\n    never evaluated"
                wrong[room].append(f"{place}  (C{number} of {len(decision.starts)} has no pair){vectors}")
        for line, (comment, reason) in beside.items():
            if line not in used:
                wrong[room].append(f"{file}:{comment}: no condition of line {line} needs the reason: {reason}")
    return table, given, wrong


def rows_of(table):
    """out: what the page has, a row for each part"""
    rows = []
    for part, rooms in PARTS.items():
        found = [table[room] for room in table if re.fullmatch(rooms, room)]
        rows.append(f"| {part} | {sum(room[0] for room in found)} | {sum(room[1] for room in found)} |")
    return rows


def report(root, shown):
    """out: every condition is driven or has its reason, and the page has these figures"""
    table, given, wrong = judge(root, shown)
    print("\n".join(text for room in sorted(wrong) for text in wrong[room]))
    if given:
        print("\nnot driven, with a reason:\n" + "\n".join(given))
    print(f"\n{'room':<20} {'driven':>6} / {'all':>4} {'':>8} {'reason':>7} {'open':>5}")
    for room in [room for room in ROOMS if room in table] + sorted(set(table) - set(ROOMS)):
        driven, count, reasoned = table[room]
        print(f"{room:<20} {driven:>6} / {count:>4} {100 * driven / count:>6.1f} % {reasoned:>7} {len(wrong[room]):>5}")
    page = (root / PAGE).read_text()
    other = [row for row in rows_of(table) if row not in page]
    if other:
        print(f"{PAGE} states other figures than:\n" + "\n".join(other))
    return not other and not any(wrong.values())


SOURCE = """\
int f(int a, int b) {
    return a &&
           b;
}
int g(int a, int b, int c) {
    /* MC/DC: it is
     * never so */
    if (a || (b && c)) return 1;
    return a && b; /* MC/DC: for a reason */
}
"""
SHOWN = """\
{root}/firmware/box/box.c:
  |---> MC/DC Decision Region (2:12) to (3:13)
  |     Condition C1 --> (2:12)
  |     Condition C2 --> (3:12)
  |  1 {{ F,  -  = F      }}
  |  2 {{ T,  T  = T      }}
  |  C1-Pair: covered: (1,2)
  |  C2-Pair: {}
  |---> MC/DC Decision Region (8:9) to (8:22)
  |     Condition C1 --> (8:9)
  |     Condition C2 --> (8:15)
  |     Condition C3 --> (8:20)
  |  C1-Pair: covered: (1,2)
  |  C2-Pair: covered: (1,2)
  |  C3-Pair: {}
  |---> MC/DC Decision Region (9:12) to (9:18)
  |     Condition C1 --> (9:12)
  |     Condition C2 --> (9:17)
  |  C1-Pair: {}
  |  C2-Pair: covered: (1,2)
"""
HERE, NOT = "covered: (1,2)", "not covered"
INSTANCE = """\
  | |---> MC/DC Decision Region (2:12) to (3:13)
  | |     Condition C1 --> (2:12)
  | |     Condition C2 --> (3:12)
  | |  C1-Pair: not covered
  | |  C2-Pair: covered: (1,2)
"""
# Pairs of the planted decisions, what is shown behind them: driven, reasons, and words of what is wrong.
PLANTED = (((HERE, NOT, NOT), "", 5, 2, []), ((NOT, NOT, NOT), "", 4, 2, ["box.c:3: b  (C2 of 2"]),
           ((NOT, NOT, NOT), INSTANCE, 5, 2, []), ((HERE, HERE, NOT), "", 6, 1, ["box.c:6: no condition of line 8"]),
           ((HERE, NOT, HERE), "", 6, 1, ["box.c:9: no condition of line 9"]))


def passes(root, shown, rows):
    """out: what the report returned, with a page that has these rows"""
    (root / PAGE).parent.mkdir(parents=True, exist_ok=True)
    (root / PAGE).write_text("\n".join(rows))
    with contextlib.redirect_stdout(io.StringIO()):
        return report(root, shown)


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "firmware/box").mkdir(parents=True)
        (root / "firmware/box/box.c").write_text(SOURCE)
        for pairs, instance, driven, reasoned, expected in PLANTED:
            table, given, wrong = judge(root, SHOWN.format(*pairs, root=root) + instance)
            found = wrong["firmware/box"]
            if (table["firmware/box"] != [driven, 7, reasoned] or len(given) != reasoned or
                    [text for text, word in zip(found, expected) if word in text] != found or
                    len(found) != len(expected)):
                sys.exit(f"mcdc.py: {pairs} gave {table['firmware/box']}, {given}, {found}")
            if passes(root, SHOWN.format(*pairs, root=root) + instance, rows_of(table)) == bool(expected):
                sys.exit(f"mcdc.py: the report on {pairs} does not follow {expected}")
            if passes(root, SHOWN.format(*pairs, root=root) + instance, []):
                sys.exit("mcdc.py: a page without the figures passes")
    print(f"{len(PLANTED)} of {len(PLANTED)} planted decisions judged")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    root = pathlib.Path(sys.argv[1]).resolve()
    return 0 if report(root, pathlib.Path(sys.argv[2]).read_text()) else 1


if __name__ == "__main__":
    sys.exit(main())
