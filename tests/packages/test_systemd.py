# SPDX-License-Identifier: MIT
"""The arm64 packages' life under a real systemd: Debian 12 with the real-time kernel in QEMU, the control on the
host. The tests go on from one another, in their order."""
import json
import re
import sys
import time

import pytest

import debian
from debian import guest as g
from test_packages import VERSION

sys.path.insert(0, str(debian.ROOT / "tests/hil"))
from box import free_port  # noqa: E402

FIGURES = debian.ROOT / "build/packages/figures.md"
CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23
FIFO = 1
FIRST_UM = g.wanted_um(0, 0, 0)
OTHER_UM = g.wanted_um(0, 0, 0, 25)
BLAS = "update-alternatives --get-selections | grep -E 'blas|lapack'"
NOW = "/mnt/compboxd_{0}-1_arm64.deb /mnt/compbox_{0}-1_arm64.deb"


def note(what, figure):
    with FIGURES.open("a") as file:
        file.write(f"| {what} | {figure} |\n")


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """The control, and the Debian that shall become its box."""
    folder, port = tmp_path_factory.mktemp("systemd"), free_port()
    FIGURES.unlink(missing_ok=True)
    disk = debian.make_disk(folder, port, {"first.json": (1, 0), "other.json": (2, 25)})
    with g.FakePlc(port, folder) as plc, debian.Debian(disk, folder) as box:
        box.run("mount -o ro /dev/vdb /mnt", 60)
        yield plc, box
        print(box.text)  # shown where a test failed


@pytest.fixture
def plc(pair):
    return pair[0]


@pytest.fixture
def box(pair):
    return pair[1]


def test_installing_enables_and_waits_for_a_coefficient_file(box):
    assert "atlas" not in box.run("dpkg-query -W -f '${Package} '")
    blas = box.run(BLAS)
    assert "/libblas.so.3" in blas and "/liblapack.so.3" in blas
    out = box.run(f"dpkg -i {NOW.format(VERSION)} /mnt/compbox-view_{VERSION}-1_arm64.deb 2>&1", 120)
    assert all(f"Setting up {name} " in out for name in ("compboxd", "compbox", "compbox-view"))
    assert box.run("dpkg --audit") == ""
    assert box.run("systemctl is-enabled compboxd compbox-view") == "enabled\nenabled\n"
    assert box.unit("ActiveState", "ConditionResult", "NRestarts") == ["inactive", "no", "0"]
    status = box.run("systemctl status -l compboxd || true")
    assert "unmet condition check (ConditionPathExists=/etc/compbox/coefficients.json)" in status
    assert box.run(BLAS) == blas, "the BLAS of all programs stays as it was"


def test_the_tools_work_with_debians_libraries(box):
    assert "2 terms" in box.run("compbox check /mnt/first.json", 60)
    assert "not found" not in box.run("ldd /usr/bin/compbox /usr/bin/fakeplc")
    assert box.run("compboxd --version") == f"compboxd {VERSION}\n"


def test_it_starts_and_compensates(plc, box):
    box.run("cp /mnt/first.json /etc/compbox/coefficients.json && systemctl start compboxd", 60)
    # Type=notify: the start has ended, so READY came
    assert box.unit("Type", "ActiveState", "SubState") == ["notify", "active", "running"]
    plc.wait_um(FIRST_UM)
    assert re.search(r"revision 1\b", box.journal())
    assert "ACTIVE" in box.run("until systemctl status compboxd | grep Status: | grep ACTIVE; do sleep 1; done", 60)


# a script of the guest, which has no curl
GET = (r"""printf '%s\n' 'exec 3<>/dev/tcp/127.0.0.1/8090' """
       r"""'printf "GET $1 HTTP/1.0\r\nHost: localhost\r\n\r\n" >&3' 'cat <&3' >/root/get""")


