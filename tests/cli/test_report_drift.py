# SPDX-License-Identifier: MIT
"""compbox report --drift: tables whose model has drifted on a known day, and others whose has not."""

import random

import pytest

DAY_S = 86400


def predictions(compbox, days=60, shift_day=None, shift_um=6.0, seed=1, clock="time_s", start_s=0):
    """Eight rows a day. What the model leaves: 3 um of a day, 2 um of a row; from shift_day on shift_um more."""
    dice = random.Random(seed)
    lines = [f"{clock},run,error_X_um,error_X_um_predicted"]
    for day in range(days):
        of_day = dice.gauss(0, 3) + (shift_um if shift_day is not None and day >= shift_day else 0)
        for k in range(8):
            model = dice.gauss(0, 20)
            lines.append(f"{start_s + day * DAY_S + 3600 * (8 + k)},{day},{model + of_day + dice.gauss(0, 2)},{model}")
    return compbox.write("p.csv", "\n".join(lines) + "\n")


def report(compbox, *options):
    compbox.good("report", "p.csv", "--drift", "-o", "drift.json", *options)
    return compbox.read("drift.json")["error_X_um"]


@pytest.mark.parametrize("shift_um", [8.0, -8.0])
def test_the_day_is_named(compbox, shift_um):
    """The shift is 2.7 standard deviations of a day's mean; day 31 is the first with it."""
    named = 0
    for seed in range(1, 11):
        predictions(compbox, shift_day=30, shift_um=shift_um, seed=seed)
        found = report(compbox)
        since, noticed = (int(found[key].split()[1]) for key in ("drifted_since", "noticed"))
        named += 28 <= since <= 33 and since <= noticed <= 40
        assert found["change_um"] == pytest.approx(shift_um, abs=4)
    assert named >= 9


def test_few_false_alarms(compbox):
    """Two months without drift: at most one alarm in twenty, as the CUSUM's limit promises with a known spread;
    the spread of twelve days is an estimate."""
    alarms = 0
    for seed in range(20):
        predictions(compbox, seed=100 + seed)
        alarms += report(compbox)["noticed"] is not None
    assert alarms <= 4


def test_the_table(compbox):
    predictions(compbox, days=12)
    text = compbox.good("report", "p.csv", "--drift")
    lines = text.splitlines()
    assert lines[0] == "error_X_um: 96 measurements, error less prediction"
    assert lines[2].split()[:3] == ["day", "1", "8"] and len(lines) == 2 + 12 + 1
    rows = [list(map(float, line.split(","))) for line in (compbox.folder / "p.csv").read_text().splitlines()[1:9]]
    left = [row[2] - row[3] for row in rows]
    mean, rms, _, largest = map(float, lines[2].split()[3:7])
    assert mean == pytest.approx(sum(left) / 8, abs=0.006)
    assert rms == pytest.approx((sum(x * x for x in left) / 8) ** 0.5, abs=0.006)
    assert largest == pytest.approx(max(map(abs, left)), abs=0.006)
    assert lines[-1].startswith("no drift: ") or lines[-1].startswith("the model has drifted since day ")


def test_dates_and_weeks(compbox):
    predictions(compbox, shift_day=35, clock="unix_s", start_s=1780272000, days=70)  # 2026-06-01 00:00 UTC
    assert report(compbox)["periods"][0]["period"] == "2026-06-01"
    assert report(compbox)["drifted_since"][:7] in ("2026-07",)
    weeks = report(compbox, "--weekly", "--reference", 4)
    assert len(weeks["periods"]) in (10, 11) and weeks["reference_periods"] == 4


def test_a_record_with_probes_shows_the_model_without_adaptation(compbox):
    """The probe shows 1 um all the time; the term had to take over 7 um more from day 20 on."""
    lines = ["time_s,T1,error_X_um,error_X_um_adapted,comp_X_um,probe_x,probe_x_n"]
    dice = random.Random(3)
    for hour in range(40 * 24):
        learnt = dice.gauss(0, 0.5) + (7 if hour >= 20 * 24 else 0)
        lines.append(f"{3600 * hour},20,5,{5 + learnt},{-5 - learnt},{1 + dice.gauss(0, 0.5)},{hour + 3}")
    compbox.write("record.csv", "\n".join(lines) + "\n")
    text = compbox.good("report", "record.csv", "--drift")
    assert "X: 959 measurements, left by the model, without what the probe adapted" in text
    assert "the model has drifted since day 21: noticed on day " in text
    short = [line.rsplit(",", 4)[0] + "," + ",".join(line.split(",")[4:]) for line in lines]
    compbox.write("record.csv", "\n".join(short).replace("error_X_um,comp", "other,comp") + "\n")
    text = compbox.good("report", "record.csv", "--drift")
    assert "as the probe showed it, with the compensation" in text and "\nno drift: " in text


def test_a_row_without_a_time_is_left_out(compbox):
    rows = ["" if day == 5 else f"{1780272000 + day * DAY_S}" for day in range(20)]
    compbox.write("p.csv", "unix_s,error_X_um,error_X_um_predicted\n" + "".join(f"{t},3,1\n" for t in rows))
    days = [period["period"] for period in report(compbox)["periods"]]
    assert len(days) == 19 and days[4:6] == ["2026-06-05", "2026-06-07"]


def test_the_errors_of_join(compbox):
    compbox.write("data.csv", "time_s,T1,error_X_um\n" + "".join(f"{3600 * k},{k},{k % 5}\n" for k in range(100)))
    text = compbox.good("report", "data.csv", "--drift", "--plot", "drift.svg")
    assert "error_X_um: 100 measurements, the errors themselves" in text
    assert "5 periods are too few to notice a drift (10 are needed)" in text
    assert (compbox.folder / "drift.svg").read_text().startswith("<?xml")


def test_refused(compbox):
    compbox.write("p.csv", "time_s,X\n0,1\n1,2\n")
    assert compbox.refused("report", "p.csv", "--drift") == (
        "p.csv: has neither probe columns (probe_NAME and probe_NAME_n), nor NAME_predicted beside NAME, nor "
        "error_NAME_um")
    compbox.write("p.csv", "time_s,probe_x,probe_x_n\n0,1,1\n1,2,1\n")
    assert compbox.refused("report", "p.csv", "--drift") == "p.csv: has no measurement of x"
    assert compbox("report", "p.csv", "--drift", "--after", "p.csv").returncode == 2
