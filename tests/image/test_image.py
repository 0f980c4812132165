# SPDX-License-Identifier: MIT
"""The image against fakeplc on the host: CAN temperatures, and everything that can go wrong."""
import json
import re
import socket
import subprocess
import time

import pytest

import guest as g
from figures import note

PATH_UM = g.wanted_um(30, 30, 20)


def test_the_first_compensated_cycle_comes_soon(machine):
    """From power-on. Judged by what the guest's two processors computed until then, in its own time, which counts
    instructions: neither the host nor its load is in it."""
    plc, guest = machine
    plc.wait_um(PATH_UM, within=1)
    wall_s, cpu_s = time.monotonic() - guest.on_s, guest.cpu_s()
    up_s, idle_s = map(float, re.search(r"([\d.]+) ([\d.]+)", guest.run("cat /proc/uptime")).groups())
    busy_s = 2 * up_s - idle_s
    note("power-on to first compensated cycle, s",
         f"{busy_s:.1f} computed by two processors of 250 MIPS; {wall_s:.1f} by the clock, {cpu_s:.1f} of the host's "
         "processor time", "11 computed")
    assert busy_s <= 11


def test_the_image_is_small():
    packed = subprocess.run(f"zstd -q -9 -T0 -c {g.OUT / 'compbox-arm64.img'} | wc -c", shell=True,
                            capture_output=True, text=True, check=True)
    mib = int(packed.stdout) / 2**20
    note("image, compressed, MiB", f"{mib:.1f}", "64")
    assert mib <= 64


def test_root_is_read_only_and_compboxd_came_first(machine):
    _, guest = machine
    assert "PREEMPT_RT" in guest.run("uname -v")
    assert "ro," in guest.run("grep '^rootfs / ' /proc/mounts")
    assert guest.run("touch /etc/x 2>&1 || true").strip().endswith("Read-only file system")
    services = guest.run("grep -v '^#' /etc/inittab").splitlines()
    assert services[1].endswith("/usr/sbin/compbox-service")


MAY = (1 << 14) | (1 << 23)  # CAP_IPC_LOCK, CAP_SYS_NICE
AS_COMPBOXD = "/usr/sbin/compbox-as compbox ,+sys_nice,+ipc_lock "  # as compbox-service starts it


def status_of(guest, name):
    """[/proc/PID/status of each thread of the program, as {key: value}]."""
    text = guest.run(f"for p in $(pidof {name}); do cat /proc/$p/task/*/status; done")
    return [dict(re.findall(r"^(\w+):\s*(.*?)\s*$", part, re.M)) for part in re.split(r"(?m)^(?=Name:)", text)[1:]]


def test_compboxd_has_a_user_of_its_own_and_two_capabilities(machine):
    _, guest = machine
    threads = status_of(guest, "compboxd")
    assert len(threads) >= 2
    for one in threads:
        assert one["Uid"].split() == one["Gid"].split() == ["100"] * 4 and one["Groups"].split() == ["20", "100"]
        assert {int(one["Cap" + which], 16) for which in ("Eff", "Prm", "Inh", "Amb", "Bnd")} == {MAY}
        assert one["NoNewPrivs"] == "1" and int(one["VmLck"].split()[0]) > 1000
    for one in status_of(guest, "compbox-log"):
        assert one["Uid"].split() == ["101"] * 4 and int(one["CapEff"], 16) == int(one["CapBnd"], 16) == 0
    stats = guest.wait_stats(lambda s: True)["realtime"]
    assert stats == {"priority": 80, "memory_locked": True, "cpu_latency_held": True}
    scheduled = [line.rsplit(")", 1)[1].split() for line in
                 guest.run("cat /proc/$(pidof compboxd)/task/*/stat").splitlines()]
    assert ["80", "1"] in [fields[37:39] for fields in scheduled], "SCHED_FIFO with priority 80"


