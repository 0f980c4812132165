#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Conformance vectors of the volumetric model: every chain, from full homogeneous 4x4 matrices.
  volumetric.py           writes tests/conformance/vectors/volumetric.inc
  volumetric.py --check   exits 1 if it is not what it would write

The machine is built as it stands: from the workpiece over the foundation to the tool, one matrix
for each travel and one exact rational rotation (Cayley) for each error. Nothing here knows lever
arms. The small-angle model is the derivative of that at zero errors, so its values come from the
same matrices with all errors scaled by 1e-9, and slopes from those at two positions. What full
matrices add is held against the bound in models/volumetric.h, for errors of a large machine.
Everything is exact rational arithmetic."""

import itertools
import random
import sys
from fractions import Fraction

from vectors import c_bound, c_double, c_float, deliver, f32

AXES = "XYZ"
UNIT_ROUNDOFF = Fraction(1, 2**24)
TINY = Fraction(1, 10**9)


def identity():
    return [[Fraction(i == j) for j in range(4)] for i in range(4)]


def product(*matrices):
    result = identity()
    for m in matrices:
        columns = [[(k, m[k][j]) for k in range(4) if m[k][j]] for j in range(4)]  # most are zero
        result = [[sum(row[k] * value for k, value in column if row[k]) for column in columns] for row in result]
    return result


def translation(v):
    m = identity()
    for i in range(3):
        m[i][3] = v[i]
    return m


def rotation(v):
    """About v by 2 atan(|v| / 2): orthogonal, exact, |v| to third order."""
    c = [x / 2 for x in v]
    square = sum(x * x for x in c)
    cross = [[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]]
    m = identity()
    for i in range(3):
        for j in range(3):
            m[i][j] = ((1 - square) * (i == j) + 2 * cross[i][j] + 2 * c[i] * c[j]) / (1 + square)
    return m


def minus(v):
    return [-x for x in v]


class Machine:
    """Numbers are exactly those that the C gets: float32, as rationals."""

    def __init__(self, chain, levers, tool, squareness):
        self.chain, self.levers, self.tool, self.squareness = chain, levers, tool, squareness

    def deviation_um(self, position, tool_mm, errors, scale=Fraction(1)):
        """E of the tool tip in the workpiece's frame, with all errors times `scale`."""
        c0y, b0z, a0z = (scale * s / 10**6 for s in self.squareness)
        turned = {"X": [0, 0, 0], "Y": [0, 0, c0y], "Z": [a0z, b0z, 0]}
        side, matrix = "workpiece", identity()
        for letter in self.chain:
            if letter == "f":
                side = "tool"
                continue
            a = AXES.index(letter)
            unit = [Fraction(i == a) for i in range(3)]
            turn = rotation([Fraction(x) for x in turned[letter]])
            way = [position[a] * sum(turn[i][j] * unit[j] for j in range(3)) for i in range(3)]
            reference = minus(self.levers[a])  # the tip without tool is the origin
            shift = [scale * e / 1000 for e in errors[a][:3]]
            angle = [scale * e / 10**6 for e in errors[a][3:]]
            error = product(translation(reference), translation(shift), rotation(angle),
                            translation(minus(reference)))
            # on the workpiece side the inverse of a carriage that moves by -way, the other order
            pair = (translation(way), error)
            matrix = product(matrix, *(pair if side == "tool" else pair[::-1]))
        tip = [tool_mm * t for t in self.tool]
        real = [sum(matrix[i][j] * tip[j] for j in range(3)) + matrix[i][3] for i in range(3)]
        return [1000 * (real[i] - tip[i] - position[i]) / scale for i in range(3)]

    def small(self, position, tool_mm, errors):
        return self.deviation_um(position, tool_mm, errors, TINY)

    def slope(self, position, tool_mm, errors, axis, slopes):
        """d E / d position[axis], quadratic in it: one symmetric difference is exact."""
        ends = []
        for h in (1, -1):
            p, e = list(position), [list(row) for row in errors]
            p[axis] += h
            e[axis] = [v + h * s for v, s in zip(e[axis], slopes)]
            ends.append(self.small(p, tool_mm, e))
        return [(up - down) / 2 for up, down in zip(*ends)]

    def motion(self, state, rate):
        """d E for a motion that changes everything at once: bilinear, so as above."""
        ends = []
        for h in (1, -1):
            p, tool_mm, e = ([v + h * r for v, r in zip(state[0], rate[0])], state[1] + h * rate[1],
                             [[v + h * r for v, r in zip(vs, rs)]
                              for vs, rs in zip(state[2], rate[2])])
            ends.append(self.small(p, tool_mm, e))
        return [(up - down) / 2 for up, down in zip(*ends)]

    def motion_size(self, state, rate):
        """Not below the sum of the sizes of all terms of any component."""
        reach = sum(map(sum, self.reach(state[0], state[1])))
        way = sum(map(abs, rate[0])) + abs(rate[1])
        angles = sum(abs(e) for row in state[2] for e in row[3:]) + sum(map(abs, self.squareness))
        turning = sum(abs(e) for row in rate[2] for e in row[3:])
        shifts = sum(abs(e) for row in rate[2] for e in row[:3])
        return shifts + (turning * reach + angles * way) / 1000

    def reach(self, position, tool_mm):
        """Size of each component of each lever: |lever| + tool + |position|, mm."""
        return [[abs(self.levers[a][c]) + abs(tool_mm * self.tool[c]) + abs(position[c])
                 for c in range(3)] for a in range(3)]

    def sizes(self, position, tool_mm, errors):
        """Sum of the sizes of all terms of each component of E: what the rounding bound is of."""
        reach = self.reach(position, tool_mm)
        c0y, b0z, a0z = map(abs, self.squareness)
        y, z = abs(position[1]), abs(position[2])
        turned = [c0y * y + b0z * z, a0z * z, Fraction(0)]
        for a, c in itertools.product(range(3), range(3)):
            i, j = (c + 1) % 3, (c + 2) % 3
            e = errors[a][3:]
            turned[c] += abs(e[i]) * reach[a][j] + abs(e[j]) * reach[a][i]
        return [sum(abs(errors[a][c]) for a in range(3)) + turned[c] / 1000 for c in range(3)]

    def slope_sizes(self, position, tool_mm, errors, axis, slopes):
        reach = self.reach(position, tool_mm)[axis]
        angles = sum(abs(e) for row in errors for e in row[3:]) + sum(map(abs, self.squareness))
        return [abs(slopes[c]) + (angles + sum(abs(s) for s in slopes[3:]) * sum(reach)) / 1000
                for c in range(3)]

    def neglected_bound(self, position, tool_mm, errors):
        """models/volumetric.h: 1e-9 A^2 L + 1e-6 A D."""
        angles = sum(abs(e) for row in errors for e in row[3:]) + sum(map(abs, self.squareness))
        shifts = sum(abs(e) for row in errors for e in row[:3])
        longest = max(sum(row) for row in self.reach(position, tool_mm))
        return angles**2 * longest / 10**9 + angles * shifts / 10**6


