#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Makes the example of a test report: EZZ of the simulated lathe before and after compensation. Before: the committed
measurement. After: another measurement by the virtual laser (new noise and set-up), plus what the box does at each
target, as `compbox eval` computes it.
  test_report.py BIN FILE.html"""

import csv
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ABOUT = {"--number": "example 1", "--machine": "lathe 3 (simulated)", "--serial": "none", "--axis": "Z",
         "--location": "none: a simulation", "--date": "2026-11-02", "--operator": "examples/lathe/test_report.py",
         "--instrument": "virtual laser, 0.3 µm noise", "--environment": "20 °C, constant"}
LIMITS = ("--limit-um", "A+=6,R+=4", "--budget",
          "device-um-per-m=0.3,misalignment-mm=0.5,temperature-K=0.02,expansion-range=2,eve-um=0.2",
          "--expansion-um-per-m-K", "11.5", "--material-degC", "20")


def after_um(folder, run):
    """out: the rows of the second measurement with the box."""
    run("compbox", "init", "--axes", "X,Z", "--profile", "sinumerik-840d", "--name", "lathe 3", "--travel",
        "X=400,Z=2000", "--host", "127.0.0.1", "-o", "machine.json")
    run("compbox", "fit", HERE / "measurements/EZZ.csv", "--name", "EZZ", "--signal", "Z", "--zero-at", "0", "-o",
        "EZZ.json")
    run("compbox", "build", "machine.json", "EZZ.json", "-o", "coefficients.json")
    run("virtual-laser", "--machine", HERE / "machine_twin.json", "--seed", "8", "-o", "second")
    rows = list(csv.DictReader((folder / "second/EZZ.csv").open()))
    (folder / "inputs.csv").write_text("time_s,X,Z\n" + "".join(
        f"{i},0,{row['position_mm']}\n" for i, row in enumerate(rows)))
    run("compbox", "eval", "coefficients.json", "--inputs", "inputs.csv", "--raw", "-o", "box.csv")
    box = list(csv.DictReader((folder / "box.csv").open()))
    return [(row["position_mm"], float(row["error_um"]) + float(moved["comp_Z_um"]), row["run"])
            for row, moved in zip(rows, box, strict=True)]


def main(binaries, page):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run = lambda program, *words: subprocess.run([binaries / program, *words], cwd=folder, check=True,
                                                     stdout=subprocess.DEVNULL)
        rows = after_um(folder, run)
        (folder / "EZZ_after.csv").write_text("position_mm,error_um,run\n" + "".join(
            f"{position},{um:.2f},{number}\n" for position, um, number in rows))
        (folder / "EZZ_before.csv").write_text((HERE / "measurements/EZZ.csv").read_text())
        run("compbox", "report", "EZZ_before.csv", "--after", "EZZ_after.csv", "--name", "EZZ", *LIMITS, "--page",
            page.resolve(), *(word for option in ABOUT.items() for word in option))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))
