# SPDX-License-Identifier: MIT
"""compbox fleet COMMAND. Exit 0 done, 1 the input is bad (one sentence), 2 wrong usage."""

import argparse
import contextlib
import json
import os
import pathlib
import re
import shlex
import signal
import sys
import tempfile

from . import bridge, demo, engines, links, machines, receiving, report, rollout, site, training
from .errors import FleetError
from .registry import Registry, read_json, write_file


class Parser(argparse.ArgumentParser):
    """Usage errors as the other commands print them."""

    def error(self, message):
        print(f"compbox: fleet: {message}\nRun with --help for more information.", file=sys.stderr)
        sys.exit(2)


def run_add(arguments):
    registry = Registry.create(arguments.registry)
    with registry.locked():
        machines.add(registry, arguments.machine, arguments.file, arguments.outputs.split(","),
                     shlex.split(arguments.train), arguments.type)


def run_record(arguments):
    registry = Registry(arguments.registry)
    with registry.locked():
        for path in arguments.files:
            for probe, found in sorted(machines.add_record(registry, arguments.machine, path).items()):
                print(f"{path}: {probe}: {found['count']} probes, rms {found['rms_um']} um")


def run_snapshot(arguments):
    registry = Registry(arguments.registry)
    with registry.locked():
        machines.add_snapshot(registry, arguments.machine, arguments.file)


def run_status(arguments):
    rows = machines.status(Registry(arguments.registry))
    print(machines.status_json(rows) if arguments.json else machines.status_text(rows))


def run_plan(arguments):
    rows = training.plan(Registry(arguments.registry), arguments.machines, arguments.all)
    if arguments.json:
        print(json.dumps(rows, indent=2, sort_keys=True))
        return
    for row in rows:
        print(f"{row['job'][:12]}  {row['machine']:<24}{'done' if row['done'] else 'to do':<7}{row['why']}")
    print(f"{sum(not row['done'] for row in rows)} of {len(rows)} jobs to do")


def progress(number, total):
    """A bar on a terminal, and only there."""
    if sys.stderr.isatty():
        done = 40 * number // total
        print(f"\rtraining [{'#' * done}{'-' * (40 - done)}] {number} of {total}",
              end="\n" if number == total else "", file=sys.stderr, flush=True)


def run_train(arguments):
    registry = Registry(arguments.registry)
    with registry.locked():
        rows = training.plan(registry, arguments.machines, arguments.all)
        if arguments.slurm:
            todo = [row for row in rows if not row["done"]]
            if todo:
                script = engines.write_array(todo, registry, arguments.slurm)
                print(f"{len(todo)} jobs: sbatch {script}; then compbox fleet collect {arguments.slurm}")
            else:
                print("every job is done")
            return
        engine = engines.dask(arguments.scheduler) if arguments.scheduler else engines.here(arguments.workers)
        print_ended(training.train(registry, rows, engine, progress), registry, rows)


def run_job(arguments):
    plan = engines.plan_of(arguments.folder)
    if not 0 <= arguments.number < len(plan["rows"]):
        raise FleetError(f"{arguments.folder}: has no job {arguments.number}, but 0 to {len(plan['rows']) - 1}")
    row = plan["rows"][arguments.number]
    if not engines.result_path(arguments.folder, row).exists():
        result = engines.jobs.run(row["what"], *training.inputs_of(Registry(plan["registry"]), row["what"]))
        write_file(engines.result_path(arguments.folder, row), json.dumps(result).encode())


def run_collect(arguments):
    plan = engines.plan_of(arguments.folder)
    registry = Registry(plan["registry"])

    def results(given):
        for key, *_ in given:
            path = engines.result_path(arguments.folder, {"job": key})
            yield key, read_json(path) if path.exists() else {"lost": "no result"}

    with registry.locked():
        for row in plan["rows"]:
            row["done"] = registry.has("jobs", row["job"])
        print_ended(training.train(registry, plan["rows"], results, progress), registry, plan["rows"])


def print_ended(ended, registry, rows):
    """in: rows: of the plan that was trained. Throws FleetError if jobs were lost, which the next call repeats."""
    job_of = {row["machine"]: row["job"] for row in rows}
    for name in ended["failed"]:
        print(f"{name}: {registry.read('jobs', job_of[name])['failed']}")
    print(f"{len(ended['trained'])} trained, {len(ended['cached'])} known before, {len(ended['failed'])} refused")
    if ended["lost"]:
        first = ended["lost"][0]
        raise FleetError(f"{len(ended['lost'])} jobs have no result, that of {first} first; repeat the command")


def run_running(arguments):
    registry = Registry(arguments.registry)
    with registry.locked():
        site.add_running(registry, arguments.machine, arguments.file)


def broker_of(arguments, follow):
    """out: the link to the broker of the options"""
    if bool(arguments.mqtt_user) != bool(arguments.mqtt_password_file):
        raise FleetError("--mqtt-user and --mqtt-password-file belong together")
    login = (arguments.mqtt_user, password_of(arguments.mqtt_password_file)) if arguments.mqtt_user else None
    return links.Mqtt(arguments.mqtt, arguments.mqtt_topic, arguments.every, login, arguments.mqtt_ca, follow)


