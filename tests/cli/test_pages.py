# SPDX-License-Identifier: MIT
"""The commands of the pages, run from the pages themselves in a copy of the source tree, as a reader types them.
A fenced block runs if its language has a further word or is sh:
  sh                a shell that stays the same for the whole page; each command has to succeed
  sh build          is not run: the programs are built already; its targets and presets have to exist
  sh terminal-2     a second terminal, which has to listen before the page goes on
  sh until-ctrl-c   runs until the next block of the shell, or the end; Ctrl-C has to end it with 0
  sh walk           a command that asks, at a terminal of its own. The table behind it has the questions in their order,
                    what is typed into the second terminal, and the answer. After `error` it has to be the difference
  text type-2       lines typed into the second terminal; a move is waited for; each answer has to be ok
  json FILE         keys that the reader sets in FILE; entries of lists are found by their name"""

import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import time

import pytest

import still_clock
from conftest import BIN, ROOT
from commissioning import Terminal

FENCE = re.compile(r"^```(\w+)(?: ([\w.-]+))?\n(.*?)^```\n(?:\n((?:\|[^\n]*\n)+))?", re.M | re.S)
# Each of these and of REHEARSED is a ctest; CMakeLists.txt reads the names from here.
PAGES = ("README.md", "docs/install.md", "docs/ten-minutes.md", "docs/machine-spindle.md")
PAGE_PORT = "1502"
REAL_PLC = "--host 192.168.0.10"
PATIENCE_S = 60


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return str(listener.getsockname()[1])


def blocks(page):
    """out: (language, further word or "", text) of each block that a reader acts on; a walk with the rows behind it."""
    for language, word, text, table in FENCE.findall((ROOT / page).read_text()):
        if language == "sh" or word:
            yield language, word, text + table if word == "walk" else text


@pytest.fixture
def tree(tmp_path):
    """A source tree with the files of this one, where commands may write into out/."""
    for name in ("README.md", "docs", "examples", "scripts", "CMakePresets.json"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "build/host").mkdir(parents=True)
    (tmp_path / "build/host/bin").symlink_to(BIN)
    return tmp_path


