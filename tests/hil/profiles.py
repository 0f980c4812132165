#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""compboxd and fakeplc in real time, in each profile: does the loop keep its ticks, and what does each
fault do to the machine?

  profiles.py [--seconds S] [--write FILE.md]

prints one table for each profile; --write puts them into a page. scripts/report hil-profiles runs it."""
import argparse
import csv
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time

import box
import realtime
from fakeplc import FakePlc

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs/plc"
PROFILES = ("generic", "sinumerik-840d", "fanuc")
AT_REST_MM = 250         # where each channel wants 12 um
PRIORITY = 50
NEAR_UM = 0.3            # of a value that is zero, or back

# command, what takes it back; what meets one request only has no end.
LASTING = [
    ("fault drop 1000000", "fault clear"),
    ("fault late 1500 1000000", "fault clear"),
    ("fault exception 4 1000000", "fault clear"),
    ("fault wrong-id 1000000", "fault clear"),
    ("fault truncate 1000000", "fault clear"),
    ("fault short 1000000", "fault clear"),
    ("fault long 1000000", "fault clear"),
    ("fault dribble 40 1000000", "fault clear"),
    ("fault torn 1000000", "fault clear"),
    ("fault drop 1000000 read", "fault clear"),
    ("fault drop 1000000 write", "fault clear"),
    ("fault away 1500", None),
    ("freeze heartbeat 1", "freeze heartbeat 0"),
    ("signal X 5000", "signal X auto"),
    ("enable 0", "enable 1"),
    ("reference 0", "reference 1"),
    ("restart", None),
]
ONCE = ["fault drop", "fault late 15", "fault exception 4", "fault wrong-id", "fault truncate",
        "fault short", "fault long", "fault dribble 1", "fault torn", "fault close"]


def coefficients(profile, port):
    """The file of docs/plc for this PLC; generic: the one of the 840D."""
    name = "fanuc" if profile == "fanuc" else "sinumerik-840d"
    data = json.loads((DOCS / f"{name}.json").read_text())
    data["plc"]["transport"]["tcp"]["port"] = port
    data["plc"]["profile"] = profile
    return data


def may_preempt():
    return bool(realtime.PRIORITY) and shutil.which("cyclictest")


class Cyclictest:
    """Beside the box, at its priority and period; late: wake-ups 10 ms late and more."""

    def __init__(self, seconds):
        loops = max(10, int(seconds / 0.03))
        self.run = subprocess.Popen(
            ["cyclictest", "-q", "-m", "-t", "1", "-p", str(PRIORITY), "-i", "30000", "-l", str(loops),
             "-h", "30000"], stdout=subprocess.PIPE, text=True)

    def figures(self):
        out = self.run.communicate(timeout=60)[0]
        counts = [(int(a), int(b)) for a, b in re.findall(r"^(\d+) (\d+)$", out, re.M)]
        total, seen, found = sum(n for _, n in counts), 0, {}
        for us, count in counts:
            seen += count
            for name, share in (("p50", 0.5), ("p99", 0.99)):
                if seen >= share * total:
                    found.setdefault(name, us)
        found["max"] = int(re.search(r"Max Latencies: (\d+)", out)[1])
        over = int(re.search(r"Histogram Overflows: (\d+)", out)[1])
        found["late"] = over + sum(n for us, n in counts if us > 10000)
        return found


class Run:
    """One compboxd against one fakeplc. The log says afterwards what happened when."""

    def __init__(self, profile, folder):
        self.profile, self.folder = profile, pathlib.Path(folder)
        self.log = self.folder / "plc.csv"
        twin_map = self.folder / "map.json"
        twin_map.write_text(json.dumps(coefficients(profile, 1)))
        self.plc = FakePlc("--map", twin_map, "--log", self.log)

    def __enter__(self):
        self.plc.__enter__()
        config = self.folder / "coefficients.json"
        config.write_text(json.dumps(coefficients(self.profile, self.plc.port)))
        self.box = box.Box(config, stderr=subprocess.DEVNULL)
        self.box.__enter__()
        try:
            self.plc.command(f"move X={AT_REST_MM} Y={AT_REST_MM} Z={AT_REST_MM} feed=15000")
            self.plc.wait(self.at_work)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.box.__exit__()
        self.plc.__exit__()

    @staticmethod
    def values(status, kind):
        return [status[f"{kind}_{axis}"] for axis in "XYZ"]

    def at_work(self, status):
        """ACTIVE, standing, and the machine has what the box wants there."""
        pairs = zip(self.values(status, "applied"), self.values(status, "commanded"))
        return (status["mode"] == 1 and status["alive"] == 1 and status["moving"] == 0 and
                int(status["control"]) & 3 == 3 and
                all(abs(a - c) <= NEAR_UM and abs(c) > 5 for a, c in pairs))

    def at_zero(self, status):
        return all(abs(um) <= NEAR_UM for um in self.values(status, "applied"))

    # ---- steady

    def travel(self, seconds):
        """Axes move to and fro for so long; out: how box and cyclictest kept their ticks."""
        beside = Cyclictest(seconds) if may_preempt() else None
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            way_mm = min(600, 40 * seconds)
            self.plc.command(f"move X={AT_REST_MM + way_mm} Y={AT_REST_MM + way_mm / 2} "
                         f"Z={AT_REST_MM - way_mm / 4} feed=10000")
            self.plc.command(f"move X={AT_REST_MM} Y={AT_REST_MM} Z={AT_REST_MM} feed=10000")
            while self.plc.status()["moving"] and time.monotonic() < until + 10:
                time.sleep(0.05)
        self.plc.wait(self.at_work)
        return beside.figures() if beside else None

    def kept(self):
        """How the box kept its ticks until now: wake-ups by its statistics, which are up to 5 s old,
        missed periods by its record, which is not."""
        times = [row["time_s"] for row in self.box.rows]
        gaps = [round((b - a) / 0.03) - 1 for a, b in zip(times, times[1:])]
        return {"cycles": len(times), "overruns": sum(gaps), "stalls": sum(gap > 0 for gap in gaps),
                "jitter_us": self.box.stats["jitter_us"]}

    # ---- faults

    def suffer(self, command, end):
        """A fault that lasts: until everything is at zero, then it is taken back."""
        self.plc.command(command)
        self.plc.wait(self.at_zero)
        if end:
            self.plc.command(end)
            time.sleep(0.1)     # the next command comes in a scan of its own
        self.plc.wait(self.at_work)

    def stop_and_go(self):
        """The box's process stands still and goes on: the PLC is alone."""
        import signal
        self.plc.command("alarms")
        self.stopped_s = self.plc.status()["time_s"]
        self.box.process.send_signal(signal.SIGSTOP)
        self.plc.wait(self.at_zero)
        self.gone_on_s = self.plc.status()["time_s"]
        self.box.process.send_signal(signal.SIGCONT)
        self.plc.wait(self.at_work)

    def rows(self):
        with open(self.log, newline="") as file:
            for row in csv.DictReader(file):
                yield row