def password_of(path):
    """out: the first line of a file that no other user may read, as compbox-view takes it"""
    text = machines.text_of(path)[1]
    if os.stat(path).st_mode & 0o007:
        raise FleetError(f"{path}: other users can read it: chmod o= {path}")
    return re.split("[\r\n]", text, maxsplit=1)[0]


def run_rollout(arguments):
    registry = Registry(arguments.registry)
    with registry.locked():
        state = site.unfinished(registry)
        if state is None:
            offers, left = site.offers(registry, arguments.without)
            for name, why in left.items():
                print(f"{name}: {why}")
            if not offers:
                print("no machine has a better candidate")
                return
            state = rollout.begun(offers, arguments.canary)
        for name in arguments.without:
            rollout.leave(state, name, "was left out by --without")
        link = links.Folder(arguments.folder, arguments.every) if arguments.folder else \
            broker_of(arguments, ("+/state", "+/values"))
        try:
            runner = site.Runner(registry, state, link, arguments.key, arguments.most_failures / 100)
            state = runner.run(arguments.wait, lambda now: print(site.line_of(now), flush=True))
        finally:
            link.close()
        for name, part in state["machines"].items():
            if part["state"] == "left":
                print(f"{name}: {part['why']}")
        if state["state"] == "halted":
            raise FleetError(f"the roll-out was halted: {state['why']}")
        print("done" if rollout.is_over(state) else "not over; the same command continues it")


def run_receive(arguments):
    if arguments.folder:
        receiving.from_folder(arguments.folder, arguments.keys, arguments.output, arguments.once)
    else:
        receiving.from_broker(broker_of(arguments, ("file",)), arguments.keys, arguments.output)


def run_report(arguments):
    page = report.page(Registry(arguments.registry))
    write_file(pathlib.Path(arguments.output), page.encode())


