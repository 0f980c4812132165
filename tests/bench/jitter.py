#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Wake-ups of compboxd's loop beside cyclictest's: by turns on the same machine, with the same
priority and interval, /dev/cpu_dma_latency held at 0 by both, memory locked by both.

  jitter.py COMPBOXD PLC [--seconds S] [--rounds N] [--planted]

Idle, and with stress-ng on all processors. Fails when the median of compboxd's wake-ups is more
than 1.5 times cyclictest's, or when its ticks drift. --planted runs compboxd as a normal thread on
a processor that may sleep, which must fail: it shows that the comparison can."""
import argparse
import contextlib
import json
import os
import pathlib
import socket
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../hil"))
import machine  # noqa: E402

LIMIT = 1.5            # of cyclictest's median
PRIORITY, PERIOD_US = 80, 30000
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def process(arguments, **options):
    child = subprocess.Popen(arguments, **options)
    try:
        yield child
    finally:
        child.terminate()
        child.wait()


def compboxd(program, plc, seconds, planted):
    """Wake-ups in µs and drift of one run against a PLC that answers at once."""
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        data = machine.coefficients(port)
        data["cycle"]["period_ms"] = PERIOD_US // 1000
        registers = machine.signal_registers(AT_REST)
        registers[machine.CONTROL] = machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME
        config, stats = pathlib.Path(folder, "c.json"), pathlib.Path(folder, "s.json")
        config.write_text(json.dumps(data))
        how = ["--cpu-latency", "off"] if planted else ["--priority", str(PRIORITY)]
        with process([plc, str(port)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as server:
            server.stdin.write("".join(f"{a} {v}\n" for a, v in registers.items()).encode())
            server.stdin.close()
            subprocess.run([program, "--config", config, "--stats", stats, "--cycles",
                            str(int(seconds * 1e6 / PERIOD_US)), *how],
                           check=True, stderr=subprocess.DEVNULL)
        reported = json.loads(stats.read_text())
    return reported["jitter_us"], reported


def cyclictest(seconds):
    """The same three figures, from its histogram of whole µs."""
    loops = int(seconds * 1e6 / PERIOD_US)
    out = subprocess.run(["cyclictest", "-q", "-m", "-t", "1", "-p", str(PRIORITY), "-i",
                          str(PERIOD_US), "-l", str(loops), "-h", "20000"],
                         check=True, capture_output=True, text=True).stdout
    counts = [(int(a), int(b)) for a, b in (line.split() for line in out.splitlines()
                                            if line[:1].isdigit())]
    longest = next(int(line.split()[-1]) for line in out.splitlines() if "Max Latencies" in line)

    def percentile(share):
        seen = 0
        for us, count in counts:
            seen += count
            if seen >= share * loops:
                return us + 0.5
        return longest
    return {"p50": percentile(0.5), "p99": percentile(0.99), "max": longest}


def compare(name, options):
    """Prints one block of the table; out: whether it is inside the limits."""
    ours, theirs, worst_drift, overruns = [], [], 0, 0
    for _ in range(options.rounds):
        jitter, reported = compboxd(options.compboxd, options.plc, options.seconds,
                                options.planted)
        ours.append(jitter)
        worst_drift = max(worst_drift, abs(reported["drift_us"]) - jitter["max"])
        overruns += reported["overruns"]
        theirs.append(cyclictest(options.seconds))

    def figures(runs):
        return [statistics.median(run["p50"] for run in runs),
                statistics.median(run["p99"] for run in runs), max(run["max"] for run in runs)]
    a, b = figures(ours), figures(theirs)
    ratio = a[0] / b[0]
    print(f"{name:8} compboxd    p50 {a[0]:7.1f} µs  p99 {a[1]:7.1f} µs  max {a[2]:8.1f} µs")
    print(f"{'':8} cyclictest  p50 {b[0]:7.1f} µs  p99 {b[1]:7.1f} µs  max {b[2]:8.1f} µs")
    print(f"{'':8} p50 ratio {ratio:.2f} / {LIMIT} allowed; p99 ratio {a[1] / b[1]:.2f}; "
          f"overruns {overruns}; drift beyond jitter {max(worst_drift, 0):.0f} µs", flush=True)
    return ratio <= LIMIT and worst_drift <= 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("compboxd")
    parser.add_argument("plc")
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--planted", action="store_true")
    options = parser.parse_args()
    fine = compare("idle", options)
    load = ["stress-ng", "--cpu", str(os.cpu_count()), "--quiet"]
    with process(load, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
        fine = compare("stress", options) and fine
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
