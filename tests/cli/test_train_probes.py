# SPDX-License-Identifier: MIT
"""compbox train --simulate-probes and --adapt on the records of a simulated lathe (examples/adaptive-lathe)."""

import math
import sys

import numpy as np
import pytest

from conftest import PLC, ROOT

sys.path.insert(0, str(ROOT / "examples/adaptive-lathe"))
import lathe  # noqa: E402  (pylint: disable=wrong-import-position)

STEP_S, DAYS = 600.0, 16
OUTPUTS = ("error_X_um", "error_Z_um")
TRAIN = ("train", "lathe.csv", "--outputs", ",".join(OUTPUTS), "--run-column", "day", "--hidden", "0", "--name", "net",
         "-o", "net.json")


@pytest.fixture(scope="module", name="record")
def record_of_a_lathe():
    """One lathe: the CSV's text, and its columns of errors as printed there."""
    time_s, temperatures, errors = lathe.make(5, DAYS, STEP_S)
    dice = np.random.default_rng(1)
    probed = [np.round(lathe.read_by_probe(dice, error), 3) for error in errors.values()]
    names = ["time_s", "day", *(f"t{k}_degC" for k in range(1, 7)), *OUTPUTS]
    table = np.column_stack([time_s, time_s // 86400 + 1, temperatures[:, :6], *probed])
    text = ",".join(names) + "\n"
    text += "".join(f"{row[0]:.0f},{row[1]:.0f}," + ",".join(f"{v:.3f}" for v in row[2:]) + "\n" for row in table)
    return text, probed


def rms(values):
    return math.sqrt(float(np.mean(np.square(values))))


def rezeroed(error, interval_s):
    """What is left where the last measurement is the compensation; the first one an interval after the start."""
    every, left, known = int(interval_s / STEP_S), [], 0.0
    for row, value in enumerate(error):
        left.append(value - known)
        if row > 0 and row % every == 0:
            known = value
    return left


def test_what_a_probe_buys(compbox, record):
    text, probed = record
    compbox.write("lathe.csv", text)
    out = compbox.good(*TRAIN, "--simulate-probes", "30,60,120")
    assert "What a probe would buy, on runs left out of training (um)" in out
    fragment = compbox.read("net.json")
    assert [term["type"] for term in fragment["terms"]] == ["linear"]  # nothing was asked to be written
    for name, error in zip(OUTPUTS, probed):
        found = fragment["provenance"]["net"]["probes"][name]
        assert found["nothing"]["rms_um"] == pytest.approx(rms(error), rel=1e-3)
        assert found["nothing"]["largest_um"] == pytest.approx(np.abs(error).max(), rel=1e-3)
        assert found["model"]["rms_um"] < found["nothing"]["rms_um"]
        assert [one["interval_min"] for one in found["probed"]] == [30, 60, 120]
        before = 0.0
        for one in found["probed"]:
            left = rezeroed(error, 60 * one["interval_min"])
            assert one["rezero"]["rms_um"] == pytest.approx(rms(left), rel=1e-3)
            adapted = one["adapted"]["rms_um"]
            assert before < adapted < min(one["rezero"]["rms_um"], found["model"]["rms_um"])
            assert adapted <= one["adapted_5_percent_wrong"]["rms_um"] < 1.3 * adapted
            assert 0.88 < one["within_two_sigma"] < 0.99
            before = adapted


def test_the_terms(compbox, record):
    compbox.write("lathe.csv", record[0])
    out = compbox.good(*TRAIN, "--adapt")
    assert "term error_X_um_adapted of error_X_um, probe probe_x and probe_x_n" in out
    model, x, z = compbox.read("net.json")["terms"]
    assert model["outputs"] == list(OUTPUTS)
    assert (x["name"], x["type"], x["of"]) == ("error_X_um_adapted", "adapt", "error_X_um")
    assert x["probe"] == {"value": "probe_x", "count": "probe_x_n"}
    assert z["of"] == "error_Z_um"
    largest = np.abs(record[1][0]).max()
    assert 5 < x["bias_max_um"] < 1.5 * largest and 0.1 <= x["gain_max"] <= 0.5
    # The wander that made the errors is 7 um an hour's root, smoothed, and there is what no model explains.
    assert 3 < x["drift_um_per_sqrt_h"] < 12 and 0.5 <= x["sigma_um"] < 3
    assert x["step_max_um"] > 1.5 * x["drift_um_per_sqrt_h"] and x["min_interval_s"] == 60


def test_named_signals_and_a_known_sigma(compbox, record):
    compbox.write("lathe.csv", record[0])
    compbox.good(*TRAIN, "--adapt", "--probe-value", "px,pz", "--probe-count", "nx,nz", "--probe-whole",
                 "--probe-sigma-um", 2)
    _, x, z = compbox.read("net.json")["terms"]
    assert x["probe"] == {"value": "px", "count": "nx"} and z["probe"]["count"] == "nz"
    assert x["measures"] == z["measures"] == "whole"
    assert x["sigma_um"] == z["sigma_um"] == 2


def test_runs_held_out_are_what_is_judged(compbox, record):
    compbox.write("lathe.csv", record[0])
    out = compbox.good(*TRAIN, "--adapt", "--hold-out", "13,14,15,16")
    assert "What a probe would buy, on runs held out (um)" in out
    found = compbox.read("net.json")["provenance"]["net"]["probes"]["error_X_um"]
    late = record[1][0][int(12 * 86400 / STEP_S):]
    assert found["nothing"]["rms_um"] == pytest.approx(rms(late), rel=1e-3)
    assert found["probed"][1]["adapted"]["rms_um"] < 0.7 * found["model"]["rms_um"]


def test_days_with_a_clock_of_their_own(compbox, record):
    """Each day begins at 0 s: the box starts anew, without bias."""
    lines = record[0].splitlines()
    rows = [line.split(",", 1) for line in lines[1:]]
    compbox.write("lathe.csv", "\n".join([lines[0], *(f"{float(t) % 86400},{rest}" for t, rest in rows)]) + "\n")
    compbox.good(*TRAIN, "--simulate-probes", 60)
    found = compbox.read("net.json")["provenance"]["net"]["probes"]["error_X_um"]
    per_day = [rezeroed(day, 3600) for day in record[1][0].reshape(DAYS, -1)]
    assert found["probed"][0]["rezero"]["rms_um"] == pytest.approx(rms(np.concatenate(per_day)), rel=1e-3)


def lagged(times_s, x, tau_s):
    """A first-order lag that starts settled, of an input that is straight from row to row."""
    y = [x[0]]
    for k in range(1, len(x)):
        share = math.exp(-(times_s[k] - times_s[k - 1]) / tau_s)
        ramp = 1 - tau_s / (times_s[k] - times_s[k - 1]) * (1 - share)
        y.append(share * y[-1] + (1 - share) * x[k - 1] + ramp * (x[k] - x[k - 1]))
    return np.array(y)


def places(model, times_s, inputs):
    """z of each row along the directions of the model's sigma: its columns are inputs with time constants."""
    columns = [lagged(times_s, x, tau_s) if tau_s else x for x in inputs for tau_s in model["bank"]["tau_s"]]
    sigma = model["sigma"]
    return np.array(columns).T @ np.array(sigma["directions"]).T + np.array(sigma["offsets"])


def kalman(rows, term, floor_um, along_um):
    """The term by a filter of its own, in double precision: rows of (time_s, model, place, probed or None).
    out: term, and its standard deviation, behind each row"""
    state, cov, known = np.zeros(2), np.diag([1.0, 0.25]), None
    drift = np.diag([term["drift_um_per_sqrt_h"]**2, term["gain_drift_per_sqrt_h"]**2])
    most = np.array([term["bias_max_um"], term["gain_max"]])
    left, before = [], rows[0][0]
    for time_s, m, place, probed in rows:
        cov = cov + drift * (time_s - before) / 3600
        before = time_s
        h = np.array([1.0, m])
        wider = np.zeros((2, 2))  # what the model's own sigma adds to the variance of b
        if known is None:
            of_b = cov[0, 0] - cov[0, 1]**2 / cov[1, 1]
            wider[0, 0] = max(0, floor_um**2 + along_um**2 * place @ place - of_b)
        else:
            wider[0, 0] = along_um**2 * (place - known) @ (place - known)
        if probed is not None:
            cov, wider, known = cov + wider, 0 * wider, place
            s = h @ cov @ h + term["sigma_um"]**2
            innovation = probed - m - h @ state
            assert abs(innovation) < 3 * math.sqrt(s), "the test is about probes inside of the gate"
            by = np.clip(state + cov @ h * innovation / s, -most, most) - state
            part = min(1.0, term["step_max_um"] / abs(h @ by))
            state = state + part * by
            # A shorter step tells less: P - part (2 - part) K S K'.
            cov = cov - part * (2 - part) * np.outer(cov @ h, cov @ h) / s
        left.append((m + state[0] + state[1] * m, math.sqrt(h @ (cov + wider) @ h)))
    return np.array(left).T


def lathe_machine(compbox, probes):
    """machine.json with six thermometers and perhaps the probes. out: the signals behind X and Z"""
    compbox.good("init", *PLC, "--axes", "XZ", "--profile", "generic", "--travel", "X=500,Z=900", "-o", "machine.json")
    machine = compbox.read("machine.json")
    wanted = [(f"t{k}_degC", "degC", "int16", 0.01, -50, 150) for k in range(1, 7)]
    for name in ("probe_x", "probe_z") if probes else ():
        wanted += [(name, "um", "int16", 0.01, -320, 320), (f"{name}_n", "1", "uint16", 1, 0, 65535)]
    for name, unit, kind, scale, least, most in wanted:
        machine["signals"].append({"name": name, "unit": unit, "plc": machine["plc"]["read"]["count"], "type": kind,
                                   "scale": scale, "min": least, "max": most})
        machine["plc"]["read"]["count"] += 1
    compbox.write("machine.json", machine)
    return wanted


def slower(compbox):
    """A period of half a second: rows are minutes apart, so nothing is lost."""
    machine = compbox.read("machine.json")
    machine["cycle"]["period_ms"] = 500
    machine["plc"]["heartbeat_timeout_ms"] = 5000
    compbox.write("machine.json", machine)


def test_the_box_adapts_as_written(compbox, record):
    """train, build, eval: a machine file with thermometers and probes, and a day that `train` has not seen."""
    compbox.write("lathe.csv", record[0])
    compbox.good(*TRAIN, "--adapt", "--probe-whole", "--hold-out", "16")
    wanted = lathe_machine(compbox, probes=True)
    slower(compbox)
    out = compbox.good("build", "machine.json", "net.json", "-o", "c.json")
    assert "channel X = -(error_X_um_adapted)" in out and "channel Z = -(error_Z_um_adapted)" in out
    lines = [list(map(float, line.split(","))) for line in record[0].splitlines()[1:]]
    day = [line for line in lines if line[1] == 16][::2]  # a row each 20 minutes
    samples, probed = [["time_s", "X", "Z", *(name for name, *_ in wanted)]], []
    shown, count = [0.0, 0.0], 7
    for row, line in enumerate(day):
        due = row > 0 and row % 3 == 0
        if due:
            shown, count = line[8:10], count + 1
        probed.append(shown if due else None)
        samples.append([line[0], 200, 400, *line[2:8], shown[0], count, shown[1], count])
    compbox.write("s.csv", "\n".join(",".join(map(str, row)) for row in samples) + "\n")
    compbox.good("eval", "c.json", "--inputs", "s.csv", "--sigma", "-o", "out.csv")
    table = compbox.table("out.csv")
    of = compbox.read("net.json")["terms"][0]
    place = places(of, [line[0] for line in day], np.array(day).T[2:8])
    for k, name in enumerate(OUTPUTS):
        term = compbox.read("net.json")["terms"][1 + k]
        model, adapted = np.array(table[name]), np.array(table[name + "_adapted"])
        floor_um, along_um = of["sigma"]["floor_um"][k], of["sigma"]["along_um"][k]
        assert np.array(table["sigma_" + name]) == pytest.approx(
            np.sqrt(floor_um**2 + along_um**2 * (place**2).sum(axis=1)), rel=1e-3)
        own, sigma = kalman([(line[0], m, z, p and p[k]) for line, m, z, p in zip(day, model, place, probed)], term,
                            floor_um, along_um)
        # The row of a probe shows the term one cycle behind: it follows at ramp_um_per_s.
        quiet = [row for row, p in enumerate(probed) if p is None]
        assert adapted[quiet] == pytest.approx(own[quiet], abs=0.05)
        assert np.array(table[f"sigma_{name}_adapted"])[1:] == pytest.approx(sigma[1:], rel=0.01)
        assert (np.abs(adapted - model) <= term["bias_max_um"] + term["gain_max"] * np.abs(model)).all()
        errors = np.array([line[8 + k] for line in day])
        assert rms((errors - adapted)[4:]) < 0.8 * rms((errors - model)[4:])
        # The channel's slew is 15 um in a cycle, and the first cycle of a row is what eval prints.
        off = np.abs(np.array(table[f"comp_{'XZ'[k]}_um"]) + adapted)
        assert np.median(off) < 0.01 and (off[quiet] > 0.01).sum() <= 3


def test_the_sigma_of_a_bank(compbox, record):
    """eval --sigma: two sigmas hold the errors of days that were not trained on, and far from all that was trained
    sigma is larger."""
    compbox.write("lathe.csv", record[0])
    compbox.good(*TRAIN, "--hold-out", "14,15,16")
    stated = compbox.read("net.json")["terms"][0]["sigma"]
    lathe_machine(compbox, probes=False)
    slower(compbox)
    compbox.good("build", "machine.json", "net.json", "-o", "c.json")
    lines = [list(map(float, line.split(","))) for line in record[0].splitlines()[1:]]
    late = [line for line in lines if line[1] >= 14]

    def sigma_at(warmer_K):
        samples = [",".join(["time_s,X,Z", *(f"t{k}_degC" for k in range(1, 7))])]
        samples += [",".join(map(str, [line[0], 200, 400, *(t + warmer_K for t in line[2:8])])) for line in late]
        compbox.write("s.csv", "\n".join(samples) + "\n")
        compbox.good("eval", "c.json", "--inputs", "s.csv", "--raw", "--sigma", "-o", "out.csv")
        return compbox.table("out.csv")

    table, far = sigma_at(0), sigma_at(12)
    for k, name in enumerate(OUTPUTS):
        left = np.abs([line[8 + k] - m for line, m in zip(late, table[name])])
        sigma = np.array(table[f"sigma_{name}"])
        assert (sigma >= 0.999 * stated["floor_um"][k]).all()
        assert np.mean(left <= 2 * sigma) > 0.85
        assert np.median(far[f"sigma_{name}"]) > 1.1 * np.median(sigma)
        assert table[f"sigma_comp_{'XZ'[k]}_um"] == pytest.approx(list(sigma), rel=1e-4)


def test_refused(compbox, record):
    lines = record[0].splitlines()
    compbox.write("lathe.csv", "\n".join(lines[:200]) + "\n")
    short = TRAIN[:4] + TRAIN[6:]
    assert compbox.refused(*short, "--accept-worse", "--simulate-probes", 120) == (
        "lathe.csv: has room for 16 probes at one in 120 min; simulated probes need 20: record for longer, or choose "
        "shorter intervals")
    compbox.write("lathe.csv", "\n".join(line.split(",", 1)[1] for line in lines) + "\n")
    assert compbox.refused(*TRAIN, "--simulate-probes", 60) == (
        "lathe.csv: has no time, which simulated probes need: name its column with --time-column")
    compbox.write("lathe.csv", record[0])
    assert compbox.refused(*TRAIN, "--adapt", "--probe-value", "px") == (
        "--probe-value: names 1 signals for 2 outputs: give one for each, in the order of --outputs")
    assert "cannot use the name 'p x'" in compbox.refused(*TRAIN, "--adapt", "--probe-value", "p x,pz")


@pytest.mark.parametrize("options", [("--probe-value", "a,b"), ("--probe-whole",), ("--probe-sigma-um", 1),
                                     ("--simulate-probes", "60,30"), ("--simulate-probes", 0)])
def test_wrong_usage(compbox, record, options):
    compbox.write("lathe.csv", record[0])
    assert compbox(*TRAIN, *options).returncode == 2
