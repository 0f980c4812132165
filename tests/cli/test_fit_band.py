# SPDX-License-Identifier: MIT
"""How often the truth is inside the band of compbox fit. The machines and their noise are made here with numpy
and share nothing with the fit: curves of four families, noise of a run correlated from target to target (AR 1)."""

import numpy
import pytest

from conftest import LONG

MACHINES = 64 if LONG else 8
STEP = 1 if LONG else 2  # through the lists of machines below
LOWEST, HIGHEST = (0.90, 0.985) if LONG else (0.85, 1.0)  # fewer machines scatter more


def truth(random, length, family):
    """A curve of 10 to 100 um over the travel."""
    size = 10 ** random.uniform(1, 2)
    if family == 0:  # cosines
        order = numpy.arange(1, random.integers(3, 10))
        amplitude = random.normal(size=order.size) / order ** random.uniform(1, 2)
        phase = random.uniform(0, 2 * numpy.pi, order.size)
        return lambda x: size * numpy.cos(numpy.pi * numpy.outer(x, order) / length + phase) @ amplitude
    if family == 1:  # bumps
        centre, width = random.uniform(0, length, 4), length * random.uniform(0.1, 0.4, 4)
        height = random.normal(size=4)
        return lambda x: size * numpy.exp(-((x[:, None] - centre) / width) ** 2) @ height
    if family == 2:  # a polynomial
        part = random.normal(size=5) / numpy.arange(1, 6)
        return lambda x: size * numpy.polynomial.chebyshev.chebval(2 * x / length - 1, part)
    slope = random.normal()
    return lambda x: size * slope * x / length


def noise_of_run(random, count, correlation):
    """A stationary sequence of variance 1."""
    noise = random.normal(size=count)
    for i in range(1, count):
        noise[i] = correlation * noise[i - 1] + numpy.sqrt(1 - correlation ** 2) * noise[i]
    return noise


def inside(compbox, seed, correlation, runs, targets, uneven=False, branches=False, white=0.0):
    """Shares of the curve's points with the truth inside 2 sigma; one for each branch."""
    random = numpy.random.default_rng(seed)
    length, sigma = random.uniform(500, 4000), 10 ** random.uniform(-0.5, 0.7)
    curve = truth(random, length, seed % 4)
    x = numpy.linspace(0, length, targets)
    if uneven:
        x = numpy.cumsum(numpy.append(0, random.uniform(0.3, 1.7, targets - 1) ** 2))
        x *= length / x[-1]
    lines = ["position_mm,error_um,run,direction"]
    for run in range(runs):
        for way in (1, -1) if branches else (1,):
            noise = noise_of_run(random, targets, correlation) + white * random.normal(size=targets)
            readings = (curve(x) + sigma * (noise[::way] + way * branches))[::way]
            lines += [f"{at:.6f},{y:.6f},{run},{way:+d}" for at, y in zip(x[::way], readings)]
    compbox.write("d.csv", "\n".join(lines) + "\n")
    done = compbox("fit", "d.csv", "--name", "EXX", "--signal", "X", "--band", "b.csv", "-o", "t.json",
                   *(["--branches"] if branches else []))
    assert done.returncode == 0, done.stderr
    band = {name: numpy.array(column) for name, column in compbox.table("b.csv").items()}
    known = curve(band["position_mm"])
    share = [numpy.mean(numpy.abs(band["curve_um"] - known - sigma * branches) <= 2 * band["sigma_um"])]
    if branches:
        off = band["backward_um"] - known + sigma
        share.append(numpy.mean(numpy.abs(off) <= 2 * band["backward_sigma_um"]))
    return numpy.mean(share), "is alike (correlation" in done.stderr


@pytest.mark.parametrize("machine", [
    dict(correlation=0.9, runs=2, targets=40),
    dict(correlation=0.9, runs=3, targets=20),
    dict(correlation=0.9, runs=3, targets=40),
    dict(correlation=0.9, runs=3, targets=40, branches=True),
    dict(correlation=0.9, runs=5, targets=40, uneven=True),
    dict(correlation=0.9, runs=5, targets=40, white=0.5),
    dict(correlation=0.9, runs=5, targets=150),
    dict(correlation=0.9, runs=20, targets=40),
    dict(correlation=0.7, runs=3, targets=40),
    dict(correlation=0.5, runs=4, targets=30, uneven=True),
][::STEP], ids=lambda machine: "-".join(f"{value:g}" for value in machine.values()))
def test_the_truth_is_inside_the_band_with_noise_that_is_correlated_in_a_run(compbox, machine):
    found = [inside(compbox, seed, **machine) for seed in range(MACHINES)]
    share = numpy.mean([one for one, warned in found])
    print(machine, f"{100 * share:.1f} %, warned {sum(warned for one, warned in found)} of {MACHINES}")
    assert LOWEST <= share <= HIGHEST
    if machine["correlation"] == 0.9:
        assert sum(warned for one, warned in found) >= 0.85 * MACHINES


@pytest.mark.parametrize("machine", [
    dict(correlation=0, runs=2, targets=25),
    dict(correlation=0, runs=3, targets=40),
    dict(correlation=0, runs=3, targets=30, uneven=True, branches=True),
    dict(correlation=0, runs=10, targets=40),
][::STEP], ids=lambda machine: "-".join(f"{value:g}" for value in machine.values()))
def test_with_white_noise_the_band_is_as_before_and_nothing_is_warned_of(compbox, machine):
    found = [inside(compbox, seed, **machine) for seed in range(MACHINES)]
    share = numpy.mean([one for one, warned in found])
    print(machine, f"{100 * share:.1f} %, warned {sum(warned for one, warned in found)} of {MACHINES}")
    assert LOWEST <= share <= HIGHEST
    assert sum(warned for one, warned in found) <= 0.08 * MACHINES


def test_one_run_that_drifts_has_a_wider_band(compbox):
    """One run cannot show what is noise: less is inside than with repeats, and more than with white noise alone
    (about 27 %)."""
    found = [inside(compbox, seed, correlation=0.9, runs=1, targets=60) for seed in range(MACHINES)]
    share = numpy.mean([one for one, warned in found])
    print(f"one run: {100 * share:.1f} %")
    assert share >= 0.6
