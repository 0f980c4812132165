# SPDX-License-Identifier: MIT
"""Linear terms with a bank of lags: through build, check and eval, and what a microcontroller has room for."""

import json
import math

import pytest

from conftest import term

THERMOMETERS = 6


def with_thermometers(machine):
    machine["plc"]["transport"] = {"rtu": {"device": "/dev/ttyS1", "baud": 115200, "slave_delay_ms": 0}}
    for i in range(THERMOMETERS):
        machine["signals"].append({"name": f"T{i}", "unit": "degC", "plc": 14 + i, "scale": 0.1, "min": -10, "max": 90})
    return machine


def bank(taus, inputs=THERMOMETERS, name="warm", **more):
    columns = inputs * len(taus)
    return {"terms": [{"name": name, "type": "linear", "outputs": ["error_X_um", "error_Y_um"],
                       "bank": {"inputs": [f"T{i}" for i in range(inputs)], "tau_s": taus,
                                "weights": [[0.01] * columns, [-0.02] * columns], **more}}]}


def written(compbox, machine, fragment):
    compbox.write("machine.json", with_thermometers(machine))
    compbox.write("bank.json", fragment)
    compbox.write("z.json", term())
    return "machine.json", "bank.json", "z.json", "-o", "c.json"


def test_build_sums_its_outputs_and_keeps_its_inputs(compbox, machine):
    printed = compbox.good("build", *written(compbox, machine, bank([0, 600])))
    assert "channel X = -(error_X_um)" in printed and "channel Y = -(error_Y_um)" in printed
    built = compbox.read("c.json")
    assert {f"T{i}" for i in range(THERMOMETERS)} <= {signal["name"] for signal in built["signals"]}
    missing = bank([600])
    missing["terms"][0]["bank"]["inputs"][2] = "T17"
    compbox.write("bank.json", missing)
    message = compbox.refused("build", "machine.json", "bank.json", "z.json", "-o", "c.json")
    assert "the term warm works on the signal T17, which no file has" in message


def test_build_reports_how_many_lags_the_box_has(compbox, machine):
    compbox.good("build", *written(compbox, machine, bank(list(range(1, 33)))))
    second = bank(list(range(1, 12)), name="second")
    second["terms"][0]["outputs"] = ["a", "b"]
    compbox.write("second.json", second)
    message = compbox.refused("build", "machine.json", "bank.json", "z.json", "second.json", "-o", "c.json")
    assert message.startswith("second.json: terms[0]: this bank needs 66 lags, and of the box's 256 only 64 are left")


@pytest.mark.parametrize("command", ["build", "check"])
def test_the_memory_of_the_microcontroller_in_numbers(compbox, machine, command):
    files = written(compbox, machine, bank([0, 60, 600]))
    printed = compbox.good("build", *files, "--target", "stm32f405")
    if command == "check":
        printed = compbox.good("check", "c.json", "--target", "stm32f405")
    size = len((compbox.folder / "c.json").read_bytes())
    line = next(line for line in printed.splitlines() if line.startswith("the STM32F405 holds it: "))
    assert f"text bytes {size} of 131040, coefficients " in line
    assert line.endswith("inputs of terms 12 of 512, lags of banks 12 of 256")
    assert "holds it" not in compbox.good("check", "c.json")
    memory = json.loads(compbox.good("check", "c.json", "--json"))["memory"]
    assert memory["lags of banks"] == {"used": 12, "most": 256}


@pytest.mark.parametrize("command", ["build", "check"])
def test_what_the_microcontroller_does_not_read_is_refused_for_it_alone(compbox, machine, command):
    files = written(compbox, machine, bank([600]))
    data = compbox.read("machine.json")
    data["signals"][-1] = {**data["signals"][-1], "can": "0x181"}
    del data["signals"][-1]["plc"]
    compbox.write("machine.json", data)
    compbox.good("build", *files)
    arguments = ("build", *files) if command == "build" else ("check", "c.json")
    assert "the STM32F405 reads no CAN bus" in compbox.refused(*arguments, "--target", "stm32f405")
    assert compbox(*arguments, "--target", "avr").returncode == 2


def test_the_demand_is_that_of_the_steady_state(compbox, machine):
    """Each thermometer alone over -10 to 90 degC, the others at 20: 2 columns of 0.01 um/K each."""
    compbox.good("build", *written(compbox, machine, bank([0, 600], bias=[3, 0])))
    demand = json.loads(compbox.good("check", "c.json", "--json"))["demand"]["X"]
    base = -(3 + 2 * 0.01 * 20 * THERMOMETERS)
    alone = [demand["alone_low_um"], demand["alone_high_um"]]
    assert alone == pytest.approx([base - 2 * 0.01 * 70, base + 2 * 0.01 * 30], abs=1e-3)


def test_a_training_range_is_where_the_others_rest(compbox, machine):
    trained = bank([0], input_min=[30] * THERMOMETERS, input_max=[40] * THERMOMETERS)
    compbox.good("build", *written(compbox, machine, trained))
    demand = json.loads(compbox.good("check", "c.json", "--json"))["demand"]["X"]
    assert demand["alone_low_um"] == pytest.approx(-0.01 * (5 * 30 + 40), abs=0.02)
    assert demand["alone_high_um"] == 0, "faded"


def test_export_has_the_steady_state(compbox, machine):
    position = {"terms": [{"name": "error_X_um", "type": "linear",
                           "bank": {"inputs": ["X"], "powers": {"X": [1, 2]}, "tau_s": [0, 600],
                                    "weights": [[0.001, 0.002, 1e-7, 2e-7]], "bias": [-1]}}]}
    compbox.good("build", *written(compbox, machine, position))
    compbox.good("export", "c.json", "--format", "linuxcnc-comp", "--step-mm", 500, "-o", "tables")
    rows = [line.split() for line in (compbox.folder / "tables").glob("X*").__next__().read_text().splitlines()
            if line and not line.startswith("#")]
    for place, forward, _ in rows:
        x = float(place)
        assert math.isclose(abs(float(forward) - x), abs(0.003 * x + 3e-7 * x * x - 1) * 1e-3, abs_tol=2e-6)
