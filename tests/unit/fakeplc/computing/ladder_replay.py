#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs the ladder of docs/plc on a trace of fakeplc: same inputs, same outputs?

usage: ladder_replay.py PROGRAM.txt TRACE.csv   (exit 0: in every scan)

The columns are those of scl_replay.py, with F60.0 as `in_erend`. Bytes of the PMC are little-endian; what
the list has beyond the instructions below is refused. An arithmetic instruction leaves its error
output, so what hangs behind it without an RD of its own never runs."""
import csv
import functools
import operator
import re
import sys

COMPARE = {"EQB": operator.eq, "NEB": operator.ne, "GTB": operator.gt, "LTB": operator.lt,
           "GEB": operator.ge, "LEB": operator.le}


class Pmc:
    def __init__(self, text):
        self.memory = {}
        self.program = []
        for line in text.splitlines():
            words = line.split("//")[0].split()
            if words:
                self.program.append(words)
        self.poke("R9091", 1, 2)     # bit 1 of R9091 is always on

    @staticmethod
    @functools.cache
    def place(address):
        letter, number = re.fullmatch(r"([DRGFX])(\d+)", address).groups()
        return letter, int(number)

    def peek(self, address, count, signed=True):
        if address.startswith("K"):
            return int(address[1:])
        letter, at = self.place(address)
        data = bytes(self.memory.get((letter, at + i), 0) for i in range(count))
        return int.from_bytes(data, "little", signed=signed and count > 1)

    def poke(self, address, count, value):
        letter, at = self.place(address)
        for i, byte in enumerate((value % (1 << 8 * count)).to_bytes(count, "little")):
            self.memory[letter, at + i] = byte

    def bit(self, address, value=None):
        byte, bit = address.split(".")
        held = self.peek(byte, 1)
        if value is None:
            return bool(held >> int(bit) & 1)
        self.poke(byte, 1, held | 1 << int(bit) if value else held & ~(1 << int(bit)))

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
            a, b = (self.peek(o, count, signed=True) for o in operands)
            return on and COMPARE[name](a, b)
        if name in ("ADDB", "SUBB"):
            a, b = (self.peek(o, count) for o in operands[:2])
            if on:
                self.poke(operands[2], count, a + b if name == "ADDB" else a - b)
            return False
        if name in ("MOVB", "MOVW", "MOVD", "NUMEB"):
            if on:
                self.poke(operands[1], count, self.peek(operands[0], count))
            return on
        raise SystemExit(f"not a function this can run: {name}")


def main():
    program, trace = sys.argv[1:]
    pmc, scans, handed, acting, steps = Pmc(open(program).read()), 0, 0, 0, set()
    for row in csv.DictReader(open(trace)):
        row = {key: float(value) for key, value in row.items()}
        flag = lambda name: bool(row["in_" + name])
        pmc.bit("R81.7", not flag("first_scan"))
        for i, name in enumerate(("enable_key", "referenced", "reset_key", "permit_key", "nc_fresh")):
            pmc.bit(f"R80.{i}", flag(name))
        pmc.bit("F60.0", flag("erend"))
        for i, axis in enumerate("XYZ"):
            pmc.poke(f"R{180 + 4 * i}", 4, int(row[f"in_position_{axis}"]))
            pmc.poke(f"D{208 + 4 * i}", 2, int(row[f"reg_value_{axis}"]))
        pmc.poke("D200", 2, int(row["reg_status"]))
        pmc.poke("D202", 2, int(row["reg_box_heartbeat"]))
        pmc.scan()
        scans += 1
        ours = {"box_alive": pmc.bit("R100.1"), "size_count": pmc.peek("R174", 2), "control": pmc.peek("D6", 1),
                "plc_heartbeat": pmc.peek("D2", 2, signed=False),
                "handshake": pmc.peek("D4", 2, signed=False),
                "read_count_first": pmc.peek("D0", 2, signed=False),
                "read_count_last": pmc.peek("D62", 2, signed=False)}
        for i, axis in enumerate("XYZ"):
            ours[f"wanted_{axis}"] = 0.1 * pmc.peek(f"R{130 + 2 * i}", 2)
            ours[f"applied_{axis}"] = 0.1 * pmc.peek(f"D{48 + 4 * i}", 2)
            ours[f"position_{axis}"] = pmc.peek(f"D{16 + 4 * i}", 4)
            ours[f"size_acts_{axis}"] = pmc.bit(f"R103.{i}")
            ours[f"size_alarm_{axis}"] = pmc.bit(f"R111.{i}")
        if ours["handshake"] >> 8 & 1:
            handed += 1
            axis = "XYZ"[int(ours["handshake"] & 0xFF) - 1]
            ours["data"] = pmc.peek("G0", 2)
            row["out_data"] = row[f"out_data_{axis}"]
            assert pmc.peek("G2", 1) & 0x7F == 0x31 + "XYZ".index(axis)
        acting += any(pmc.bit(f"R103.{i}") for i in range(3))
        steps.add(int(ours["handshake"]) >> 8 & 3)
        for key, value in ours.items():
            off = abs(float(value) - row.get("out_" + key, row.get("in_" + key)))
            assert off <= 1e-3, f"scan {scans}: {key} is {value}, fakeplc has {row.get('out_' + key)}"
    assert scans > 1000 and handed > 500 and acting > 100 and steps == {0, 1, 2}, (
        scans, handed, acting, steps)
    print(f"{scans} scans, ESTB in {handed} of them, a size acts in {acting}: the same")


if __name__ == "__main__":
    main()