def run_demo(arguments):
    """Until Ctrl-C, SIGTERM or so many seconds; then nothing of it is left."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with contextlib.ExitStack() as ending:
        folder = arguments.output or ending.enter_context(tempfile.TemporaryDirectory(prefix="compbox-demo-"))
        if arguments.output:
            pathlib.Path(folder).mkdir(mode=0o700)
        site_of_demo = demo.Demo(pathlib.Path(folder).resolve(), arguments.boxes)
        ending.callback(site_of_demo.close)
        site_of_demo.start()
        for name, address in site_of_demo.addresses():
            print(f"{name + ':':<34}{address}")
        print("Ctrl-C ends all of it", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            site_of_demo.ended.wait(arguments.wait)


def run_bridge(arguments):
    registry = Registry(arguments.watch) if arguments.watch else None
    link = broker_of(arguments, ("+/online", "+/state", "+/values"))
    try:
        bridge.run(link, bridge.Database(arguments.database), lambda: forecasts_of(registry), lambda: False)
    finally:
        link.close()


def forecasts_of(registry):
    """out: {machine: {probe: um}} of the models that run"""
    names = registry.names("machines") if registry else []
    return {name: machines.forecast_of(registry, registry.read("machines", name)) for name in names}


def add_site(add):
    """Commands of a site."""
    command = add("demo", run_demo, "Start a site with simulated boxes on this computer, until Ctrl-C", "")
    command.add_argument("--boxes", type=positive, default=5, metavar="N", help="boxes (5), of which the first is real")
    command.add_argument("--wait", type=float, metavar="S", help="end after so many seconds")
    command.add_argument("-o", "--output", metavar="DIR", help="keep data and logs in this new folder")
    command = add("bridge", run_bridge, "Bring what boxes publish into a time-series database",
                  "--mqtt broker:8883 --mqtt-user site --mqtt-password-file site.password --mqtt-ca ca.pem "
                  "--database http://127.0.0.1:8428")
    command.add_argument("--database", required=True, metavar="URL", help="a VictoriaMetrics, as http://127.0.0.1:8428")
    command.add_argument("--watch", metavar="DIR", help="registry whose forecasts the alerts compare residuals with")
    add_broker(command, "topics of the boxes begin with it (compbox)")


def add_link(command, folder, prefix):
    """Options of a link: a folder or a broker."""
    way = command.add_mutually_exclusive_group(required=True)
    way.add_argument("--folder", metavar="DIR", help=folder)
    add_broker(command, prefix, way)


def topic(text):
    """Throws ValueError for what is no begin of a topic."""
    if set("+#") & set(text):
        raise ValueError(text)
    text.encode()  # a broker takes UTF-8 alone
    return text


def add_broker(command, prefix, way=None):
    """Options of a broker, which may be one of several ways."""
    (way or command).add_argument("--mqtt", required=way is None, metavar="HOST:PORT", help="MQTT broker")
    command.add_argument("--mqtt-topic", type=topic, default="compbox", metavar="TOPIC", help=prefix)
    command.add_argument("--mqtt-user", metavar="NAME", help="login at the broker")
    command.add_argument("--mqtt-password-file", metavar="F", help="its password")
    command.add_argument("--mqtt-ca", metavar="F.pem", help="TLS: certificate of the broker's authority")
    command.add_argument("--every", type=float, default=1.0, metavar="S", help="seconds between two looks (1)")


def add_rollout(add):
    """Commands that bring models to boxes."""
    command = add("running", run_running, "Keep the file that a box runs, to return to", "lathe-3 coefficients.json")
    command.add_argument("machine", help="name of the machine")
    command.add_argument("file", help="its coefficient file")
    command = add("rollout", run_rollout, "Bring better models to the boxes, in stages",
                  "--key plant.key --mqtt broker:1883")
    command.add_argument("--key", required=True, metavar="F.key", help="secret key that signs, without a password")
    command.add_argument("--canary", metavar="NAME", help="the first machine (whose record differs most)")
    command.add_argument("--without", nargs="*", default=[], metavar="NAME",
                         help="machines to leave alone, also of a roll-out that began")
    command.add_argument("--most-failures", type=float, default=10, metavar="PERCENT",
                         help="part of a stage that may fail (10); the canary may not")
    command.add_argument("--wait", type=float, default=float("inf"), metavar="S", help="end after so long")
    add_link(command, "folder that the boxes share, with a folder for each machine",
             "topics of the boxes begin with it (compbox)")
    command = add("receive", run_receive, "On a box: take signed files that arrive",
                  "--mqtt broker:1883 --mqtt-topic compbox/lathe-3 --keys /etc/compbox/keys -o coefficients.json")
    command.add_argument("--keys", required=True, metavar="DIR", help="folder of public keys, NAME.pub")
    command.add_argument("-o", "--output", required=True, metavar="F.json", help="file that compboxd runs")
    command.add_argument("--once", action="store_true", help="look once, with --folder")
    add_link(command, "folder of this machine", "topic of this machine, as compbox/lathe-3")
    command = add("report", run_report, "Write a page about the fleet, with pictures", "-o fleet.html")
    command.add_argument("-o", "--output", required=True, metavar="F.html", help="page to write")


def add_training(add):
    """Commands that make models."""
    for name, run, text in (("plan", run_plan, "Show the training jobs that are due"),
                            ("train", run_train, "Train the models that are due")):
        command = add(name, run, text, "--all")
        command.add_argument("machines", nargs="*", help="machines (those without a model, and those that drift)")
        command.add_argument("--all", action="store_true", help="every machine with a record")
        if name == "plan":
            command.add_argument("--json", action="store_true", help="print the result as JSON")
            continue
        command.add_argument("--workers", type=positive, default=os.cpu_count(), metavar="N",
                             help="jobs at once on this computer (as many as there are processors)")
        command.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, as tcp://host:8786")
        command.add_argument("--slurm", metavar="DIR", help="write an array script for sbatch instead")
    command = add("run-job", run_job, "Run one task of a Slurm array", "DIR 0")
    command.add_argument("folder", help="the folder of `train --slurm`")
    command.add_argument("number", type=int, help="index of the task, from 0")
    command = add("collect", run_collect, "Take the results of a Slurm array into the registry", "DIR")
    command.add_argument("folder", help="the folder of `train --slurm`")


def positive(text):
    if not 1 <= int(text) <= 1000:
        raise ValueError(text)
    return int(text)


def add_machines(add):
    """Commands of the registry."""
    command = add("add", run_add, "Add a machine to the registry", "lathe-3 machine.json --outputs error_X_um")
    command.add_argument("machine", help="name of the machine")
    command.add_argument("file", help="machine file of `compbox init`, with the signals of the model")
    command.add_argument("--outputs", required=True, metavar="A,B", help="errors that the model predicts")
    command.add_argument("--train", default="", metavar="TEXT", help="further options of `compbox train`, in one text")
    command.add_argument("--type", default="machine", help="machines of one type are alike")
    command = add("record", run_record, "Add records of the box, oldest first", "lathe-3 record.csv")
    command.add_argument("machine", help="name of the machine")
    command.add_argument("files", nargs="+", help="records with probe columns")
    command = add("snapshot", run_snapshot, "Keep a snapshot of the box", "lathe-3 snapshot.json")
    command.add_argument("machine", help="name of the machine")
    command.add_argument("file", help="the snapshot of compboxd")
    command = add("status", run_status, "Show which machines drift", "")
    command.add_argument("--json", action="store_true", help="print the result as JSON")


def parser():
    """out: the parser of all commands, whose arguments have `run`"""
    whole = Parser(prog="compbox fleet", description="Many machines: registry, training, roll-out.")
    parts = whole.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    def add(name, run, text, example):
        command = parts.add_parser(name, help=text, description=text,
                                   epilog=f"Example: compbox fleet {name} {example}".rstrip())
        command.set_defaults(run=run)
        command.add_argument("--registry", default="registry", metavar="DIR", help="folder of the registry (registry)")
        return command

    add_machines(add)
    add_training(add)
    add_rollout(add)
    add_site(add)
    return whole


def main():
    arguments = parser().parse_args()
    try:
        arguments.run(arguments)
        sys.stdout.flush()
    except FleetError as error:
        print(f"compbox: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 1
    except OSError as error:
        print(f"compbox: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
