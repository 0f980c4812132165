# SPDX-License-Identifier: MIT
"""What compbox leaves of recorded errors, beside peers, days or runs left out: a results page.
    real_data.py COMPBOX DIR [--write PAGE.md] [--folds N] [--script NAME]
DIR has records, *.csv, and may have record.json (docs/real-data.md)."""

import argparse
import fnmatch
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

try:
    from sklearn.neural_network import MLPRegressor
except ImportError:
    MLPRegressor = None

LAGS_S = (600.0, 3600.0, 10800.0)  # of the peers' inputs
DECAYS = np.power(10.0, np.arange(-4.0, 3.1, 0.5))
USUAL_MINUTES = [30, 60, 120]


def read_table(path):
    """out: names and columns: numbers, or texts where a cell is none"""
    lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line and not line.startswith("#")]
    names = [name.strip() for name in lines[0].split(",")]
    cells = list(zip(*(line.split(",") for line in lines[1:])))
    table = {}
    for name, column in zip(names, cells):
        try:
            table[name] = np.array(column, dtype=float)
        except ValueError:
            table[name] = np.array(column)
    return table


def names_of_runs(values):
    """The runs of each row as `compbox train` names them: a value that comes back is another run."""
    met, names, last = {}, [], None
    for value in values:
        if value != last:
            met[value] = met.get(value, 0) + 1
            text = f"{value:g}" if isinstance(value, float) else str(value)
            name = text if met[value] == 1 else f"{text}#{met[value]}"
        names.append(name)
        last = value
    return np.array(names)


def lagged(time_s, values, tau_s):
    """A first-order lag that starts settled; inputs are straight lines from row to row."""
    out = np.empty_like(values)
    out[0] = values[0]
    for i in range(1, len(values)):
        step = time_s[i] - time_s[i - 1]
        share = np.exp(-step / tau_s) if step > 0 else 0.0
        part = tau_s / step * (1.0 - share) if step > 0 else 0.0
        out[i] = share * out[i - 1] + (1.0 - part) * values[i] + (part - share) * values[i - 1]
    return out


def features(table, inputs):
    columns = []
    for name in inputs:
        speed = any(word in name.lower() for word in ("rpm", "speed", "drehzahl"))
        for power in (1, 2, 3) if speed else (1,):
            value = table[name]**power
            columns += [value, *(lagged(table["time_s"], value, tau) for tau in LAGS_S)]
    x = np.column_stack(columns)
    return (x - x.mean(axis=0)) / np.maximum(x.std(axis=0), 1e-9)


def ridge(x, y, decay):
    mean, level = x.mean(axis=0), y.mean(axis=0)
    square = (x - mean).T @ (x - mean) / len(x) + decay * np.eye(x.shape[1])
    weights = np.linalg.solve(square, (x - mean).T @ (y - level) / len(x))
    return lambda some: (some - mean) @ weights + level


def by_ridge(x, y, runs, learn, test):
    """Ridge regression over the lagged inputs; the decay by leaving out groups of runs of the rows to learn from."""
    groups = np.array_split(list(dict.fromkeys(runs[learn])), 5)
    squares = np.zeros(len(DECAYS))
    for group in groups:
        out = learn & np.isin(runs, group)
        if not out.any() or not (learn & ~out).any():
            continue
        for k, decay in enumerate(DECAYS):
            squares[k] += np.sum((ridge(x[learn & ~out], y[learn & ~out], decay)(x[out]) - y[out])**2)
    return ridge(x[learn], y[learn], DECAYS[np.argmin(squares)])(x[test])


