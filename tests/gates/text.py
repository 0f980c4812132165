#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: what clang-format does not look at. Python and shell scripts parse, JSON is JSON; no text has
tabs where they mean nothing, blanks at line ends, CRLF, or an end without a newline.
  text.py FILE…        prints how many files were looked at, or every line that is wrong
  text.py --self-test  plants one mistake after the other; each must be caught"""

import ast
import json
import pathlib
import subprocess
import sys
import tempfile

WIDTH = 120  # of Python


def lines_wrong(text):
    """out: (line, what) of each line whose blanks are wrong."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.endswith("\r"):
            yield number, "ends with a carriage return"
        elif line != line.rstrip():
            yield number, "ends with a blank"
    if text and not text.endswith("\n"):
        yield text.count("\n") + 1, "the file does not end with a newline"


def python_wrong(text):
    try:
        ast.parse(text)
    except SyntaxError as error:
        yield error.lineno or 1, f"is not Python: {error.msg}"
    for number, line in enumerate(text.split("\n"), 1):
        if "\t" in line:
            yield number, "has a tab"
        if len(line) > WIDTH:
            yield number, f"is {len(line)} characters wide, more than {WIDTH}"


def shell_wrong(text):
    done = subprocess.run(["bash", "-n"], input=text, text=True, capture_output=True)
    for line in done.stderr.splitlines()[:1]:
        yield 1, f"is not shell: {line}"


def json_wrong(text):
    try:
        json.loads(text)
    except ValueError as error:
        yield getattr(error, "lineno", 1), f"is not JSON: {error}"


def language(path, text):
    """out: the check of the file's own language, or None."""
    first = text.split("\n", 1)[0]
    if path.suffix == ".py" or first.startswith("#!") and "python" in first:
        return python_wrong
    if path.suffix == ".sh" or first.startswith("#!") and first.endswith("sh"):
        return shell_wrong
    return json_wrong if path.suffix == ".json" else None


def wrong(path):
    """out: a line of text for each mistake in the file."""
    try:
        text = path.read_bytes().decode()
    except UnicodeDecodeError as error:
        return [f"{path}: is not UTF-8: {error}"]
    own = language(path, text)
    found = list(lines_wrong(text)) + (list(own(text)) if own else [])
    return [f"{path}:{number}: {what}" for number, what in found]


PLANTED = {"a.py": "if x\n    pass\n", "b.py": "if x:\n\tpass\n", "c.py": f"x = '{'x' * WIDTH}'\n",
           "d.sh": "if true; then\n", "e.json": "{,}\n", "f.txt": "a \n", "g.md": "a\r\n",
           "h.cmake": "a", "i": "#!/usr/bin/env bash\nfi\n", "j": "#!/usr/bin/python3\n)\n"}
GOOD = {"a.py": "if True:\n    pass\n", "b.sh": "true\n", "c.json": "[1]\n", "d.txt": "", "e.md": "ä\n"}


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        for expected, files in ((1, PLANTED), (0, GOOD)):
            for name, text in files.items():
                path = pathlib.Path(folder) / name
                path.write_bytes(text.encode())
                if bool(wrong(path)) != bool(expected):
                    sys.exit(f"text.py: {name!r} {text!r} gave {wrong(path)}")
    print(f"{len(PLANTED)} of {len(PLANTED)} planted mistakes caught")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    paths = [pathlib.Path(name) for name in sys.argv[1:]]
    found = [line for path in paths for line in wrong(path)]
    print("\n".join(found + [f"text: {len(paths)} files, {len(found)} wrong / 0 allowed"]))
    return 1 if found or not paths else 0


if __name__ == "__main__":
    sys.exit(main())
