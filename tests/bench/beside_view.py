#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Wake-ups of compboxd's loop beside compbox-view under load, and beside an idle process: by turns in one run.

  beside_view.py FOLDER_OF_PROGRAMS [--seconds S] [--rounds N] [--planted]

compboxd and compbox-view share the first processor, which is the cabinet. The other ones are the plant: the control,
100 scrapes a second, ten readers of the page's stream, and a broker that comes and goes every two seconds. In the
other half of the rounds a process that sleeps has the place of compbox-view, and a stand-in in the plant answers the
same clients with the same bytes. Fails when the median or the 99th percentile of the wake-ups beside compbox-view is
more than 1.1 times that beside the idle process, or when the load has not reached it. --planted lets a process above
the loop's priority take a tenth of the processor beside compbox-view, which must fail: it shows that the comparison
can."""
import argparse
import contextlib
import json
import os
import pathlib
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../hil"))
import machine  # noqa: E402
import plant_load  # noqa: E402

LIMIT = 1.1
PRIORITY, PERIOD_MS = 80, 30
TURN_S = 2  # of the broker
AT_REST = {"X": 4000, "Y": 200, "Z": 1500, "T1": 35}
LOAD = [sys.executable, plant_load.__file__]
AS_SERVICE = ["nice", "-n", "10"]  # as compbox-view.service
PLANTED = ["chrt", "-f", "90", sys.executable, "-c", """
import time
while True:
    end = time.monotonic() + 0.002
    while time.monotonic() < end:
        pass
    time.sleep(0.018)
"""]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def processors():
    """The cabinet's, and those of the plant."""
    usable = sorted(os.sched_getaffinity(0))
    if len(usable) < 2:
        sys.exit("beside_view: needs two processors: one for the cabinet, one for its clients")
    return {usable[0]}, set(usable[1:])


CABINET, PLANT = processors()


@contextlib.contextmanager
def process(where, arguments, **options):
    child = subprocess.Popen(arguments, preexec_fn=lambda: os.sched_setaffinity(0, where), **options)
    try:
        yield child
    finally:
        child.terminate()
        child.wait()


class Broker:
    """mosquitto, which comes and goes."""

    def __init__(self, folder):
        self.port, self.running = free_port(), None
        self.file = folder / "mosquitto.conf"
        self.file.write_text(f"listener {self.port} 127.0.0.1\nallow_anonymous true\nuser root\n")

    def turn(self):
        if self.running is not None:
            self.running.kill()
            self.running.wait()
            self.running = None
            return
        self.running = subprocess.Popen(["/usr/sbin/mosquitto", "-c", self.file], stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL, preexec_fn=lambda: os.sched_setaffinity(0, PLANT))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.running is not None:
            self.turn()


@contextlib.contextmanager
def control(programs, folder):
    """A PLC that answers at once, and the box's file for it."""
    port = free_port()
    registers = machine.signal_registers(AT_REST)
    registers[machine.CONTROL] = machine.ENABLE | machine.REFERENCED | machine.PERMIT_RESUME
    data = machine.coefficients(port)
    data["cycle"]["period_ms"] = PERIOD_MS
    (folder / "c.json").write_text(json.dumps(data))
    with process(PLANT, [programs / "libmodbus_plc", str(port)], stdin=subprocess.PIPE,
                 stdout=subprocess.DEVNULL) as server:
        server.stdin.write("".join(f"{a} {v}\n" for a, v in registers.items()).encode())
        server.stdin.close()
        yield


def run_box(programs, folder, seconds, broker, meanwhile):
    """compboxd for this time, the broker comes and goes. out: its statistics"""
    words = [programs / "compboxd", "--config", "c.json", "--stats", "stats.json", "--snapshot", "snapshot.json",
             "--events", "events.jsonl", "--priority", str(PRIORITY), "--cycles", str(int(seconds * 1000 / PERIOD_MS))]
    with (folder / "box.log").open("w") as log, process(CABINET, words, cwd=folder, stderr=log) as box:
        while True:
            broker.turn()
            with contextlib.suppress(subprocess.TimeoutExpired):
                if box.wait(TURN_S) != 0:
                    sys.exit("beside_view: compboxd failed: " + (folder / "box.log").read_text())
                return json.loads((folder / "stats.json").read_text())
            meanwhile()


