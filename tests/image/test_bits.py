# SPDX-License-Identifier: MIT
"""The daemon itself gives the same bits on x86-64, cross-built for arm64 under qemu-user, and in the image:
the same readings, and every term's output as the record writes it, which reads back as the same float32."""
import csv
import io
import subprocess
import sys

import pytest

import guest as g
from figures import note
from test_image import put_text

sys.path.insert(0, str(g.ROOT / "tests/hil"))
import machine as m  # noqa: E402
import plc as plc_module  # noqa: E402
from box import free_port  # noqa: E402
from pymodbus_plc import PymodbusPlc  # noqa: E402

CYCLES = 300
INPUTS = [s["name"] for s in m.FILE["signals"]]
OUTPUTS = [t["name"] for t in m.FILE["terms"]]


def readings(plc):
    """Positions and temperature by the number of the reading, so that every run meets the same ones."""
    def motion(_):
        k = len(plc.readings)
        return {"X": 47.7 * k % 14300, "Y": 31.3 * k % 3000 - 1500, "Z": 17.9 * k % 2500, "T1": 15 + k % 97 * 0.3}
    plc.motion = motion


def table(text):
    """{inputs as written: outputs as written} of a record, of the first row that has these inputs. In a later one
    they may be old, on a machine that stands still: the outputs then fade."""
    found = {}
    for row in csv.DictReader(io.StringIO(text)):
        if all(row[name] for name in INPUTS):
            found.setdefault(tuple(row[name] for name in INPUTS), tuple(row[name] for name in OUTPUTS))
    return found


def record_of(program, folder):
    port, plc = free_port(), plc_module.Plc()
    readings(plc)
    folder.mkdir()
    config = m.write_coefficients(folder / "c.json", port)
    with PymodbusPlc(plc, port):
        subprocess.run([*program, "--config", config, "--record", folder / "r.csv", "--cycles", str(CYCLES)],
                       timeout=120 * g.SLOW, stderr=subprocess.DEVNULL, check=False)
    return table((folder / "r.csv").read_text())


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return record_of([g.ROOT / "build/host/bin/compboxd"], tmp_path_factory.mktemp("bits") / "host")


def compare(here, there, where):
    common = here.keys() & there.keys()
    assert len(common) > 50, "the runs must have met the same readings"
    different = [key for key in common if here[key] != there[key]]
    assert not different, (different[0], here[different[0]], there[different[0]])
    note(f"term outputs of compboxd with the bits of x86-64, {where}",
         f"{len(common) * len(OUTPUTS)} of {len(common) * len(OUTPUTS)}", "all")


def test_under_qemu_user(here, tmp_path):
    emulator = ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu", g.ROOT / "build/arm64/bin/compboxd"]
    compare(here, record_of(emulator, tmp_path / "arm64"), "qemu-user")


def test_in_the_image(here, machine, tmp_path):
    _, guest = machine
    port, plc = free_port(), plc_module.Plc()
    readings(plc)
    config = m.write_coefficients(tmp_path / "c.json", port, lambda data: data["plc"]["transport"]["tcp"].update(
        host="10.0.2.2"))
    put_text(guest, "/tmp/bits.json", config.read_text())
    with PymodbusPlc(plc, port):
        guest.run(f"compboxd --config /tmp/bits.json --record /tmp/bits.csv --cycles {CYCLES} 2>/dev/null || true", 60)
    compare(here, table(guest.run("cat /tmp/bits.csv", 60)), "image")
