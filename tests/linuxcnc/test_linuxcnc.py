# SPDX-License-Identifier: MIT
"""compboxd compensates LinuxCNC's joints, over the program of compbox export; faults of both sides."""
import json
import pathlib
import random
import signal
import struct
import subprocess
import sys
import time

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "hil"))

from box import Box, free_port  # noqa: E402
from control import COMPBOX, Client, LinuxCnc, until  # noqa: E402

POSITIONS, VALUES = [0, 100, 200, 300, 400, 500], [0, 60, -40, 80, 20, -30]  # EXX, um
LIMIT_UM, SIZE_UM, SLOPE_UM_PER_S, RAMP_UM_PER_S = 200, 220, 1000, 50


def curve_um(x):
    i = min(int(x // 100), 4)
    return VALUES[i] + (VALUES[i + 1] - VALUES[i]) * (x - POSITIONS[i]) / 100


def compbox(folder, *words):
    subprocess.run([COMPBOX, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """machine.json and coefficients.json, and the port."""
    folder, port = tmp_path_factory.mktemp("files"), free_port()
    compbox(folder, "init", "--axes", "XYZ", "--profile", "linuxcnc", "--host", "127.0.0.1", "--port", str(port),
            "--travel", "X=500,Y=500,Z=500", "-o", "machine.json")
    machine = json.loads((folder / "machine.json").read_text())
    for channel in machine["channels"]:
        channel.update(limit_um=LIMIT_UM, error_um=250)
    (folder / "machine.json").write_text(json.dumps(machine))
    (folder / "EXX.json").write_text(json.dumps({"terms": [
        {"name": "EXX", "type": "polyline", "signal": "X", "positions": POSITIONS, "values": VALUES}]}))
    compbox(folder, "build", "machine.json", "EXX.json", "-o", "coefficients.json")
    return folder, port


@pytest.fixture
def cnc(files, tmp_path_factory):
    # LinuxCNC's user has to come into the folder.
    folder = pathlib.Path(f"/dev/shm/compbox-linuxcnc-{random.randrange(1 << 32):x}")
    folder.mkdir(mode=0o755)
    try:
        with LinuxCnc(folder, files[0] / "machine.json") as control:
            yield control
    finally:
        print(control.log())
        subprocess.run(["rm", "-r", folder], check=True)


@pytest.fixture
def box(files, cnc):
    cnc.on()
    cnc.home()
    with Box(files[0] / "coefficients.json") as running:
        try:
            wait_mode(files, "ACTIVE")
            yield running
        finally:
            if running.code is None:
                running.stop()
            print(running.log)


MODES = ["STANDBY", "ACTIVE", "HOLD", "RAMP", "FAULT", "STOPPED"]


def wait_mode(files, mode):
    """By its status register."""
    client = Client(files[1])
    try:
        until(lambda: MODES[client.read(101, 1)[0] & 0xFF] == mode, mode)
    finally:
        print("registers", client.read(0, 32), client.read(100, 12))


def biggest_step_um(samples):
    return max(abs(b[1] - a[1]) for a, b in zip(samples, samples[1:])) * 1e3


def settle(cnc, want_um, within_um=0.05):
    until(lambda: abs(cnc.applied_um() - want_um) <= within_um, f"{want_um} um, it is {cnc.applied_um()}")


def test_it_compensates_in_motion(cnc, box):
    cnc.move("G1 X50 F3000")
    cnc.at_rest()
    settle(cnc, -curve_um(50))
    samples = cnc.samples(3500, lambda: cnc.move("G1 X250 F1800"))
    moving = [s for a, s in zip(samples, samples[1:]) if a[0] != s[0]]
    assert len(moving) > 1500 and len({applied for _, applied, *_ in moving}) > 50
    for planned, applied, commanded, permission in moving:
        assert commanded == pytest.approx(planned + applied, abs=1e-9) and permission == 1
    # At 30 mm/s the curve changes by 30 um/s at most here: 10 um are a third of a second.
    off_um = sorted(abs(1e3 * applied + curve_um(planned)) for planned, applied, *_ in moving)
    assert off_um[len(off_um) // 2] < 10
    assert max(abs(1e3 * applied) for _, applied, *_ in moving) > 50
    assert biggest_step_um(samples) <= SLOPE_UM_PER_S * 1e-3 + 1e-6
    cnc.at_rest()
    settle(cnc, -curve_um(250))
    assert abs(float(cnc.command("s.joint_actual_position[0]")) - 250) < 1e-6, "feedback is without the offset"
    # The box stops in good order: to zero, nothing of it stays.
    box.stop()
    settle(cnc, 0.0, 0.0)


def test_the_box_is_gone(cnc, box):
    cnc.move("G1 X100 F6000")
    cnc.at_rest()
    settle(cnc, -60)
    samples = cnc.samples(2500, lambda: box.process.send_signal(signal.SIGKILL))
    gone = [s for s in samples if s[3] == 0]
    assert gone and abs(gone[0][1]) == pytest.approx(0.060, abs=1e-4)
    assert biggest_step_um(gone) <= RAMP_UM_PER_S * 1e-3 + 1e-6, "on the ramp"
    settle(cnc, 0.0, 0.0)


def test_the_component_is_gone(cnc, box):
    """Watchdog and ramp are in realtime; the box sees a PLC that is away."""
    cnc.move("G1 X100 F6000")
    cnc.at_rest()
    settle(cnc, -60)
    cnc.hal("unloadusr", "compbox")
    settle(cnc, 0.0, 0.0)
    box.stop()
    assert box.code == 1 and "ended without the PLC's confirmation of zero" in box.log


@pytest.mark.parametrize("away, back", [
    (lambda cnc: cnc.hal("sets", "compbox-key-enable", "0"), lambda cnc: cnc.hal("sets", "compbox-key-enable", "1")),
    (lambda cnc: cnc.command("c.state(linuxcnc.STATE_OFF)"), lambda cnc: cnc.on()),
    (lambda cnc: cnc.command("c.state(linuxcnc.STATE_ESTOP)"), lambda cnc: cnc.on()),
], ids=["key", "machine off", "emergency stop"])
def test_it_is_switched_off_and_on(files, cnc, box, away, back):
    cnc.move("G1 X100 F6000")
    cnc.at_rest()
    settle(cnc, -60)
    away(cnc)
    settle(cnc, 0.0, 0.0)
    wait_mode(files, "STANDBY")
    back(cnc)
    wait_mode(files, "ACTIVE")
    settle(cnc, -60)


def test_the_box_stalls(cnc, box):
    cnc.move("G1 X100 F6000")
    cnc.at_rest()
    settle(cnc, -60)
    box.process.send_signal(signal.SIGSTOP)
    settle(cnc, 0.0, 0.0)
    box.process.send_signal(signal.SIGCONT)
    settle(cnc, -60)


def block(port, count, um, beats):
    """The write block of another client: whole where count is one number, else torn."""
    first, last = count
    value = struct.unpack(">2H", struct.pack(">i", round(100 * um)))
    return [first, 1, beats, 0, *value, 0, 0, 0, 0, 0, last]


def test_another_client(files, cnc):
    """Without a box: zero at the start; then a client that writes what it likes."""
    cnc.on()
    cnc.home()
    assert cnc.applied_um() == 0.0
    client = Client(files[1])
    read = client.read(0, 32)
    assert read[0] == read[31] and read[2] == 0b1011
    beats = iter(range(1, 1 << 16))

    def write_for(seconds, um, torn=0):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            n = next(beats)
            client.write(100, block(files[1], (n, (n + torn) & 0xFFFF), um, n))
            time.sleep(0.03)
    # [size] and [slope], in realtime
    samples = cnc.samples(1500, lambda: write_for(1.6, 1e6))
    assert 1e3 * max(s[1] for s in samples) == pytest.approx(SIZE_UM, abs=1e-6)
    assert biggest_step_um(samples) <= SLOPE_UM_PER_S * 1e-3 + 1e-6
    write_for(0.7, 1e6)
    assert cnc.applied_um() == pytest.approx(SIZE_UM, abs=1e-6)
    # [torn] is not taken over, and the value before stays
    write_for(0.5, -50, torn=1)
    assert cnc.applied_um() == pytest.approx(SIZE_UM, abs=1e-6)
    write_for(1.0, -50)
    assert cnc.applied_um() == pytest.approx(-50, abs=0.01)
    settle(cnc, 0.0, 0.0)   # nobody writes any more


def test_requests_that_are_not_served(files, cnc):
    client = Client(files[1])
    assert client.exchange(struct.pack(">BHH", 6, 100, 1)) == bytes([0x86, 1])
    assert client.exchange(struct.pack(">BHH", 3, 100, 13)) == bytes([0x83, 2])
    assert client.exchange(struct.pack(">BHH", 3, 0, 126)) == bytes([0x83, 3])
    assert client.exchange(struct.pack(">BHHBH", 16, 100, 2, 4, 7)) == bytes([0x90, 3])
    assert client.exchange(b"\x03\x00") == bytes([0x83, 3])
    both = client.exchange(struct.pack(">BHHHHBH", 23, 100, 4, 103, 1, 2, 77))
    assert both == struct.pack(">BB4H", 23, 8, 0, 0, 0, 77)
    dice = random.Random(1)
    for _ in range(300):
        client.exchange(dice.randbytes(dice.randrange(1, 253)))
    assert len(client.read(0, 112)) == 112
