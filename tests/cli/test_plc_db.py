# SPDX-License-Identifier: MIT
"""compbox export --format plc-db: the layouts are read back and held against the file itself, and the
PLC programs of docs/plc against the layouts."""

import csv
import json
import re

import pytest

from conftest import GANTRY, PLC, ROOT, term

DOCS = ROOT / "docs/plc"
WORDS = {"WORD": 1, "INT": 1, "DWORD": 2, "DINT": 2, "REAL": 2}
S7 = {"uint16": "WORD", "int16": "INT", "uint32": "DWORD", "int32": "DINT", "float32": "REAL"}


def numbers(data):
    """{register: type} of everything in the file, from its keys."""
    plc, found = data["plc"], {}
    for key in ("control", "plc_heartbeat", "status", "box_heartbeat", "handshake"):
        if key in plc:
            found[plc[key]] = "uint16"
    for block in (plc["read"], plc["write"]):
        if block.get("counters"):
            found[block["start"]] = found[block["start"] + block["count"] - 1] = "uint16"
    for signal in data["signals"]:
        if "plc" in signal:
            found[signal["plc"]] = signal.get("type", "int16")
    for channel in data.get("channels", []):
        found[channel["plc"]] = channel.get("type", "int16")
        if "applied" in channel:
            found[channel["applied"]] = channel.get("type", "int16")
        tangent = channel.get("tangent", {})
        for key in ("slope", "reference"):
            if tangent:
                found[tangent[key + "_plc"]] = tangent[key + "_type"]
    return found


def read_block(text):
    """{register: (name, type)} of a data block, by S7's own rules of where things lie; spare arrays
    take room and are no numbers. What the comments say of places is held against that."""
    assert "S7_Optimized_Access := 'FALSE'" in text
    body = text[text.index("STRUCT\n"):text.index("END_STRUCT")]
    found, at = {}, 0
    for line in body.splitlines()[1:]:
        if not line.strip():
            continue
        name, kind, comment = re.fullmatch(r"\s*(\w+) : (.+?); +// (.*)", line).groups()
        register, byte = map(int, re.match(r"register (\d+), byte (\d+)", comment).groups())
        assert (register, byte) == (at, 2 * at), line
        array = re.fullmatch(r"ARRAY\[0\.\.(\d+)\] OF WORD", kind)
        if array:
            assert name == f"spare_{at}"
            at += int(array[1]) + 1
        else:
            found[at] = (name, kind)
            at += WORDS[kind]
    return found, at


def exported(compbox, path, *more):
    files = compbox.good("export", path, "--format", "plc-db", *more, "-o", "plc").split()
    assert len(files) == 1
    return (compbox.folder / files[0]).read_text()


def machine(compbox, profile, axes="XYZ"):
    compbox.good("init", *PLC, "--axes", axes, "--profile", profile, "-o", "machine.json")
    return compbox.folder / "machine.json"


@pytest.mark.parametrize("where", ["docs", "gantry", "spindle", "init", "init generic"])
def test_the_data_block_is_the_files_registers(compbox, where):
    path = {"docs": DOCS / "sinumerik-840d.json", "gantry": GANTRY / "machine.json",
            "spindle": ROOT / "examples/spindle-thermal/machine.json"}.get(where)  # "terms": []
    path = path or machine(compbox, "generic" if "generic" in where else "sinumerik-840d")
    data = json.loads(path.read_text())
    block, size = read_block(exported(compbox, path))
    assert {at: kind for at, (_, kind) in block.items()} == \
        {at: S7[kind] for at, kind in numbers(data).items()}
    names = [name for name, _ in block.values()]
    assert len(set(names)) == len(names)
    ends = [b["start"] + b["count"] for b in (data["plc"]["read"], data["plc"]["write"])]
    assert size == max(ends), "the server answers for both blocks as a whole"


def program_of(compbox, path, *more):
    """Program and registers of one file, by --format plc-program."""
    files = compbox.good("export", path, "--format", "plc-program", *more, "-o", "plc").split()
    return [(compbox.folder / name).read_text() for name in files]


OWN = {"840d": "sinumerik-840d", "840d X,Z": "X,Z", "840d stages": "X,Y1+Y2,Z1+Z2"}


