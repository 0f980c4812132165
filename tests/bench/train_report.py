# SPDX-License-Identifier: MIT
"""Training a 19-20-3 network on 600 rows to the same loss, on one thread: compbox beside scipy's
L-BFGS-B with an analytic gradient, from the same random starts, and beside scikit-learn, PyTorch and FANN
where they are installed.   train_report.py TRAIN_BENCH
Fails where compbox is slower than scipy."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import importlib.util
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy
from scipy.optimize import minimize

INPUTS, HIDDEN, OUTPUTS, ROWS, NOISE = 19, 20, 3, 600, 0.05
SHAPES = [(INPUTS, HIDDEN), (HIDDEN,), (HIDDEN, OUTPUTS), (OUTPUTS,)]  # column by column, as ours
# A tenth above the noise floor, which is half the noise's square for each output: there all starts
# arrive, and luck in the last iterations does not count.
TARGET = 1.1 * 0.5 * OUTPUTS * NOISE**2
STARTS = 15


class Reached(Exception):
    pass


def rows(shape=(INPUTS, HIDDEN, OUTPUTS), count=ROWS, noise=NOISE):
    """Inputs, and what a network of the same shape makes of them, with noise."""
    inputs, hidden, outputs = shape
    dice = numpy.random.default_rng(20)
    x = dice.normal(size=(count, inputs))
    w1, w2 = dice.normal(size=(inputs, hidden)) / 4, dice.normal(size=(hidden, outputs)) / 4
    t = numpy.tanh(x @ w1 + dice.normal(size=hidden) / 2) @ w2
    return x, t + noise * dice.normal(size=t.shape)


def split(p):
    parts, at = [], 0
    for shape in SHAPES:
        size = int(numpy.prod(shape))
        parts.append(p[at:at + size].reshape(shape))
        at += size
    return parts


def loss_and_gradient(p, x, t):
    """1/(2N) sum |y - t|^2, as ours."""
    w1, b1, w2, b2 = split(p)
    h = numpy.tanh(x @ w1 + b1)
    error = h @ w2 + b2 - t
    share = error / len(x)
    back = (share @ w2.T) * (1 - h * h)
    gradient = numpy.concatenate([(x.T @ back).ravel(), back.sum(0), (h.T @ share).ravel(),
                                  share.sum(0)])
    return 0.5 * float((error * error).sum()) / len(x), gradient


def by_scipy(x, t, start):
    """Seconds, evaluations and loss to the target."""
    state = {"n": 0, "loss": None}

    def function(p):
        value, gradient = loss_and_gradient(p, x, t)
        state["n"] += 1
        state["loss"] = value
        if value <= TARGET:
            raise Reached
        return value, gradient

    began = time.perf_counter()
    try:
        minimize(function, start, jac=True, method="L-BFGS-B",
                 options={"maxiter": 20000, "maxfun": 40000, "maxcor": 20, "ftol": 0, "gtol": 0})
    except Reached:
        pass
    return time.perf_counter() - began, state["n"], state["loss"]


def by_sklearn(x, t):
    """Its own starts and L-BFGS; stopped at the iteration that reaches the target, found beforehand."""
    import warnings
    from sklearn.neural_network import MLPRegressor
    warnings.simplefilter("ignore")

    def run(seed, iterations):
        net = MLPRegressor((HIDDEN,), activation="tanh", solver="lbfgs", alpha=0, tol=0,
                           max_iter=iterations, max_fun=10**6, random_state=seed)
        began = time.perf_counter()
        net.fit(x, t)
        took = time.perf_counter() - began
        return took, 0.5 * float(((net.predict(x) - t) ** 2).sum()) / len(x)

    def first(seed):
        low, high = 0, 100
        while run(seed, high)[1] > TARGET and high < 5000:
            low, high = high, high * 2
        while high - low > 10:
            middle = (low + high) // 2
            low, high = (low, middle) if run(seed, middle)[1] <= TARGET else (middle, high)
        return high

    done = []
    for seed in range(1, 6):
        iterations = first(seed)
        took, loss = run(seed, iterations)
        done.append((took, iterations, loss))
    return sorted(done)[len(done) // 2]


def by_torch(x, t, start):
    import torch
    torch.set_num_threads(1)
    xs, ts = torch.tensor(x), torch.tensor(t)

    def run():
        w1, b1, w2, b2 = [torch.tensor(part.copy(), requires_grad=True) for part in split(start)]
        optimiser = torch.optim.LBFGS([w1, b1, w2, b2], max_iter=5000, max_eval=20000,
                                      history_size=20, tolerance_grad=0, tolerance_change=0,
                                      line_search_fn="strong_wolfe")
        state = {"n": 0, "loss": None}

        def closure():
            optimiser.zero_grad()
            error = torch.tanh(xs @ w1 + b1) @ w2 + b2 - ts
            loss = 0.5 * (error * error).sum() / len(x)
            loss.backward()
            state["n"] += 1
            state["loss"] = float(loss)
            if state["loss"] <= TARGET:
                raise Reached
            return loss

        began = time.perf_counter()
        try:
            optimiser.step(closure)
        except Reached:
            pass
        return time.perf_counter() - began, state["n"], state["loss"]

    times = [run() for _ in range(3)]
    return statistics.median(one[0] for one in times), times[0][1], times[0][2]


def by_fann(x, t):
    from fann2 import libfann
    net = libfann.neural_net()
    net.create_standard_array([INPUTS, HIDDEN, OUTPUTS])
    net.set_activation_function_hidden(libfann.SIGMOID_SYMMETRIC)
    net.set_activation_function_output(libfann.LINEAR)
    net.set_training_algorithm(libfann.TRAIN_RPROP)
    data = libfann.training_data()
    data.set_train_data(x.tolist(), t.tolist())
    began = time.perf_counter()
    epochs, loss = 0, 1e9
    while loss > TARGET and epochs < 20000:
        net.train_epoch(data)
        loss = 0.5 * OUTPUTS * net.get_MSE()  # mean over outputs and rows
        epochs += 1
    return time.perf_counter() - began, epochs, loss


def ours_on(program, folder, data, target, seed, way, shape):
    """What train_bench says of these rows."""
    file = pathlib.Path(folder, "rows.f64")
    data.tofile(file)
    return json.loads(subprocess.run(
        [program, file, str(target), str(seed), pathlib.Path(folder, "start.f64"), way,
         *map(str, shape)], check=True, stdout=subprocess.PIPE).stdout)


def compare_ways(program, folder):
    """L-BFGS beside Levenberg-Marquardt, from the same starts: how many arrive, and how soon."""
    print("\nL-BFGS beside Levenberg-Marquardt: starts that reach 1.1 of the noise floor, median of their times")
    for shape, count, noise, starts in (((6, 8, 2), 300, NOISE, 8), ((6, 8, 2), 300, 0.001, 8),
                                        ((INPUTS, HIDDEN, OUTPUTS), ROWS, NOISE, 3)):
        x, t = rows(shape, count, noise)
        target = 1.1 * 0.5 * shape[2] * noise**2
        found = {way: [ours_on(program, folder, numpy.hstack([x, t]), target, seed, way, shape)
                       for seed in range(1, starts + 1)] for way in ("lbfgs", "lm")}
        text = []
        for way, runs in found.items():
            there = sorted(run["seconds"] for run in runs if run["loss"] <= target)
            took = f"{1000 * statistics.median(there):8.1f} ms" if there else f"{'-':>11}"
            text.append(f"{way} {len(there)} of {len(runs)} {took}")
        print(f"  {'-'.join(map(str, shape)):<8} on {count} rows, noise {noise:<6g}  " + "   ".join(text))


def show(name, seconds, steps, loss, ours):
    print(f"{name:<34}{1000 * seconds:>10.1f} ms {steps:>7} {loss:>12.6f} {seconds / ours:>8.2f}")


def main(program):
    x, t = rows()
    with tempfile.TemporaryDirectory() as folder:
        start = pathlib.Path(folder, "start.f64")
        theirs, ours = [], []
        for seed in range(1, STARTS + 1):  # by turns, so that a busy machine hits both
            done = ours_on(program, folder, numpy.hstack([x, t]), TARGET, seed, "lbfgs",
                           (INPUTS, HIDDEN, OUTPUTS))
            ours.append((done["seconds"], done["evaluations"], done["loss"]))
            # Their layout is row by row with inputs first, ours column by column with units first:
            # the same numbers in the same order.
            begin = numpy.fromfile(start)
            theirs.append(by_scipy(x, t, begin))
    # Start by start, because some starts are longer ways for both.
    ratio = statistics.geometric_mean(t[0] / o[0] for o, t in zip(ours, theirs))
    ours, theirs = sorted(ours)[STARTS // 2], sorted(theirs)[STARTS // 2]
    mine = ours[0]
    print(f"19-20-3 on {ROWS} rows to a loss of {TARGET:g} (1.1 of the noise floor), one thread, median of "
          f"several starts\n{'':<34}{'time':>13} {'steps':>7} {'loss':>12} {'ratio':>8}")
    show("compbox (Ceres L-BFGS)", *ours, mine)
    show("scipy L-BFGS-B, analytic gradient", *theirs, mine)
    for name, module, run in (("scikit-learn MLPRegressor lbfgs", "sklearn", lambda: by_sklearn(x, t)),
                              ("PyTorch LBFGS", "torch", lambda: by_torch(x, t, begin)),
                              ("FANN RPROP", "fann2", lambda: by_fann(x, t))):
        if importlib.util.find_spec(module) is None:
            print(f"{name}: not installed, skipped")
        else:
            show(name, *run(), mine)
    print(f"scipy's time over ours, start by start, geometric mean of {STARTS}: {ratio:.2f}")
    with tempfile.TemporaryDirectory() as folder:
        compare_ways(program, folder)
    if ours[2] > TARGET or theirs[2] > TARGET:
        sys.exit("the target was not reached")
    if ratio < 1.0:
        sys.exit("compbox is slower than scipy")


main(sys.argv[1])
