# SPDX-License-Identifier: MIT
"""The Debian packages: what lintian says, their dependencies, manuals and demo, and a life from installation to purge
in a folder as the root."""
import gzip
import json
import os
import pathlib
import platform
import re
import shlex
import shutil
import socket
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
PACKAGES = ROOT / "build/packages"
VERSION = re.search(r"project\(compbox VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
DAEMONS = [f"compboxd_{VERSION}-1_amd64.deb", f"compboxd_{VERSION}-1_arm64.deb"]
TOOLS = [f"compbox_{VERSION}-1_amd64.deb", f"compbox_{VERSION}-1_arm64.deb"]
PAGES = [f"compbox-view_{VERSION}-1_amd64.deb", f"compbox-view_{VERSION}-1_arm64.deb"]
ALL = [*DAEMONS, *TOOLS, *PAGES]
EMULATED = {"arm64": ["qemu-aarch64", "-L", str(ROOT / "build/debian/sysroot")], "amd64": []}  # with libmodbus

sys.path.insert(0, str(ROOT / "tests/hil"))
import machine  # noqa: E402


def run(*words, **how):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **how)
    assert done.returncode == 0, f"{shlex.join(map(str, words))}\n{done.stdout}{done.stderr}"
    return done.stdout


# What the programs are linked with, by hand from `readelf -d`; dpkg-shlibdeps says it too, for arm64 by a database
# that scripts/arm64-sysroot makes.
NEEDED = {"compboxd": ["libc6", "libmodbus5", "libsodium23", "zlib1g"],
          "compbox-view": ["libc6", "libfmt9", "libmicrohttpd12", "libmosquitto1", "libstdc++6", "libgcc-s1", "zlib1g"],
          "compbox": ["libc6", "libmodbus5", "libsodium23", "libstdc++6", "libgcc-s1", "libgoogle-glog0v6",
                      "libcholmod3", "libcxsparse3", "liblapack3", "liblapack.so.3"]}
BLAS = re.compile("atlas|blas|lapack")


@pytest.mark.parametrize("package", ALL)
def test_it_depends_on_its_libraries(package):
    depends = run("dpkg-deb", "-f", PACKAGES / package, "Depends")
    names = {word.split()[0] for word in re.split(r"[,|]", depends)}
    assert set(NEEDED[package.split("_")[0]]) <= names, depends
    assert all("(>=" in word for word in depends.split(", ") if word.startswith(("libc6", "libstdc++6"))), depends


def apt_installs(folder, package, *others):
    """out: the packages of linear algebra that apt adds on a Debian with nothing installed."""
    (folder / "status").touch()
    environment = dict(os.environ)
    if "_arm64" in package:  # of the lists that scripts/arm64-sysroot fetched
        environment["APT_CONFIG"] = str(ROOT / "build/debian/apt/conf")
    printed = run("apt-get", "-s", "-o", f"Dir::State::status={folder}/status", "-o", "APT::Install-Recommends=false",
               "install", PACKAGES / package, *others, env=environment)
    names = re.findall(r"^Inst (\S+)", printed, re.MULTILINE)
    assert package.split("_")[0] in {name.split(":")[0] for name in names}, printed
    return {name.split(":")[0] for name in names if BLAS.search(name)}


@pytest.mark.parametrize("package", TOOLS)
def test_installing_takes_the_generic_blas_or_the_one_that_is_there(package, tmp_path):
    """ATLAS has a higher priority than the generic BLAS: installed, it becomes that of every program."""
    assert apt_installs(tmp_path, package) == {"libblas3", "liblapack3"}
    assert apt_installs(tmp_path, package, "libopenblas0-pthread") == {"libopenblas0-pthread"}


@pytest.mark.parametrize("package", TOOLS)
def test_no_program_is_linked_with_one_blas(package, tmp_path):
    run("dpkg-deb", "-x", PACKAGES / package, tmp_path)
    needed = re.findall(r"NEEDED.*\[(.*)\]", run("readelf", "-d", tmp_path / "usr/bin/compbox"))
    assert [name for name in needed if BLAS.search(name)] == ["liblapack.so.3"]


@pytest.mark.parametrize("package", ALL)
def test_lintian_finds_nothing(package):
    """Neither errors nor warnings, infos or pedantic ones; an override names its reason beside it."""
    done = subprocess.run(["lintian", "--allow-root", "-I", "--pedantic", PACKAGES / package],
                          capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")


def contents(package, folder):
    """Unpacks it. out: the paths of its files"""
    run("dpkg-deb", "-x", PACKAGES / package, folder)
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir() or path.is_symlink()}


def test_both_architectures_have_the_same_files(tmp_path):
    for amd64, arm64 in (DAEMONS, TOOLS, PAGES):
        here, there = contents(amd64, tmp_path / amd64), contents(arm64, tmp_path / arm64)
        assert here == there
        for page in (name for name in here if name.startswith("usr/share/")):
            assert (tmp_path / amd64 / page).is_symlink() or \
                (tmp_path / amd64 / page).read_bytes() == (tmp_path / arm64 / page).read_bytes(), page


def test_packing_again_gives_the_same_bytes(tmp_path):
    run("cpack", "--config", "CPackConfig.cmake", "-B", tmp_path, cwd=ROOT / "build/host")
    for package in (DAEMONS[0], TOOLS[0], PAGES[0]):
        assert (tmp_path / package).read_bytes() == (PACKAGES / package).read_bytes()