@pytest.mark.parametrize("which", OWN)
def test_the_program_of_the_840d_uses_only_what_the_block_has(compbox, which):
    path = DOCS / "sinumerik-840d.json" if which == "840d" else machine(compbox, "sinumerik-840d", OWN[which])
    program, registers = program_of(compbox, path)
    assert registers == exported(compbox, path)
    block, _ = read_block(registers)
    kinds = dict(block.values())
    program = re.sub("//.*", "", program)
    used = set(re.findall(r'"CompBoxRegisters"\.(\w+)', program))
    assert used == set(kinds), used ^ set(kinds)
    for name in re.findall(r'DINT_TO_REAL\("CompBoxRegisters"\.(\w+)\)', program):
        assert kinds[name] == "DINT"
    file = json.loads(path.read_text())
    for constant, value in (("UM", file["channels"][0]["scale"]),
                            ("MM", file["signals"][0]["scale"]),
                            ("PER_MM", file["channels"][0]["tangent"]["slope_scale"])):
        assert float(re.search(rf"\b{constant} := ([^;]+);", program)[1]) == value


def read_table(text):
    return {int(row["register"]): row for row in csv.DictReader(text.splitlines())}


@pytest.mark.parametrize("base", [0, 1000])
@pytest.mark.parametrize("where", ["docs", "init"])
def test_the_pmc_addresses_are_the_files_registers(compbox, where, base):
    path = DOCS / "fanuc.json" if where == "docs" else machine(compbox, "fanuc")
    data = json.loads(path.read_text())
    table = read_table(exported(compbox, path, "--pmc-base", base))
    assert {at: row["type"] for at, row in table.items()} == numbers(data)
    write = data["plc"]["write"]
    for at, row in table.items():
        assert row["pmc_address"] == f"D{base + 2 * at}"
        assert int(row["bytes"]) == (4 if "32" in row["type"] else 2)
        box = write["start"] <= at < write["start"] + write["count"]
        assert row["written_by"] == ("box" if box else "PLC")


@pytest.mark.parametrize("axes, base", [("XYZ", 0), ("X,Z", 400), ("X,Y1+Y2,Z,W", 1000)])
def test_the_ladder_uses_only_addresses_of_the_table(compbox, axes, base):
    path = DOCS / "fanuc.json" if axes == "XYZ" else machine(compbox, "fanuc", axes)
    ladder, registers = program_of(compbox, path, "--pmc-base", base)
    assert registers == exported(compbox, path, "--pmc-base", base)
    table = read_table(registers)
    bytes_ = {int(row["pmc_address"][1:]) + i: row for row in table.values()
              for i in range(int(row["bytes"]))}
    program = re.sub("//.*", "", ladder)
    used = {int(a) for a in re.findall(r"\bD(\d+)", program)}
    assert used and used <= set(bytes_), used - set(bytes_)
    touched = {bytes_[a]["name"] for a in used}
    assert touched == {row["name"] for row in table.values()}, "each register has its line"
    written = {int(a) for a in re.findall(r"^(?:WRT +|SUB \d+ +MOV\w \d \S+ )D(\d+)", program, re.M)}
    assert all(bytes_[a]["written_by"] == "PLC" for a in written)


# The meaning of a value register states the smallest size, limit + slope limit over AHEAD_MM of the program.
@pytest.mark.parametrize("file, least_um", [("sinumerik-840d.json", "140 um with AHEAD_MM 40"),
                                            ("fanuc.json", "100 um")])
def test_the_smallest_size_is_stated_and_the_programs_is_not_below(compbox, file, least_um):
    text = exported(compbox, DOCS / file)
    for axis in "XYZ":
        assert re.search(rf"compensation of {axis} in \S+ um; largest offset in the PLC program: at least "
                         rf"{least_um}(,|\"|$)", text, re.M), text
    program = (DOCS / file.replace("json", "scl")) if "840d" in file else DOCS / "fanuc.txt"
    program = program.read_text()
    if "840d" in file:
        assert re.search(r"\bAHEAD_MM := 40.0;", program)
        sizes = [float(re.search(rf"\bSIZE_{axis}_UM := ([^;]+);", program)[1]) for axis in "XYZ"]
    else:
        sizes = [0.1 * int(k) for k in re.findall(r"SUB 202 GTB 2 R120 K(\d+)", program)]
    assert len(sizes) == 3 and all(size >= float(least_um.split()[0]) for size in sizes)
    names = dict(read_block(text)[0].values()) if "840d" in file else text
    assert not re.search("size", str(names), re.I), "what a client can write is no place for it"


def test_a_machine_file_without_limits_has_no_sizes(compbox):
    def change(data):
        for channel in data["channels"]:
            channel.pop("limit_um", None)
    path = changed(compbox, change)
    assert "largest offset in the PLC program" not in exported(compbox, path)


