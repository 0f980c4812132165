# SPDX-License-Identifier: MIT
"""The Debian packages: what lintian says, and a life from installation to purge in a folder as the root."""
import os
import pathlib
import platform
import re
import shlex
import socket
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
PACKAGES = ROOT / "build/packages"
VERSION = re.search(r"project\(compbox VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
DAEMONS = [f"compboxd_{VERSION}-1_amd64.deb", f"compboxd_{VERSION}-1_arm64.deb"]
TOOLS = [f"compbox_{VERSION}-1_amd64.deb", f"compbox_{VERSION}-1_arm64.deb"]
ALL = [*DAEMONS, *TOOLS]
EMULATED = {"arm64": ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"], "amd64": []}

sys.path.insert(0, str(ROOT / "tests/hil"))
import machine  # noqa: E402


def run(*words, **how):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **how)
    assert done.returncode == 0, f"{shlex.join(map(str, words))}\n{done.stdout}{done.stderr}"
    return done.stdout


# What the programs are linked with, by hand from `readelf -d`; dpkg-shlibdeps says it too, for arm64 by a database
# that scripts/arm64-sysroot makes.
NEEDED = {"compboxd": ["libc6"], "compbox": ["libc6", "libstdc++6", "libgcc-s1", "libgoogle-glog0v6", "libcholmod3",
                                             "libcxsparse3"]}


@pytest.mark.parametrize("package", ALL)
def test_it_depends_on_its_libraries(package):
    depends = run("dpkg-deb", "-f", PACKAGES / package, "Depends")
    names = {word.split()[0] for word in re.split(r"[,|]", depends)}
    assert set(NEEDED[package.split("_")[0]]) <= names, depends
    assert all("(>=" in word for word in depends.split(", ") if word.startswith(("libc6", "libstdc++6"))), depends


@pytest.mark.parametrize("package", ALL)
def test_lintian_finds_no_error(package):
    done = subprocess.run(["lintian", "--fail-on", "error", "--allow-root", PACKAGES / package],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "E: " not in done.stdout


@pytest.mark.parametrize("package", ALL)
def test_programs_are_hardened(package, tmp_path):
    subprocess.run(["dpkg-deb", "-x", PACKAGES / package, tmp_path], check=True)
    programs = [*tmp_path.glob("usr/bin/*"), *tmp_path.glob("usr/sbin/*")]
    assert programs
    done = subprocess.run([sys.executable, ROOT / "tests/gates/hardening.py", *programs],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


class Target:
    """A folder that dpkg takes for the root of a machine."""

    def __init__(self, folder, architecture):
        self.folder, self.architecture = folder, architecture
        for name in ("var/lib/dpkg/info", "var/lib/dpkg/updates", "var/lib/dpkg/triggers", "etc"):
            (folder / name).mkdir(parents=True)
        (folder / "var/lib/dpkg/status").touch()
        (folder / "var/lib/dpkg/available").touch()
        (folder / "var/lib/dpkg/arch").write_text(f"{architecture}\n")

    def dpkg(self, *words):
        return run("dpkg", f"--root={self.folder}", "--force-depends", "--force-script-chrootless",
                   "--force-not-root", "--force-confold", "--force-architecture", f"--log={self.folder}/log",
                   *words)

    def state(self, package="compboxd"):
        done = subprocess.run(["dpkg-query", f"--admindir={self.folder}/var/lib/dpkg", "-W", "-f",
                               "${db:Status-Status} ${Version}", package], capture_output=True, text=True)
        return done.stdout.strip()

    def compboxd(self, *words):
        return subprocess.run([*EMULATED[self.architecture], str(self.folder / "usr/sbin/compboxd"), *words],
                              capture_output=True, text=True)


@pytest.mark.parametrize("architecture", ["amd64", "arm64"])
def test_a_daemons_life(tmp_path, architecture):
    target = Target(tmp_path / "root", architecture)
    target.dpkg("--install", PACKAGES / f"compboxd_{VERSION}-1_{architecture}.deb")
    assert target.state() == f"installed {VERSION}-1"
    assert target.compboxd("--version").stdout == f"compboxd {VERSION}\n"
    coefficients = target.folder / "etc/compbox/coefficients.json"
    machine.write_coefficients(coefficients, 1502)
    assert target.compboxd("--config", str(coefficients), "--check").returncode == 0
    options = target.folder / "etc/default/compboxd"
    options.write_text('COMPBOXD_OPTIONS="--priority 7"\n')

    later = next((PACKAGES / "later").glob(f"compboxd_99.0.0-1_{architecture}.deb"))
    target.dpkg("--install", later)
    assert target.state() == "installed 99.0.0-1"
    assert "--priority 7" in options.read_text(), "a changed configuration file survives an upgrade"
    assert coefficients.exists()

    target.dpkg("--remove", "compboxd")
    assert target.state().startswith("config-files")
    assert not (target.folder / "usr/sbin/compboxd").exists()
    assert not (target.folder / "lib/systemd/system/compboxd.service").exists()
    assert options.exists() and coefficients.exists()

    state = target.folder / "var/lib/private/compboxd"
    state.mkdir(parents=True)
    target.dpkg("--purge", "compboxd")
    assert target.state().split(" ")[0] in ("", "not-installed")
    assert not options.exists() and not state.exists()
    assert coefficients.exists(), "the machine's measurements are nobody's to throw away"


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the unit's command runs here")
def test_the_units_command_starts_and_stops(tmp_path):
    """What systemd would run, with its variables, as far as a test without systemd can: READY, and a stop."""
    target = Target(tmp_path / "root", "amd64")
    target.dpkg("--install", PACKAGES / DAEMONS[0])
    unit = (target.folder / "lib/systemd/system/compboxd.service").read_text()
    command = next(line for line in unit.splitlines() if line.startswith("ExecStart=")).removeprefix("ExecStart=")
    for path in ("/usr/sbin", "/etc/compbox", "/run/compboxd", "/var/lib/compboxd"):
        (target.folder / path[1:]).mkdir(parents=True, exist_ok=True)
        command = command.replace(path + "/", f"{target.folder}{path}/")
    machine.write_coefficients(target.folder / "etc/compbox/coefficients.json", 1502)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(20)
        words = shlex.split(command.replace("$COMPBOXD_OPTIONS", ""))
        daemon = subprocess.Popen(words, stderr=subprocess.PIPE, text=True,
                                  env=dict(os.environ, NOTIFY_SOCKET=str(tmp_path / "notify")))
        try:
            assert systemd.recv(100) == b"READY=1"
            daemon.terminate()
            while not (said := systemd.recv(500)).startswith(b"STOPPING=1"):
                assert said.startswith((b"STATUS=", b"WATCHDOG=1")), said
            daemon.wait(20)
        finally:
            daemon.kill()
    assert (target.folder / "run/compboxd/stats.json").exists()
    assert (target.folder / "var/lib/compboxd/lags").exists()


def test_the_tools_run_from_where_they_are_installed(tmp_path):
    target = Target(tmp_path / "root", "amd64")
    target.dpkg("--install", PACKAGES / f"compbox_{VERSION}-1_amd64.deb")
    machine.write_coefficients(tmp_path / "c.json", 1502)
    assert "signals" in run(target.folder / "usr/bin/compbox", "check", tmp_path / "c.json")
    target.dpkg("--remove", "compbox")
    assert not (target.folder / "usr/bin/compbox").exists()
