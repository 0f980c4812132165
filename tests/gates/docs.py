#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: what the documents point at is there. Every relative link of a Markdown file, with its anchor;
every scripts/NAME that a document or script mentions, which must be executable too, and every scripts/report NAME;
every path of the sources in `code quotes` that ends like a file. Each table has a header. No commands belong to a
list. Each page is once in the order of the site, docs/site/navigation.txt, and each figure has all words of its
.dot source and is on a page. Each test in `code quotes` exists: `unit.SUITE`, `unit.SUITE.case`, `daemon.NAME`,
`hil.NAME`, `cli.NAME`, `gate.NAME`. Each sentence of the README's properties has its row in docs/promises.md.
  docs.py [ROOT]       prints how many links were looked at, or every one that leads nowhere
  docs.py --self-test  plants one broken link after the other; each must be caught"""

import html
import os
import pathlib
import re
import sys
import tempfile

SKIPPED = {"build", "out", ".git", ".cache", ".venv", "__pycache__"}
LINK = re.compile(r"\[[^\]]*\]\(([^()\s]+(?:\([^()]*\))?)\)")
SCRIPT = re.compile(r"(?<![\w./-])scripts/([a-z0-9][a-z0-9-]*)(?![\w*/-])(?!\.\w)")
REPORT = re.compile(r"(?<![\w./-])scripts/report ([a-z0-9][a-z0-9-]*)")
QUOTED = re.compile(r"`((?![^`]*NAME)(?:docs|models|firmware|hal|host-tools|tests|examples|cmake)/[\w./-]*\.\w+)`")
TEST = re.compile(r"`((?:unit|daemon|hil|cli|gate|oracle)\.[a-z]\w*(?:\.\w+)*)`", re.I)
FENCE = re.compile(r"^ {0,3}(```|~~~).*?^ {0,3}\1", re.M | re.S)


def anchors(text):
    """out: the anchors of the headings, as GitHub makes them."""
    found = set()
    for heading in re.findall(r"^#{1,6} +(.*?) *#*$", FENCE.sub("", text), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
        slug = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        same = sum(1 for anchor in found if re.fullmatch(re.escape(slug) + r"(-\d+)?", anchor))
        found.add(f"{slug}-{same}" if same else slug)
    return found


def link_wrong(root, path, target):
    """out: what is wrong with the target of a link in the file, or None."""
    if re.match(r"[a-z][a-z0-9+.-]*:", target):
        return None
    name, _, anchor = target.partition("#")
    there = (path.parent / name).resolve() if name else path
    if not there.exists():
        return f"{target} is not there"
    if root not in there.parents and there != root:
        return f"{target} leads out of the project"
    if anchor and there.suffix == ".md" and anchor not in anchors(there.read_text()):
        return f"{target}: no heading gives #{anchor}"
    return None


def script_wrong(root, name):
    script = root / "scripts" / name
    if not script.is_file():
        return f"scripts/{name} is not there"
    return None if os.access(script, os.X_OK) else f"scripts/{name} is not executable"


def torn_tables(prose):
    """out: line number of each table that has no header, as behind a blank line in its middle."""
    lines = [""] + prose.split("\n") + [""]
    for number in range(1, len(lines) - 1):
        if lines[number].startswith("|") and not lines[number - 1].startswith("|"):
            if not re.match(r"\|[ :|-]+\|$", lines[number + 1]):
                yield number


def lost_code(prose):
    """out: line number of each command that is text of the list item above it, because nothing is between them."""
    for match in re.finditer(r"^(?:\d+\.|[-*]) .*\n(?: +\S.*\n)*\n(?= {4}\S)", prose, re.M):
        yield prose[:match.end()].count("\n") + 1


def tests_of(root):
    """out: the names of ctest, and those of whole suites, as far as the sources have them."""
    names = set()
    for source in [*(root / "tests/unit").rglob("*_test.cpp"), *(root / "tests/world/unit").glob("*_test.cpp")]:
        for suite, case in re.findall(r"^TEST\w*\(\s*(\w+),\s*(\w+)\)", source.read_text(), re.M):
            names.update((f"unit.{suite}", f"unit.{suite}.{case}"))
    for folder in ("daemon", "hil", "cli"):
        names.update(f"{folder}.{test.stem[5:]}" for test in (root / "tests" / folder).glob("test_*.py"))
    for folder in ("gates", "conformance", "world"):
        lists = root / "tests" / folder / "CMakeLists.txt"
        text = lists.read_text() if lists.exists() else ""
        names.update("gate." + gate for gate in re.findall(r"\bcb_gate\((\S+)", text))
        names.update(re.findall(r"\badd_test\(NAME ([\w.-]+)(?=\s)", text))
        for loop, words in re.findall(r"\bforeach\((\w+) ([\w ]+)\)", text):
            names.update(name.replace(f"${{{loop}}}", word) for word in words.split()
                         for name in re.findall(r"\badd_test\(NAME (\S+)", text))
    return names


def sentences_of(text):
    """out: the sentences of the lists of a Markdown text, without their marks."""
    items = " ".join(re.findall(r"^- (.*(?:\n  .*)*)", text, re.M))
    return [one.strip() for one in re.findall(r"[^.]+\.", re.sub(r"\s+", " ", items.replace("**", "")))]


def promises_wrong(root):
    """out: each sentence of the README's properties that docs/promises.md does not have, a line each."""
    page, readme = root / "docs/promises.md", root / "README.md"
    part = re.search(r"^## Properties\n(.*?)(?=^## |\Z)", readme.read_text(), re.M | re.S)
    rows = re.findall(r"^\| ([^|]*) \|", page.read_text(), re.M) if page.exists() else []
    for one in sentences_of(part[1]) if part else ():
        if " " in one and one not in rows:  # a single word is a heading
            yield f"docs/promises.md has no row for the README's {one!r}"