def floats(rng, count, size):
    return [Fraction(float(f32(rng.uniform(-size, size)))) for _ in range(count)]


def errors_of(rng, which):
    """Six errors of three axes; "straightness": those of S1 alone, "few": some missing."""
    rows = [floats(rng, 3, 200) + floats(rng, 3, 60) for _ in range(3)]
    if which == "few":
        rows = [[v if rng.random() < 0.4 else Fraction(0) for v in row] for row in rows]
    if which == "straightness":
        rows = [[v if k < 3 and k != a else Fraction(0) for k, v in enumerate(row)]
                for a, row in enumerate(rows)]
    return rows


def c_row(machine, rng, which):
    """One struct volumetric_row; also the share of the small-angle bound that it uses."""
    position, tool_mm = floats(rng, 3, 3000), abs(floats(rng, 1, 300)[0])
    errors, slopes = errors_of(rng, which), floats(rng, 6, 0.5)
    axis = rng.randrange(3)
    e = machine.small(position, tool_mm, errors)
    d = machine.slope(position, tool_mm, errors, axis, slopes)
    full = machine.deviation_um(position, tool_mm, errors)
    added = max(abs(f - s) for f, s in zip(full, e))
    bound = machine.neglected_bound(position, tool_mm, errors)
    share = added / bound if bound else 2 * (added > 0)
    e_bound = [12 * UNIT_ROUNDOFF * s for s in machine.sizes(position, tool_mm, errors)]
    d_bound = [12 * UNIT_ROUNDOFF * s
               for s in machine.slope_sizes(position, tool_mm, errors, axis, slopes)]
    numbers = [", ".join(map(c_float, position)), c_float(tool_mm),
               ", ".join(c_float(v) for row in errors for v in row)]
    state = "{{%s}, %s, {%s}}" % tuple(numbers)
    listed = ["{" + ", ".join(f(v) for v in vs) + "}"
              for f, vs in ((c_float, slopes), (c_double, e), (c_bound, e_bound), (c_double, d),
                            (c_bound, d_bound))]
    return "    {%s, %d, %s},\n" % (state, axis, ", ".join(listed)), share, float(added)