@pytest.mark.parametrize("command", [
    "touch /x", "touch /usr/sbin/x", "touch /data/x", "touch /data/settings", "touch /data/log/x", "touch /run/x",
    "mv /data/coefficients.json /data/x", "sh -c 'echo >>/data/coefficients.json'", "/bin/ip link set can0 down",
    "mount -o remount,rw /", "sh -c 'echo b >/proc/sysrq-trigger'", "cat /dev/vda", "cat /dev/ttyAMA0", "kill -0 1",
    "modprobe vcan", "reboot -f"])
def test_compboxd_may_not(machine, command):
    _, guest = machine
    printed = guest.run(f"{AS_COMPBOXD} {command} && echo DONE || echo refused")
    assert printed.splitlines()[-1] == "refused"
    assert re.search("not permitted|ermission denied|Read-only", printed)


def test_compboxd_may(machine):
    """What is refused above is refused for the right reason: this works the same way."""
    _, guest = machine
    guest.run(f"{AS_COMPBOXD} sh -c 'cd /data/state && echo x >x && sync x && mv x y && rm y && cat ../settings'")


def test_the_watchdog_is_fed(machine):
    """It is set to 10 s and runs; a daemon that hangs is reset, see below."""
    _, guest = machine
    assert "/dev/watchdog" in guest.run("ls -l /proc/$(pidof compboxd)/fd")
    assert guest.wait_stats(lambda s: s["elapsed_s"] > 15)["plc"]["connects"] == 1


def test_temperatures_over_can_reach_the_axis(machine):
    plc, guest = machine
    plc.wait_um(PATH_UM)
    guest.run("echo 300 455 >/run/node")          # T2: at once
    plc.wait_um(g.wanted_um(30, 30, 45.5))
    guest.run("echo -50 455 >/run/node")          # T1 below zero; its lag follows with 4 s
    plc.wait(lambda s: abs(float(s["applied_Z"]) - g.wanted_um(-5, 30, 45.5)) < 25)
    plc.wait_um(g.wanted_um(-5, -5, 45.5), timeout_s=40)
    guest.run("echo 300 200 >/run/node")
    plc.wait_um(PATH_UM, timeout_s=40)
    can = guest.wait_stats(lambda s: s["can"]["frames"] > 100)["can"]
    assert can["state"] == "up" and can["nodes"][0]["state"] == "operational"
    assert can["short_frames"] == can["queue_overflows"] == can["error_frames"] == 0


def test_a_node_that_boots_is_started_again(machine):
    plc, guest = machine
    boots = guest.stats()["can"]["nodes"][0]["boots"]
    guest.run("killall -HUP node")
    node = guest.wait_stats(lambda s: s["can"]["nodes"][0]["boots"] == boots + 1 and
                            s["can"]["nodes"][0]["state"] == "operational")["can"]["nodes"][0]
    assert node["starts"] >= 2
    plc.wait_um(PATH_UM)


def test_a_bus_that_goes_away_comes_back(machine):
    """Bus-off as the driver tells it (the emulated controller never does it by itself), the interface
    down, up again, and the message of the restart. What brings it up is held for that long."""
    plc, guest = machine
    plc.wait_um(PATH_UM)
    guest.run("killall -STOP compbox-devices; /opt/test/node bus-off can0 && /bin/ip link set can0 down")
    plc.wait_um(0)                                  # terms fade out: the box stays ACTIVE, degraded
    can = guest.wait_stats(lambda s: s["can"]["state"] == "down")["can"]
    assert can["bus_offs"] == 1 and can["error_frames"] >= 1 and can["went_down"] == 1
    assert can["nodes"][0]["state"] == "unknown" and can["nodes"][0]["losses"] >= 1
    guest.run("killall -CONT compbox-devices")
    guest.run("until /bin/ip link show can0 | grep -q LOWER_UP; do usleep 100000; done; /opt/test/node restarted can0")
    plc.wait_um(PATH_UM)
    can = guest.wait_stats(lambda s: s["can"]["state"] == "up" and s["can"]["restarts"] == 1)["can"]
    assert can["nodes"][0]["state"] == "operational"