def test_the_page_reads_what_the_daemon_writes_and_may_do_nothing_else(box):
    """It runs since before the first start of compboxd, and finds the box without a restart."""
    assert box.run("systemctl show compbox-view -p NRestarts --value") == "0\n"
    box.run(GET)
    box.run("until bash /root/get /metrics | grep '^compbox_mode 1'; do sleep 1; done", 60)
    assert '"mode":"ACTIVE"' in box.run("bash /root/get /api/events", 20)
    page = box.run("systemctl show compbox-view -p MainPID --value").strip()
    status = box.run(f"grep -E '^(Uid|Groups|CapEff|CapBnd|NoNewPrivs)' /proc/{page}/status")
    values = dict(line.split(":", 1) for line in status.splitlines() if ":" in line)
    group = box.run("getent group compbox").split(":")[2]
    assert group in values["Groups"].split()
    assert values["Uid"].split()[0] not in box.run(f"grep ^Uid /proc/{box.pid()}/status").split()
    assert int(values["CapEff"], 16) == int(values["CapBnd"], 16) == 0 and values["NoNewPrivs"].strip() == "1"
    for place in ("/etc", "/run/compboxd", "/var/lib/compboxd", "/var/lib"):
        assert "Read-only" in box.run(f"nsenter -m -t {page} touch {place}/mark 2>&1 || true"), place
    printed = box.run("systemd-analyze security compbox-view --no-pager", 60)
    exposure = float(re.search(r"Overall exposure level for compbox-view.service: ([\d.]+)", printed)[1])
    note("`systemd-analyze security compbox-view`, exposure of 10", exposure)
    assert exposure <= 2.0


def test_it_is_nobody_with_two_capabilities(box):
    status = dict(line.split(":", 1) for line in box.run(f"cat /proc/{box.pid()}/status").splitlines() if ":" in line)
    users = {int(user) for user in status["Uid"].split()}
    assert len(users) == 1 and 61184 <= users.pop() <= 65519, "a user of systemd's own making"
    both = f"{1 << CAP_IPC_LOCK | 1 << CAP_SYS_NICE:016x}"
    assert {name: status[name].strip() for name in ("CapEff", "CapPrm", "CapBnd", "CapAmb")} == \
        dict.fromkeys(("CapEff", "CapPrm", "CapBnd", "CapAmb"), both)
    assert status["NoNewPrivs"].strip() == "1"
    assert status["Seccomp"].strip() == "2" and int(status["Seccomp_filters"]) > 0
    assert int(status["VmLck"].split()[0]) > 1000, "its memory is locked"


def test_its_loop_runs_before_others(box):
    threads = box.run(f"cat /proc/{box.pid()}/task/*/stat").splitlines()
    fields = [line.rsplit(")", 1)[1].split() for line in threads if ")" in line]
    assert [(int(f[38]), int(f[37])) for f in fields if int(f[38])] == [(FIFO, 80)]
    assert box.wait_stats(lambda s: s["cycles"] > 0)["realtime"]["priority"] == 80


def test_its_system_is_read_only_and_its_tmp_its_own(box):
    for place in ("/usr/bin", "/etc", "/etc/compbox", "/var", "/root", "/boot"):
        assert "Read-only file system" in box.inside(f"touch {place}/mark"), place
    assert box.inside("touch /var/lib/compboxd/mark && rm /var/lib/compboxd/mark && echo written") == "written\n"
    box.run("touch /tmp/of-others")
    assert "of-others" not in box.inside("ls /tmp")
    assert box.inside("touch /tmp/its-own && ls /tmp") == "its-own\n"
    assert "its-own" not in box.run("ls /tmp; rm /tmp/of-others")


def test_what_systemd_thinks_of_it(box):
    printed = box.run("systemd-analyze security compboxd --no-pager", 60)
    exposure = float(re.search(r"Overall exposure level for compboxd.service: ([\d.]+)", printed)[1])
    note("`systemd-analyze security compboxd`, exposure of 10", exposure)
    assert exposure <= 2.5