def by_network(x, y, learn, test):
    """scikit-learn's MLP, the mean of five starts; each stops early by a tenth of the rows."""
    scale = y[learn].std(axis=0)
    rows = np.flatnonzero(learn)[::max(1, learn.sum() // 6000)]
    total = 0.0
    for seed in range(5):
        net = MLPRegressor(hidden_layer_sizes=(24,), alpha=1.0, early_stopping=True, max_iter=300, random_state=seed)
        target = y[rows] / scale
        net.fit(x[rows], target if target.shape[1] > 1 else target.ravel())
        total = total + net.predict(x[test]).reshape(test.sum(), -1)
    return total / 5 * scale


def by_compbox(compbox, path, task, held):
    """out: the figures of the runs held out, by output (provenance of the term)"""
    with tempfile.TemporaryDirectory() as folder:
        term = f"{folder}/term.json"
        command = [compbox, "train", path, "--outputs", ",".join(task["outputs"]), "--run-column", task["run_column"],
                   "--name", "net", "--accept-worse", "--simulate-probes", ",".join(map(str, task["probe_minutes"])),
                   "--hold-out", ",".join(held), "-o", term, *task["options"]]
        if task["inputs"]:
            command += ["--inputs", ",".join(task["inputs"])]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"real-data: {done.stderr.strip()}")
        return json.loads(pathlib.Path(term).read_text(encoding="utf-8"))["provenance"]["net"]["probes"]


def task_of(folder, path, table):
    """What record.json states, completed."""
    stated = folder / "record.json"
    task = json.loads(stated.read_text(encoding="utf-8")) if stated.exists() else {}
    patterns = task.get("outputs", ["error_*_um"])
    task["outputs"] = [name for name in table if any(fnmatch.fnmatch(name, one) for one in patterns)]
    if not task["outputs"]:
        sys.exit(f"real-data: {path}: no column is called {' or '.join(patterns)}; name the errors in record.json")
    if "run_column" not in task:
        task["run_column"] = next((name for name in ("day", "run") if name in table), "")
    if task["run_column"] not in table:
        sys.exit(f"real-data: {path}: no column distinguishes days or runs: add a column day or run")
    task.setdefault("inputs", [])
    task.setdefault("probe_minutes", USUAL_MINUTES)
    task.setdefault("options", [])
    task.setdefault("title", path.stem)
    return task


def folds_of(runs, task, count):
    """Groups of runs that are left out together: those of record.json, else stretches of the record in time."""
    if "hold_out" in task:
        return task["hold_out"]
    names = list(dict.fromkeys(runs))
    if len(names) < 3:
        sys.exit("real-data: fewer than three days or runs: nothing can be left out")
    return [list(map(str, group)) for group in np.array_split(names, min(count, len(names)))]


class Sums:
    """rms and largest of several parts."""

    def __init__(self):
        self.squares, self.rows, self.largest = 0.0, 0, 0.0

    def add(self, rms, largest, rows):
        self.squares, self.rows, self.largest = self.squares + rows * rms**2, self.rows + rows, max(self.largest,
                                                                                                   largest)

    def text(self):
        return f"{(self.squares / self.rows)**0.5:.2f} / {self.largest:.1f}" if self.rows else "–"


def judge(compbox, path, task, table, folds):
    """out: {row of the table: {output: Sums}}"""
    runs = names_of_runs(table[task["run_column"]])
    y = np.column_stack([table[name] for name in task["outputs"]])
    skip = {"time_s", "unix_s", task["run_column"], "day", "run", *task["outputs"]}
    skip |= {name for name in table if name.endswith(("_um", "_urad"))}
    patterns = task["inputs"]
    speed_is_run = any(word in task["run_column"].lower() for word in ("rpm", "speed", "drehzahl"))
    inputs = [name for name in table if table[name].dtype == float and table[name].std() > 0 and (
        any(fnmatch.fnmatch(name, one) for one in patterns) if patterns else
        name not in skip or (speed_is_run and name == task["run_column"]))]
    x = features(table, inputs)
    results = {}

    def note(row, output, rms, largest, rows):
        results.setdefault(row, {}).setdefault(output, Sums()).add(rms, largest, rows)

    for held in folds:
        test = np.isin(runs, held)
        found = by_compbox(compbox, path, task, held)
        peers = {"ridge with lags": by_ridge(x, y, runs, ~test, test)}
        if MLPRegressor is not None:
            peers["MLP with lags (scikit-learn)"] = by_network(x, y, ~test, test)
        for k, output in enumerate(task["outputs"]):
            figures, rows = found[output], int(test.sum())

            def own(row, part, output=output, rows=rows):
                note(row, output, part["rms_um"], part["largest_um"], rows)

            own("nothing", figures["nothing"])
            for name, predicted in peers.items():
                left = np.abs(predicted[:, k] - y[test, k])
                note(name, output, float(np.sqrt(np.mean(left**2))), float(left.max()), rows)
            own("compbox, offline", figures["model"])
            for one in figures["probed"]:
                every = f"{one['interval_min']:g} min"
                own(f"re-zero by a probe every {every}", one["rezero"])
            for one in figures["probed"]:
                every = f"{one['interval_min']:g} min"
                own(f"**compbox, adapted**, a probe every {every}", one["adapted"])
                own(f"the same, 5 % of the probes wrong by 100 µm, {every}", one["adapted_5_percent_wrong"])
        print(f"  {path.name}: {', '.join(held)} left out", file=sys.stderr)
    return results


def section(path, task, table, folds, results):
    outputs = task["outputs"]
    lines = [f"## {task['title']}", ""]
    if "source" in task:
        lines += [task["source"], ""]
    groups = "; ".join(f"{group[0]} to {group[-1]}" if len(group) > 2 else " and ".join(group) for group in folds)
    lines += [f"{len(table['time_s'])} rows of {path.name}, errors {', '.join(outputs)}. Runs are distinguished by "
              f"`{task['run_column']}`. Left out together: {groups}.", "",
              "rms / largest of all rows left out, µm:", "",
              "| | " + " | ".join(outputs) + " |", "|---" * (len(outputs) + 1) + "|"]
    order = sorted(results, key=lambda row: ("nothing" not in row, "ridge" not in row, "MLP" not in row,
                                             "offline" not in row, "re-zero" not in row))
    lines += [f"| {row} | " + " | ".join(results[row][name].text() for name in outputs) + " |" for row in order]
    if MLPRegressor is None:
        lines += ["", "scikit-learn was not installed, so its network is missing."]
    return lines + [""]


HEAD = """# Recorded errors: what is left

`scripts/real-data {folder}` makes this page.
[real-data.md](../real-data.md) has the format of the folder and the method. Every figure is of rows whose day or run
the model has not seen. The peers get the same rows and the same inputs with lags of 10 min, 1 h and 3 h. Probed rows
are simulated from the record, with the box's own filter, a fresh box at each stretch left out, and no repetition of a
doubtful probe.
"""


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("compbox")
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--write", type=pathlib.Path, help="the page (printed without it)")
    options.add_argument("--folds", type=int, default=5, help="groups of days or runs left out (5)")
    given = options.parse_args()
    records = sorted(given.folder.glob("*.csv"))
    if not records:
        sys.exit(f"real-data: {given.folder} has no *.csv")
    lines = HEAD.format(folder=given.folder).splitlines() + [""]
    for path in records:
        table = read_table(path)
        if "time_s" not in table:
            sys.exit(f"real-data: {path}: has no column time_s")
        task = task_of(given.folder, path, table)
        folds = folds_of(names_of_runs(table[task["run_column"]]), task, given.folds)
        lines += section(path, task, table, folds, judge(given.compbox, path, task, table, folds))
    text = "\n".join(lines).rstrip() + "\n"
    if given.write:
        given.write.write_text(text, encoding="utf-8")
    else:
        print(text, end="")


if __name__ == "__main__":
    main()
