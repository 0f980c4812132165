# SPDX-License-Identifier: MIT
"""Measures what a fleet costs the site, for 10, 100 and 1000 simulated machines in compressed time; computes the rest.
Then broker, bridge and database with the values of as many boxes, at their real pace.
  growth.py [--machines 10,100,1000] [--write PAGE]     three records of each fleet are poisoned
  growth.py --traffic …                                 the second part alone; the first part of the page stays"""

import argparse
import pathlib
import random
import sys
import tempfile
import threading
import time

import broker_load
from broker_load import PERIOD_S, VALUES
from fleets import POISONED, Plant, cli
from fleet import links, machines, rollout, site
from fleet.registry import Registry
from test_training import scheduler, workers_below

PROBE_S, BYTES_OF_SAMPLE = 1800, 16
MESSAGE_BYTES = (194, 2200)  # of `values`: docs/uplink.md


class Boxes(links.Folder):
    """Boxes that live in each poll; boxes_s is their time."""

    def __init__(self, plant, boxes):
        super().__init__(plant.folder / "boxes", 0)
        self.boxes, self.boxes_s = boxes, 0.0

    def poll(self):
        began = time.monotonic()
        for box in self.boxes.values():
            box.turn()
        self.boxes_s += time.monotonic() - began
        return super().poll()


def rolled_out(plant, registry, boxes, without):
    """out: (state at the end, the site's own time, s)"""
    link, began = Boxes(plant, boxes), time.monotonic()
    offers, left = site.offers(registry, without)
    assert not left
    runner = site.Runner(registry, rollout.begun(offers), link, plant.folder / "plant.key", 0.1)
    state = runner.run(1200, lambda _: None)
    return state, time.monotonic() - began - link.boxes_s


def trained(plant, count, kills):
    """Trains with a scheduler and two workers, of which one is killed whenever a part of the jobs is done. out: s"""
    dice, killed, models = random.Random(count), 0, plant.folder / "registry/models"
    with tempfile.TemporaryDirectory() as name, scheduler(pathlib.Path(name), 2, 0) as (address, above):
        began = time.monotonic()
        training = threading.Thread(target=plant.train_all, args=(count, address))
        training.start()
        while training.is_alive():
            time.sleep(0.02)
            workers = workers_below(above)
            if killed < kills and workers and len(list(models.glob("*"))) > (killed + 0.5) * count / kills:
                dice.choice(workers).kill()
                killed += 1
        training.join()
        assert killed == kills and len(list(models.glob("*"))) == count + 1  # and that which runs
        return time.monotonic() - began


def measured(count):
    """out: figures of a fleet of so many machines"""
    with tempfile.TemporaryDirectory() as name:
        plant, spent = Plant(pathlib.Path(name)), {"records_s": 0.0}
        real = machines.add_record

        def timed(*words):
            began = time.monotonic()
            real(*words)
            spent["records_s"] += time.monotonic() - began
        machines.add_record = timed
        try:
            plant.prepare(count)
        finally:
            machines.add_record = real
        spent["killed"] = count // 100
        spent["train_s"] = trained(plant, count, spent["killed"])
        registry, boxes = Registry(plant.folder / "registry"), plant.boxes()
        poisoned = [one for one in POISONED if one in boxes]
        if poisoned:
            state, _ = rolled_out(plant, registry, boxes, [])
            assert state["state"] == "halted"
        spent["saw_poison"] = sum(bool(box.taken) for box in boxes.values())
        state, spent["rollout_s"] = rolled_out(plant, registry, boxes, poisoned)
        spent["better"] = sum(part["state"] == "good" for part in state["machines"].values())
        spent["returned"] = sum(part["state"] == "returned" for part in state["machines"].values())
        unchanged = [box for box in boxes.values() if not box.taken or len(box.taken) == 2]
        assert state["state"] == "done" and spent["better"] + len(unchanged) == count
        files = [path for path in (plant.folder / "registry").rglob("*") if path.is_file()]
        spent["registry_mb"] = sum(path.stat().st_size for path in files) / 1e6
        return {**spent, "stages": len(state["stages"])}


def number(value):
    """out: two digits, and whole numbers as they are"""
    if isinstance(value, int):
        return str(value)
    rounded = float(f"{value:.2g}")
    return f"{rounded:g}" if rounded < 1e4 else f"{rounded:.0f}"


def page_of(counts, found):
    """out: the page. in: numbers of machines, and what measured() found for them"""
    columns = [*counts, 100_000]
    last = found[counts[-1]]
    scale = columns[-1] / counts[-1]
    rows = [("poisoned records, machines that saw one of their models", "saw_poison", None),
            ("machines with a better model afterwards", "better", None),
            ("machines that returned to their own by themselves", "returned", None),
            ("taking a record of 3 days each, s", "records_s", scale),
            ("workers killed in the training", "killed", None),
            ("training with 2 workers, s", "train_s", scale),
            ("the site's work for the roll-out, s", "rollout_s", scale), ("registry, MB", "registry_mb", scale)]
    names = [f"{count:,}".replace(",", " ") for count in columns]
    lines = ["| | " + " | ".join(names) + " |", "|---" * (len(columns) + 1) + "|"]
    for text, key, factor in rows:
        cells = [number(found[count][key]) for count in counts]
        cells.append(f"*{number(last[key] * factor)}*" if factor else "–")
        lines.append(f"| {text} | " + " | ".join(cells) + " |")
    for text, of in (
            ("`values` a second", lambda n: n / PERIOD_S),
            ("GB a day through the broker, small and large `values`",
             lambda n: [n * 86400 / PERIOD_S * size / 1e9 for size in MESSAGE_BYTES]),
            (f"GB a year of {VALUES} values, every 10 s", lambda n: n * VALUES * BYTES_OF_SAMPLE * 3153600 / 1e9),
            ("the same, means of 5 min", lambda n: n * VALUES * BYTES_OF_SAMPLE * 105120 / 1e9),
            ("the same, means of an hour", lambda n: n * VALUES * BYTES_OF_SAMPLE * 8760 / 1e9),
            ("hours of a roll-out with a probe every 30 min",
             lambda n: len(rollout.stages_of(n)) * (rollout.PROBES + 1) * PROBE_S / 3600)):
        cells = [of(count) for count in columns]
        cells = [" to ".join(map(number, one)) if isinstance(one, list) else number(one) for one in cells]
        lines.append(f"| {text} | " + " | ".join(f"*{one}*" for one in cells) + " |")
    return "\n".join(lines) + "\n"


