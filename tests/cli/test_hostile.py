# SPDX-License-Identifier: MIT
"""A hostile user: files spoiled in every key, streams that break, places that cannot be written.
Whatever it is, one sentence and exit 1, nothing half-written, never a fault in the program itself."""

import copy
import json
import os
import random
import resource
import shutil
import subprocess
import tempfile

import pytest

from conftest import BIN, GANTRY, LONG, PLC, term

GONE = object()
SPOILED = [None, True, -1, 0, 1e308, 1.5, "x", "", [], {}, [[1]], {"a": 1}, 10**30, "\0", GONE]
EVERY = 60 if LONG else 20  # of the spoiled files of one kind, drawn by a fixed seed


def places(value, at=()):
    """Every key and the first two entries of every list, as paths."""
    if at:
        yield at
    if isinstance(value, dict):
        inner = value.items()
    else:
        inner = enumerate(value[:2]) if isinstance(value, list) else ()
    for key, item in inner:
        yield from places(item, at + (key,))


def spoiled(value, at, new):
    value = copy.deepcopy(value)
    holder = value
    for key in at[:-1]:
        holder = holder[key]
    if new is GONE:
        del holder[at[-1]]
    else:
        holder[at[-1]] = new
    return value


def drawn(value):
    cases = [(at, new) for at in places(value) for new in SPOILED]
    return [spoiled(value, *case) for case in random.Random(7).sample(cases, EVERY)]


def check(program, done, *names):
    """Exit 0, or 1 with one sentence that names one of the files."""
    printed = (done.returncode, done.stderr)
    assert done.returncode in (0, 1), printed
    if done.returncode == 1:
        assert done.stderr.startswith(program + ": ") and done.stderr.count("\n") == 1, printed
        assert any(name in done.stderr for name in names), printed


@pytest.fixture
def files(compbox, machine):
    compbox.write("term.json", term())
    compbox.good("build", "machine.json", "term.json", "-o", "good.json")
    for name in ("machine_twin.json", "scenario.json"):
        shutil.copy(GANTRY / name, compbox.folder / name)
    shutil.copy(GANTRY / "machine.json", compbox.folder / "gantry.json")
    return compbox


@pytest.mark.parametrize("name", ["machine.json", "term.json"])
def test_build_with_a_spoiled_file(files, name):
    for value in drawn(files.read(name)):
        files.write("bad.json", value)
        given = ["bad.json" if name == one else one for one in ("machine.json", "term.json")]
        check("compbox", files("build", *given, "-o", "c.json"), "machine.json", "bad.json")


def test_check_with_a_spoiled_file(files):
    for value in drawn(files.read("good.json")):
        files.write("bad.json", value)
        check("compbox", files("check", "bad.json"), "bad.json")


@pytest.mark.parametrize("name, option", [("good.json", "--map"), ("machine_twin.json", "--machine")])
def test_fakeplc_with_a_spoiled_file(files, name, option):
    for value in drawn(files.read(name)):
        files.write("bad.json", value)
        done = subprocess.run([BIN / "fakeplc", "--listen", "127.0.0.1:0", option, "bad.json"],
                              cwd=files.folder, input="quit\n", capture_output=True, text=True,
                              timeout=60)
        check("fakeplc", done, "bad.json", "machine.json")