@pytest.mark.parametrize("package", [DAEMONS[0], TOOLS[0], PAGES[0]])
def test_every_program_and_command_has_a_good_man_page(package, tmp_path):
    contents(package, tmp_path)
    programs = [*tmp_path.glob("usr/bin/*"), *tmp_path.glob("usr/sbin/*")]
    helps = {program.name: run(program, "--help") for program in programs}
    listed = re.findall(r"^  ([\w-]+) ", helps.get("compbox", "").partition("Subcommands:\n")[2].split("\n\n")[0],
                        re.MULTILINE)
    helps.update({f"compbox-{command}": run(tmp_path / "usr/bin/compbox", command, "--help") for command in listed})
    pages = {path.name.split(".")[0]: path for path in tmp_path.glob("usr/share/man/man*/*.gz")}
    assert pages.keys() == helps.keys()
    for name, path in pages.items():
        troff = tmp_path / "page"
        troff.write_bytes(gzip.decompress(path.read_bytes()))
        lint = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", troff], capture_output=True, text=True)
        assert (lint.returncode, lint.stdout) == (0, ""), name
        shown = subprocess.run(["man", "--warnings", "-l", troff], capture_output=True, text=True,
                               env=dict(os.environ, MANWIDTH="200", LC_ALL="C.UTF-8"))
        assert (shown.returncode, shown.stderr) == (0, ""), name
        options = set(re.findall(r"^  (?:-\w,)?(-[\w-]+)", helps[name], re.MULTILINE))
        assert options and not {o for o in options if not re.search(rf"^ +(-\w, )?{o}\b", shown.stdout, re.MULTILINE)}
        assert f"\n       {name} - " in shown.stdout and "\nEXAMPLES\n" in shown.stdout, name


# What Debian calls essential, and awk; no compiler.
MINIMAL = ["bash", "env", "awk", "cat", "cp", "mkdir", "mkfifo", "rm", "sed", "sleep", "tail"]


@pytest.mark.parametrize("draws", [False, True], ids=["without gnuplot", "with gnuplot"])
def test_the_demo_runs_from_the_packages(tmp_path, draws):
    for package in (DAEMONS[0], TOOLS[0], PAGES[0]):
        contents(package, tmp_path / "root")
    (tmp_path / "bin").mkdir()
    for name in MINIMAL + ["gnuplot"] * draws:
        (tmp_path / "bin" / name).symlink_to(shutil.which(name))
    root, out = tmp_path / "root/usr", tmp_path / "out"
    words = [root / "bin/compbox-demo", out]
    environment = {"PATH": f"{root}/bin:{root}/sbin:{tmp_path}/bin", "LC_ALL": "C.UTF-8",
                   "COMPBOX_EXAMPLES": str(root / "share/compbox/examples")}
    printed = run(*words, env=environment, cwd=tmp_path)
    assert "STOPPED: a stop was requested" in printed
    reported = json.loads((out / "report.json").read_text())
    assert all(percent > 90 for percent in reported["reduction_percent"].values()), "in virtual time"
    assert reported["in_motion"]["before_um"]["Z"] > 30 and reported["plc"]["replies"] > 100
    drawn = {path.name for path in (out / "plots").iterdir()}
    assert drawn >= {"EXY.svg", "EZX.svg", "space-diagonal.svg"} if draws else not drawn
    again = subprocess.run(words, env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert (again.returncode, again.stderr) == (1, f"compbox-demo: {out} exists: remove it or name another folder\n")


@pytest.mark.parametrize("package", ALL)
def test_programs_are_hardened(package, tmp_path):
    subprocess.run(["dpkg-deb", "-x", PACKAGES / package, tmp_path], check=True)
    files = [*tmp_path.glob("usr/bin/*"), *tmp_path.glob("usr/sbin/*")]
    programs = [file for file in files if file.read_bytes()[:4] == b"\x7fELF"]
    assert programs and {file.name for file in files} - {file.name for file in programs} <= {"compbox-demo"}
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
    assert state.is_dir()
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
    for path in ("/usr/sbin", "/etc/compbox", "/run/compboxd", "/var/lib/compboxd", "/var/lib/compboxd/blackbox"):
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
            while not (printed := systemd.recv(500)).startswith(b"STOPPING=1"):
                assert printed.startswith((b"STATUS=", b"WATCHDOG=1")), printed
            daemon.wait(20)
        finally:
            daemon.kill()
    assert (target.folder / "run/compboxd/stats.json").exists()
    assert (target.folder / "var/lib/compboxd/lags").exists()
    assert (target.folder / "var/lib/compboxd/record.csv").read_text().startswith("time_s,")


def test_the_tools_run_from_where_they_are_installed(tmp_path):
    target = Target(tmp_path / "root", "amd64")
    target.dpkg("--install", PACKAGES / f"compbox_{VERSION}-1_amd64.deb")
    machine.write_coefficients(tmp_path / "c.json", 1502)
    assert "signals" in run(target.folder / "usr/bin/compbox", "check", tmp_path / "c.json")
    target.dpkg("--remove", "compbox")
    assert not (target.folder / "usr/bin/compbox").exists()
