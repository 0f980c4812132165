# SPDX-License-Identifier: MIT
"""compbox join: a recording as compboxd writes it and probed errors to rows for training. The
machine's own error is known here; the probe saw it with the compensation on top."""

import json

import pytest

PERIOD = 0.03


def position(t):
    """A staircase: 2 s at a place, 1 s to the next one 100 mm on."""
    step, within = divmod(t, 3.0)
    return 100 * step + (0 if within < 2 else 100 * (within - 2))


def temperature(t):
    return 20 + 0.1 * t


def compensation(t):
    return -(0.02 * position(t) + 0.5 * (temperature(t) - 20))


def machine_error(t):
    return 0.025 * position(t) + 0.6 * (temperature(t) - 20)


def record(compbox, seconds=30, blind_s=0.0, name="record.csv"):
    """T1 was not received in the first blind_s seconds: its cells are empty."""
    lines = ["time_s,X,T1,EXX,comp_X_um,mode,reason,unix_s"]
    for k in range(int(seconds / PERIOD)):
        t = k * PERIOD
        warm = "" if t < blind_s else repr(temperature(t))
        lines.append(f"{t!r},{position(t)!r},{warm},1.5,{compensation(t)!r},1,0,{1700000000 + t!r}")
    compbox.write(name, "\n".join(lines) + "\n")


def probe(compbox, times, header="time_s,error_X_um", offset=0.0, first=None):
    rows = [header]
    for t in times:
        key = t - offset if first is None else first(t)
        rows.append(f"{key!r},{machine_error(t) + compensation(t)!r}")
    compbox.write("probe.csv", "\n".join(rows) + "\n")


def test_by_time(compbox):
    record(compbox)
    times = [1.0, 4.111, 7.5, 28.77]
    probe(compbox, times)
    out = compbox.good("join", "record.csv", "probe.csv", "-o", "data.csv")
    assert out == ("4 rows, matched by time: data.csv\n"
                   "outputs of terms left out: EXX (--signals takes what it names)\n")
    data = compbox.table("data.csv")
    assert list(data) == ["time_s", "X", "T1", "error_X_um"]
    for i, t in enumerate(times):
        assert data["time_s"][i] == pytest.approx(t, abs=1e-9)
        assert data["X"][i] == pytest.approx(position(t), abs=1e-6)
        assert data["T1"][i] == pytest.approx(temperature(t), abs=1e-9)
        assert data["error_X_um"][i] == pytest.approx(machine_error(t), abs=1e-6)


def test_two_clocks_chosen_signals_and_json(compbox):
    record(compbox)
    probe(compbox, [1.5, 4.5], offset=1000.0)
    done = json.loads(compbox.good("join", "record.csv", "probe.csv", "--time-offset-s", 1000,
                                   "--signals", "T1,X", "--json", "-o", "data.csv"))
    assert done["columns"] == ["time_s", "T1", "X", "error_X_um"] and done["rows"] == 2
    assert compbox.table("data.csv")["error_X_um"] == pytest.approx([machine_error(t) for t in (1.5, 4.5)])


def test_by_position_takes_the_middle_of_each_dwell(compbox):
    record(compbox)
    middles = [1.0, 4.0, 7.0]  # dwells from 0 to 2 s, 3 to 5 s …
    probe(compbox, middles, "X,error_X_um", first=position)
    out = compbox.good("join", "record.csv", "probe.csv", "-o", "data.csv")
    assert out.startswith("3 rows, matched by position")
    data = compbox.table("data.csv")
    assert data["time_s"] == pytest.approx(middles, abs=0.05)
    assert data["X"] == [0, 100, 200]
    assert data["error_X_um"] == pytest.approx([machine_error(t) for t in middles], abs=0.01)


def test_runs_are_kept_and_compensated_errors_too_where_asked(compbox):
    record(compbox)
    compbox.write("probe.csv", "run,time_s,error_X_um\n1,3,10\n2,6,20\n")
    compbox.good("join", "record.csv", "probe.csv", "--keep-compensated", "-o", "data.csv")
    data = compbox.table("data.csv")
    assert data["run"] == [1, 2] and data["error_X_um"] == [10, 20]


def test_runs_may_have_names(compbox):
    record(compbox)
    compbox.write("probe.csv", 'run,time_s,error_X_um\na0,3,10\n"b, warm",6,20\na0,9,30\n007,12,40\n')
    compbox.good("join", "record.csv", "probe.csv", "--keep-compensated", "-o", "data.csv")
    lines = (compbox.folder / "data.csv").read_text().splitlines()
    assert lines[0] == "time_s,run,X,T1,error_X_um"
    assert lines[2].split(",", 1)[1].startswith('"b, warm",')
    assert [lines[i].split(",")[1] for i in (1, 3, 4)] == ["a0", "a0", "007"]
    assert [line.split(",")[-1] for line in lines[1:]] == ["10", "20", "30", "40"]