def look_at(root, path, tests):
    """in : tests: names of all. out: (line number, what is wrong or None) of each pointer of a file."""
    text = path.read_text()
    markdown = path.suffix == ".md"
    prose = FENCE.sub(lambda block: "\n" * block[0].count("\n"), text) if markdown else ""
    for match in LINK.finditer(prose):
        yield prose[:match.start()].count("\n") + 1, link_wrong(root, path, match[1])
    for number in torn_tables(prose):
        yield number, "a table without a header: a blank line in its middle?"
    for number in lost_code(prose):
        yield number, "commands behind a list lose their form: put a line of text between"
    for match in SCRIPT.finditer(text):
        yield text[:match.start()].count("\n") + 1, script_wrong(root, match[1])
    for match in REPORT.finditer(text):
        there = (root / "scripts/reports" / match[1]).is_file()
        yield text[:match.start()].count("\n") + 1, None if there else f"there is no report {match[1]}"
    for match in QUOTED.finditer(prose):
        wrong = None if (root / match[1]).exists() else f"{match[1]} is not there"
        yield prose[:match.start()].count("\n") + 1, wrong
    for match in TEST.finditer(prose):
        wrong = None if match[1] in tests else f"there is no test {match[1]}"
        yield prose[:match.start()].count("\n") + 1, wrong


def not_in_order(root):
    """out: what is wrong with the order of the pages, a line each."""
    order = root / "docs/site/navigation.txt"
    listed = re.findall(r"^(\S+\.md)(?:: .*?)?( \*)?$", order.read_text(), re.M) if order.exists() else []
    named = {root / page for page, _ in listed}
    for page, below in listed:
        named.update((root / page).parent.glob("*.md") if below else ())
    for page in files(root):
        outside = page.parent != root and root / "docs" not in page.parents and root / "examples" not in page.parents
        if listed and page.suffix == ".md" and not outside and page not in named:
            yield f"{page.relative_to(root)} is not in docs/site/navigation.txt"
    yield from (f"{page} of docs/site/navigation.txt is not there" for page, _ in listed if not (root / page).exists())
    pages = [page for page, _ in listed]
    yield from (f"{page} is in docs/site/navigation.txt twice" for page in sorted(set(pages)) if pages.count(page) > 1)


def figures_wrong(root):
    """out: what is wrong with the figures, a line each."""
    pages = "".join(page.read_text() for page in files(root) if page.suffix == ".md")
    for figure in sorted((root / "docs/figures").glob("*.svg")):
        name, drawn = f"docs/figures/{figure.name}", html.unescape(figure.read_text())
        if f"figures/{figure.name})" not in pages:
            yield f"{name} is on no page"
        for source in (root / "docs" / f"{figure.stem}.dot", figure.with_suffix(".dot")):
            for label in re.findall(r'\blabel="([^"]+)"', source.read_text()) if source.exists() else ():
                missing = [line for line in label.split("\\n") if f">{line}</text>" not in drawn]
                yield from (f"{name} does not show {line!r}: run scripts/docs --figures" for line in missing)


