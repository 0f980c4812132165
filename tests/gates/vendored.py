#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: files of others are those of their package. vendored.txt lists them with their hashes; each folder that has
one has no file that is not listed, and its licence lies beside it. No file of the page names an outside address.
  vendored.py ROOT         prints how many files were compared, or each file that is wrong
  vendored.py --self-test  plants one mistake after the other; each must be caught"""

import hashlib
import pathlib
import re
import sys
import tempfile

LIST, PAGE = "tests/gates/vendored.txt", "host-tools/view/page"
ADDRESS = re.compile(r"(?:https?:)?//[a-z0-9-]+(?:\.[a-z0-9-]+)+", re.I)
NAMES_ONLY = {"http://www.w3.org"}  # of namespaces, which nobody loads


def listed(root):
    """out: {path: sha256}"""
    lines = [line.split() for line in (root / LIST).read_text().splitlines() if not line.startswith("#")]
    return {path: digest for digest, path, _, _ in lines}


def wrong_files(root, files):
    for path, digest in files.items():
        if not (root / path).is_file():
            yield f"{path}: is missing"
        elif hashlib.sha256((root / path).read_bytes()).hexdigest() != digest:
            yield f"{path}: is not the file of its package"
    for folder in sorted({pathlib.PurePath(path).parent for path in files}):
        there = {str(path.relative_to(root)) for path in (root / folder).rglob("*") if path.is_file()}
        yield from (f"{path}: is not in {LIST}" for path in sorted(there - set(files)))
        if not any(path.startswith(f"{folder}/LICENSE") for path in there):
            yield f"{folder}: has no licence"


def outside_addresses(root, files):
    for path in sorted((root / PAGE).rglob("*")):
        name = str(path.relative_to(root))
        if path.is_file() and name not in files:
            found = [match[0] for match in ADDRESS.finditer(path.read_text()) if match[0] not in NAMES_ONLY]
            yield from (f"{name}: names the outside address {address}" for address in found)


def check(root):
    files = listed(root)
    return len(files), [*wrong_files(root, files), *outside_addresses(root, files)]


def self_test():
    """Each planted mistake must be found, and the folder without one must pass."""
    def make(root, change=lambda root: None):
        folder = root / PAGE / "lib"
        folder.mkdir(parents=True)
        (root / LIST).parent.mkdir(parents=True)
        files = {"LICENSE.txt": b"free", "lib.js": b"1\n"}
        for name, content in files.items():
            (folder / name).write_bytes(content)
        (root / LIST).write_text("# of others\n" + "".join(
            f"{hashlib.sha256(content).hexdigest()} {PAGE}/lib/{name} lib-1 MIT\n" for name, content in files.items()))
        (root / PAGE / "icon.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
        change(root)
        return check(root)[1]

    def drop_licence(root):
        (root / PAGE / "lib/LICENSE.txt").unlink()
        text = (root / LIST).read_text()
        (root / LIST).write_text("".join(line for line in text.splitlines(True) if "LICENSE" not in line))

    planted = [lambda root: (root / PAGE / "lib/lib.js").write_bytes(b"2\n"),
               lambda root: (root / PAGE / "lib/lib.js").unlink(),
               lambda root: (root / PAGE / "lib/more.js").write_bytes(b""),
               drop_licence,
               lambda root: (root / PAGE / "page.js").write_text('fetch("https://example.org/x")'),
               lambda root: (root / PAGE / "page.css").write_text("@import url(//fonts.example.org/a.css);")]
    missed = 0
    for number, change in enumerate([lambda root: None, *planted]):
        with tempfile.TemporaryDirectory() as folder:
            found = make(pathlib.Path(folder), change)
        if len(found) != (number > 0):
            print(f"planted mistake {number}: {found}")
            missed += 1
    print(f"{len(planted)} planted mistakes, {missed} missed")
    return missed > 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    count, wrong = check(pathlib.Path(sys.argv[1]))
    print("\n".join(wrong) if wrong else f"{count} files of others, all as in their packages")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