def test_outputs_are_taken_where_they_are_named(compbox):
    record(compbox)
    probe(compbox, [1.0])
    out = compbox.good("join", "record.csv", "probe.csv", "--signals", "X,EXX", "-o", "data.csv")
    assert "left out" not in out
    assert compbox.table("data.csv")["EXX"] == [1.5]


def test_rows_before_a_signal_was_received_are_left_out_and_reported(compbox):
    record(compbox, blind_s=10)
    probe(compbox, [5.0, 15.0])
    out = compbox.good("join", "record.csv", "probe.csv", "-o", "data.csv")
    assert "1 probed rows left out: a signal had not been received by then" in out
    assert compbox.table("data.csv")["time_s"] == pytest.approx([15.0])
    record(compbox, blind_s=100)
    assert compbox.refused("join", "record.csv", "probe.csv", "-o", "data.csv") == (
        "record.csv: at every probed moment a signal had never been received")


REFUSED = {
    "outside": ("time_s,error_X_um\n5,1\n31,1\n",
                "probe.csv:3: time 31.000 s is outside the recording (0.000 to 29.970 s); "
                "--time-offset-s brings two clocks together"),
    "gap": ("time_s,error_X_um\n12.5,1\n", "probe.csv:2: time 12.500 s falls into a gap of 5.010 s in "
            "the recording (--longest-gap-s)"),
    "no error": ("time_s,X\n5,1\n", "probe.csv: has no probed error; call its columns error_X_um and so "
                 "on, after the channels"),
    "no channel": ("time_s,error_Y_um\n5,1\n", "record.csv: has no column comp_Y_um, which must be "
                   "subtracted from error_Y_um (--keep-compensated leaves the error as it is)"),
    "no key": ("error_X_um\n5\n", "probe.csv: has neither time_s nor a position that record.csv has too"),
    "unknown": ("time_s,Q,error_X_um\n5,1,1\n", "probe.csv: the column 'Q' is neither time_s, run, "
                "error_…_um nor a signal of record.csv"),
    "no such place": ("X,error_X_um\n0,1\n250.5,1\n",
                      "probe.csv:3: from here on the recording never comes within 0.05 mm of this "
                      "place (nearest: 1.5 mm); rows must be in the order in which they were probed"),
    "backward": ("X,error_X_um\n200,1\n100,1\n",
                 "probe.csv:3: from here on the recording never comes within 0.05 mm of this place "
                 "(nearest: 101 mm); rows must be in the order in which they were probed"),
    "text": ("time_s,error_X_um\n5,one\n", "probe.csv:2:3: 'one' is not a finite number")}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(compbox, case):
    content, message = REFUSED[case]
    record(compbox)
    if case == "gap":
        lines = (compbox.folder / "record.csv").read_text().splitlines()
        kept = [x for x in lines[1:] if not 10 < float(x.split(",")[0]) < 15]
        compbox.write("record.csv", "\n".join(lines[:1] + kept) + "\n")
    compbox.write("probe.csv", content)
    assert compbox.refused("join", "record.csv", "probe.csv", "-o", "data.csv") == message


def test_a_broken_record(compbox):
    probe(compbox, [1.0])
    compbox.write("record.csv", "time_s,X,comp_X_um\n0,1,2\n0,1,2\n")
    assert compbox.refused("join", "record.csv", "probe.csv", "-o", "d") == (
        "record.csv:3: time_s must rise from row to row")
    assert compbox.refused("join", "record.csv", "-o", "d") == (
        "record.csv: has no columns probe_NAME and probe_NAME_n: name the probe's with --probe "
        "CHANNEL=VALUE,COUNT, or give a PROBE.csv")


def own_probes(compbox, measure_s, first=7, step=1, value=None, every_s=0.5, blind_s=0.0, names=("probe_x",)):
    """A record with a row each half second and probe columns. The probe measures at measure_s; the
    control shows value and new count in the next row, where the compensation has moved already."""
    value = value or (lambda t: machine_error(t) + compensation(t))
    lines = ["time_s,X,T1,EXX,X_adapted,comp_X_um," + ",".join(f"{n},{n}_n" for n in names) + ",mode"]
    count, shown, waiting = first, 0.0, list(measure_s)
    for k in range(60):
        t = k * every_s
        if waiting and waiting[0] < t:
            shown, count = value(waiting.pop(0)), (count + step) % 65536
        warm = "" if t < blind_s else repr(temperature(t))
        probes = ",".join(f"{shown!r},{count}" for _ in names)
        lines.append(f"{t!r},{position(t)!r},{warm},1.5,3,{compensation(t)!r},{probes},1")
    compbox.write("record.csv", "\n".join(lines) + "\n")


