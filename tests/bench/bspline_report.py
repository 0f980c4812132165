#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs bspline_bench, times scipy on the same curves and points, prints the table, and fails unless
our evaluation takes at most half of Eigen's time and a quarter of GSL's, for both kinds of knots.
  bspline_report.py BSPLINE_BENCH
  bspline_report.py --self-test"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy.interpolate import BSpline

OURS = "compbox"  # value, slope and range; the others give the value alone
LIMITS = {"Eigen float": 0.5, "Eigen double": 0.5, "GSL": 0.25}
OPTIONS = ["--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=15",
           "--benchmark_min_time=0.02", "--benchmark_report_aggregates_only=true",
           "--benchmark_out_format=json"]


def run(program, folder):
    """{(knots, contestant): ns per point}, medians of CPU time over interleaved repetitions."""
    out = folder / "result.json"
    subprocess.run([program, f"--write={folder}", f"--benchmark_out={out}"] + OPTIONS, check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return {tuple(b["run_name"].split("/")): 1e9 / b["items_per_second"]
            for b in json.loads(out.read_text())["benchmarks"] if b["aggregate_name"] == "median"}


def best_ns(function, points, repetitions):
    times = []
    for _ in range(repetitions):
        start = time.process_time_ns()
        function()
        times.append(time.process_time_ns() - start)
    return float(np.median(times)) / points


def scipy_ns(path):
    """ns per point: (4096 points in one call, one call per point), after comparing the values."""
    knots, control, x, ours = (np.array(line.split(), float) for line in open(path))
    curve = BSpline(knots, control, 3)
    worst = np.max(np.abs(curve(x) - ours))
    if not worst < 2e-3:
        sys.exit(f"{path.name}: scipy and compbox differ by {worst:g}")
    few = [float(v) for v in x[:300]]
    return best_ns(lambda: curve(x), len(x), 15), best_ns(lambda: [curve(v) for v in few], 300, 5)


def report(times):
    """Prints the table; the list of limits that are not met."""
    broken = []
    for knots in ("uniform", "random"):
        ours = times[knots, OURS]
        print(f"cubic B-spline, 20 control points, {knots} knots, random x"
              f"{'':>14}ns/point   ours/theirs   allowed")
        for (_, name), ns in sorted((t for t in times.items() if t[0][0] == knots),
                                    key=lambda t: t[1]):
            limit = LIMITS.get(name)
            print(f"  {name:<58}{ns:10.1f}{ours / ns:14.3f}{f'{limit:.2f}' if limit else '':>10}")
            if limit and not ours / ns <= limit:
                broken.append(f"{knots} knots: {ours / ns:.3f} of {name}, allowed {limit}")
    return broken


def self_test():
    """A contestant that becomes too fast for us must be reported, for each limit and knots."""
    right = {(knots, name): 1.0 if name == OURS else 100.0
             for knots in ("uniform", "random") for name in [OURS, *LIMITS]}
    if report(right):
        sys.exit("self-test: right times were refused")
    for key in right:
        if key[1] in LIMITS and not report({**right, key: 0.99 / LIMITS[key[1]]}):
            sys.exit(f"self-test: not caught: {key}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        try:
            times = run(sys.argv[1], folder)
        except subprocess.CalledProcessError as error:
            sys.exit(error.stderr.decode())
        for knots in ("uniform", "random"):
            bulk, single = scipy_ns(folder / f"bspline-{knots}.txt")
            times[knots, "scipy, 4096 points in one call"] = bulk
            times[knots, "scipy, one call per point"] = single
    broken = report(times)
    if broken:
        sys.exit("\n".join(broken))


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    else:
        main()