def reaction(rows, begin, end):
    """Seconds from `begin` (a command, or a time) until the box or the PLC notices, until everything is
    at zero; and from `end` until the box is ACTIVE and what it wants is applied. None: it was not. from_um: what was
    applied at `begin`."""
    def at(row, what):
        return (float(row["time_s"]) >= what if isinstance(what, float) else
                f"command {what}" in row["event"].split(" | "))
    def um(row, kind):
        return [float(row[f"{kind}_{a}_um"]) for a in "XYZ"]
    start = next(i for i, row in enumerate(rows) if at(row, begin))
    t0 = float(rows[start]["time_s"])
    found = dict.fromkeys(("noticed_s", "zero_s", "active_s", "back_s"))
    found["from_um"] = max(map(abs, um(rows[start], "applied")))
    stop = start
    if end is not None:
        stop = next(i for i in range(start + 1, len(rows)) if at(rows[i], end))
    t1 = float(rows[stop]["time_s"])
    zero_at = start
    for i in range(start + 1, len(rows)):
        row, t = rows[i], float(rows[i]["time_s"])
        mode = int(row["status"]) & 255
        during = end is None or i <= stop      # afterwards it is another fault's
        if during and found["noticed_s"] is None and (mode != 1 or "watchdog" in row["event"] or
                                           max(map(abs, um(row, "applied"))) < 10):
            found["noticed_s"] = t - t0
        if during and found["zero_s"] is None and max(map(abs, um(row, "applied"))) <= NEAR_UM:
            found["zero_s"], zero_at = t - t0, i
        noticed = end is None or found["noticed_s"] is not None
        if i <= max(stop, zero_at) or noticed and found["zero_s"] is None:
            continue
        heard = row["box_heartbeat"] != rows[stop]["box_heartbeat"]
        if found["active_s"] is None and mode == 1 and heard and int(row["control"]) & 3 == 3:
            found["active_s"] = t - t1
        if found["active_s"] is not None and all(
                abs(a - c) <= NEAR_UM and abs(c) > 5
                for a, c in zip(um(row, "applied"), um(row, "commanded"))):
            found["back_s"] = t - t1
            break
    return found


def ride(rows, command, for_s=0.4):
    """What a fault that meets one request did in the time after it: whether the box stayed ACTIVE, and
    the largest change of what was applied."""
    start = next(i for i, row in enumerate(rows) if f"command {command}" in row["event"].split(" | "))
    t0 = float(rows[start]["time_s"])
    stretch = [row for row in rows[start:] if float(row["time_s"]) < t0 + for_s]
    moved = max(abs(float(row[f"applied_{a}_um"]) - float(rows[start][f"applied_{a}_um"]))
                for row in stretch for a in "XYZ")
    return all(int(row["status"]) & 255 == 1 for row in stretch), moved