def test_the_probe_columns_of_a_record(compbox):
    times = [1.0, 4.5, 20.0]
    own_probes(compbox, times)
    out = compbox.good("join", "record.csv", "-o", "data.csv")
    assert out == "3 rows, matched by count: data.csv\n"
    data = compbox.table("data.csv")
    assert list(data) == ["time_s", "X", "T1", "error_X_um"]
    assert data["time_s"] == [t + 0.5 for t in times]  # rows of the new counts
    assert data["error_X_um"] == pytest.approx([machine_error(t) for t in times], abs=1e-9)


def test_a_count_that_jumps_or_wraps_is_one_measurement(compbox):
    times = [1.0, 4.5, 20.0]
    for first, step in ((65534, 1), (10, 5)):
        own_probes(compbox, times, first=first, step=step)
        compbox.good("join", "record.csv", "-o", "data.csv")
        assert compbox.table("data.csv")["error_X_um"] == pytest.approx([machine_error(t) for t in times])


def test_a_count_that_began_anew_is_a_reference(compbox):
    """The PLC restarts after the second measurement: value and count are 0 from then on."""
    own_probes(compbox, [1.0, 4.5, 20.0])
    lines = (compbox.folder / "record.csv").read_text().splitlines()
    for row, text in enumerate(lines[1:], 1):
        cells = text.split(",")
        if float(cells[0]) >= 10:
            cells[-3:-1] = ["0.0", "0"] if float(cells[0]) < 20.5 else [cells[-3], "1"]
        lines[row] = ",".join(cells)
    compbox.write("record.csv", "\n".join(lines) + "\n")
    compbox.good("join", "record.csv", "-o", "data.csv")
    data = compbox.table("data.csv")
    assert data["time_s"] == [1.5, 5.0, 20.5]
    assert data["error_X_um"] == pytest.approx([machine_error(t) for t in (1.0, 4.5, 20.0)])
    assert "X: 3 measurements, " in compbox.good("report", "record.csv", "--drift")


def test_whole_errors_and_named_columns(compbox):
    own_probes(compbox, [3.0, 9.0], value=machine_error, names=("touch",))
    done = json.loads(compbox.good("join", "record.csv", "--probe", "X=touch,touch_n", "--keep-compensated", "--json",
                                   "-o", "data.csv"))
    assert done["matched_by"] == "count" and done["columns"] == ["time_s", "X", "T1", "error_X_um"]
    assert compbox.table("data.csv")["error_X_um"] == pytest.approx([machine_error(3.0), machine_error(9.0)])
    assert compbox("join", "record.csv", "--probe", "X=touch", "-o", "d").returncode == 2


def test_measurements_before_a_signal_was_received(compbox):
    own_probes(compbox, [3.0, 9.0], blind_s=5.0)
    out = compbox.good("join", "record.csv", "-o", "data.csv")
    assert "1 measurements left out: a signal, the probed value or the compensation was not known then" in out
    assert compbox.table("data.csv")["time_s"] == [9.5]
    own_probes(compbox, [], blind_s=5.0)
    assert compbox.refused("join", "record.csv", "-o", "d") == (
        "record.csv: has no measurement to join: no count of a probe rises while every signal is known")


def test_two_probes_of_one_cycle_are_one_row(compbox):
    lines = ["time_s,T1,comp_X_um,comp_Z_um,probe_x,probe_x_n,probe_Z,probe_Z_n"]
    for k in range(40):
        t = 60 * k
        # X each 10 minutes from the 5th on, Z a minute later, but not the last time.
        lines.append(f"{t},{20 + k},1,2,{k // 10 * 10},{(k + 5) // 10},{100 + k},{min((k + 4) // 10, 3)}")
    compbox.write("record.csv", "\n".join(lines) + "\n")
    out = compbox.good("join", "record.csv", "-o", "data.csv")
    assert "1 measurements left out: not every probe measured within 120 s" in out
    data = compbox.table("data.csv")
    assert data["time_s"] == [360, 960, 1560]
    assert data["error_X_um"] == [-1, 9, 19] and data["error_Z_um"] == [104, 114, 124]
    compbox.good("join", "record.csv", "--probe", "X=probe_x,probe_x_n", "-o", "data.csv")
    assert compbox.table("data.csv")["error_X_um"] == [-1, 9, 19, 29]


def test_a_probe_without_its_channel(compbox):
    own_probes(compbox, [3.0], names=("probe_Q",))
    assert compbox.refused("join", "record.csv", "-o", "d") == (
        "record.csv: has no column comp_Q_um, which must be subtracted from probe_Q: name the channel with "
        "--probe CHANNEL=probe_Q,probe_Q_n, or leave the values as they are with --keep-compensated")


def test_help(compbox):
    assert "compbox join " in compbox.good("join", "--help").split("Example:")[1]
