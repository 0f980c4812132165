#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The spindle's record once more, by numpy and nothing of the tools: the mean of eight ridge regressions over all
temperatures and speed, its square and its cube, each with two lags. Decay and shares come from the speeds left out.
  spindle_maps.py STEPS.csv FOLDER   a table of both: FOLDER/RUNS.json is the term of `train --hold-out RUNS`"""

import json
import pathlib
import sys

import numpy

LAGS_S = ((60, 600), (120, 1200), (300, 1200), (300, 3600), (600, 2400), (600, 5400), (1200, 7200), (1800, 10800))
DECAYS = 10.0 ** numpy.arange(-6, 1.6, 0.5)
EVERY = 4  # rows
OUTPUTS = [f"ch{k}_um" for k in range(1, 6)]


def lagged(t, x, tau_s, starts):
    """A first-order lag of columns that are linear from row to row, settled at each start."""
    y = x.copy()
    for i in range(1, len(t)):
        if i in starts:
            continue
        dt = t[i] - t[i - 1]
        decay = numpy.exp(-dt / tau_s)
        ramp = tau_s / dt * (1 - decay)
        y[i] = decay * y[i - 1] + (1 - ramp) * x[i] + (ramp - decay) * x[i - 1]
    return y


class Record:
    """Each row twice, with the memory of the whole record and with that of its own stretch."""

    def __init__(self, path):
        rows = numpy.genfromtxt(path, delimiter=",", names=True)
        rpm, t = rows["spindle_rpm"], rows["time_s"]
        self.sensors = [name for name in rows.dtype.names if name.endswith("_degC")]
        x = numpy.array([rows[name] for name in self.sensors] + [(rpm / 5000) ** power for power in (1, 2, 3)]).T
        stretch = numpy.cumsum(numpy.append(0, numpy.diff(rpm) != 0))
        starts = set(numpy.flatnonzero(numpy.append(True, numpy.diff(stretch))))
        twice = [{tau: lagged(t, x, tau, of)[::EVERY] for tau in sorted({s for pair in LAGS_S for s in pair})}
                 for of in ({0}, starts)]
        self.x, self.lags = x[::EVERY], twice
        y = numpy.array([rows[name] for name in OUTPUTS]).T
        self.largest, self.y = abs(y).max(axis=0), numpy.tile(y[::EVERY], (2, 1))
        self.stretch = numpy.tile(stretch[::EVERY], 2)
        speeds = [int(rpm[stretch == k][0]) for k in range(stretch[-1] + 1)]
        self.names = [f"{v}#{speeds[:k + 1].count(v)}" if v in speeds[:k] else str(v) for k, v in enumerate(speeds)]
        with_idling = numpy.cumsum([k > 0 and v > 0 for k, v in enumerate(speeds)])
        self.fold = with_idling[self.stretch]

    def design(self, pair, train):
        """Scaled columns; temperatures share one scale, and so do the lags of an input."""
        columns = numpy.vstack([numpy.hstack([self.x] + [of[tau] for tau in pair]) for of in self.lags])
        scale = columns[train].std(axis=0)[:self.x.shape[1]]
        scale[:len(self.sensors)] = numpy.median(scale[:len(self.sensors)])
        return columns / numpy.tile(scale, 1 + len(pair))


def path(x, y):
    """out: the ridge regression of each decay, as a function of new rows"""
    centre, mean = x.mean(axis=0), y.mean(axis=0)
    values, vectors = numpy.linalg.eigh((x - centre).T @ (x - centre) / len(x))
    seen = vectors.T @ ((x - centre).T @ (y - mean) / len(x))
    return lambda decay, rows: (rows - centre) @ (vectors @ (seen / (values[:, None] + decay))) + mean


def left(record, runs):
    """out: the largest residual of each output in these stretches, %, by maps that never saw them"""
    train = ~numpy.isin(record.stretch, [record.names.index(run) for run in runs])
    total, shares = 0.0, 0.0
    for pair in LAGS_S:
        x = record.design(pair, train)
        squares = numpy.zeros((len(DECAYS), len(OUTPUTS)))
        for fold in numpy.unique(record.fold[train]):
            inside, others = train & (record.fold == fold), train & (record.fold != fold)
            of_others = path(x[others], record.y[others])
            squares += [abs(of_others(decay, x[inside]) - record.y[inside]).max(axis=0) ** 2 for decay in DECAYS]
        of_all = path(x[train], record.y[train])
        found = numpy.array([of_all(DECAYS[g], x[~train])[:, k] for k, g in enumerate(squares.argmin(axis=0))]).T
        share = squares.min(axis=0) ** -2.0
        total, shares = total + share * found, shares + share
    return 100 * abs(total / shares - record.y[~train]).max(axis=0) / record.largest


def main():
    record = Record(sys.argv[1])
    print(f"{'left out':<12}{'compbox: ch1 … ch5':>30}{'eight maps in numpy':>32}")
    ratios = []
    for file in sorted(pathlib.Path(sys.argv[2]).glob("*.json")):
        figures = json.loads(file.read_text())["provenance"]["spindle"]["written"]["held_out"]
        ours = numpy.array([figures[name]["worst_percent_of_largest"] for name in OUTPUTS])
        other = left(record, file.stem.split(","))
        ratios.append(numpy.log(ours / other))
        print(f"{file.stem:<12}" + "".join(f"{v:6.1f}" for v in ours) + "  " + "".join(f"{v:6.1f}" for v in other))
    print("compbox leaves", ", ".join(f"{v:.2f}" for v in numpy.exp(numpy.mean(ratios, axis=0))),
          "times as much (geometric mean over the rows)")


main()