def test_the_program_is_of_the_coefficient_file_too(compbox):
    """After build: without the channels and signals that no curve needs."""
    machine(compbox, "sinumerik-840d", "X,Y1+Y2,Z")
    compbox.write("t.json", term("EZX", "X"))
    compbox.good("build", "machine.json", "t.json", "-o", "c.json")
    program, _ = program_of(compbox, "c.json")
    assert set(re.findall(r"SIZE_(\w+)_UM :=", program)) == {"Z"}
    assert 'CompBoxRegisters".signal_X := signal_X;' in program, "Z has no position, X no channel"


@pytest.mark.parametrize("axes", ["XYZ", "X,Z", "X,Y1+Y2,Z,W"])
@pytest.mark.parametrize("profile", ["linuxcnc", "generic"])
def test_the_program_of_linuxcnc_has_the_files_registers(compbox, profile, axes):
    """tests/linuxcnc runs it; here: each number of the file, joints and signals in their order."""
    path = machine(compbox, profile, axes)
    data = json.loads(path.read_text())
    hal, component = program_of(compbox, path)
    compile(component, "compbox_plc.py", "exec")
    shown = re.findall(r'\("(signal-\d)", (\d+), "(\w+)", ([\d.e-]+), 0\),', component)
    assert shown == [(f"signal-{i}", str(s["plc"]), s["type"], "0.0001") for i, s in enumerate(data["signals"])]
    taken = re.findall(r'\((\d), (\d+), "(\w+)", 1e-05, (\d+)\),', component)
    assert taken == [(str(i), str(c["plc"]), c["type"], str(c["applied"])) for i, c in enumerate(data["channels"])]
    for i, channel in enumerate(data["channels"]):
        size = float(re.search(rf"setp compbox-limit-{i}.max (\S+)", hal)[1])
        assert size == pytest.approx(1.1e-3 * channel["limit_um"])
    assert "@" not in hal + component


def test_json_names_the_file(compbox):
    reported = json.loads(compbox.good("export", DOCS / "fanuc.json", "--format", "plc-db", "--json",
                                   "-o", "plc"))
    assert reported["files"] == ["plc/pmc_addresses.csv"]


def changed(compbox, change, profile="generic"):
    data = json.loads(machine(compbox, profile).read_text())
    change(data)
    (compbox.folder / "m.json").write_text(json.dumps(data))
    return "m.json"


@pytest.mark.parametrize("change, message", [
    (lambda d: d["signals"][0].update(type="int32cdab"),
     "m.json: 'signal_X' is not in the order ABCD"),
    (lambda d: d["signals"][1].update(plc=9), "m.json: 'signal_Y' overlaps the number before it"),
    (lambda d: d["plc"]["read"].update(start=0, count=65000),
     "m.json: register 64999 lies beyond what an S7 data block holds"),
    (lambda d: d.pop("plc"), "m.json: plc: must be an object"),
    (lambda d: d["plc"].update(status=5), "m.json: plc.status: register 5 is outside the block"),
])
def test_refused(compbox, change, message):
    path = changed(compbox, change)
    assert compbox.refused("export", path, "--format", "plc-db", "-o", "plc").startswith(message)


def test_a_coefficient_file_that_the_box_refuses_is_refused(compbox):
    data = json.loads((DOCS / "fanuc.json").read_text())
    data["channels"][0]["sum"] = ["nothing"]
    (compbox.folder / "m.json").write_text(json.dumps(data))
    assert "nothing" in compbox.refused("export", "m.json", "--format", "plc-db", "-o", "plc")


def test_wrong_usage(compbox):
    done = compbox("export", DOCS / "fanuc.json", "--format", "plc-db", "--pmc-base", "-1", "-o", "plc")
    assert done.returncode == 2, done.stderr


@pytest.mark.parametrize("option", [("--step-mm", "5"), ("--range", "X=0:5"), ("--name", "X=AX1"), ("--at", "T=20"),
                                    ("--axis", "X=X"), ("--most-points", "9"), ("--lost-motion-um", "X=3")])
def test_options_of_tables_are_refused(compbox, option):
    done = compbox("export", DOCS / "fanuc.json", "--format", "plc-program", *option, "-o", "plc")
    assert (done.returncode, done.stderr.splitlines()[0]) == (
        2, f"compbox: {option[0]}: it is for tables; --format plc-program has none")
    assert not (compbox.folder / "plc").exists()


def test_names_stay_apart_and_plain(compbox):
    def change(data):
        data["signals"][0]["name"], data["signals"][1]["name"] = "T-1", "T.1"
    block, _ = read_block(exported(compbox, changed(compbox, change)))
    names = {name for name, _ in block.values()}
    assert {"signal_T_1", "signal_T_1_2"} <= names