HEAD = """# Results: growth of a fleet

`scripts/report fleet-growth --write` makes this page. Numbers in italics are computed, the others are measured on one
computer with two processors that other work shared. Machines are simulated in compressed time: a record of three days
each, a worn machine, an old model that leaves 5 µm and a candidate. Of fleets with 100 machines and more three have
poisoned records: a probe that is wrong by 30 µm. Workers of a Dask scheduler are killed while they train.

"""
TAIL = """
- A sample is 16 bytes: time and value without compression. A time-series database takes less.
- Hours of a roll-out are those of eight probes and one reference in each stage. The site's work comes on top.
- The state of a roll-out is one file, written at each change: about half a kilobyte for each machine. With 100 000
  machines this file alone is 50 MB, so roll out by plant or by type.
- A machine that returned by itself had a residual above its bound in its eight probes; its old model runs on.
- These runs use a folder, without broker and database, which have a section of their own. For more training use a Dask
  scheduler or the Slurm array: jobs are independent.
"""
SPAN_S = broker_load.PERIODS * broker_load.PERIOD_S
TRAFFIC = "## Values through broker and database"
TRAFFIC_HEAD = f"""
{TRAFFIC}

`scripts/report fleet-growth --traffic --write` makes this section. Debian's mosquitto and VictoriaMetrics and
`compbox fleet bridge` run on this computer. Each box sends {VALUES} values every {PERIOD_S} s with QoS 1,
at a time of its own, for {SPAN_S} s. Processor time is that of each program, until all is in the database.

"""


def traffic_of(counts, found):
    """out: the section about broker and database. in: numbers of boxes, what broker_load.measured() found for them"""
    columns, last = [*counts, 100_000], found[counts[-1]]
    scale, names = columns[-1] / counts[-1], [f"{count:,}".replace(",", " ") for count in columns]
    lines = ["| boxes | " + " | ".join(names) + " |", "|---" * (len(columns) + 1) + "|"]
    for text, key, factor in (
            ("samples in the database", "samples", scale), ("lost", "lost", None),
            ("processor time of mosquitto, s", "broker_s", scale), ("of the bridge, s", "bridge_s", scale),
            ("of VictoriaMetrics, s", "database_s", scale), ("memory of mosquitto, MB", "broker_mb", None),
            ("of the bridge, MB", "bridge_mb", None), ("of VictoriaMetrics, MB", "database_mb", None)):
        cells = [number(found[count][key]) for count in counts]
        lines.append(f"| {text} | " + " | ".join([*cells, f"*{number(last[key] * factor)}*" if factor else "–"]) + " |")
    busy = {part: last[part] / SPAN_S for part in ("broker_s", "bridge_s", "database_s")}
    most = {part: number(counts[-1] / share) if share else "–" for part, share in busy.items()}
    return TRAFFIC_HEAD + "\n".join(lines) + f"""

- A `values` message has {last["bytes"]} bytes here.
- mosquitto and the bridge use one processor each. By these figures a processor of this computer is full at
  *{most["broker_s"]}* boxes in the broker and at *{most["bridge_s"]}* in the bridge, without TLS. Stay at half of it.
  Then start a broker and a bridge for each plant, and bridge the brokers upward where one place has to see all: topics
  are separate by machine.
- VictoriaMetrics fills one processor at *{most["database_s"]}* boxes, and uses all processors of its computer. Beyond
  one computer its cluster (vminsert, vmstorage, vmselect) takes the same lines: the bridge gets vminsert's address.
"""


def main():
    parser = argparse.ArgumentParser(description="what a fleet costs the site")
    parser.add_argument("--machines", default="10,100,1000")
    parser.add_argument("--traffic", action="store_true")
    parser.add_argument("--write", metavar="PAGE")
    arguments = parser.parse_args()
    counts = [int(one) for one in arguments.machines.split(",")]
    if arguments.traffic and arguments.write:
        first = pathlib.Path(arguments.write).read_text().split("\n" + TRAFFIC)[0]
    elif not arguments.traffic:
        first = HEAD + page_of(counts, each(measured, counts)) + TAIL
    second = traffic_of(counts, each(lambda count: broker_load.measured(count, cli.BIN / "compbox"), counts))
    if arguments.write:
        pathlib.Path(arguments.write).write_text(first + second)
    print(second if arguments.traffic else first + second, end="")


def each(measure, counts):
    found = {}
    for count in counts:
        found[count] = measure(count)
        print(count, found[count], file=sys.stderr, flush=True)
    return found


if __name__ == "__main__":
    main()