def test_fakeplc_empties_no_file_that_it_reads(files):
    before = files.files()
    for option, name in (("--map", "good.json"), ("--machine", "machine_twin.json")):
        done = subprocess.run([BIN / "fakeplc", "--listen", "127.0.0.1:0", "--log", name, option, "./" + name],
                              cwd=files.folder, input="quit\n", capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (
            1, f"fakeplc: {name}: was read by this very command: give the log another name\n")
    assert files.files() == before


@pytest.mark.parametrize("spoil, message", [
    (lambda s: s["paths"][0]["to_mm"].update(X=1e30),
     "the path diagonal goes to X = 1e+30 mm, but the machine has 0 to 14300"),
    (lambda s: s["methods"][0].update(method="spline"),
     "there is no method or line 'spline' (there are bspline, bspline-lmc, polynomial, polyline)"),
    (lambda s: s["methods"][0].update(name="../x"),
     "methods[].name must be letters, digits, '_' and '-': a folder is named so"),
    (lambda s: s.update(curves=["QQQ"]), "'QQQ' is not an ISO 230-1 name such as EZX"),
    (lambda s: s.update(seeds="all"), "the key 'seeds' has the wrong type (string)"),
])
def test_simulate_with_a_spoiled_scenario(files, spoil, message):
    scenario = files.read("scenario.json")
    scenario["paths"][0]["name"] = "diagonal"
    scenario["machine"] = "gantry.json"
    spoil(scenario)
    files.write("bad.json", scenario)
    assert files.refused("simulate", "bad.json", "-o", "out") == f"bad.json: {message}"


@pytest.mark.parametrize("statistics", [
    [], {"history": 3}, {"history": [1, {"mode": 2, "time_s": "x"}], "cycles": "x", "jitter_us": {"p50": "x"}},
])
def test_simulate_with_somebody_elses_statistics(files, statistics):
    scenario = files.read("scenario.json")
    path = {**scenario["paths"][0], "every_mm": 7000}
    files.write("bad.json", {**scenario, "machine": "gantry.json", "measurements": "", "seeds": [1],
                             "paths": [path], "methods": [{"name": "polyline"}], "moving_mm_per_min": [10000]})
    files.write("stats.json", statistics)
    check("compbox", files("simulate", "bad.json", "--stats", "stats.json", "-o", "out"), "stats.json")


def test_a_mistake_in_a_term_comes_before_what_cannot_be_filled_in(compbox):
    compbox.good("init", *PLC, "--axes", "XYZ", "--profile", "generic", "-o", "machine.json")
    for spoil, message in ((lambda t: t.pop("signal"), "the key signal is missing"),
                           (lambda t: t.update(positions=""), "must be a list")):
        value = term()
        spoil(value["terms"][0])
        compbox.write("t.json", value)
        printed = compbox.refused("build", "machine.json", "t.json", "-o", "c.json")
        assert printed.startswith("t.json: terms[0]") and message in printed, printed


def test_streams_that_break(files):
    run = dict(cwd=files.folder, stderr=subprocess.PIPE, text=True, timeout=60)
    with open("/dev/full", "w") as full:
        for arguments in (["check", "good.json"], ["build", "machine.json", "term.json", "-o", "-"]):
            done = subprocess.run([BIN / "compbox", *arguments], stdout=full, **run)
            assert done.returncode == 1 and "written" in done.stderr or "write" in done.stderr, done
    closed = subprocess.run([BIN / "compbox", "check", "good.json"], close_fds=True,
                            preexec_fn=lambda: os.close(1), **run)
    assert closed.returncode == 0, closed


@pytest.mark.parametrize("output, message", [
    ("", "the name of the file to write is empty"),
    ("no/such/c.json", "no/such/c.json: cannot create a file there (No such file or directory)"),
    ("/dev/full", "/dev/full: is not a regular file, so it is not written over"),
    (".", ".: is not a regular file, so it is not written over"),
])
def test_outputs_that_cannot_be_written(files, output, message):
    assert files.refused("build", "machine.json", "term.json", "-o", output) == message


def limited(folder, bytes_most, *arguments):
    """compbox, whose files may grow to so many bytes: the signal for that kills most programs."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_most, bytes_most))
    return subprocess.run([BIN / "compbox", *arguments], cwd=folder, preexec_fn=limit,
                          capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("bytes_most", [0, 500])
def test_a_file_that_may_not_grow(files, bytes_most):
    before = files.files()
    done = limited(files.folder, bytes_most, "build", "machine.json", "term.json", "-o", "good.json")
    assert (done.returncode, done.stderr) == (
        1, "compbox: good.json: cannot write the file (File too large)\n")
    assert files.files() == before


@pytest.mark.skipif(shutil.which("gnuplot") is None, reason="no gnuplot here")
def test_a_figure_that_is_not_whole_is_none(files):
    """gnuplot itself ends well however little of its figure could be written."""
    before = files.files()
    done = limited(files.folder, 8192, "report", GANTRY / "measurements/EZX.csv", "--plot", "f.svg")
    assert (done.returncode, done.stderr) == (
        1, "compbox: f.svg: the figure could not be written whole (is the disk full?)\n")
    assert files.files() == before


def test_what_was_read_is_not_written_over(files):
    """A measurement is the one thing that no computer brings back."""
    files.write("d.csv", "position_mm,error_um\n0,0\n1,1\n2,0\n3,1\n4,0\n5,2\n6,1\n")
    files.write("s.csv", "time_s,X,Y,Z\n0,1,2,3\n")
    (files.folder / "link.csv").symlink_to("d.csv")
    fit = ("fit", "d.csv", "--name", "EZX", "--signal", "X")
    for name, *command in (("d.csv", *fit, "-o", "d.csv"), ("./d.csv", *fit, "-o", "./d.csv"),
                           ("link.csv", *fit, "-o", "link.csv"),
                           ("d.csv", *fit, "--band", "d.csv", "-o", "t.json"),
                           ("s.csv", "eval", "good.json", "--inputs", "s.csv", "-o", "s.csv"),
                           ("good.json", "pack", "good.json", "-o", "good.json"),
                           ("term.json", "build", "machine.json", "term.json", "-o", "term.json"),
                           ("machine.json", "build", "machine.json", "term.json", "-o", "machine.json")):
        assert files.refused(*command) == (
            f"{name}: was read by this very command: give what it writes another name")
    done = files(*fit, "--band", "t.json", "-o", "t.json")
    assert done.returncode == 2 and "--band: names the same file as -o" in done.stderr


def test_a_folder_that_may_not_be_written(files):
    """Root may write everywhere, so it runs as nobody, with its own copy of the program."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (BIN / "compbox", files.folder / "machine.json", files.folder / "term.json"):
            shutil.copy(name, folder)
        os.chmod(folder, 0o555)
        before = os.listdir(folder)
        done = subprocess.run(["./compbox", "build", "machine.json", "term.json", "-o", "c.json"],
                              cwd=folder, capture_output=True, text=True, timeout=60,
                              user=65534 if os.getuid() == 0 else None)
        assert done.stderr == "compbox: c.json: cannot create a file there (Permission denied)\n"
        assert done.returncode == 1 and os.listdir(folder) == before
        os.chmod(folder, 0o755)


def test_many_writers_of_one_file_leave_a_whole_one(files):
    writers = [subprocess.Popen([BIN / "compbox", "build", "machine.json", "term.json", "--revision",
                                 str(i), "-o", "c.json"], cwd=files.folder,
                                stdout=subprocess.DEVNULL) for i in range(12)]
    assert [writer.wait(60) for writer in writers] == [0] * 12
    files.good("check", "c.json")
    assert not [name for name in files.files() if "tmp" in name]


@pytest.mark.parametrize("content, message", [
    (b"", "EZX.csv: is empty: a header line is missing"),
    (b"\xef\xbb\xbf", "EZX.csv: is empty: a header line is missing"),
    (b"position_mm,error_um\r\n0,1\0\r\n", "EZX.csv:2:3: '1?' is not a finite number"),
    (b"position_mm,error_um\n0\n", "EZX.csv:2: has 1 column, the header has 2"),
])
def test_measurements_that_are_none(compbox, content, message):
    (compbox.folder / "EZX.csv").write_bytes(content)
    assert compbox.refused("fit", "EZX.csv", "--name", "EZX", "--signal", "X", "-o",
                           "t.json") == message


def test_a_port_in_use(files):
    first = subprocess.Popen([BIN / "fakeplc", "--listen", "127.0.0.1:0"], stdin=subprocess.PIPE,
                             stdout=subprocess.PIPE, text=True)
    try:
        port = first.stdout.readline().rsplit(":", 1)[1].strip()
        second = subprocess.run([BIN / "fakeplc", "--listen", f"127.0.0.1:{port}"], text=True,
                                capture_output=True, timeout=30, stdin=subprocess.DEVNULL)
        assert second.returncode == 1 and "is in use" in second.stderr
        assert second.stderr.count("\n") == 1
    finally:
        first.terminate()
        assert first.wait(10) == 0


# ---- what a program would do with all of its memory, or all of its stack

LIMIT = 2 << 30  # bytes of address space


def bounded(program, folder, *arguments, **how):
    """The program with LIMIT bytes of memory, a small stack and 60 s."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (LIMIT, LIMIT))
        resource.setrlimit(resource.RLIMIT_STACK, (1 << 20, 1 << 20))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return subprocess.run([BIN / program, *map(str, arguments)], cwd=folder, preexec_fn=limit, text=True,
                          capture_output=True, timeout=60, **how)


def test_the_last_seed_ends_the_list(files):
    for seeds in (str(2**64 - 1), f"{2**64 - 3}-{2**64 - 1}"):
        done = bounded("compbox", files.folder, "simulate", "none.json", "--seeds", seeds)
        assert done.returncode == 1 and done.stderr.startswith("compbox: none.json: cannot open"), done


def deep(levels, open_="[", close="]", inner=""):
    return open_ * levels + inner + close * levels


@pytest.mark.parametrize("text", [
    '{"format": "compbox-machine/1", "provenance": ' + deep(200000) + "}",
    '{"format": "compbox-machine/1", "provenance": ' + deep(200000, '{"a": ', "}", "1") + "}",
    "[" * 200000,
    "\n\n" + deep(33),
], ids=["lists", "objects", "open", "one too many"])
def test_nested_json_is_refused_by_every_reader(files, text):
    files.write("deep.json", text)
    line = text.count("\n") + 1
    for program, *arguments in (("compbox", "build", "deep.json", "term.json", "-o", "c.json"),
                                ("compbox", "build", "machine.json", "deep.json", "-o", "c.json"),
                                ("compbox", "simulate", "deep.json", "-o", "out"),
                                ("fakeplc", "--listen", "127.0.0.1:0", "--map", "deep.json"),
                                ("fakeplc", "--listen", "127.0.0.1:0", "--machine", "deep.json")):
        done = bounded(program, files.folder, *arguments, stdin=subprocess.DEVNULL)
        assert done.returncode == 1, (program, arguments, done)
        start = f"{program}: deep.json:{line}:"
        assert done.stderr.startswith(start), done.stderr
        assert done.stderr.endswith(": brackets are nested deeper than 32\n"), done.stderr
    small = files.write("small.json", deep(40))  # fits into the box
    for program, *arguments in (("compbox", "check", small), ("compboxd", "--config", small)):
        done = bounded(program, files.folder, *arguments)
        assert done.returncode == 1 and "brackets are nested deeper than 32" in done.stderr, done


def test_nesting_that_the_box_reads_is_read(files):
    files.write("t.json", deep(32))
    assert files.refused("build", "t.json", "term.json", "-o", "c.json") == "t.json: must be a JSON object"
    value = files.read("term.json")
    value["provenance"] = {"by": json.loads(deep(20)), "brackets": "[" * 1000 + '\\"' + "[" * 1000}
    files.write("t.json", value)
    files.good("build", "machine.json", "t.json", "-o", "c.json")


def test_a_counter_in_the_run_column(files):
    rows = "".join(f"{i % 100},{i * 7 % 13},r{i}\n" for i in range(20000))
    files.write("runs.csv", "position_mm,error_um,run\n" + rows)
    for command in (("fit", "runs.csv", "--name", "EZX", "--signal", "X", "-o", "t.json"), ("report", "runs.csv")):
        done = bounded("compbox", files.folder, *command)
        assert (done.returncode, done.stderr) == (
            1, "compbox: runs.csv: has 20000 readings in 20000 runs, too many to align: all readings of "
               "one traverse carry the same name in the column 'run' (so many readings: at most 500 runs)\n")


# ---- numbers that no integer holds

@pytest.mark.parametrize("spoil, message", [
    (lambda s: s["methods"][0].update(method="polynomial", degree=1e300),
     "the key 'degree' must be a whole number from -2147483648 to 2147483647"),
    (lambda s: s["methods"][0].update(method="polynomial", degree=2.5),
     "the key 'degree' must be a whole number from -2147483648 to 2147483647"),
    (lambda s: s.update(seeds=[1, 1e300]), "the key 'seeds' must be a whole number from 0 to 18446744073709551615"),
    (lambda s: s.update(seeds=[-1]), "the key 'seeds' must be a whole number from 0 to 18446744073709551615"),
    (lambda s: s["paths"][0].update(every_mm=1e-300),
     "the path diagonal has more than 100000 stops: make every_mm larger"),
    (lambda s: s.update(moving_mm_per_min=[1e-300]), "moving_mm_per_min must be from 0.001 to 10000000"),
    (lambda s: s.update(name="a\u202eb"), "the key 'name': 'a?b' contains a control character"),
])
def test_simulate_with_numbers_and_texts_of_no_use(files, spoil, message):
    scenario = files.read("scenario.json")
    scenario["paths"][0]["name"] = "diagonal"
    scenario["machine"] = "gantry.json"
    spoil(scenario)
    files.write("bad.json", scenario)
    assert files.refused("simulate", "bad.json", "-o", "out") == f"bad.json: {message}"


def test_a_whole_number_may_have_a_decimal_point(files):
    scenario = files.read("scenario.json")
    path = {**scenario["paths"][0], "every_mm": 7000}
    files.write("s.json", {**scenario, "machine": "gantry.json", "measurements": "", "seeds": [1.0], "paths": [path],
                           "methods": [{"name": "p", "method": "polynomial", "degree": 3.0}], "moving_mm_per_min": []})
    files.good("simulate", "s.json", "-o", "out")


@pytest.mark.parametrize("status", ["1e300", "-1", "65536", "-1e300"])
def test_a_log_with_a_status_that_no_register_holds(files, status):
    files.write("log.csv", f"time_s,event,status\n0,,1\n1,,{status}\n")
    printed = files.refused("simulate", "scenario.json", "--log", "log.csv", "-o", "out")
    assert printed == "log.csv:3: status must be from 0 to 65535"


# The first lines of a recording: the site's ceiling, the state with which the box started, and the columns.
SITE = "most_um,300,most_um_per_s,0\n"
STATE = "stopped,0,beat,1,plc_heartbeat,7,beat_us,-5,lags,\n"
RECORDED = ("number,generation,now_us,read_us,exchange_us,read_ok,last_write,held,stop,missed_ticks,samples,"
            "registers,held_registers,mode,channels,written")


@pytest.mark.parametrize("line, printed", [
    (SITE.replace("300", "nan"), "'nan' is not a number that can stand here"),
    (SITE.replace("300", "2e6"), "'2e6' is not a number that can stand here"),
    (SITE.replace("300", ""), "'' is not a number that can stand here"),
    (SITE.replace("most_um,", "least_um,"), "has no most_um"),
    ("most_um,300\n", "has 2 columns")])
def test_a_recording_with_a_ceiling_that_no_site_has(files, line, printed):
    files.write("r.csv", line + STATE + RECORDED + "\n")
    assert files.refused("simulate", "good.json", "--replay", "r.csv") == (
        f"r.csv:1: {printed}; it is not what compboxd --record-inputs writes")


@pytest.mark.parametrize("line, printed", [
    (STATE.replace("-5", "-9223372036854775808"), "'-9223372036854775808' is not a number that can stand here"),
    (STATE.replace("7", "65536"), "'65536' is not a number that can stand here"),
    (STATE.replace("beat,1", "beat,2"), "'2' is not a number that can stand here"),
    (STATE.replace("lags,", "lags,0:00000000:5"), "a lag is broken"),
    (STATE.replace("lags,", "lags,200:00000000:00000000:00000000:5"), "a lag is broken"),
    ("stopped,0\n", "has 2 columns")])
def test_a_recording_with_a_state_that_no_box_had(files, line, printed):
    files.write("r.csv", SITE + line + RECORDED + "\n")
    assert files.refused("simulate", "good.json", "--replay", "r.csv") == (
        f"r.csv:2: {printed}; it is not what compboxd --record-inputs writes")


@pytest.mark.parametrize("column", [2, 3])
@pytest.mark.parametrize("time", ["-9223372036854775808", "9223372036854775807", "-1"])
def test_a_recording_with_a_time_that_no_clock_shows(files, column, time):
    plc = files.read("good.json")["plc"]
    row = ["0", "0", "1000", "1000", "0", "0", "0", "0", "0", "0", "", "0000" * plc["read"]["count"], "", "0",
           "00000000" * len(files.read("good.json")["channels"]), "0000" * plc["write"]["count"]]
    row[column] = time
    files.write("r.csv", SITE + STATE + RECORDED + "\n" + ",".join(row) + "\n")
    assert files.refused("simulate", "good.json", "--replay", "r.csv") == (
        f"r.csv:4: '{time}' is not a number that can stand here; it is not what compboxd --record-inputs writes")


@pytest.mark.parametrize("time", ["-1e300", "-1.7e308", "-1"])
def test_a_table_whose_time_falls(files, time):
    files.write("s.csv", f"time_s,X,Y,Z\n0,1,2,3\n{time},1,2,3\n")
    assert files.refused("eval", "good.json", "--inputs", "s.csv", "-o", "o.csv") == (
        "s.csv:3: time_s must rise by at least a microsecond from row to row")


@pytest.mark.parametrize("formula", ["-" * 120000 + "X", "+" * 120000 + "X", "X" + "+X" * 60000, "X" + "^X" * 60000,
                                     "(" * 60000 + "X"])
def test_a_formula_without_end(files, formula):
    done = bounded("compbox", files.folder, "export", "good.json", "--format", "twincat-cam", "--master", "X",
                   "--path", "Y=" + formula, "-o", "cams")
    assert done.returncode == 1 and done.stderr.count("\n") == 1, (done.returncode, done.stderr[:200])
    assert f"has {len(formula)} characters; write it with at most 1000" in done.stderr, done.stderr[:200]


def test_messages_repeat_no_control_character(files):
    for hidden in "\x7f\u009b\u202e\u2028\u2066":
        files.write("d.csv", f"position_mm,error_um,a{hidden}b,a{hidden}b\n0,1,2,3\n")
        printed = files.refused("fit", "d.csv", "--name", "EZX", "--signal", "X", "-o", "t.json")
        assert "'a?b'" in printed and hidden not in printed, ascii(printed)


# ---- a scenario from a stranger

@pytest.fixture
def scenario(files):
    """.run(**changes): compbox simulate of a small scenario in its own folder, for output into out/."""
    folder = files.folder / "stranger"
    folder.mkdir()
    for name in ("machine_twin.json", "gantry.json"):
        shutil.copy(files.folder / name, folder / name)
    base = files.read("scenario.json")
    small = {**base, "machine": "gantry.json", "measurements": "", "seeds": [1], "moving_mm_per_min": [],
             "paths": [{**base["paths"][0], "every_mm": 7000}], "methods": [{"name": "polyline"}]}

    class Runner:
        pass
    runner = Runner()
    runner.folder = folder
    runner.outside = files.folder / "outside"

    def run(*options, **changes):
        (folder / "s.json").write_text(json.dumps({**small, **changes}))
        return bounded("compbox", files.folder, "simulate", "stranger/s.json", *options, "-o", "out")
    runner.run = run
    return runner


@pytest.mark.parametrize("word", ["commission", "simulate", "compboxd", "fakeplc", "--help", "/bin/sh"])
def test_a_step_computes_and_does_nothing_else(scenario, word):
    done = scenario.run(once=[f"{word} coefficients.json --listen 127.0.0.1:1"])
    assert done.returncode == 1
    assert done.stderr == (
        f"compbox: stranger/s.json: step '{word} coefficients.json --listen 127.0.0.1:1': '{word}' is not a step: "
        "a step is measure or a command that computes, such as fit or build\n")


INIT = "init --host 127.0.0.1 --axes XYZ --profile generic --travel X=1,Y=1,Z=1 -o "


@pytest.mark.parametrize("target", ["{outside}/f.json", "$out/../../outside/f.json", "../outside/f.json",
                                    "outside/f.json", "$out/link/f.json", "$out/file-link", "$here/link/f.json"])
@pytest.mark.parametrize("where", ["once", "steps"])
def test_a_step_writes_nowhere_else(files, scenario, target, where):
    scenario.outside.mkdir()
    (scenario.outside / "victim").write_text("precious")
    for place in (files.folder / "out", files.folder / "out/seed-1", scenario.folder):
        place.mkdir(exist_ok=True)
        (place / "link").symlink_to(scenario.outside)
        (place / "file-link").symlink_to(scenario.outside / "victim")
    if where == "steps":
        target = target.replace("$out/../..", "$out/../../..")
    done = scenario.run(**{where: [INIT + target.replace("{outside}", str(scenario.outside))]})
    assert done.returncode == 1, done
    assert done.stderr.endswith(": is outside the scenario's folder and the folder of the run (-o), and is not "
                                "written\n"), done.stderr
    assert [path.name for path in scenario.outside.iterdir()] == ["victim"]
    assert (scenario.outside / "victim").read_text() == "precious"


@pytest.mark.parametrize("step", ["measure laser -o {outside}", "fit $out/EZX.csv --name EZX --signal X -o $out/t.json "
                                  "--plot {outside}/f.svg", "fit $out/EZX.csv --name EZX --signal X -o $out/t.json "
                                  "--band {outside}/f.csv"])
def test_neither_do_folders_bands_and_figures(scenario, step):
    step = step.replace("{outside}", str(scenario.outside))
    done = scenario.run(once=["measure laser -o $out", step])
    assert done.returncode == 1 and "is outside the scenario's folder" in done.stderr, done
    assert not scenario.outside.exists()


def test_a_step_writes_into_the_run_and_beside_the_scenario(scenario):
    done = scenario.run(once=[INIT + "$out/a.json", INIT + "$here/b.json", INIT + "stranger/c.json"])
    assert done.returncode == 0, done.stderr
    assert (scenario.folder / "b.json").exists() and (scenario.folder / "c.json").exists()


@pytest.mark.parametrize("step", ["fit " + "{a,b}" * 40, "fit " + "x{a,b,c,d,e,f,g,h,i,j}" * 200,
                                  "fit " + " ".join(["{a,b,c,d}{a,b,c,d}{a,b,c,d}{a,b,c,d}"] * 4),
                                  "fit {" + "a," * 1001 + "b}"])
def test_choices_are_counted_before_they_are_made(scenario, step):
    done = scenario.run(once=[step])
    assert done.returncode == 1, done
    assert done.stderr.endswith("': its braces make more than 1000 words: write fewer choices\n"), done.stderr


@pytest.mark.parametrize("step, message", [("fit {a,{b,c}}", "braces within braces"),
                                           ("fit " + "a" * 70000, "is longer than 65536 characters")])
def test_steps_that_are_none(scenario, step, message):
    done = scenario.run(once=[step])
    assert done.returncode == 1 and done.stderr.endswith(f": {message}\n"), done.stderr[:300]