def merged(into, keys):
    """The keys of a page in a file: objects key by key, entries of lists by name, anything else as it is."""
    for key, value in keys.items():
        if isinstance(value, dict):
            merged(into.setdefault(key, {}), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            entries = into.setdefault(key, [])
            for entry in value:
                same = [old for old in entries if old.get("name") == entry["name"]]
                if same:
                    merged(same[0], entry)
                else:
                    entries.append(entry)
        else:
            into[key] = value


class Reader:
    """A person with two terminals. What runs in both at once has one clock, on which nothing waits for real time."""

    def __init__(self, tree):
        self.tree, self.port, self.answers, self.running, self.second = tree, free_port(), [], None, None
        self.path = f"{BIN}:{os.environ['PATH']}"
        self.clock = dict(still_clock.shared_in(tree), PATH=self.path)
        self.shell = subprocess.Popen(["bash", "-e"], cwd=tree, env=dict(os.environ, PATH=self.path), text=True,
                                      stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, stderr=(tree / "shell.err").open("w"))

    def act(self, language, word, text):
        text = text.replace(PAGE_PORT, self.port).replace(REAL_PLC, f"--host 127.0.0.1 --port {self.port}")
        if language == "json":
            return self.edit(word, json.loads(text))
        if (language, word) == ("text", "type-2"):
            return self.type(text)
        if word == "build":
            return self.check_build(text)
        self.interrupt()
        if word == "walk":
            return self.walk(*text.split("\n", 1))
        if word == "terminal-2":
            return self.open_second(text)
        return self.run_on(text) if word == "until-ctrl-c" else self.run(text)

    def run(self, text):
        """out: what the commands print."""
        self.shell.stdin.write(f"{text}\necho\necho end-of-block\n")
        self.shell.stdin.flush()
        lines = []
        for line in self.shell.stdout:
            if line == "end-of-block\n":
                return "".join(lines)
            lines.append(line)
        raise AssertionError(f"{text}{''.join(lines)}{(self.tree / 'shell.err').read_text()}")

    def here(self):
        return self.run("pwd").strip()

    def edit(self, name, keys):
        path = pathlib.Path(self.here()) / name
        document = json.loads(path.read_text())
        merged(document, keys)
        path.write_text(json.dumps(document, indent=2))

    def check_build(self, text):
        for target in re.search(r"--target ([\w -]+)", text)[1].split():
            assert (BIN / target).exists(), target
        presets = {preset["name"] for preset in json.loads((ROOT / "CMakePresets.json").read_text())["buildPresets"]}
        assert set(re.findall(r"--preset ([\w-]+)", text)) <= presets

    def open_second(self, text):
        *before, command = text.replace("\\\n", " ").strip().split("\n")
        self.second = subprocess.Popen(
            ["bash", "-e", "-c", "\n".join([*before, f"exec {command}"])], cwd=self.tree, text=True,
            env=self.clock, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        line = self.second.stdout.readline()
        assert " listening on " in line, (line, self.second.communicate()[1])

    def command(self, line):
        self.second.stdin.write(line + "\n")
        self.second.stdin.flush()
        answer = self.second.stdout.readline().strip()
        assert answer.startswith("ok"), (line, answer)
        return answer

    def wait_for(self, word):
        until = time.monotonic() + PATIENCE_S
        while word not in self.command("status"):
            assert time.monotonic() < until, f"no {word} in {self.command('status')}"
            time.sleep(0.05)

    def type(self, text):
        self.wait_for(" mode=1 ")
        for line in text.strip().split("\n"):
            self.answers.append(self.command(line))
            self.wait_for(" moving=0 ")

    def walk(self, command, table):
        terminal = Terminal(self.here(), command=["bash", "-c", f"exec {command}"], environment=self.clock)
        for row in table.strip().split("\n")[2:]:
            question, typed, answer = (cell.strip().strip("`") for cell in row.strip("|").split("|"))
            terminal.until(question, seconds=PATIENCE_S)
            if typed.startswith("move"):
                self.type(typed)
            elif typed:
                before, after = errors(self.command(typed))
                axis = question[0]
                assert round(after[axis] - before[axis]) == int(answer), (before, after)
            terminal.type("\n" if answer == "Enter" else answer + "\n")
        assert terminal.end() == 0, terminal.text

    def run_on(self, text):
        command = text.strip()
        self.running = subprocess.Popen(["bash", "-c", f"exec {command}"], cwd=self.here(), text=True,
                                        env=self.clock, stderr=subprocess.PIPE)

    def interrupt(self):
        if self.running is None:
            return
        program, self.running = self.running, None
        program.send_signal(signal.SIGINT)
        errors = program.communicate(timeout=PATIENCE_S)[1]
        assert program.returncode == 0, errors

    def leave(self):
        for program in (self.running, self.second, self.shell):
            if program and program.poll() is None:
                program.terminate()
                program.communicate(timeout=PATIENCE_S)


@pytest.fixture
def reader(tree):
    person = Reader(tree)
    yield person
    person.leave()


def errors(answer):
    """out: ({axis: µm} without the box, with it) of an answer of fakeplc to `error`."""
    without, with_box = answer.split(" after ")
    return [dict((axis, float(um)) for axis, um in re.findall(r"([XYZ])=(\S+)", part)) for part in (without, with_box)]


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_work_as_printed(reader, page):
    found = list(blocks(page))
    assert found, page
    for block in found:
        reader.act(*block)
    reader.interrupt()
    compensated = [errors(answer) for answer in reader.answers if " after " in answer]
    assert bool(compensated) == any(word == "type-2" for _, word, _ in found)
    printed = [errors(line) for line in re.findall(r"^ok before .*$", (ROOT / page).read_text(), re.M)]
    for (stated, _), (before, _) in zip(printed, compensated):
        assert stated == {axis: pytest.approx(um, abs=0.06) for axis, um in before.items()}
    for before, after in compensated:
        assert max(map(abs, before.values())) > 10, before
        assert max(map(abs, after.values())) < 0.1 * max(map(abs, before.values())), (before, after)


REHEARSED = {  # profile, example, what an indicator shows, a place
    "docs/machine-lathe.md": ("sinumerik-840d", "lathe", {"X": -20, "Z": -20}, "X=300 Z=1500"),
    "docs/machine-portal.md": ("fanuc", "portal", {"X": 20, "Y1": 20, "Y2": 20, "Y1+Y2": 20, "Z": 20},
                               "X=1500 Y=2500 Z=900")}


def walk_of(command, axes, measured):
    """out: a walk in which each axis is jogged to 50 mm."""
    rows = [row for axis in axes for row in (
        f"| `{axis}: what does the control show` | | Enter |",
        f"| `{axis}: jog this axis alone` | `move {axis}=50 feed=5000` | `50` |")]
    rows += [row for name, um in measured.items() for row in (
        f"| `{name}: set the indicator to zero` | | Enter |", f"| `{name}: what does the indicator show` | | `{um}` |")]
    return "sh", "walk", "\n".join([command, "| | | |", "|---|---|---|", *rows])


@pytest.mark.parametrize("page", REHEARSED)
def test_the_file_that_a_page_makes_compensates_its_machine(reader, page):
    profile, example, measured, place = REHEARSED[page]
    for block in blocks(page):
        reader.act(*block)
    folder = pathlib.Path(reader.here())
    reader.act("sh", "terminal-2", f"cd {folder}\nfakeplc --profile {profile} --listen 127.0.0.1:{reader.port} "
               f"--machine {ROOT}/examples/{example}/machine_twin.json --map coefficients.json")
    walk, build = re.search(r"^    (compbox commission .*)\n    (compbox build .*)$", (ROOT / page).read_text(),
                            re.M).groups()
    reader.act(*walk_of(walk.replace(" --watch", ""), re.findall(r"([XYZ])=", place), measured))
    reader.act("sh", "", build)
    reader.act("sh", "until-ctrl-c", "compboxd --config coefficients.json")
    reader.act("text", "type-2", f"move {place} feed=20000\nerror")
    reader.interrupt()
    before, after = errors(reader.answers[-1])
    for axis, um in before.items():
        assert abs(after[axis]) < max(1.0, 0.1 * abs(um)), (before, after)


def test_both_pages_of_the_ten_minutes_have_the_same_commands():
    """The page shows a plot beside those of the README."""
    readme, page = ([block for block in blocks(name) if block[1] != "build"] for name in (PAGES[0], PAGES[2]))
    assert readme == [block for block in page if "gnuplot" not in block[2]]


def test_the_page_of_commands_is_what_the_programs_print():
    done = subprocess.run(["/usr/bin/python3", ROOT / "docs/site/commands.py", BIN, ROOT / "docs/commands.md"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_the_example_of_a_test_report_is_what_its_script_makes(tmp_path):
    """All that a page shows but its figure, whose coordinates gnuplot rounds."""
    made = tmp_path / "page.html"
    subprocess.run(["/usr/bin/python3", ROOT / "examples/lathe/test_report.py", BIN, made], check=True)
    shown, stated = (re.sub(r"<svg.*?</svg>", "", page.read_text(), flags=re.S)
                     for page in (made, ROOT / "examples/lathe/test-report.html"))
    assert shown == stated, "run scripts/report test-report"
    assert stated.count(">conforms</td>") == 2


QUOTED_OF_OTHERS = ("compbox ", "ConditionPathExists", "Connection refused")  # commands, systemd, the operating system
# In a quoted line; a message has a place for each.
VALUE = re.compile(r"…|\d.*|[XZ]|T1|net|X_adapted|mm|FILE|LINE|coefficients\.json|terms\[3\].*")


def words_of(text):
    return re.split(r"[\s:;,()]+", text.strip(" :;,()"))


def messages():
    """out: the words of each string literal of the box, between the places of its values."""
    for source in (path for room in ("firmware", "hal") for path in (ROOT / room).rglob("*.[ch]")):
        joined = re.sub(r'"\s*(?:PRI\w+\s*)?"', "", source.read_text())
        for literal in re.findall(r'"((?:[^"\\\n]|\\.)+)"', joined):
            for piece in re.split(r"%[-+ 0-9.*]*[a-zA-Z]+|\\n", literal.replace('\\"', '"')):
                yield words_of(piece)


def unknown_words(line, texts, phrases):
    """out: the words of a line that are neither a whole text of a message nor beside their neighbour in one."""
    words = [word for word in words_of(line) if not VALUE.fullmatch(word)]
    beside = [pair in phrases for pair in zip(words, words[1:])]
    return [word for i, word in enumerate(words)
            if (word,) not in texts and not any(beside[max(i - 1, 0):i + 1])]


def test_each_line_that_when_it_stops_quotes_is_one_of_the_box():
    texts = {tuple(text) for text in messages()}
    phrases = {pair for text in texts for pair in zip(text, text[1:])}
    page = (ROOT / "docs/when-it-stops.md").read_text()
    quoted = re.findall(r"`([^`\n]+)`", page) + re.findall(r"^    (compboxd: .*)$", page, re.M)
    lines = [line for line in quoted if len(line.split()) >= 3 and not line.startswith(QUOTED_OF_OTHERS)]
    assert len(lines) > 20
    for line in lines:
        for others in QUOTED_OF_OTHERS:
            line = line.replace(others, "")
        assert unknown_words(line, texts, phrases) == [], line
    assert unknown_words("signal X is 120 ms old and its age_limit is 90", texts, phrases) == ["age_limit"]


def test_the_figure_of_the_registers_is_that_of_init():
    done = subprocess.run(["/usr/bin/python3", ROOT / "docs/figures/registers.py", BIN / "compbox"],
                          capture_output=True, text=True, check=True)
    assert done.stdout == (ROOT / "docs/figures/registers.svg").read_text(), "run scripts/docs --figures"