def test_an_adapter_that_is_unplugged_and_plugged_in_again(machine):
    """The interface disappears, and a new one without bit rate takes its place."""
    plc, guest = machine
    plc.wait_um(PATH_UM)
    guest.run("basename $(readlink /sys/class/net/can0/device) >/run/can0; cd /sys/bus/pci/drivers/kvaser_pci; "
              "cat /run/can0 >unbind; cd /")
    plc.wait_um(0)
    assert guest.wait_stats(lambda s: s["can"]["went_away"] == 1)["can"]["state"] == "not there"
    guest.run("cat /run/can0 >/sys/bus/pci/drivers/kvaser_pci/bind")
    plc.wait_um(PATH_UM)
    assert "bitrate 250000" in guest.run("/bin/ip -d link show can0")


def test_killed_without_warning_it_is_started_again(machine):
    plc, guest = machine
    plc.wait_um(PATH_UM)
    pid, said_from, killed_s = guest.run("pidof compboxd").split()[0], guest.now(), plc.now_s()
    guest.run("killall -KILL compboxd")
    guest.wait(r"[12] of 2 lags go on", 60, said_from)  # the slow one; the fast one where the state was fresh
    again_s = float(plc.wait_um(PATH_UM)["time_s"])
    assert guest.run("pidof compboxd").split()[0] != pid
    scans = plc.scans(killed_s, again_s)
    assert any("box heartbeat does not change; ramping" in row["event"] for row in scans)
    applied = [float(row["applied_Z_um"]) for row in scans]
    assert max(applied) > PATH_UM + 1
    assert max(abs(b - a) for a, b in zip(applied, applied[1:])) < 10, "a ramp has no step"


def test_a_daemon_that_hangs_is_reset_by_the_hardware(machine):
    plc, guest = machine
    guest.run("kill -STOP $(pidof compboxd)")
    guest.wait_reset()
    plc.wait_um(PATH_UM)


def test_a_reboot_ramps_first(machine):
    """Outputs are zero and the data partition is clean when the machine goes down."""
    plc, guest = machine
    guest.type("reboot")
    plc.wait(lambda s: s["mode"] == "5" and float(s["commanded_Z"]) == 0)
    guest.wait_reset()
    plc.wait_um(PATH_UM)
    assert "recovery" not in guest.run("dmesg | grep EXT4-fs")


def test_a_plc_that_dies_is_found_again(machine):
    plc, guest = machine
    plc.wait_um(PATH_UM)
    guest.wait_stats(lambda s: s["mode"] == "ACTIVE")  # it was STANDBY before
    plc.__exit__()
    guest.wait_stats(lambda s: s["mode"] == "STANDBY")
    plc.__enter__()
    plc.wait_um(PATH_UM)


def test_a_new_file_takes_over_and_a_bad_one_does_not(machine, port):
    plc, guest = machine
    plc.wait_um(PATH_UM)
    put(guest, g.coefficients(port, 2, 25))
    plc.wait_um(g.wanted_um(30, 30, 20, 25))
    bad = g.coefficients(port, 3)
    bad["channels"][0]["limit_um"] = -1
    printed = put(guest, bad, expect="1")
    assert "limit_um: -1 is outside the range" in printed
    assert guest.wait_stats(lambda s: s["reloads"]["taken"] == 1)["revision"] == 2
    assert '"revision": 2' in guest.run("cat /data/coefficients.json")
    guest.run("compbox-put - </data/coefficients.json.old")  # revision 1: a running box takes no older one
    assert guest.wait_stats(lambda s: s["reloads"]["refused"] >= 1)["revision"] == 2
    guest.run("killall -TERM compboxd")
    plc.wait_um(PATH_UM)
    assert guest.wait_stats(lambda s: s["mode"] == "ACTIVE")["revision"] == 1


