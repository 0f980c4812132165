#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The fault table of decision 6, for both clients of compboxd: a PLC of raw sockets spoils one reading in EVERY, and
the box's own recording says what that cost. Prints the tables; --write puts them between the marks of a page.
  clients.py [--seconds S] [--write PAGE]"""
import argparse
import pathlib
import re
import statistics
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import box as box_module  # noqa: E402
import realtime  # noqa: E402
import machine  # noqa: E402
import plc_faults as faults  # noqa: E402
from machine import ACTIVE  # noqa: E402
from plc import Plc  # noqa: E402
from raw_plc import RawPlc  # noqa: E402
from steps import LOST  # noqa: E402

CLIENTS = ("compbox", "libmodbus")
FIRST, EVERY = 15, 20                 # cycles with a fault: the first, one in so many


def no_reply(_, __):
    return []


def late_100(_, reply):
    return [0.100, reply]


def byte_by_byte(_, reply):
    return [part for byte in reply for part in (bytes([byte]), 0.006)]


FAULTS = [(None, "none"), (faults.late, "reply 3 ms after the period"), (late_100, "reply after 100 ms"),
          (byte_by_byte, "reply byte by byte, 6 ms apart"), (faults.wrong_id, "wrong transaction id"),
          (faults.wrong_unit, "wrong unit id"), (faults.exception, "exception"), (faults.other_length, "wrong length"),
          (faults.stops_short, "incomplete reply"), (faults.closes, "connection closed"),
          (faults.garbage, "garbage instead of a header"), (faults.twice, "reply sent twice"),
          (no_reply, "no reply to one reading")]


class Run:
    """One client with one fault."""

    def __init__(self, client, fault, seconds):
        self.spoilt = 0
        plc, port = Plc(), box_module.free_port()
        plc.values = dict(machine.AT_REST)
        self.over = False

        def now_and_then(request, reply):
            due = fault and not self.over and len(plc.reads) >= FIRST and request.is_cyclic_read
            if not due or len(plc.reads) % EVERY:
                return None
            self.spoilt += 1
            return fault(request, reply)

        def with_client(data):
            data["plc"]["transport"]["tcp"]["client"] = client
        with tempfile.TemporaryDirectory() as folder, RawPlc(plc, port, now_and_then) as server:
            config = machine.write_coefficients(pathlib.Path(folder) / "c.json", port, with_client)
            with box_module.Box(config) as box:
                box_module.until(lambda: box.steps and box.steps[-1].mode == ACTIVE, every_s=0.2)
                time.sleep(seconds)
                self.over = True
                time.sleep(0.5)
                steps = box.steps
                box.stop()
            self.connections = server.connections - 1
        first = next(i for i, step in enumerate(steps) if step.mode == ACTIVE)
        self.steps = steps[first:]
        self.missed = sum(step.missed_ticks for step in self.steps)
        if fault and self.spoilt == 0:
            sys.exit(f"{client}: no reading was spoilt")

    def each(self, count):
        return count / self.spoilt if self.spoilt else count

    def cells(self):
        readings = self.each(sum(not step.read_ok for step in self.steps))
        writes = self.each(sum(step.last_write in LOST for step in self.steps))
        held = self.each(sum(step.mode != ACTIVE for step in self.steps))
        return [f"{value:.1f}" for value in (readings, writes, self.each(self.connections), held)]

    def ages_ms(self):
        return sorted((step.now_us - step.read_us) / 1e3 for step in self.steps if step.read_ok)


def fault_table(runs):
    names = "readings | writes | connections | cycles not ACTIVE"
    lines = [f"| fault | {' | '.join(f'{client}: {names}' for client in CLIENTS)} |",
             "|---" * (1 + 4 * len(CLIENTS)) + "|"]
    for _, name in FAULTS[1:]:
        cells = [cell for client in CLIENTS for cell in runs[client, name].cells()]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def age_table(runs):
    lines = ["| client | readings lost of | age of a reading in the step, median | 99 % | periods missed |",
             "|---|---|---|---|---|"]
    for client in CLIENTS:
        run = runs[client, "none"]
        ages = run.ages_ms()
        lost = sum(not step.read_ok for step in run.steps)
        lines.append(f"| {client} | {lost} of {len(run.steps)} | {statistics.median(ages):.1f} ms | "
                     f"{ages[int(0.99 * (len(ages) - 1))]:.1f} ms | {run.missed} |")
    return lines


def put(page, lines):
    """Replaces what is between the marks."""
    path = pathlib.Path(page)
    text, count = re.subn(r"(<!-- clients -->\n).*?(<!-- /clients -->)",
                          lambda match: match[1] + "\n".join(lines) + "\n" + match[2], path.read_text(), flags=re.S)
    if count != 1:
        sys.exit(f"{page} has no marks <!-- clients --> and <!-- /clients -->")
    path.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--write", metavar="PAGE")
    arguments = parser.parse_args()
    realtime.run_before_others()
    runs = {}
    for fault, name in FAULTS:
        for client in CLIENTS:
            seconds = arguments.seconds if fault else 3 * arguments.seconds
            runs[client, name] = run = Run(client, fault, seconds)
            print(f"{client}, {name}: {run.spoilt} faults, {run.cells()}", file=sys.stderr)
    lines = age_table(runs) + [""] + fault_table(runs)
    print("\n".join(lines))
    if arguments.write:
        put(arguments.write, lines)


if __name__ == "__main__":
    main()
