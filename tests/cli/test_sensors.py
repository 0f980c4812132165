# SPDX-License-Identifier: MIT
"""compbox sensors: a record of healthy thermometers, then faults on days that it has not seen, by the box in `eval`."""

import json

import numpy
import pytest

COUNT = 10
NAMES = [f"T{j + 1}_degC" for j in range(COUNT)]


class Lathe:
    """Thermometers at a spindle that works by shifts, in a hall with days and a season; each has slow noise."""

    def __init__(self, seed):
        self.dice = numpy.random.default_rng(seed)
        self.quick, self.slow = self.dice.uniform(1, 9, COUNT), self.dice.uniform(0, 8, COUNT)
        self.air = self.dice.uniform(0.8, 1.0, COUNT)

    def days(self, first, count, step_s):
        time = numpy.arange(first * 86400, (first + count) * 86400, step_s, dtype=float)
        hall = 22 + 2 * numpy.sin(2 * numpy.pi * time / 86400) + 4 * numpy.sin(2 * numpy.pi * time / (120 * 86400))
        load, quick, slow, own = 0.0, 0.0, 0.0, numpy.zeros(COUNT)
        keeps = numpy.exp(-step_s / 7200)
        rows = []
        for t, air in zip(time, hall):
            if self.dice.random() < step_s / 5400:
                load = self.dice.uniform(0, 1) if 0.25 < t / 86400 % 1 < 0.9 else 0.0
            quick += (load - quick) * (1 - numpy.exp(-step_s / 900))
            slow += (load - slow) * (1 - numpy.exp(-step_s / 9000))
            own = keeps * own + self.dice.normal(0, 0.15 * numpy.sqrt(1 - keeps ** 2), COUNT)
            rows.append(self.air * air + self.quick * quick + self.slow * slow + own + self.dice.normal(0, 0.05, COUNT))
        return time, numpy.array(rows)


def write(compbox, name, time, rows):
    lines = [",".join(["time_s", "Z", *NAMES])]
    lines += [",".join([f"{t:.0f}", "0", *(f"{x:.3f}" for x in row)]) for t, row in zip(time, rows)]
    return compbox.write(name, "\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def lathe():
    return Lathe(7)


@pytest.fixture
def box(compbox, machine, lathe):
    """coefficients.json of a machine whose Z has a term of all thermometers, with the section of 20 days."""
    time, rows = lathe.days(0, 20, 600)
    write(compbox, "record.csv", time, rows)
    compbox.report = compbox.good("sensors", "record.csv", "--sensors", "T*_degC", "-o", "sensors.json")
    machine["signals"] = [s for s in machine["signals"] if s["name"] == "Z"]
    machine["signals"] += [{"name": name, "unit": "degC", "plc": 36 + 2 * j, "type": "float32", "min": -50, "max": 150,
                            "max_age_ms": 86400000} for j, name in enumerate(NAMES)]
    machine["channels"] = [c for c in machine["channels"] if c["name"] == "Z"]
    machine["channels"][0]["sum"] = ["warm"]
    machine["plc"]["read"]["count"] = 60
    machine["cycle"]["period_ms"] = 1000
    machine["plc"]["heartbeat_timeout_ms"] = 5000
    machine["safety"]["ramp_um_per_s"] = 10
    compbox.write("machine.json", machine)
    compbox.write("warm.json", {"terms": [{"name": "warm", "type": "linear", "inputs": NAMES,
                                           "weights": [0.3] * COUNT, "constant": 5}]})
    compbox.good("build", "machine.json", "warm.json", "sensors.json", "-o", "coefficients.json")
    return compbox


def live(box, time, rows):
    """Whether the term is alive, row by row."""
    write(box, "day.csv", time, rows)
    done = box("eval", "coefficients.json", "--inputs", "day.csv", "-o", "out.csv")
    assert done.returncode == 0, done.stderr
    box.remarks = done.stdout + done.stderr
    return numpy.abs(box.table("out.csv")["warm"]) > 1.0


def test_the_table_and_the_section(box, lathe):
    section = box.read("sensors.json")["sensors"]
    matrix = numpy.array(section["precision"])
    assert section["signals"] == NAMES and matrix.shape == (COUNT, COUNT)
    assert (matrix == matrix.T).all() and (numpy.linalg.eigvalsh(matrix) > 0).all()
    table = {line.split()[0]: list(map(float, line.split()[1:])) for line in box.report.splitlines() if "_degC " in line
             and len(line.split()) == 3}
    for name, own in zip(NAMES, matrix.diagonal()):
        assert table[name][1] == pytest.approx(section["threshold"] / numpy.sqrt(own), abs=0.006)
        assert table[name][0] < table[name][1] < 5


def test_healthy_days_have_no_alarm(box, lathe):
    time, rows = lathe.days(40, 30, 300)
    assert live(box, time, rows).all()


def test_offsets_of_five_kelvin_are_found_within_ten_minutes(box, lathe):
    found, trials = 0, 0
    for sensor in range(COUNT):
        for day, size in ((25, 5.0), (33, -5.0)):
            time, rows = lathe.days(day, 0.5, 60)
            rows[300:, sensor] += size
            alive = live(box, time, rows)
            assert alive[:300].all()
            trials += 1
            found += not alive[311:].any()
            assert alive[311:].all() or f"{NAMES[sensor]} doubted, the other sensors contradict it: " in box.remarks
    assert found >= 0.95 * trials, (found, trials)


def test_a_ramp_an_exchange_and_a_stuck_one_are_found(box, lathe):
    time, rows = lathe.days(27, 0.6, 60)
    ramp = rows.copy()
    ramp[200:, 3] += numpy.minimum(5.0, numpy.arange(len(time) - 200) / 60)
    assert not live(box, time, ramp)[511:].any()
    apart = numpy.abs(rows[:, :, None] - rows[:, None, :])
    row, one, other = numpy.unravel_index(apart[:-20].argmax(), apart[:-20].shape)
    assert apart[row, one, other] > 5
    swapped = rows.copy()
    swapped[row:, [one, other]] = rows[row:, [other, one]]
    assert not live(box, time, swapped)[row + 11]
    moved = numpy.abs(rows - rows[300])
    row, one = numpy.unravel_index(moved[300:-20].argmax(), moved[300:-20].shape)
    assert moved[300 + row, one] > 5
    stuck = rows.copy()
    stuck[300:, one] = rows[300, one]
    assert not live(box, time, stuck)[311 + row]


def test_a_sensor_that_no_other_one_sees_is_named(compbox, lathe):
    time, rows = lathe.days(0, 8, 600)
    rows[:, 5] += numpy.repeat(lathe.dice.normal(0, 12, len(time) // 36), 36)
    write(compbox, "record.csv", time, rows)
    text = compbox.good("sensors", "record.csv", "--sensors", "T*_degC", "-o", "s.json")
    assert "An offset of 5 is not found at: T6_degC." in text


def test_what_cannot_be_is_refused(box, lathe):
    assert "3 to 32 with --sensors" in box.refused("sensors", "record.csv", "--sensors", "T1_degC,T2_degC")
    box.write("again.json", {"sensors": box.read("sensors.json")["sensors"]})
    build = ("build", "machine.json", "warm.json", "sensors.json")
    assert "again.json" in box.refused(*build, "again.json", "-o", "c.json")
    broken = box.read("sensors.json")
    broken["sensors"]["precision"][0][1] += 0.1
    box.write("sensors.json", json.dumps(broken))
    assert "matrix is symmetric" in box.refused(*build, "-o", "c.json")