def test_a_box_without_a_file_waits_for_its_first(machine, port):
    plc, guest = machine
    since = guest.now()
    guest.run("rm /data/coefficients.json* && killall -TERM compboxd")
    plc.wait(lambda s: s["mode"] == "5" and float(s["applied_Z"]) == 0)  # STOPPED in good order
    guest.wait("no /data/coefficients.json yet", 30, since)
    put(guest, g.coefficients(port))
    plc.wait_um(PATH_UM)


def test_settings_from_another_system_and_bad_ones(machine):
    _, guest = machine
    assert guest.run("printf 'A=1\\r\\nB=\"2 3\"\\r\\n' >/tmp/s; compbox-settings /tmp/s") == 'A=1\nB="2 3"\n'
    since = guest.now()
    assert "A=1" not in guest.run("printf 'A=1\\nB=(2\\n' >/tmp/s; compbox-settings /tmp/s")
    guest.wait(r"/tmp/s is not used, correct it with vi and reboot: syntax error", 10, since)
    assert "CAN_BITRATE=250000" in guest.run("cat /run/settings")


def test_the_log_is_sent_to_the_pc(machine):
    """As docs/image.md says: by the folder's owner, without a web server."""
    _, guest = machine
    with socket.create_server(("127.0.0.1", 0)) as pc:
        pc.settimeout(60)
        send = f"nc 10.0.2.2 {pc.getsockname()[1]} </data/log/box.log"
        guest.run(f"(compbox-as log '' sh -c '{send}' >/dev/null 2>&1 &)")
        connection, _ = pc.accept()
        with connection:
            connection.settimeout(60)
            received = b"".join(iter(lambda: connection.recv(65536), b""))
    assert b"compboxd: " in received


def test_an_address_by_dhcp(machine):
    plc, guest = machine
    guest.run("/bin/ip address flush dev eth0 && udhcpc -q -n -i eth0")
    assert "inet 10.0.2.15/24" in guest.run("/bin/ip address show dev eth0")
    assert "default via 10.0.2.2" in guest.run("/bin/ip route")
    plc.wait_um(PATH_UM)


def put_text(guest, path, text):
    """A file through the serial line, in pieces that its buffer takes."""
    text = text.replace("\n", " ").replace("'", "")
    guest.run(f": >{path}")
    for i in range(0, len(text), 200):
        guest.run(f"printf %s '{text[i:i + 200]}' >>{path}")


def put(guest, data, expect="0"):
    """A new coefficient file, as a technician brings it; out: what compbox-put printed."""
    put_text(guest, "/tmp/new.json", json.dumps(data))
    printed = guest.run("compbox-put - </tmp/new.json; echo put:$?")
    assert f"put:{expect}" in printed, printed
    return printed


def test_the_same_bits_as_on_every_other_target(machine):
    _, guest = machine
    here = [line for line in guest.run("/opt/test/conformance", 120).splitlines() if line.strip()]
    expected = (g.ROOT / "tests/conformance/expected.txt").read_text().splitlines()
    assert [line for line in here if line in expected] == expected


def test_a_flood_of_frames_is_survived(machine):
    """A thousand frames a second, while the loop runs and while it is kept away for some seconds: then the
    kernel's queue overflows. No faster: QEMU's SJA1000 never recovers from an overflow of its own."""
    plc, guest = machine
    before = guest.wait_stats(lambda s: True)["can"]
    guest.run("/opt/test/node flood can1 2000", 60)
    after = guest.wait_stats(lambda s: s["can"]["frames"] >= before["frames"] + 1400)
    assert after["mode"] == "ACTIVE" and after["can"]["queue_overflows"] == 0
    guest.run("kill -STOP $(pidof compboxd); /opt/test/node flood can1 2500; kill -CONT $(pidof compboxd)", 60)
    guest.wait_stats(lambda s: s["can"]["queue_overflows"] > 0)
    plc.wait_um(PATH_UM)
