#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Copies the pages of navigation.txt, and the files that they link to, into a folder for Sphinx. The tree stays the
same, so links need no change. The first page gets the table of contents.
  stage.py ROOT FOLDER"""

import pathlib
import re
import shutil
import sys

LINK = re.compile(r"\]\(([^()\s#]+)")


def navigation(root):
    """out: {group: {page: short title or ""}} in the order of the file, and {page: [pages below it]}."""
    groups, below = {}, {}
    for line in (root / "docs/site/navigation.txt").read_text().splitlines():
        entry = re.fullmatch(r"(\S+\.md)(?:: (.*?))?( \*)?", line)
        if not entry:
            if line and not line.startswith("#"):
                pages = groups.setdefault(line, {})
            continue
        page, title, star = entry.groups()
        pages[page] = title or ""
        if star:
            others = (str(other.relative_to(root)) for other in sorted((root / page).parent.glob("*.md")))
            below[page] = {other: "" for other in others if other != page}
    return groups, below


def contents(pages, caption=None):
    """out: a hidden table of contents."""
    options = [":hidden:", *([f":caption: {caption}"] if caption else [])]
    lines = (f"{title} </{page[:-3]}>" if title else f"/{page[:-3]}" for page, title in pages.items())
    return "\n".join(["", "```{toctree}", *options, "", *lines, "```", ""])


def linked_files(root, page, text):
    """out: the files, not pages, that a page links to."""
    for target in LINK.findall(text):
        path = (root / page).parent / target
        if ":" not in target and path.is_file() and path.suffix != ".md":
            yield path.resolve().relative_to(root)


def additions(groups, below):
    """out: {page: text behind it}: the first page is the root of all."""
    first = next(iter(next(iter(groups.values()))))
    text = {page: contents(pages) for page, pages in below.items()}
    for group, pages in groups.items():
        others = {page: title for page, title in pages.items() if page != first}
        text[first] = text.get(first, "") + contents(others, group)
    return text


def stage(root, folder):
    groups, below = navigation(root)
    behind = additions(groups, below)
    pages = [page for pages in [*groups.values(), *below.values()] for page in pages]
    files = set()
    for page in pages:
        text = (root / page).read_text()
        files.update(linked_files(root, page, text))
        there = folder / page
        there.parent.mkdir(parents=True, exist_ok=True)
        there.write_text(text + behind.get(page, ""))
    for name in sorted(files):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(root / name, folder / name)
    for name in ("conf.py", "_static"):
        there = root / "docs/site" / name
        (shutil.copytree if there.is_dir() else shutil.copyfile)(there, folder / name)
    return len(pages)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    print(f"{stage(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))} pages")