def test_a_reload_takes_over_the_new_file(plc, box):
    before = box.pid()
    box.run("cp /mnt/other.json /etc/compbox/new && mv /etc/compbox/new /etc/compbox/coefficients.json"
            " && systemctl reload compboxd")
    plc.wait_um(OTHER_UM)
    assert box.pid() == before
    assert box.wait_stats(lambda s: s["reloads"]["taken"] == 1)["revision"] == 2


def restarted(plc, box, kill):
    """Kills it so and waits until it compensates again; out: seconds by the guest's clock."""
    before, restarts = box.pid(), int(box.unit("NRestarts"))
    from_s = float(box.run(f"cat /proc/uptime; kill -{kill} {before}").split()[0])
    until = time.monotonic() + 60 * g.SLOW
    while int(box.unit("NRestarts")) == restarts or box.unit("SubState") != "running":
        assert time.monotonic() < until, "it was not restarted"
    assert box.pid() != before
    plc.wait_um(OTHER_UM)
    return box.uptime_s() - from_s


def test_systemds_watchdog_restarts_one_that_hangs(plc, box):
    took_s = restarted(plc, box, "STOP")
    assert "Watchdog timeout" in box.journal()
    note("compensates again after SIGSTOP, s", f"{took_s:.1f}")


def test_it_is_restarted_when_killed(plc, box):
    took_s = restarted(plc, box, "KILL")
    assert "code=killed, status=9/KILL" in box.journal()
    note("compensates again after SIGKILL, s", f"{took_s:.1f}")


def test_an_upgrade_keeps_what_is_the_machines(plc, box):
    box.run("""echo 'COMPBOXD_OPTIONS="--priority 70"' >/etc/default/compboxd""")
    box.run("md5sum /etc/default/compboxd /etc/compbox/coefficients.json >/root/sums")
    before = box.pid()
    box.run(f"dpkg -i {NOW.format('99.0.0')} 2>&1", 90)
    assert box.run("dpkg-query -W -f '${Status} ${Version}' compboxd") == "install ok installed 99.0.0-1"
    box.run("md5sum -c /root/sums")
    assert box.unit("ActiveState") == "active" and box.pid() != before
    assert "--priority 70" in box.run(f"tr '\\0' ' ' </proc/{box.pid()}/cmdline")
    plc.wait_um(OTHER_UM)
    assert "lags go on" in box.journal(20)


def test_it_starts_with_the_system(plc, box):
    box.reboot()
    plc.wait_um(OTHER_UM)
    assert box.unit("ActiveState", "NRestarts") == ["active", "0"]


def test_a_bad_file_is_reported_and_a_good_one_starts_it(plc, box):
    box.run("cp /etc/compbox/coefficients.json /root/good && echo '{' >/etc/compbox/coefficients.json"
            " && ! systemctl restart compboxd", 60)
    assert "/etc/compbox/coefficients.json" in box.journal(5)
    box.run("cp /root/good /etc/compbox/coefficients.json")
    plc.wait_um(OTHER_UM)


def test_removing_stops_it_with_the_outputs_at_zero(plc, box):
    box.run("dpkg -r compboxd compbox compbox-view 2>&1", 90)
    status = plc.wait(lambda s: s["mode"] == "5")
    assert float(status["applied_Z"]) == 0
    assert box.unit("ActiveState", "LoadState") == ["inactive", "not-found"]
    assert box.run("ls /usr/sbin/compboxd /usr/bin/compbox /run/compboxd /lib/systemd/system/compboxd.service "
                   "2>/dev/null || true") == ""
    box.run("md5sum -c /root/sums")


def test_a_purge_leaves_the_measurements_alone(box):
    assert box.run("ls -d /var/lib/private/compboxd") != ""
    box.run("dpkg -P compboxd compbox compbox-view 2>&1", 90)
    left = box.run("find / -xdev -name '*compbox*' -not -path '/var/log/*' -not -path '/root/*'").split()
    assert left == ["/etc/compbox"]
    assert json.loads(box.run("cat /etc/compbox/coefficients.json"))["revision"] == 2
