# SPDX-License-Identifier: MIT
"""compbox fleet COMMAND. Exit 0 done, 1 the input is bad (one sentence), 2 wrong usage."""

import argparse
import os
import shlex
import sys

from . import machines
from .errors import FleetError
from .registry import Registry


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
    return 0


if __name__ == "__main__":
    sys.exit(main())
