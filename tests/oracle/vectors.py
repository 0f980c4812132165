# SPDX-License-Identifier: MIT
"""Writing conformance vectors: float32 numbers as C text, rows of inputs and expected outputs."""

import math
import pathlib
import sys

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parents[1] / "conformance" / "vectors"


def f32(x):
    return np.float32(x)


def ulps(x, n):
    """The float32 n units in the last place above x (below, if n is negative)."""
    x = f32(x)
    for _ in range(abs(n)):
        x = np.nextafter(x, f32(math.inf if n > 0 else -math.inf))
    return x


def c_float(x):
    """The shortest decimal that is exactly this float32, as a C constant."""
    x = f32(x)
    if np.isnan(x):
        return "NAN"
    if np.isinf(x):
        return "INFINITY" if x > 0 else "-INFINITY"
    text = repr(float(str(x)))
    return (text if "." in text or "e" in text else text + ".0") + "f"


def c_double(x):
    return repr(float(x))


def c_bound(x):
    """Three digits, never below x."""
    return "%.2e" % (float(x) * 1.006) if x else "0.0"


def c_array(name, numbers):
    body = ", ".join(c_float(v) for v in numbers)
    return f"static const float {name}[] = {{{body}}};\n"


def curve_row(x, exact, outside):
    """One struct cb_curve_row (tests/conformance/curves.c)."""
    return "{%s, %s, %s, %s, %s, %d}" % (c_float(x), c_double(exact.value),
                                         c_bound(exact.value_bound), c_double(exact.slope),
                                         c_bound(exact.slope_bound), outside)


def deliver(files, source):
    """in : {name: text}. Writes them, or with --check compares them with what is checked in."""
    head = f"/* SPDX-License-Identifier: MIT\n * Made by tests/oracle/{source}; do not edit. */\n"
    stale = []
    for name, text in files.items():
        path = FOLDER / name
        if "--check" not in sys.argv[1:]:
            path.write_text(head + text)
        elif not path.exists() or path.read_text() != head + text:
            stale.append(name)
    if stale:
        sys.exit(f"{', '.join(stale)}: not what tests/oracle/{source} makes; run it again")