def files(root):
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if name not in SKIPPED)
        for name in sorted(names):
            path = pathlib.Path(folder) / name
            scripts = path.parent in (root / "scripts", root / "scripts/reports")
            if path.suffix == ".md" or scripts or path == root / ".ci/run":
                yield path


def check(root):
    """out: how many pointers there are, and a line of text for each that is wrong."""
    count, wrong = 0, [*not_in_order(root), *figures_wrong(root), *promises_wrong(root)]
    tests = tests_of(root)
    for path in files(root):
        for line, problem in look_at(root, path, tests):
            count += 1
            if problem:
                wrong.append(f"{path.relative_to(root)}:{line}: {problem}")
    return count, wrong


GOOD = """# A title, `quoted`

[up](../README.md) [self](#a-title-quoted) [other](../README.md#two-words) [web](https://a.b/c)
`scripts/good`, `scripts/good --long`, scripts/good-*, `firmware/box/box.c`, `scripts/report good`
`unit.box`, `unit.box.is_good`, `hil.good`, `gate.good`, `gate.one.good`

```
[no](link.md)
```
"""
PROMISES = "| promise | held by |\n|---|---|\n| Always good. | x |\n"
PLANTED = ["[gone](gone.md)", "[gone](../docs/gone/)", "[anchor](../README.md#three-words)",
           "[anchor](#nothing)", "[out](../../elsewhere.md)", "`scripts/gone`", "run scripts/plain now",
           "`scripts/report gone`", "`firmware/gone.c`", "`unit.box.gone`", "`hil.gone`", "`gate.gone`",
           "| a |\n|---|\n| b |\n\n| c |\n",
           "1. one\n   more\n\n    make it\n"]


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder).resolve() / "project"
        for name, text in (("README.md", "# One\n\n## Two words\n\n## Properties\n\n- **Good.** Always\n  good.\n"),
                           ("docs/a.md", GOOD), ("docs/promises.md", PROMISES),
                           ("tests/unit/box/box_test.cpp", "TEST(box, is_good) {\n"), ("tests/hil/test_good.py", ""),
                           ("tests/gates/CMakeLists.txt",
                            "cb_gate(good\nforeach(i one)\nadd_test(NAME gate.${i}.good COMMAND"),
                           ("scripts/good", "#!/bin/sh\n"), ("scripts/plain", ""),
                           ("scripts/report", "#!/bin/sh\n"), ("scripts/reports/good", ""),
                           ("firmware/box/box.c", ""), ("../elsewhere.md", "")):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        (root / "scripts/good").chmod(0o755)
        (root / "scripts/report").chmod(0o755)
        count, wrong = check(root)
        if wrong or count != 14:
            sys.exit(f"docs.py: {count} pointers, what is good is called wrong: {wrong}")
        for planted in PLANTED:
            (root / "docs/a.md").write_text(GOOD + planted + "\n")
            if len(check(root)[1]) != 1:
                sys.exit(f"docs.py: the planted {planted!r} gave {check(root)[1]}")
        (root / "docs/a.md").write_text(GOOD)
        (root / "docs/site").mkdir()
        (root / "docs/figures").mkdir()
        order = "README.md\ndocs/a.md\ndocs/promises.md\n"
        for name, good, planted in (
                ("site/navigation.txt", order, "README.md\ndocs/promises.md\n"),
                ("site/navigation.txt", order, order + "b.md\n"),
                ("site/navigation.txt", order, order + "docs/a.md: Again\n"),
                ("promises.md", PROMISES, PROMISES.replace("Always", "Never")),
                ("figures/x.svg", "", ""), ("a.md", "", GOOD + "![x](figures/x.svg)\n![y](figures/x.svg)\n")):
            (root / "docs" / name).write_text(planted)
            if name == "a.md":
                (root / "docs/x.dot").write_text('a [label="gone"];')
            if len(check(root)[1]) != 1:
                sys.exit(f"docs.py: the planted {name} gave {check(root)[1]}")
            (root / "docs" / name).write_text(good)
    print(f"{len(PLANTED) + 6} of {len(PLANTED) + 6} planted mistakes caught")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    count, wrong = check(root)
    print("\n".join(wrong + [f"docs: {count} links and paths, {len(wrong)} wrong / 0 allowed"]))
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
