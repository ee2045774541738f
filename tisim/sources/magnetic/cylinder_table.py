"""The six numbers of a cylinder's end from a table, in units of its radius; one table serves cylinders of any
shape.

A point is located by its distance d from the rim and its direction from the rim, because the numbers vary
most near the rim. Cells have equal widths in d^2 between powers of two, and in u / (|x| + u), x = rho - 1.
They are found from bits, without a logarithm or an angle. In each cell the numbers are polynomials through
Chebyshev points.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import InputError
from tisim.sources.magnetic.cylinder_end import end

FIRST_OCTAVE, OCTAVES_END = -40, 16
"""The table covers (d / R)^2 between these powers of two."""
GRIDS = ((3, 1, 2), (3, 2, 4), (3, 4, 8), (3, 8, 16), (5, 4, 8), (5, 8, 16))
"""Polynomial degree, cells of d^2 per octave, and cells of direction per quadrant; the smallest table
first."""
SAFE = 3.0
"""Upper bound on the factor by which errors grow in field and gradient, which are differences between
ends."""


@in_taichi_thread
@ti.kernel
def _ends(places: ti.types.ndarray(), out: ti.types.ndarray()):  # type: ignore[valid-type]
    for i in range(places.shape[0]):
        # On the other side of the axis all numbers are the same except the third, which is odd.
        six = end(ti.abs(places[i, 0]), places[i, 1], 1.0)
        six[2] *= ti.select(places[i, 0] < 0.0, -1.0, 1.0)
        for k in ti.static(range(6)):
            out[i, k] = six[k]


def _numbers(octave: np.ndarray, part: np.ndarray, side: np.ndarray, slant: np.ndarray) -> tuple[Any, Any]:
    """Return rho / R and the six numbers for points with (d/R)^2 = part 2^octave, 1 <= part < 2; arrays of
    one shape."""
    d = np.sqrt(np.ldexp(part, octave)) / np.hypot(1 - slant, slant)
    places = np.stack([1 + side * d * (1 - slant), d * slant], axis=-1)
    out = np.zeros((*places.shape[:-1], 6))
    _ends(np.ascontiguousarray(places.reshape(-1, 2)), out.reshape(-1, 6))
    return places[..., 0], out


def _coefficients(degree: int, parts: int, slants: int) -> np.ndarray:
    """Return the coefficients of all cells, (octaves, parts, slants, sides, degree + 1, degree + 1, 6),
    highest power first."""
    x = chebyshev.chebpts1(degree + 1)
    solve = np.linalg.inv(np.vander(x, degree + 1))
    octave, i, j, side = np.meshgrid(
        np.arange(FIRST_OCTAVE, OCTAVES_END), np.arange(parts), np.arange(slants), [-1, 1], indexing="ij"
    )
    cells = (..., None, None)
    part = 1 + (i[cells] + 0.5 + 0.5 * x[:, None]) / parts
    slant = (j[cells] + 0.5 + 0.5 * x) / slants
    _, values = _numbers(*np.broadcast_arrays(octave[cells], part, side[cells], slant))
    return np.einsum("pa,qb,...abk->...pqk", solve, solve, values)


def _error(coefficients: np.ndarray, points: int = 200_000) -> float:
    """Return the largest error at random points, for the numbers of the field and for those of the gradient,
    each relative to their own magnitude."""
    draw = np.random.Generator(np.random.Philox(16))
    _, parts, slants, _, n, _, _ = coefficients.shape
    octave, side = draw.integers(FIRST_OCTAVE, OCTAVES_END, points), draw.integers(0, 2, points)
    part, slant = draw.uniform(0, parts, points), draw.uniform(0, slants, points)
    rho, expected = _numbers(octave, 1 + part / parts, 2 * side - 1, slant / slants)
    cell = coefficients[octave - FIRST_OCTAVE, part.astype(int), slant.astype(int), side]
    p, q = (np.vander(2 * (v % 1) - 1, n) for v in (part, slant))
    wrong = np.einsum("ip,iq,ipqk->ik", p, q, cell) - expected
    there, weight = rho >= 0, np.stack([np.ones_like(rho), rho], axis=-1)[:, [0, 0, 1, 1, 0, 0, 0, 1]]
    worst = 0.0
    for used, weights in (([0, 1, 2, 3], weight[:, :4]), ([2, 3, 4, 5], weight[:, 4:])):
        size = np.linalg.norm((expected[:, used] * weights)[there], axis=1)
        worst = max(worst, float((np.linalg.norm((wrong[:, used] * weights)[there], axis=1) / size).max()))
    return worst


@cache
def _table(digits: int, settings: runtime.Runtime) -> tuple[np.ndarray, tuple[int, int, int]]:
    """Return the smallest table accurate to this number of digits, (cells, numbers in each), and its grid."""
    for grid in GRIDS:
        coefficients = _coefficients(*grid)
        if SAFE * _error(coefficients) < 10.0**-digits:
            return coefficients.reshape(-1, 6 * (grid[0] + 1) ** 2), grid
    raise InputError(f"table_digits must be fewer in {runtime.current().precision}; received {digits}")


def table(digits: int) -> tuple[np.ndarray, tuple[int, int, int]]:
    """Return the table for a number of digits, made once for the running settings; raise InputError if no
    table is accurate enough."""
    return _table(digits, runtime.current())


class TabulatedEnds:
    """Ends read from a table, within its range. cells : the bound array of ``table``."""

    far = 9.0

    def __init__(self, cells: Any, digits: int) -> None:
        self.cells, self.small = cells, 0.01 * 10.0**-digits
        degree, self.parts, self.slants = table(digits)[1]
        self.terms = degree + 1
        self.shift = 23 - self.parts.bit_length() + 1

    @ti.func
    def both(self, rho, u, radius):
        both = ti.Matrix([[0.0 * rho, 0.0 * rho] for _ in range(6)])
        # A loop, so that the long code is compiled once.
        for k in range(2):
            first = k == 0
            one = self.at(rho, ti.select(first, u[0], u[1]), radius)
            for i in ti.static(range(6)):
                both[i, 0], both[i, 1] = ti.select(first, one[i], both[i, 0]), one[i]
        return both

    @ti.func
    def mostly(self, rho, u, radius):
        # Reading a table needs branches.
        return ti.Matrix([[0.0 * rho, 0.0 * rho] for _ in range(6)]), False

    @ti.func
    def at(self, rho, u, radius):
        x, y = rho / radius - 1.0, u / radius
        square = x * x + y * y
        six = ti.Vector([0.0 * rho, 0.0, 0.0, 0.0, 0.0, 0.0])
        if square > ti.static(2.0**FIRST_OCTAVE) and square < ti.static(2.0**OCTAVES_END):
            six = self.read(x, y, square, radius)
        else:
            six = end(rho, u, radius)
        return six

    @ti.func
    def read(self, x, y, square, radius):
        # In an f32 number, the bits from 23 on are its octave, and the next lower bits its part of the
        # octave.
        bits = ti.bit_cast(ti.cast(square, ti.f32), ti.i32)
        octave, part = bits >> 23, (bits >> self.shift) & (self.parts - 1)
        inverse = ti.cast(ti.bit_cast((254 - octave) << 23, ti.f32), float)
        slant = self.slants * y / (ti.abs(x) + y)
        number = ti.min(ti.cast(slant, ti.i32), self.slants - 1)
        p = 2.0 * ((square * inverse - 1.0) * self.parts - part) - 1.0
        q = 2.0 * (slant - number) - 1.0
        row = ((octave - 127 - FIRST_OCTAVE) * self.parts + part) * self.slants + number
        cell = 2 * row + ti.cast(x >= 0.0, ti.i32)
        six = ti.Vector([0.0 * p, 0.0, 0.0, 0.0, 0.0, 0.0])
        for a in range(self.terms):
            line = ti.Vector([0.0 * p, 0.0, 0.0, 0.0, 0.0, 0.0])
            for b in ti.static(range(self.terms)):
                for k in ti.static(range(6)):
                    line[k] = line[k] * q + self.cells[cell, (a * self.terms + b) * 6 + k]
            six = six * p + line
        per = 1.0 / radius
        return six * ti.Vector([1.0, 1.0, per, per, per, per * per])
