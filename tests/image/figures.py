# SPDX-License-Identifier: MIT
"""What the tests measured, for docs/results/image.md: build/image/figures.md has one row for each."""
import pathlib

FILE = pathlib.Path(__file__).parents[2] / "build/image/figures.md"


def note(what, figure, limit):
    rows = FILE.read_text().splitlines() if FILE.exists() else []
    rows = [row for row in rows if not row.startswith(f"| {what} |")]
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text("\n".join([*rows, f"| {what} | {figure} | {limit} |"]) + "\n")
    print(f"{what}: {figure} / {limit}")
