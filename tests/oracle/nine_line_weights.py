# SPDX-License-Identifier: MIT
"""Weighted least squares of nine or more lines as one dense system, with an offset for each line and
a slope for each straightness line among the unknowns. It shares nothing with the tools."""

import numpy

from nine_line import moved

class Lines:
    """Lines at `points` along `axis`, at positions_mm, with the noise sigma_um of each line."""

    def __init__(self, points, axis, positions_mm, sigma_um):
        self.axis, self.x = "XYZ".index(axis), numpy.asarray(positions_mm, float)
        self.sigma = numpy.asarray(sigma_um, float)
        self.A = moved(points, numpy.eye(6)).T  # lines x 6: the six unit errors
        self.t = (self.x - self.x.mean()) / numpy.ptp(self.x)
        self.keeps = {self.axis, 3 + (self.axis + 1) % 3, 3 + (self.axis + 2) % 3}

    def used(self, method):
        if method == "improved":
            return list(range(len(self.sigma)))
        a = self.axis
        return [a, 3 + a, 6 + a, (a + 1) % 3, 3 + (a + 1) % 3, (a + 2) % 3]

    def system(self, lines):
        """Rows: readings, position by position. Columns: six errors of each position, set-ups."""
        n, m = len(self.x), len(lines)
        straight = [line for line in lines if line % 3 != self.axis]
        M = numpy.zeros((n * m, 6 * n + m + len(straight)))
        for i in range(n):
            rows = slice(i * m, (i + 1) * m)
            M[rows, 6 * i:6 * i + 6] = self.A[lines]
            M[rows, 6 * n:6 * n + m] = numpy.eye(m)
            for k, line in enumerate(straight):
                M[i * m + lines.index(line), 6 * n + m + k] = self.t[i]
        return M

    def estimable(self):
        """Takes off what set-ups hide: 6n x 6n, errors of each position in a row."""
        n = len(self.x)
        out = numpy.zeros((6 * n, 6 * n))
        for k in range(6):
            base = numpy.stack([numpy.ones(n)] + ([] if k in self.keeps else [self.t])).T
            out[k::6, k::6] = numpy.eye(n) - base @ numpy.linalg.pinv(base)
        return out

    def gauged(self, errors):
        return (self.estimable() @ numpy.asarray(errors).ravel()).reshape(-1, 6)

    def estimator(self, method="improved", weights_by=None):
        """G with errors = G readings (both position by position), weighted by 1 / weights_by^2."""
        lines = self.used(method)
        sigma = numpy.asarray(self.sigma if weights_by is None else weights_by, float)[lines]
        w = numpy.tile(1 / sigma, len(self.x))
        M = self.system(lines)
        scale = 1 / numpy.linalg.norm(M * w[:, None], axis=0)
        part = numpy.linalg.pinv(M * w[:, None] * scale, rcond=1e-9) * w
        return self.estimable() @ (scale[:, None] * part)[:6 * len(self.x)], lines

    def solve(self, readings, method="improved", weights_by=None):
        G, lines = self.estimator(method, weights_by)
        return (G @ numpy.asarray(readings)[:, lines].ravel()).reshape(-1, 6)

    def scatter(self, method="improved", weights_by=None, correlation=0.0):
        """Standard deviation of what solve() gives, under the true noise: n x 6. correlation: of
        neighbours along a line."""
        G, lines = self.estimator(method, weights_by)
        steps = abs(numpy.subtract.outer(range(len(self.x)), range(len(self.x))))
        alike = numpy.linalg.cholesky(float(correlation) ** steps)
        noise = numpy.kron(alike, numpy.diag(self.sigma[lines]))
        return numpy.sqrt(((G @ noise) ** 2).sum(axis=1)).reshape(-1, 6)


def random_points(dice, axis, count=3):
    """A box of any shape, and points in it that show all six errors well enough."""
    a = "XYZ".index(axis)
    size = numpy.exp(dice.uniform(numpy.log(60), numpy.log(900), 3))
    centre = dice.uniform(-600, 600, 3)
    while True:
        points = centre + size * dice.choice([-0.5, -0.25, 0, 0.25, 0.5], (count, 3))
        across = numpy.delete(points - points.mean(axis=0), a, axis=1)
        if numpy.linalg.svd(across)[1][1] > 0.15 * numpy.delete(size, a).min():
            return points.tolist()


def rms(values):
    return numpy.sqrt((numpy.asarray(values) ** 2).mean(axis=0))