def measure(profile, seconds, lasting=LASTING, once=ONCE):
    """A whole run; out: what was measured, as plain data."""
    with tempfile.TemporaryDirectory() as folder:
        with Run(profile, folder) as run:
            steady = run.travel(seconds)
            kept = run.kept()
            for command in once:
                run.plc.command(command)
                time.sleep(0.5)
                run.plc.wait(run.at_work)
            for command, end in lasting:
                run.suffer(command, end)
            run.stop_and_go()
            stopped, gone_on = run.stopped_s, run.gone_on_s
            run.box.stop()
            code, stats = run.box.code, run.box.stats
            run.plc.command("quit")
            run.plc.process.wait(60)
            rows = list(run.rows())
        faults = {command: reaction(rows, command, end) for command, end in lasting}
        faults["SIGSTOP to compboxd"] = reaction(rows, stopped, gone_on)
        return {"profile": profile, "seconds": seconds, "cyclictest": steady, "steady": kept,
                "code": code, "stats": stats, "faults": faults,
                "once": {command: ride(rows, command) for command in once}}


# ---- the page

def seconds_text(value):
    return "–" if value is None else f"{value:.2f}"


def table(found):
    lines = [f"## {found['profile']}", ""]
    steady, beside = found["steady"], found["cyclictest"]
    jitter = steady["jitter_us"]
    lines += [f"{found['seconds']:.0f} s with the axes moving: {steady['cycles']} cycles, "
              f"**{steady['overruns']} missed periods**.", "",
              "| wake-ups, µs | p50 | p99 | largest | delays of 10 ms and more |", "|---|---|---|---|---|",
              f"| compboxd | {jitter['p50']:.0f} | {jitter['p99']:.0f} | {jitter['max']:.0f} | "
              f"{steady['stalls']} |"]
    if beside:
        lines.append(f"| cyclictest beside it | {beside['p50']} | {beside['p99']} | {beside['max']} | "
                     f"{beside['late']} |")
    lines += ["", "| fault, until it is removed | noticed s | at zero s | ACTIVE again s | as before s |",
              "|---|---|---|---|---|"]
    for command, times in found["faults"].items():
        shown = [seconds_text(value) for key, value in times.items() if key.endswith("_s")]
        lines.append(f"| `{command}` | " + " | ".join(shown) + " |")
    lines += ["", "| fault of one request | stayed ACTIVE | movement of the applied value, µm |", "|---|---|---|"]
    for command, (stayed, moved) in found["once"].items():
        lines.append(f"| `{command}` | {'yes' if stayed else 'no'} | {moved:.2f} |")
    return lines + [""]


def page(results):
    load = os.getloadavg()[0]
    intro = (DOCS.parent / "results/plc-profiles.md").read_text().split("\n<!-- measured -->\n")[0]
    text = [intro, "<!-- measured -->", "",
            f"Measured on {platform.machine()} with {os.cpu_count()} processors, load average {load:.1f} at "
            f"the end. The figures include the effect of other programs.", ""]
    for found in results:
        text += table(found)
    return "\n".join(text).rstrip() + "\n"


def stood(found):
    """Where the loop missed periods that cyclictest beside it did not miss, in words. That hangs on what
    else the machine does: a figure for a quiet one (scripts/report hil-profiles), no test beside others."""
    steady, beside = found["steady"], found["cyclictest"]
    # They run on different processors: what the machine takes from one it need not take from the other.
    if not beside or steady["stalls"] <= beside["late"] + 1:
        return []
    return [f"{found['profile']}: the loop stood {steady['stalls']} times, cyclictest beside it "
            f"{beside['late']} times (10 ms and more)"]


def complaints(found):
    """What did not behave as it has to, in words."""
    wrong, name = [], found["profile"]
    for command, times in found["faults"].items():
        if times["zero_s"] is None:
            wrong.append(f"{name}: {command}: never at zero")
        if times["active_s"] is None or times["back_s"] is None:
            wrong.append(f"{name}: {command}: never back")
    if found["code"] != 0:
        wrong.append(f"{name}: compboxd ended with {found['code']}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--profile", choices=PROFILES)
    parser.add_argument("--write", type=pathlib.Path)
    options = parser.parse_args()
    results = []
    for profile in [options.profile] if options.profile else PROFILES:
        results.append(measure(profile, options.seconds))
        print("\n".join(table(results[-1])), flush=True)
    if options.write:
        options.write.write_text(page(results))
    wrong = [line for found in results for line in stood(found) + complaints(found)]
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
