# SPDX-License-Identifier: MIT
"""Mistakes on the command line and in the coefficient file: one sentence, the right exit code."""
import json
import os
import pathlib
import re
import resource

import pytest

import machine
from box import run, until


@pytest.fixture
def config(tmp_path, port):
    return machine.write_coefficients(tmp_path / "coefficients.json", port)


def one_sentence(text):
    return text.startswith("compboxd: ") and text.count("\n") == 1


@pytest.mark.parametrize("arguments", [
    [], ["--config"], ["--nonsense"], ["--config", "{config}", "--cycles", "0"],
    ["--config", "{config}", "--cycles", "-3"], ["--config", "{config}", "--cycles", "1.5"],
    ["--config", "{config}", "--priority", "100"], ["--config", "{config}", "--priority", "x"],
    ["--config", "{config}", "--cpu-latency", "maybe"], ["--config", "{config}", "more"],
    ["--config", "{config}", "--cycles", "99999999999999999999"], ["--st", "a"], ["--help=3"],
    ["-c", "{config}"], ["-xy"], ["--cpu-latency=on", "-xy"],
])
def test_wrong_usage_is_exit_2(config, arguments):
    code, out, err = run(*[a.format(config=config) for a in arguments])
    assert code == 2 and out == "" and one_sentence(err)


@pytest.mark.parametrize("arguments, word", [
    (["--nonsense"], " --nonsense;"), (["--st", "a"], " --st;"), (["--config"], " --config needs"),
    (["--help=3"], '"--help=3"'), (["--cpu-latency=on", "-xy"], " -x;"),
])
def test_wrong_usage_names_the_word(arguments, word):
    assert word in run(*arguments)[2]


def test_help_and_version():
    code, out, err = run("--help")
    assert code == 0 and err == ""
    assert "example: compboxd --config" in out
    for option in ("--config", "--cycles", "--stats", "--record", "--priority", "--cpu-latency"):
        assert option in out
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs/compboxd.md").read_text().split("Check a file")[0]
    options = re.findall(r"^  (--[a-z-]+)", out, re.M)
    assert re.findall(r"--[a-z-]+", page.split("    compboxd --config coefficients.json --check")[0]) == \
        [one for one in options if one not in ("--check", "--help", "--version")], "the usage of docs/compboxd.md"
    code, out, _ = run("--version")
    assert code == 0 and re.fullmatch(r"compboxd \d+\.\d+\.\d+\n", out)


def test_a_file_that_is_missing(tmp_path):
    path = tmp_path / "none.json"
    code, _, err = run("--config", str(path))
    assert code == 1 and one_sentence(err) and str(path) in err


def test_a_folder_instead_of_a_file(tmp_path):
    code, _, err = run("--config", str(tmp_path))
    assert code == 1 and one_sentence(err)


@pytest.mark.parametrize("spoil, place", [
    (lambda d: d["terms"][0]["knots"].__setitem__(5, 1), r"terms\[0\]\.knots"),
    (lambda d: d["signals"][0].__setitem__("offzet", 1), r"signals\[0\]\.offzet"),
    (lambda d: d["channels"][0]["sum"].append("EQQ"), r"channels\[0\]\.sum"),
    (lambda d: d["plc"]["transport"]["tcp"].__setitem__("host", "plc.local"), r"host"),
    (lambda d: d.__setitem__("format", "compbox/9"), r"format"),
])
def test_a_mistake_in_the_file_is_reported_with_its_place(tmp_path, port, spoil, place):
    path = machine.write_coefficients(tmp_path / "c.json", port, spoil)
    code, _, err = run("--config", str(path))
    assert code == 1
    assert one_sentence(err), err
    assert err.startswith(f"compboxd: {path}: ")
    assert re.search(place, err), err
    assert re.search(r", line \d+, column \d+\n$", err), err


