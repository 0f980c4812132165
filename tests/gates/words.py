#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: the documents are plain technical English. In each page nine sentences of ten have at most
28 words, and no page uses a word of the list PRIVATE.
  words.py [ROOT]       prints the figures of the longest page, or every page and line that is wrong
  words.py --pages      prints the figures of every page
  words.py --long PAGE  prints the sentences of a page that exceed the limit
  words.py --self-test  checks planted sentences; each mistake must be caught"""

import math
import os
import pathlib
import re
import sys
import tempfile

LIMIT_WORDS = 28
SKIPPED = {"build", "out", ".git", ".cache", ".venv", "__pycache__"}
# Each entry: a pattern, and the word to use instead.
PRIVATE = (
    (r"\b(?:is|are|was|were|be|been) told\b", "reported, named or distinguished"),
    (r"\btold (?:apart|as|by|with|like)\b", "distinguished or reported"),
    (r"\b(?:is|are|was|were|be|been) said\b", "stated, reported or printed"),
    (r"\b(?:says|said|say) so\b", "reports it"),
    (r"\bsomebody\b", "a person, a peer or a program"),
    (r"\bwhat (?:is|was) out\b", "pending"),
    (r"\basked (?:again|anew)\b", "retried"),
    (r"\basks (?:again|anew)\b", "retries"),
    (r"\b(?:stands|stood) (?:there|beside|in|at|on)\b", "is"),
    (r"\bbelieved\b", "accepted"),
    (r"\bwhat becomes of\b", "the thing itself as the subject"),
    (r"(?:^|[.!?] )That [a-z ]{1,60} is (?:counted|checked|tested|shown)\b", "the test as the subject"),
)

FENCE = re.compile(r"^ {0,3}(```|~~~).*?^ {0,3}\1[^\n]*$", re.M | re.S)
ENDS = re.compile(r"(?<=[.!?])[)\"]*\s+|:\s*$")
SHORT = re.compile(r"\b(e\.g|i\.e|cf|Fig|no|vs|approx|incl|max|min)\.$")


def plain(text):
    """out: the text without marks of Markdown; a quoted piece of code, a link or a formula is one word."""
    text = re.sub(r"`+[^`]*`+", "CODE", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"[*_]{1,3}(?=\S)|(?<=\S)[*_]{1,3}", "", text)


def blocks(page):
    """out: (line, text) of each paragraph, list item and cell of a table; without code and headings."""
    lines = FENCE.sub(lambda fence: "\n" * fence[0].count("\n"), page).split("\n") + [""]
    start, block, item = 0, [], False
    for number, line in enumerate(lines, 1):
        mark = re.match(r"\s*(?:[-*+]|\d+\.)\s+", line)
        code = not item and re.match(r" {4}|\t", line) and not block
        row = re.match(r"\s*\|", line)
        skipped = not line.strip() or code or row or re.match(r"\s*[#<]|\s*[-=]{3,}\s*$", line)
        if (skipped or mark) and block:
            yield start, " ".join(block)
            block = []
        if row:
            yield from ((number, cell) for cell in re.sub(r"\\\|", "or", line).split("|"))
        if mark:
            item = True
        elif line.strip() and not line.startswith(" ") and not block:
            item = False
        if not skipped:
            start = start if block else number
            block.append(re.sub(r"^\s*>?\s*", "", line[mark.end():] if mark else line))


def sentences(page):
    """out: (line of its paragraph, sentence, words) of each sentence of a page."""
    for line, text in blocks(page):
        whole = ""
        for piece in ENDS.split(plain(text)):
            whole = f"{whole} {piece}".strip()
            if SHORT.search(whole):
                continue
            count = sum(1 for word in whole.split() if re.search(r"\w", word))
            if count:
                yield line, whole, count
            whole = ""


def p90(page):
    """out: the length in words that nine sentences of ten keep; 0 for a page without sentences."""
    counts = sorted(count for _, _, count in sentences(page))
    return counts[math.ceil(0.9 * len(counts)) - 1] if counts else 0


def private(page):
    """out: (line, word, better) of each private word outside of code."""
    text = FENCE.sub(lambda fence: "\n" * fence[0].count("\n"), page)
    text = re.sub(r"`+[^`\n]*`+", "CODE", text)
    for pattern, better in PRIVATE:
        for match in re.finditer(pattern.replace(" ", r"\s+"), text, re.I | re.M):
            yield text[:match.start()].count("\n") + 1, " ".join(match[0].split()), better


def pages(root):
    """out: README.md, CHANGELOG.md, docs/**/*.md and examples/**/README.md."""
    yield from (root / name for name in ("README.md", "CHANGELOG.md") if (root / name).exists())
    for folder in ("docs", "examples"):
        for top, folders, names in os.walk(root / folder):
            folders[:] = sorted(name for name in folders if name not in SKIPPED)
            yield from (pathlib.Path(top) / name for name in sorted(names) if name.endswith(".md"))


def check(root):
    """out: (p90, page) of each page, and a line for each mistake."""
    figures, wrong = [], []
    for path in pages(root):
        name, text = path.relative_to(root), path.read_text()
        figures.append((p90(text), str(name)))
        if figures[-1][0] > LIMIT_WORDS:
            wrong.append(f"{name}: {figures[-1][0]} words at p90 / {LIMIT_WORDS} allowed")
        wrong += [f"{name}:{line}: {word!r}: use {better}" for line, word, better in private(text)]
    return figures, wrong


# Pages and what each has to give: its p90 and its private words.
LONG = "This sentence " + "goes on " * 14 + "to its end."
PLANTED = (
    ("The box reads a file. It checks the file.", 5, []),
    (LONG, 33, []),
    ("Short. " * 9 + LONG, 1, []),
    ("Short. " * 8 + LONG, 33, []),
    ("- An item of\n  two lines\n- another item", 5, []),
    ("# A heading is told\n\n    code goes in\n\n```\nit is told\n```\n| this is | a table |", 2, ["is told"]),
    ("`is told` is code. A call, e.g. of `x`, is one sentence.", 8, []),
    ("It is\ntold with the file.", 6, ["is told", "told with"]),
    ("This is said somebody asks again.", 6, ["is said", "somebody", "asks again"]),
    ("What becomes of a file? What is out?", 5, ["What becomes of", "What is out"]),
    ("That none of these calls is counted.", 7, ["That none of these calls is counted"]),
)


def self_test():
    for text, length, words in PLANTED:
        found = sorted(word for _, word, _ in private(text))
        if p90(text) != length or found != sorted(words):
            sys.exit(f"words.py: {text!r} gave {p90(text)} words and {found}, not {length} and {words}")
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs").mkdir()
        (root / "docs/a.md").write_text(LONG + " It is told.")
        (root / "README.md").write_text("Good.")
        if len(check(root)[1]) != 2:
            sys.exit(f"words.py: two planted mistakes gave {check(root)[1]}")
    print(f"{len(PLANTED) + 1} of {len(PLANTED) + 1} planted pages measured right")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    if sys.argv[1:2] == ["--long"]:
        for line, text, count in sentences(pathlib.Path(sys.argv[2]).read_text()):
            if count > LIMIT_WORDS:
                print(f"{line}: {count}: {text}")
        return 0
    arguments = [argument for argument in sys.argv[1:] if argument != "--pages"]
    figures, wrong = check(pathlib.Path(arguments[0] if arguments else ".").resolve())
    if "--pages" in sys.argv:
        print("\n".join(f"{length:3d} {name}" for length, name in sorted(figures)))
    longest = max(figures, default=(0, "no page"))
    used = f"words: {len(figures)} pages, longest p90 {longest[0]} / {LIMIT_WORDS} words ({longest[1]})"
    print("\n".join(wrong + [used + f", {len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not figures else 0


if __name__ == "__main__":
    sys.exit(main())
