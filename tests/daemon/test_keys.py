# SPDX-License-Identifier: MIT
"""compboxd --keys: what an enrolled key has not signed, of another machine or older, is refused; the running file goes
on. Signatures are those of `compbox sign`."""
import errno
import json
import os
import pathlib
import signal
import subprocess

import pytest

import machine
from box import run, until
from machine import ACTIVE, AT_REST
from raw_plc import RawPlc

COMPBOX = os.environ.get("COMPBOX", str(pathlib.Path(__file__).resolve().parents[2] / "build/host/bin/compbox"))


@pytest.fixture
def keys(tmp_path, real_path):
    """A folder with the key of the plant, whose secret half is real_path/plant.key."""
    for name in ("plant", "other"):
        subprocess.run([COMPBOX, "keygen", name], cwd=real_path, check=True, capture_output=True)
    folder = tmp_path / "keys"
    folder.mkdir()
    enrol(folder, real_path, "plant")
    return folder


def enrol(folder, real_path, name):
    (folder / f"{name}.pub").write_text((real_path / f"{name}.pub").read_text())


def signature(real_path, text, key="plant"):
    """out: the text of a signature of this coefficient file"""
    (real_path / "c.json").write_text(text)
    return subprocess.run([COMPBOX, "sign", "c.json", "--key", f"{key}.key", "-o", "-"], cwd=real_path, check=True,
                          capture_output=True, text=True).stdout


def text_of(port, change=None):
    return json.dumps(machine.coefficients(port, change), indent=1)


def revision(number, name=None):
    """A later file, which lets Z go so much lower for each revision."""
    def change(data):
        data["revision"] = number
        data["machine"]["name"] = name or data["machine"]["name"]
        next(t for t in data["terms"] if t["name"] == "GROW")["coefficients"][0] += 10 * (number - 7)
    return change


class Signed:
    """A box with --keys that compensates at rest by a signed file of revision 7."""

    def __init__(self, box, plc, port, real_path, path):
        self.box, self.plc, self.port, self.real_path, self.path = box, plc, port, real_path, path
        self.before_um = plc.last().um["Z"]

    def put(self, text, signed=None):
        """As `compbox fleet receive` does: at every moment one of two names has the signature that fits."""
        waits = self.path.with_name("coefficients.json.minisig.new")
        if signed is not None:
            waits.write_text(signed)
        new = self.path.with_name("new.json")
        new.write_text(text)
        new.rename(self.path)
        if signed is not None:
            waits.rename(self.path.with_name("coefficients.json.minisig"))

    def refuses(self, words, count=1):
        """out: the sentence; revision 7 goes on."""
        until(lambda: self.box.stats["reloads"]["refused"] >= count)
        reloads = self.box.stats["reloads"]
        assert words in reloads["last"] and reloads["taken"] == 0, reloads
        assert f"{reloads['last']}; revision 7 goes on" in self.box.log
        last = self.plc.last()
        assert last.mode == ACTIVE and abs(last.um["Z"] - self.before_um) < 0.1

    def takes(self, number):
        self.plc.wait(lambda w: abs(w.um["Z"] - self.before_um + 10 * (number - 7)) < 0.1)
        until(lambda: f"revision {number} is running now" in self.box.log)


@pytest.fixture
def signed(plc, port, start_box, tmp_path, keys, real_path):
    plc.values = dict(AT_REST)
    path = tmp_path / "coefficients.json"
    box = start_box("--keys", keys)
    path.with_name("coefficients.json.minisig").write_text(signature(real_path, path.read_text()))
    with RawPlc(plc, port), box:
        plc.wait_mode(ACTIVE)
        plc.wait(lambda w: abs(w.um["Z"] - machine.wanted_um(AT_REST)["Z"]) < 0.1)
        yield Signed(box, plc, port, real_path, path)
        box.stop()
        assert box.code == 0, box.log


def test_a_signed_file_is_taken(signed):
    assert "files must be signed by a key in /box/keys; without --state" in signed.box.log
    text = text_of(signed.port, revision(8))
    signed.put(text, signature(signed.real_path, text))
    signed.takes(8)
    assert signed.box.stats["reloads"]["refused"] == 0


def test_an_unsigned_file_is_refused(signed):
    signed.put(text_of(signed.port, revision(8)))
    signed.refuses("/box/coefficients.json: is not what was signed")
    signed.path.with_name("coefficients.json.minisig").unlink()
    signed.refuses("is not signed: /box/coefficients.json.minisig: No such file", 2)


def test_a_changed_file_or_signature_is_refused(signed):
    text = text_of(signed.port, revision(8))
    good = signature(signed.real_path, text)
    signed.put(text.replace('"limit_um": 300', '"limit_um": 301', 1), good)
    signed.refuses("is not what was signed, or /box/coefficients.json.minisig was changed")
    signed.put(text, good.replace("revision:8", "revision:9"))
    signed.refuses("is not what was signed", 2)
    signed.put(text, good[:-2])
    signed.refuses("/box/coefficients.json.minisig: is not a signature", 3)


def test_a_file_of_another_key_is_refused_until_the_key_is_enrolled(signed, keys):
    text = text_of(signed.port, revision(8))
    signed.put(text, signature(signed.real_path, text, "other"))
    signed.refuses("no key in /box/keys has signed it")
    enrol(keys, signed.real_path, "other")
    signed.box.send_signal(signal.SIGHUP)
    signed.takes(8)