def c_state(state):
    position, tool_mm, errors = state
    return "{{%s}, %s, {%s}}" % (", ".join(map(c_float, position)), c_float(tool_mm),
                                 ", ".join(c_float(v) for row in errors for v in row))


def c_motion(machine, rng):
    """One struct volumetric_motion."""
    state = floats(rng, 3, 3000), abs(floats(rng, 1, 300)[0]), errors_of(rng, "all")
    rate = (floats(rng, 3, 2), floats(rng, 1, 1)[0],
            [[v / 256 for v in row] for row in errors_of(rng, "few")])
    d = machine.motion(state, rate)
    bound = c_bound(16 * UNIT_ROUNDOFF * machine.motion_size(state, rate))
    return "    {%s, %s, {%s}, %s},\n" % (c_state(state), c_state(rate),
                                         ", ".join(map(c_double, d)), bound)


def main():
    rng = random.Random(21)
    motion_rng = random.Random(22)
    text, cases, motions, shares = "", "", "", []
    for i, letters in enumerate(itertools.permutations("XYZf")):
        chain = "".join(letters)
        levers = [floats(rng, 3, 1500) for _ in range(3)]
        tool = [[0, 0, -1], [0.6, 0, -0.8]][i % 2]
        tool = [Fraction(float(f32(t))) for t in tool]
        squareness = floats(rng, 3, 50)
        rows = ""
        for which in ("all", "all", "few", "straightness"):
            machine = Machine(chain, levers, tool,
                              [Fraction(0)] * 3 if which == "straightness" else squareness)
            row, share, added = c_row(machine, rng, which)
            rows += row
            shares.append((share, added))
        motions += c_motion(Machine(chain, levers, tool, squareness), motion_rng)
        numbers = ", ".join("{" + ", ".join(map(c_float, v)) + "}" for v in levers)
        text += f"static const struct volumetric_row volumetric_{i}_rows[] = {{\n{rows}}};\n"
        cases += ('    {"%s", {{%s}, {%s}, {%s}, {0}}, volumetric_%d_rows},\n' %
                  (chain, numbers, ", ".join(map(c_float, tool)),
                   ", ".join(map(c_float, squareness)), i))
    text += f"static const struct volumetric_case volumetric_cases[] = {{\n{cases}}};\n"
    text += f"static const struct volumetric_motion volumetric_motions[] = {{\n{motions}}};\n"
    share, added = max(s for s, _ in shares), max(a for _, a in shares)
    print(f"full matrices add at most {added:.3f} um, {float(share):.0%} of the stated bound")
    if share > 1:
        sys.exit("the bound of models/volumetric.h on what small angles neglect does not hold")
    deliver({"volumetric.inc": text}, "volumetric.py")


if __name__ == "__main__":
    main()
