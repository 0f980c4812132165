#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Gate: the deepest stack of the portable core on the target, from the compiler's own call graph.
  stack.py COMPILE_COMMANDS   compiles models/ and firmware/ once more with -fcallgraph-info=su, into
                              stack/ beside the commands (again after a change), and adds up the
                              frames along the deepest path from each entry, used / limit; no
                              recursion, no frame of unknown size, and no call through a pointer but
                              those listed below
  stack.py --image COMPILE_COMMANDS   the same of compbox-stm32f405 as a whole: main, on top of it the
                              frame of an interrupt and the deepest handler (all have one priority), on
                              top of that the frame and the handler of the clock's failure
  stack.py --self-test COMPILER…   compiles one fault after the other; each must be caught"""

import concurrent.futures
import fnmatch
import json
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

LIMIT = 2048
ENTRIES = ("cb_box_step", "cb_config_load", "cb_box_start", "cb_box_adopt", "cb_box_settle")
# What the compiler calls unseen (memcpy, memset, 64-bit division) or the C library has: at most so
# much below any function. newlib's and libgcc's deepest, __aeabi_ldivmod, takes 48.
HELPERS = 64
# Calls through a pointer: where they are made, and the functions that the pointers can hold, as names or
# patterns. These must be exactly the functions whose addresses are taken anywhere.
ADDRESS = {"R_ARM_ABS32", "R_ARM_THM_MOVW_ABS_NC"}
INDIRECT = {
    "terms/terms.c:evaluate": ["terms/*.c:value", "cb_piecewise_value", "terms/adapt.c:stay_near"],
    "terms/terms.c:cb_terms_slopes": ["terms/*.c:slope", "cb_piecewise_slope"],
    "terms/load.c:cb_load_terms": ["terms/*.c:load", "terms/*.c:link", "cb_curve_load"],
    "terms/curves.c:cb_curve_load": ["terms/*.c:load_*"],
    "terms/curves.c:load_backward": ["terms/*.c:load_*"],
}

# The image: the same, and these. An exception stacks 26 words and up to one to align.
IMAGE_LIMIT = 4096
EXCEPTION_FRAME = 26 * 4 + 4
HANDLERS = ("cb_systick_handler", "cb_usart1_handler", "cb_usart2_handler", "cb_usart3_handler")
HAL = ["stm32f405/box_hal.c:" + name for name in ("now_us", "wait_tick", "read", "write", "write_read", "samples",
                                        "feed_watchdog", "stop_requested")]
COMMANDS = ["cb_dump_request", "cb_dump_request_kept", "cb_status_counters", "cb_status_fault", "cb_status_start",
            "cb_status_wires"] + [
    "app/commands.c:" + name for name in (
        "end_trace", "help", "restart", "restart_with_trace", "begin_trace", "show_slots", "stop")] + [
    "variant/test.c:crash_" + name for name in (
        "address", "assertion", "canary", "hang", "stack", "undefined")]  # of the test image
IMAGE_INDIRECT = {
    "hal/cycle.c:cb_cycle_run": HAL,
    "app/main.c:cb_main": HAL,
    "app/standby.c:cb_standby_run": HAL,
    "app/commands.c:cb_commands_serve": COMMANDS,
    "stm32f405/box_hal.c:cb_board_wait_tick": ["app/main.c:idle"],
    "stm32f405/box_hal.c:exchange_once": ["app/main.c:meanwhile"],
    "hal/rtu_exchange.c:cb_rtu_exchange_on": ["stm32f405/box_hal.c:now_us", "stm32f405/box_hal.c:exchange_once"],
}


def name_of(title):
    """Titles of static functions carry the whole path: its last folder and file tell them apart."""
    return "/".join(title.split("/")[-2:])


class Graph:
    def __init__(self, indirect):
        self.frames, self.calls, self.places, self.wrong = {}, {}, {}, []
        self.indirect, self.taken = indirect, set()

    def read(self, text):
        for title, label in re.findall(r'node: { title: "([^"]+)" label: "([^"]*)"', text):
            size = re.search(r"\\n(\d+) bytes \(([^)]*)\)", label)
            if not size:
                continue
            name = name_of(title)
            self.frames[name] = int(size[1])
            self.places[name] = name_of(label.split("\\n")[1]).split(":")[0]
            if size[2] != "static":
                self.wrong.append(f"{name}: its frame is {size[2]}, of no fixed size")
        for source, target in re.findall(r'edge: { sourcename: "([^"]+)" targetname: "([^"]+)"', text):
            self.calls.setdefault(name_of(source), set()).add(name_of(target))

    def read_addresses(self, relocations):
        """Functions whose addresses are taken, in code or in tables, from `objdump -r`."""
        section = ""
        for line in relocations.splitlines():
            header = re.match(r"RELOCATION RECORDS FOR \[(.*)\]", line)
            section = header[1] if header else section
            fields = line.split()
            if section.startswith((".text", ".rodata", ".data")) and ADDRESS & set(fields):
                self.taken.add(fields[-1])  # a place inside a function (".text.f+0x12") is a switch's

    def resolve(self):
        listed = set()
        for name, targets in list(self.calls.items()):
            if "__indirect_call" not in targets:
                continue
            targets.discard("__indirect_call")
            key = name if ":" in name else f"{self.places.get(name)}:{name}"
            if key not in self.indirect:
                self.wrong.append(f"{key} calls through a pointer and is not listed in stack.py")
            for one in self.indirect.get(key, []):
                found = set(fnmatch.filter(self.frames, one)) if "*" in one else {one}
                targets.update(found)
                listed.update(found)
        for name in listed - set(self.frames):
            self.wrong.append(f"stack.py lists {name}, which is no function of the core")
        bare = {name.rpartition(":")[2] for name in listed}
        functions = {name.rpartition(":")[2] for name in self.frames}
        for name in sorted((self.taken & functions) ^ bare):
            self.wrong.append(f"{name}: its address is taken or it is in stack.py's list, not both")

    def deepest(self, name, above=()):
        """(bytes, path) of the deepest chain of calls from here."""
        if name in above:
            self.wrong.append("recursion: " + " -> ".join(above[above.index(name):] + (name,)))
            return 0, ()
        if name not in self.frames:
            return HELPERS, (name,)
        below = [self.deepest(callee, above + (name,)) for callee in sorted(self.calls.get(name, ()))]
        bytes_below, path = max(below, default=(HELPERS, ()), key=lambda one: one[0])
        return self.frames[name] + max(bytes_below, HELPERS), (name,) + path


def judge(graph, entries, limit=LIMIT):
    """Prints used / limit of each entry and what is wrong; true when nothing is."""
    graph.resolve()
    for entry in entries:
        if entry not in graph.frames:
            graph.wrong.append(f"{entry} is not there")
            continue
        used, path = graph.deepest(entry)
        print(f"stack of {entry:16} {used:5} / {limit} bytes  {' > '.join(path)}")
        if used > limit:
            graph.wrong.append(f"{entry} needs {used} bytes of stack, {limit} are allowed")
    for line in dict.fromkeys(graph.wrong):
        print(line)
    return not graph.wrong


def newest(root, command):
    """When a source of the product, this file or the compiler changed last."""
    sources = [path for folder in ("models", "firmware", "hal") for path in (root / folder).rglob("*.[ch]")]
    return max(path.stat().st_mtime for path in (*sources, pathlib.Path(__file__), pathlib.Path(command[0])))


def compiled(command, folder, made, changed=float("inf")):
    """The call graph and the relocations of one object, which is kept until something changes. in: when that was"""
    command = command + ["-fcallgraph-info=su", "-o", str(made)]
    graph, same = made.with_suffix(".ci"), made.with_suffix(".command")
    if not (same.exists() and same.stat().st_mtime > changed and same.read_text() == shlex.join(command)):
        same.unlink(missing_ok=True)
        subprocess.run(command, check=True, cwd=folder)
        same.write_text(shlex.join(command))
    objdump = re.sub(r"gcc$", "objdump", command[0])
    relocations = subprocess.run([objdump, "-r", str(made)], check=True, capture_output=True, text=True)
    return graph.read_text(), relocations.stdout


def read_core(commands, folders=("models", "firmware"), indirect=INDIRECT):
    """The graph of everything in these folders."""
    graph, jobs, changed = Graph(indirect), [], None
    root = pathlib.Path(__file__).resolve().parents[2]
    kept = pathlib.Path(commands).parent / "stack" / "-".join(folders)
    kept.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for entry in json.loads(pathlib.Path(commands).read_text()):
            source = pathlib.Path(entry["file"])
            if not source.is_relative_to(root) or source.relative_to(root).parts[0] not in folders:
                continue
            words = shlex.split(entry["command"])
            words = words[next(i for i, word in enumerate(words) if word.endswith("gcc")):]
            at = words.index("-o")
            made = kept / words[at + 1].replace("/", "-")
            del words[at:at + 2]
            changed = changed or newest(root, words)
            jobs.append(pool.submit(compiled, words, entry["directory"], made, changed))
        for job in jobs:
            text, relocations = job.result()
            graph.read(text)
            graph.read_addresses(relocations)
    return graph


def judge_image(graph):
    """Prints the parts and their sum; true when that is within the limit and nothing is wrong."""
    graph.resolve()
    parts = [("main", 0, graph.deepest("cb_start"))]
    handler = max((graph.deepest(name) for name in HANDLERS), key=lambda one: one[0])
    parts += [("interrupt", EXCEPTION_FRAME, handler),
              ("clock failure", EXCEPTION_FRAME, graph.deepest("cb_nmi_handler"))]
    used = sum(frame + below for _, frame, (below, _) in parts)
    for name, frame, (below, path) in parts:
        print(f"stack of {name:14} {frame:4} + {below:5} bytes  {' > '.join(path)}")
    print(f"stack of compbox-stm32f405 {used:5} / {IMAGE_LIMIT} bytes")
    if used > IMAGE_LIMIT:
        graph.wrong.append(f"the image needs {used} bytes of stack, {IMAGE_LIMIT} are there")
    for line in dict.fromkeys(graph.wrong):
        print(line)
    return not graph.wrong


RIGHT = """int leaf(int *p); int leaf(int *p) { return p[3]; }
int entry(int x); int entry(int x) { int a[20] = {x}; return leaf(a) + a[7]; }
"""
FAULTS = {
    "too deep": """void use(char *); __attribute__((noinline)) static void below(void) { char b[1200]; use(b); use(b); }
        int entry(int x); int entry(int x) { char a[900]; use(a); below(); use(a); return x; }""",
    "recursion": """void use(int *); int entry(int x);
        int entry(int x) { int below = x ? entry(x - 1) : 0; use(&below); return below; }""",
    "a frame of any size": """void use(char *); int entry(int n);
        int entry(int n) { char a[n]; use(a); use(a); return n; }""",
    "a pointer": """int entry(int x); extern int (*call)(int); int entry(int x) { return call(x) + 1; }""",
    "a table": """__attribute__((noinline)) static int one(int x) { return x * 3; }
        extern int (*const table[1])(int); int (*const table[1])(int) = {one};
        int entry(int x); int entry(int x) { return x; }""",
}


def verdict(compiler, source):
    graph = Graph({})
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "planted.c"
        path.write_text(source)
        text, relocations = compiled(compiler + ["-O2", "-c", str(path)], folder, path.with_suffix(".o"))
    graph.read(text)
    graph.read_addresses(relocations)
    return judge(graph, ["entry"])


def check_what_is_kept(compiler):
    """What is compiled is kept while nothing changes, and no longer."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "planted.c"
        command, made = compiler + ["-O2", "-c", str(path)], path.with_suffix(".o")
        path.write_text(RIGHT)
        first = compiled(command, folder, made, changed=0)
        path.write_text(FAULTS["recursion"])
        if compiled(command, folder, made, changed=0) != first:
            sys.exit("self-test: compiled again without a change")
        if compiled(command, folder, made, path.stat().st_mtime + 60) == first:
            sys.exit("self-test: a change was not compiled")


def self_test(compiler):
    check_what_is_kept(compiler)
    if not verdict(compiler, RIGHT):
        sys.exit("self-test: a right object was refused")
    for name, source in FAULTS.items():
        if verdict(compiler, source):
            sys.exit(f"self-test: not caught: {name}")
    print(f"self-test: {len(FAULTS)} planted faults, all caught")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test(sys.argv[2:])
    elif sys.argv[1] == "--image":
        folders = ("models", "firmware", "hal")
        if not judge_image(read_core(sys.argv[2], folders, {**INDIRECT, **IMAGE_INDIRECT})):
            sys.exit(1)
    elif not judge(read_core(sys.argv[1]), ENTRIES):
        sys.exit(1)
