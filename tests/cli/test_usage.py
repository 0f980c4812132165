# SPDX-License-Identifier: MIT
"""Wrong usage and help of every command: one sentence, exit 2, never a fault in the program itself."""

import re
import subprocess

import pytest

from conftest import BIN

MORE = "\nRun with --help for more information.\n"
PROGRAMS = ["fakeplc", "fakept100", "virtual-laser"]
FIT = ("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t")


def commands():
    text = subprocess.run([BIN / "compbox", "--help"], capture_output=True, text=True).stdout
    listed = text.split("Subcommands:\n")[1].split("\n\n")[0]
    return re.findall(r"^  ([\w-]+) ", listed, re.MULTILINE)


@pytest.fixture(params=commands())
def command(request):
    return request.param


def refusal(compbox, *arguments):
    """Wrong usage: its sentence."""
    done = compbox(*arguments)
    assert (done.returncode, done.stdout) == (2, ""), (arguments, done.stdout, done.stderr)
    assert done.stderr.startswith("compbox: ") and done.stderr.endswith(MORE), done.stderr
    return done.stderr[len("compbox: "):-len(MORE)]


def test_help_has_options_and_an_example(compbox, command):
    text = compbox.good(command, "--help")
    assert "\n  -h,--help " in text and "Example:\n  compbox " + command + " " in text
    description = text.splitlines()[0]
    assert f"\n{command}\n  {description}\n" in compbox.good("--help-all")
    assert compbox.good(command, "--bogus", "--help") == text


def test_every_option_without_its_value(compbox, command):
    # A flag has two blanks behind it, or nothing.
    options = re.findall(r"^  (?:-\w,)?(--[\w-]+) \S", compbox.good(command, "--help"), re.MULTILINE)
    assert options or command in ("check", "fleet", "keygen")
    for option in options:
        printed = refusal(compbox, command, option)
        assert re.fullmatch("(-o,)?" + option + " needs [1-9] values?", printed), printed


@pytest.mark.parametrize("arguments, sentence", [
    ((*FIT, "--bogus"), "unknown argument --bogus"),
    ((*FIT, "--reversal-mm", "1"), "--reversal-mm needs --branches"),
    ((*FIT, "--degree", "1", "--degree", "2"), "--degree needs 1 value, not 2"),
    ((*FIT, "--method", "no"), "--method: must be one of bspline, bspline-lmc, polynomial, polyline, not no"),
    ((*FIT, "--band", "t"), "--band: names the same file as -o"),
    (FIT[:-2], "--output is missing"),
    (("volumetric", "d", "--chain", "fXYZ", "--name", "v", "-o", "t", "--tool-length", "L", "--tool-length-mm", "4"),
     "--tool-length-mm cannot be combined with --tool-length"),
    (("plan", "--criterion", "e"), "--criterion: must be one of a, d, mean-cv, not e"),
    (("identify", "--side", "left"), "--side: must be one of tool, workpiece, not left"),
    (("init", "--profile", "s7"), "--profile: must be one of generic, sinumerik-840d, fanuc, linuxcnc, not s7"),
    (("export", "c.json", "--sign", "2"), "--sign: must be one of 1, -1, not 2"),
    (("join", "a", "--keep-compensated=" + 20 * "9"), "--keep-compensated takes no value"),
])
def test_sentences(compbox, arguments, sentence):
    assert refusal(compbox, *arguments) == sentence


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), ("fit", "--help")])
def test_help_that_does_not_arrive(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run([BIN / "compbox", *arguments], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (1, "compbox: standard output could not be written whole\n")


@pytest.mark.parametrize("program", PROGRAMS)
def test_other_programs(program):
    def call(*arguments):
        done = subprocess.run([BIN / program, *arguments], capture_output=True, text=True, timeout=10)
        return done.returncode, done.stdout, done.stderr
    assert call("--help")[0] == 0 and "Example:\n  " + program in call("--help")[1]
    code, out, printed = call("--bogus", "1")
    assert (code, out) == (2, "") and printed.startswith(program + ": ")
    assert printed.endswith(MORE)