@contextlib.contextmanager
def clients(port, got):
    with process(PLANT, [*LOAD, "clients", str(port)], stdout=subprocess.PIPE, text=True) as running:
        yield
        running.terminate()
        got.update(json.loads(running.communicate()[0]))


def check_load(got, seconds, connections=None):
    """Ends the program where the clients had clearly less than the load, or the broker hardly came."""
    fewest = min(got["messages"])
    if got["metrics"] < 0.9 * plant_load.SCRAPES_PER_S * seconds or fewest < 0.8 * plant_load.MESSAGES_PER_S * seconds \
            or (connections is not None and connections < seconds / (4 * TURN_S)):
        sys.exit(f"beside_view: the load was not reached: {got}")


def beside_view(programs, folder, options, captured):
    """out: wake-ups, and the load that compbox-view has answered"""
    got = {}
    with Broker(folder) as broker, control(programs, folder):
        words = [*AS_SERVICE, programs / "compbox-view", "--snapshot",
                 "snapshot.json", "--events", "events.jsonl", "--listen", "127.0.0.1:0", "--mqtt",
                 f"127.0.0.1:{broker.port}", "--mqtt-every", "0.2"]
        with process(CABINET, words, cwd=folder, stdout=subprocess.PIPE,
                     stderr=subprocess.DEVNULL, text=True) as view:
            port = int(view.stdout.readline().split(":")[-1].strip("/\n"))

            def meanwhile():
                if not captured.exists():
                    subprocess.run([*LOAD, "capture", str(port), captured], check=True)
            disturbance = process(CABINET, PLANTED) if options.planted else contextlib.nullcontext()
            with clients(port, got), disturbance:
                stats = run_box(programs, folder, options.seconds, broker, meanwhile)
            used = pathlib.Path(f"/proc/{view.pid}/stat").read_text().rsplit(")", 1)[1].split()
            metrics = urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics").read().decode()
    got["processor_s"] = (int(used[11]) + int(used[12])) / os.sysconf("SC_CLK_TCK")
    got["connections"] = int(re.search(r"^compbox_mqtt_connections_total (\d+)$", metrics, re.M)[1])
    check_load(got, options.seconds, got["connections"])
    return stats["jitter_us"], got


def beside_idle(programs, folder, options, captured):
    """out: wake-ups, and the load that the stand-in has answered"""
    got = {}
    with Broker(folder) as broker, control(programs, folder):
        with process(PLANT, [*LOAD, "answer", captured], stdout=subprocess.PIPE, text=True) as answers, \
                process(CABINET, [*AS_SERVICE, "sleep", "infinity"]), \
                clients(int(answers.stdout.readline()), got):
            stats = run_box(programs, folder, options.seconds, broker, lambda: None)
    check_load(got, options.seconds)
    return stats["jitter_us"], got


def judge(runs):
    """Prints medians over the rounds. out: 0: both ratios are inside the limit"""
    fine = True
    for key in ("p50", "p99"):
        ours, idle = (statistics.median(run[key] for run in runs[kind]) for kind in (beside_view, beside_idle))
        fine = fine and ours <= LIMIT * idle
        print(f"{key}: beside compbox-view {ours:.1f} µs, beside an idle process {idle:.1f} µs: "
              f"{ours / idle:.2f} / {LIMIT} allowed")
    return 0 if fine else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--planted", action="store_true")
    options = parser.parse_args()
    programs, runs = options.programs.resolve(), {beside_view: [], beside_idle: []}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for number in range(options.rounds):
            # Each kind is the first one as often as the other.
            order = (beside_view, beside_idle) if number % 2 == 0 else (beside_idle, beside_view)
            for kind in order:
                jitter, got = kind(programs, folder, options, folder / "replies.json")
                runs[kind].append(jitter)
                print(f"{kind.__name__:12} p50 {jitter['p50']:6.1f} p99 {jitter['p99']:7.1f} max {jitter['max']:8.1f} "
                      f"{got}", flush=True)
    return judge(runs)


if __name__ == "__main__":
    sys.exit(main())