@pytest.mark.parametrize("text", [b"", b"{", b"\x00\xff\xfe", b"[1, 2]", b" " * 200000,
                                  b'{"format": "compbox/1"'],
                         ids=["empty", "brace", "binary", "array", "oversized", "truncated"])
def test_what_is_no_coefficient_file(tmp_path, text):
    path = tmp_path / "c.json"
    path.write_bytes(text)
    code, _, err = run("--config", str(path))
    assert code == 1 and one_sentence(err), err
    assert str(path) in err


def test_a_configuration_path_that_is_no_file_is_refused_at_once(tmp_path):
    fifo, folder = tmp_path / "fifo", tmp_path / "folder"
    os.mkfifo(fifo)
    folder.mkdir()
    for path, why in ((fifo, "it is not a regular file; put the file itself there"),
                      ("/dev/zero", "it is not a regular file; put the file itself there"),
                      (folder, "Is a directory")):
        for more in ([], ["--check"]):
            assert run("--config", str(path), *more) == \
                (1, "", f"compboxd: {path}: cannot be read: {why}\n")


@pytest.mark.parametrize("option", ["--stats", "--record"])
def test_an_output_that_cannot_be_written_is_reported_before_the_start(config, tmp_path, option):
    path = tmp_path / "no" / "folder" / "f"
    code, _, err = run("--config", str(config), option, str(path))
    assert code == 1 and one_sentence(err) and str(path) in err


def test_statistics_replace_no_device(config, tmp_path):
    """They are renamed over what is there, and root may do that even to /dev/null."""
    device = tmp_path / "device"
    os.mkfifo(device)
    code, _, err = run("--config", str(config), "--stats", str(device))
    assert code == 1
    assert err == f"compboxd: {device}: cannot be written: it is not a regular file\n"
    assert device.is_fifo() and not list(tmp_path.glob("*.new"))


def test_stats_are_json_whatever_the_names(tmp_path, port):
    path = machine.write_coefficients(
        tmp_path / "c.json", port,
        lambda d: d["machine"].__setitem__("name", 'gantry "14 m" \\ µ'))
    stats = tmp_path / 'st"ats.json'
    run("--config", str(path), "--cycles", "3", "--stats", str(stats))
    assert json.loads(stats.read_text())["machine"] == 'gantry "14 m" \\ µ'


def test_a_record_that_may_not_grow_ends_no_compensation(start_box, tmp_path):
    """The signal that comes with it kills a program that does not mind it."""
    log = tmp_path / "log.txt"
    with open(log, "w") as stderr, start_box(stderr=stderr) as box:
        until(box.record_file.exists)
        resource.prlimit(box.process.pid, resource.RLIMIT_FSIZE, (2000, 2000))
        until(lambda: f"{box.record_file}: rows are lost: File too large" in log.read_text())
        box.stop()
    assert box.code == 1 and "ended without any reply of the PLC" in log.read_text()  # not by a signal
    text = box.record_file.read_text()
    assert text.endswith("\n") and 1000 < len(text) <= 2000, "whole lines only"
    assert log.read_text().count(f"{box.record_file}: rows are lost: File too large") == 1


@pytest.mark.parametrize("option", ["--stats", "--record", "--record-inputs", "--state"])
def test_nothing_is_written_over_the_coefficient_file(config, option):
    text, link = config.read_text(), config.parent / "link"
    link.symlink_to(config)
    for path in (config, link):
        code, out, err = run("--config", str(config), option, str(path))
        assert (code, out) == (2, "")
        assert err == f"compboxd: --config and {option} name the same file, {path}; give each its own\n"
    assert config.read_text() == text


def test_two_outputs_are_two_files(config, tmp_path):
    path = tmp_path / "new"
    code, _, err = run("--config", str(config), "--record", str(path), "--state", str(path))
    assert code == 2 and "--record and --state name the same file" in err and not path.exists()
    assert run("--config", str(config), "--record", "/dev/null", "--record-inputs", "/dev/null",
               "--check")[0] == 0
