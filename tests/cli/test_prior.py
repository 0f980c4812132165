# SPDX-License-Identifier: MIT
"""compbox prior: files of --moments to a prior, and what it refuses."""

import json
import random

import pytest


def table(seed, gain=3.0):
    dice, lines = random.Random(seed), ["time_s,T1,T2,error_um"]
    t1 = t2 = 20.0
    for k in range(300):
        t1, t2 = t1 + dice.gauss(0, 0.3) - (t1 - 20) / 50, t2 + dice.gauss(0, 0.3) - (t2 - 20) / 50
        lines.append(f"{600 * k},{t1:.3f},{t2:.3f},{gain * (t1 - 20) - (t2 - 20) + dice.gauss(0, 0.5):.3f}")
    return "\n".join(lines) + "\n"


TRAIN = ("train", "data.csv", "--outputs", "error_um", "--hidden", "0", "--name", "net", "-o", "net.json")


@pytest.fixture
def moments(compbox):
    """Files of three machines."""
    for seed in range(3):
        compbox.write("data.csv", table(seed))
        compbox.good(*TRAIN, "--moments", f"m{seed}.json")
    return [f"m{seed}.json" for seed in range(3)]


def test_a_prior_is_made_and_used(compbox, moments):
    summary = json.loads(compbox.good("prior", *moments, "-o", "prior.json", "--json"))
    assert summary["machines"] == 3 and summary["files"] == ["prior.json"] and summary["strange"] == [[]]
    compbox.write("data.csv", table(9))
    report = compbox.good(*TRAIN, "--prior", "prior.json")
    shares = compbox.read("net.json")["provenance"]["net"]["prior"]["shares"]["error_um"]
    assert sum(shares.values()) == pytest.approx(1, abs=1e-3) and "others of its type" in report


def test_what_is_refused(compbox, moments):
    def sentence(*words):
        done = compbox(*words)
        assert done.returncode == 1, done
        return done.stderr

    assert "a prior needs 3 to 1000 machines, not 2" in sentence("prior", *moments[:2], "-o", "prior.json")
    other = sentence("prior", *moments, "net.json", "-o", "p.json")
    assert "net.json: is no file of `compbox train --moments`" in other
    compbox.good("prior", *moments, "-o", "prior.json")
    for key, value, words in (("format", "compbox-prior/2", "is no file of `compbox prior`"),
                              ("spaces", [], "has not one or two spaces"), ("machines", "three", "machines"),
                              ("spaces", [{**compbox.read("prior.json")["spaces"][0], "mean": [[1.0]]}],
                               "mean: has not 1 times"), ("more", 1, "more")):
        compbox.write("wrong.json", json.dumps({**compbox.read("prior.json"), key: value}))
        assert words in sentence(*TRAIN, "--prior", "wrong.json"), key
    compbox.write("data.csv", table(9).replace("T2", "T3"))
    assert "have the inputs T1,T2 and T1,T3" in sentence(*TRAIN, "--prior", "prior.json")
    done = compbox(*TRAIN, "--prior", "prior.json", "--lags", "600")
    assert done.returncode == 2 and "is for a bank" in done.stderr
