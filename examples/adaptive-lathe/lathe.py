#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A simulated lathe over a season: records of 24 thermometers and the thermal errors of X and Z, as a probe would
see them. It shares no code with compbox.

    lathe.py SEED DAYS RECORD.csv [--every-s S]      DAYS days from June on, a row each S seconds (300)

What changes over the months, and what no thermometer shows:
- the season and each day's temperature; two shifts with random work, a coolant tank that warms up with it
- eight bodies with time constants of ten minutes to twelve hours; three of them have no thermometer of their own
- ageing: gains that change by some percent a week, and a step on one day (an adjusted guide)
- a wander that grows with the square root of time within a day, and stays bounded over weeks
"""

import argparse

import numpy as np

HOUR_S, DAY_S = 3600.0, 86400.0
THERMOMETERS = 24
WANDER_UM = {"X": 7.0, "Z": 4.0}  # each square root of an hour
WANDER_BACK_H = 7.0  # the wander's time constant
NOISE_UM, NOISE_K = 0.7, 0.06


def first_order(drive, tau_s, step_s, start):
    """A body with this time constant behind its drive."""
    share, value, out = 1.0 - np.exp(-step_s / tau_s), start, np.empty_like(drive)
    for i, x in enumerate(drive):
        value += share * (x - value)
        out[i] = value
    return out


def work_of(dice, days, step_s):
    """Spindle power and coolant of each row, 0 to 1: two shifts from 6 to 22 h, jobs of half an hour to three hours,
    pauses, no work on Sundays."""
    rows = int(days * DAY_S / step_s)
    power, coolant = np.zeros(rows), np.zeros(rows)
    for day in range(days):
        if day % 7 == 6:
            continue
        now_s, end_s = day * DAY_S + 6 * HOUR_S, day * DAY_S + 22 * HOUR_S
        while now_s < end_s:
            stop_s = min(now_s + dice.uniform(0.5, 3.0) * HOUR_S, end_s)
            rows_now = slice(int(now_s / step_s), int(stop_s / step_s))
            power[rows_now] = dice.uniform(0.1, 1.0) ** 1.5
            coolant[rows_now] = dice.random() < 0.7
            now_s = stop_s + dice.exponential(0.4) * HOUR_S
    return power, coolant


def wander(dice, rows, step_s, um):
    """A bounded random walk: sqrt-time growth within hours."""
    step_h = step_s / HOUR_S
    value, out = 0.0, np.empty(rows)
    for i, shock in enumerate(dice.standard_normal(rows)):
        value += -value * step_h / WANDER_BACK_H + um * np.sqrt(step_h) * shock
        out[i] = value
    # Nothing in a machine moves by steps: structures smooth it over twenty minutes.
    return first_order(out, 1200.0, step_s, 0.0)


def make(seed, days, step_s=300.0):
    """One machine. out: time_s, temperatures (rows x 24), errors {"X": um, "Z": um} without the probe's noise"""
    dice = np.random.default_rng(seed)
    power, coolant = work_of(dice, days, step_s)
    rows = len(power)
    time_s = np.arange(rows) * step_s
    day = time_s / DAY_S
    season = 24.0 - 7.0 * (day / 140.0) + 2.0 * np.sin(2 * np.pi * day / 23.0 + dice.uniform(0, 6))
    outside = season + 2.5 * np.sin(2 * np.pi * (day - 0.4)) + wander(dice, rows, step_s, 0.15)
    hall = first_order(outside, 2 * HOUR_S, step_s, outside[0])
    tank = first_order(hall + 7.0 * coolant * (0.4 + power), 3 * HOUR_S, step_s, hall[0])
    wash = coolant * (tank - hall)
    taus_s = np.array([600, 1500, 2400, 5400, 9000, 14400, 25000, 43200]) * dice.uniform(0.8, 1.25, 8)
    heats, washes = dice.uniform(1, 14, 8) * (taus_s < 15000), dice.uniform(0, 0.9, 8)
    bodies = np.array([first_order(hall + heats[k] * power + washes[k] * wash, taus_s[k], step_s, hall[0])
                       for k in range(8)]).T
    seen = np.column_stack([bodies[:, [0, 1, 3, 5, 6]], hall, tank])
    mix = dice.dirichlet(np.full(seen.shape[1], 0.35), THERMOMETERS)
    temperatures = seen @ mix.T + NOISE_K * dice.standard_normal((rows, THERMOMETERS))
    errors = {}
    for name, spread in (("X", 1.9), ("Z", 1.1)):
        gains = spread * dice.standard_normal(8) * np.array([1, 1, 0.5, 1, 0.5, 1, 1, 0.4])
        ageing = 1.0 + np.outer(day / 7.0, 0.015 * dice.standard_normal(8))
        error = ((bodies - 20.0) * gains * ageing).sum(axis=1)
        error += 0.15 * spread * (bodies[:, 0] - hall) ** 2 / 10.0 * dice.standard_normal()
        error += 2.0 * spread * (day > dice.uniform(0.5, 1.0) * days) * dice.choice([-1, 1])
        errors[name] = error - error[0] + wander(dice, rows, step_s, WANDER_UM[name])
    return time_s, temperatures, errors


def read_by_probe(dice, error, wrong=0.0):
    """The error with the probe's noise; a share of wrong ones by 100 um."""
    noisy = error + NOISE_UM * dice.standard_normal(len(error))
    return noisy + np.where(dice.random(len(error)) < wrong, 100.0 * dice.choice([-1, 1], len(error)), 0.0)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("seed", type=int)
    options.add_argument("days", type=int)
    options.add_argument("record")
    options.add_argument("--every-s", type=float, default=300.0)
    given = options.parse_args()
    time_s, temperatures, errors = make(given.seed, given.days, given.every_s)
    dice = np.random.default_rng(given.seed + 1000)
    probed = [read_by_probe(dice, error) for error in errors.values()]
    columns = [time_s, np.floor(time_s / DAY_S) + 1, *temperatures.T, *probed]
    names = ["time_s", "day", *(f"t{k + 1}_degC" for k in range(THERMOMETERS)), *(f"error_{n}_um" for n in errors)]
    with open(given.record, "w", encoding="utf-8") as file:
        file.write(",".join(names) + "\n")
        for row in zip(*columns):
            file.write(f"{row[0]:.0f},{row[1]:.0f}," + ",".join(f"{v:.3f}" for v in row[2:]) + "\n")


if __name__ == "__main__":
    main()