def test_a_file_of_another_machine_is_refused(signed):
    text = text_of(signed.port, revision(8, "test gantry 2"))
    signed.put(text, signature(signed.real_path, text))
    signed.refuses('is of machine "test gantry 2", but this box runs "test gantry"; bring its own file')


def test_an_older_file_is_refused_although_it_was_signed_once(signed):
    text = text_of(signed.port, revision(6))
    signed.put(text, signature(signed.real_path, text))
    signed.refuses("revision 6 is older than the running one, 7")


def test_a_damaged_key_refuses_every_file(signed, keys):
    text = text_of(signed.port, revision(8))
    (keys / "old.pub").write_text("half")
    signed.put(text, signature(signed.real_path, text))
    signed.refuses("/box/keys/old.pub: is not a public key")
    (keys / "old.pub").unlink()
    signed.box.send_signal(signal.SIGHUP)
    signed.takes(8)


@pytest.mark.parametrize("first", ["file", "signature"])
@pytest.mark.parametrize("pause_s", [0, 0.5, 10])
def test_file_and_signature_may_arrive_one_after_the_other(signed, first, pause_s):
    text = text_of(signed.port, revision(8))
    beside = signed.path.with_name("coefficients.json.minisig")
    puts = [lambda: signed.path.write_text(text), lambda: beside.write_text(signature(signed.real_path, text))]
    for put in puts if first == "file" else puts[::-1]:
        put()
        signed.plc.wait_writes(1 + int(pause_s / machine.PERIOD_S))
    signed.takes(8)
    assert signed.box.stats["reloads"]["taken"] == 1


def start(path, port, keys, *more):
    """out: exit code and log of a start that must fail"""
    return run("--config", path, "--keys", keys, "--cycles", 20, *more)


def test_a_start_with_a_file_that_is_not_signed_is_refused(tmp_path, port, keys, real_path):
    path = machine.write_coefficients(tmp_path / "coefficients.json", port)
    code, log = start(path, port, keys)
    assert code == 1 and log.startswith("compboxd: /box/coefficients.json: is not signed: ") and log.count("\n") == 1
    path.with_name("coefficients.json.minisig").write_text(signature(real_path, path.read_text(), "other"))
    code, log = start(path, port, keys)
    assert code == 1 and "no key in /box/keys has signed it" in log and log.count("\n") == 1
    assert run("--config", path, "--keys", keys, "--check")[0] == 1
    path.with_name("coefficients.json.minisig").write_text(signature(real_path, path.read_text()))
    assert run("--config", path, "--keys", keys, "--check") == (0, "")


@pytest.mark.parametrize("call, skipped", [("opendir", 0), ("readdir", 0), ("readdir", 1)])
def test_a_folder_that_cannot_be_read_is_not_one_without_keys(stage, tmp_path, port, keys, call, skipped):
    path = machine.write_coefficients(tmp_path / "coefficients.json", port)
    stage.fail(call, errno.EIO, times=1, skipped=skipped)
    assert start(path, port, keys, "--check") == (1, f"compboxd: {keys}: cannot be read: Input/output error; make this "
                                                     "folder, or leave --keys out\n")


def test_a_folder_that_is_missing_is_refused_and_an_empty_one_takes_any_file(tmp_path, port):
    path = machine.write_coefficients(tmp_path / "coefficients.json", port)
    code, log = start(path, port, tmp_path / "kyes")
    assert code == 1 and log == ("compboxd: /box/kyes: cannot be read: No such file or directory; make this folder, or "
                                 "leave --keys out\n")
    (tmp_path / "keys").mkdir()
    assert "no key is enrolled in /box/keys: unsigned files are taken" in start(path, port, tmp_path / "keys")[1]
    assert "no key is enrolled; set --keys: unsigned files are taken" in run("--config", path, "--cycles", 20)[1]


@pytest.mark.parametrize("change, sentence", [
    (revision(6), "revision 6 is older than the running one, 7; raise it, or start compboxd with --allow-older"),
    (revision(8, "another"), 'is of machine "another", but this box runs "test gantry"; bring its own file')])
def test_a_restart_is_no_way_around(plc, port, start_box, tmp_path, keys, real_path, change, sentence):
    path = tmp_path / "coefficients.json"
    state = tmp_path / "lags"

    def put(change):
        path.write_text(text_of(port, change))
        path.with_name("coefficients.json.minisig").write_text(signature(real_path, path.read_text()))

    plc.values = dict(AT_REST)
    put(None)
    with RawPlc(plc, port), start_box("--keys", keys, "--state", state) as box:
        plc.wait_mode(ACTIVE)
        assert "files must be signed by a key in /box/keys\n" in box.log
        box.stop()
    put(change)
    code, log = start(path, port, keys, "--state", state)
    assert code == 1 and log == f"compboxd: /box/coefficients.json: {sentence} (by /box/lags)\n"
    code, log = start(path, port, keys, "--state", state, "--allow-older")
    assert ("is of machine" in log) == ("machine" in sentence)
    state.unlink()
    assert "(by /box/lags)" not in start(path, port, keys, "--state", state)[1]
