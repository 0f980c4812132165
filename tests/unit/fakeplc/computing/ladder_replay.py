#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs a ladder of compbox export on a trace of fakeplc: same inputs, same outputs?

usage: ladder_replay.py PROGRAM.txt ADDRESSES.csv TRACE.csv   (exit 0: in every scan)

The columns are those of scl_replay.py, with F60.0 as `in_erend`; ADDRESSES gives the D address of register
0. Bytes of the PMC are little-endian; what the list has beyond the instructions below is refused. An
arithmetic instruction leaves its error output, so what hangs behind it without an RD of its own never runs."""
import csv
import functools
import operator
import re
import sys

COMPARE = {"EQB": operator.eq, "NEB": operator.ne, "GTB": operator.gt, "LTB": operator.lt,
           "GEB": operator.ge, "LEB": operator.le}


class Pmc:
    def __init__(self, text):
        self.memory = {letter: bytearray(1 << 16) for letter in "DRGFX"}
        self.place, self.place_of_bit = functools.cache(self.place), functools.cache(self.place_of_bit)
        self.program = []
        for line in text.splitlines():
            words = line.split("//")[0].split()
            if words:
                self.program.append(words)
        self.poke("R9091", 1, 2)     # bit 1 of R9091 is always on

    def place(self, address):
        """out: the memory of its letter, the index in it"""
        letter, number = re.fullmatch(r"([DRGFX])(\d+)", address).groups()
        assert int(number) + 4 <= len(self.memory[letter]), address
        return self.memory[letter], int(number)

    def place_of_bit(self, address):
        """out: the memory, the index in it, the bit alone"""
        byte, bit = address.split(".")
        return *self.place(byte), 1 << int(bit)

    def peek(self, address, count, signed=True):
        if address.startswith("K"):
            return int(address[1:])
        memory, at = self.place(address)
        return int.from_bytes(memory[at:at + count], "little", signed=signed and count > 1)

    def poke(self, address, count, value):
        memory, at = self.place(address)
        memory[at:at + count] = (value % (1 << 8 * count)).to_bytes(count, "little")

    def bit(self, address, value=None):
        memory, at, bit = self.place_of_bit(address)
        if value is None:
            return bool(memory[at] & bit)
        memory[at] = memory[at] | bit if value else memory[at] & ~bit

    def scan(self):
        stack = [False]
        for words in self.program:
            name, rest = words[0], words[1:]
            if name == "SUB":
                stack[-1] = self.function(stack[-1], rest[1], int(rest[2]), rest[3:])
            elif name in ("OR.STK", "AND.STK"):
                top = stack.pop()
                stack[-1] = stack[-1] or top if name == "OR.STK" else stack[-1] and top
            elif name in ("WRT", "WRT.NOT"):
                self.bit(rest[0], stack[-1] != (name == "WRT.NOT"))
                assert len(stack) == 1, f"{words}: the stack is not empty"
            else:
                base, *how = name.split(".")
                value = self.bit(rest[0]) != ("NOT" in how)
                if base == "RD" and "STK" in how:
                    stack.append(value)
                elif base == "RD":
                    stack[-1] = value
                elif base in ("AND", "OR"):
                    stack[-1] = stack[-1] and value if base == "AND" else stack[-1] or value
                else:
                    raise SystemExit(f"not an instruction this can run: {words}")

    def function(self, on, name, count, operands):
        if name in COMPARE:
            return on and COMPARE[name](*(self.peek(o, count) for o in operands))
        if name in ("ADDB", "SUBB"):
            if on:
                a, b = (self.peek(o, count) for o in operands[:2])
                self.poke(operands[2], count, a + b if name == "ADDB" else a - b)
            return False
        if name in ("MOVB", "MOVW", "MOVD", "NUMEB"):
            if on:
                self.poke(operands[1], count, self.peek(operands[0], count))
            return on
        raise SystemExit(f"not a function this can run: {name}")


def base_of(path):
    """The D address of register 0."""
    row = next(csv.DictReader(open(path)))
    return int(row["pmc_address"][1:]) - 2 * int(row["register"])


def words_of(row, block, base):
    """(column, D address) of the registers of a block, w or r."""
    return [(key, f"D{base + 2 * int(key[1:])}") for key in row if re.fullmatch(block + r"\d+", key)]


def set_inputs(pmc, row, written, sources):
    pmc.bit("R81.7", not row["in_first_scan"])
    for i, name in enumerate(("enable_key", "referenced", "reset_key", "permit_key", "nc_fresh")):
        pmc.bit(f"R80.{i}", bool(row["in_" + name]))
    pmc.bit("F60.0", bool(row["in_erend"]))
    for s, (address, count) in enumerate(sources):
        pmc.poke(address, int(count), int(row[f"in_signal_{s}"]))
    for i, key in enumerate(key for key in row if key.startswith("in_probe_") and key.endswith("_done")):
        pmc.bit(f"R82.{i}", bool(row[key]))
    for key, address in written:
        pmc.poke(address, 2, int(row[key]))


def results(pmc, axes):
    """What fakeplc has as `out_*`."""
    ours = {"box_alive": pmc.bit("R100.1"), "size_count": pmc.peek("R174", 2)}
    for i in range(axes):
        ours |= {f"wanted_{i + 1}": 0.1 * pmc.peek(f"R{130 + 2 * i}", 2),
                 f"size_acts_{i + 1}": pmc.bit(f"R103.{i}"), f"size_alarm_{i + 1}": pmc.bit(f"R111.{i}")}
    return ours


def main():
    program, addresses, trace = sys.argv[1:]
    text, base = open(program).read(), base_of(addresses)
    sources = re.findall(r"^//   (R\d+)  \S+, (\d) bytes", text, re.M)
    pmc, scans, handed, acting, probes, steps = Pmc(text), 0, 0, 0, 0, set()
    rows = list(csv.DictReader(open(trace)))
    written, shown = (words_of(rows[0], block, base) for block in "wr")
    axes = sum(key.startswith("out_wanted_") for key in rows[0])
    for row in rows:
        row = {key: float(value) for key, value in row.items()}
        set_inputs(pmc, row, written, sources)
        pmc.scan()
        scans += 1
        for key, address in shown:
            word = pmc.peek(address, 2, signed=False)
            assert word == row[key], f"scan {scans}: register {key[1:]} is {word}, fakeplc has {row[key]}"
        ours = results(pmc, axes)
        if "out_probe_again" in row:
            ours["probe_again"] = pmc.bit("R87.0")
        probes += any(pmc.bit(f"R84.{i}") for i in range(8))
        if pmc.bit("G2.7"):
            handed += 1
            axis = pmc.peek("R162", 2)
            ours[f"data_{axis}"] = pmc.peek("G0", 2)
            assert pmc.peek("G2", 1) & 0x7F == 0x30 + axis
        acting += any(pmc.bit(f"R103.{i}") for i in range(axes))
        steps.add((pmc.bit("G2.7"), pmc.bit("F60.0")))
        for key, value in ours.items():
            assert abs(float(value) - row["out_" + key]) <= 1e-3, (
                f"scan {scans}: {key} is {value}, fakeplc has {row['out_' + key]}")
    assert scans > 1000 and handed > 500 and acting > 100 and len(steps) == 3, (scans, handed, acting, steps)
    assert probes > 10 or "out_probe_again" not in row, probes
    print(f"{scans} scans, {probes} probes, ESTB in {handed} of them, a size acts in {acting}: the same")


if __name__ == "__main__":
    main()
