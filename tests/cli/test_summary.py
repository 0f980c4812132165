# SPDX-License-Identifier: MIT
"""--json of the commands whose result is a file: one object with files and remarks on stdout."""

import json
import math

import pytest
from conftest import GANTRY, PLC, ROOT, term


def summary(compbox, *arguments):
    done = json.loads(compbox.good(*arguments, "--json"))
    assert list(done)[0] == "files" and list(done)[-1] == "remarks"
    assert all((compbox.folder / name).exists() for name in done["files"])
    return done


def test_from_the_machine_to_the_slot(compbox):
    done = summary(compbox, "init", *PLC, "--axes", "XYZ", "--profile", "generic", "--name", "mill", "-o", "m.json")
    assert done["files"] == ["m.json"] and done["machine"] == "mill"
    assert done["remarks"][0].startswith("To set: min and max of X, Y, Z")
    compbox.write("EZX.json", term())
    printed = compbox.good("build", "m.json", "EZX.json", "-o", "c.json")
    done = summary(compbox, "build", "m.json", "EZX.json", "-o", "c.json")
    assert done["terms"] == ["EZX.json"] and done["remarks"] == printed.splitlines() != []
    done = summary(compbox, "check", "c.json")
    assert done["files"] == [] and done["machine"] == "mill"
    assert (done["revision"], done["signals"], done["terms"], done["channels"]) == (1, 1, 1, 1)
    done = summary(compbox, "pack", "c.json", "-o", "slot.bin")
    assert done["bytes"] == (compbox.folder / "slot.bin").stat().st_size < done["most_bytes"]


def test_eval(compbox, machine):
    compbox.write("EZX.json", term())
    compbox.good("build", "machine.json", "EZX.json", "-o", "c.json")
    compbox.write("in.csv", "time_s,X,Y,Z\n0,100,0,0\n1,90000,0,0\n")
    reported = compbox("eval", "c.json", "--inputs", "in.csv", "-o", "out.csv").stderr
    done = summary(compbox, "eval", "c.json", "--inputs", "in.csv", "-o", "out.csv")
    assert done["rows"] == 2 and done["columns"] == list(compbox.table("out.csv"))
    assert [f"in.csv: {remark}" for remark in done["remarks"]] == reported.splitlines() != []


def test_a_file_on_stdout_stays_alone(compbox):
    out = compbox.good("init", *PLC, "--axes", "X", "--profile", "generic", "--json", "-o", "-")
    assert "files" not in json.loads(out)


PLAN = ("plan", "--box=-300:300:3,-200:200:3,-100:150:3", "--axis", "X")
ON_STDOUT = {
    "fit": ("fit", "d.csv", "--name", "EZX", "--signal", "X"),
    "fit, json": ("fit", "d.csv", "--name", "EZX", "--signal", "X", "--json"),
    "plan": PLAN,
    "plan, json": (*PLAN, "--json"),
    "etve": ("etve", "night.csv"),
    "report": ("report", "d.csv"),
    "drift": ("report", "drift.csv", "--drift"),
    "select-inputs": ("select-inputs", "rows.csv", "--outputs", "e_um", "--candidates", "t*"),
    "sensors": ("sensors", "rows.csv", "--sensors", "t1,t2,t3"),
    "train": ("train", "rows.csv", "--outputs", "e_um", "--inputs", "t*", "--name", "net", "--hidden", 0),
}


@pytest.mark.parametrize("file", ["-", "/dev/stdout"])
@pytest.mark.parametrize("case", ON_STDOUT)
def test_no_report_is_printed_behind_a_file_on_stdout(compbox, case, file):
    compbox.write("d.csv", "position_mm,error_um\n" + "".join(f"{50 * i},{i * i % 7}\n" for i in range(12)))
    compbox.write("night.csv", "time_s,X_um\n" + "".join(f"{60 * i},{i % 3}\n" for i in range(300)))
    compbox.write("drift.csv", "time_s,error_X_um\n" + "".join(f"{3600 * i},{i % 5}\n" for i in range(100)))
    compbox.write("rows.csv", "time_s,t1,t2,t3,e_um\n" + "".join(
        f"{60 * i},{20 + math.sin(i / 9)},{30 + math.cos(i / 5)},{25 + math.sin(i / 7)},{2 * math.sin(i / 9)}\n"
        for i in range(120)))
    out = compbox(*ON_STDOUT[case], "-o", file)
    assert out.returncode == 0, out.stderr
    assert isinstance(json.loads(out.stdout), dict)


def test_assemble(compbox):
    names = [ROOT / f"examples/nine-line/X/P{p}{d}.rtl" for p in "123" for d in "xyz"]
    done = summary(compbox, "assemble", *names, "-o", "X.csv")
    at = compbox.table("X.csv")["position_mm"]
    assert (done["positions"], done["from_mm"], done["to_mm"]) == (len(at), at[0], at[-1])


def test_simulate(compbox):
    done = summary(compbox, "simulate", GANTRY / "scenario.json", "--seeds", "2015", "-o", "out")
    written = compbox.read("out/report.json")
    assert done["files"] == ["out/report.json"]
    assert done["reduction_percent"] == written["reduction_percent"]
    assert any("did not converge" in remark for remark in done["remarks"])
