"""A box along the axes, and the cylinder along z and the ball inscribed in it."""

import math
from typing import Literal

from tisim.backend.taichi import ti
from tisim.numerics import elementary

BoxShape = Literal["box", "cylinder", "ball"]
ROUND: dict[BoxShape, tuple[int, int, int]] = {"box": (0, 0, 0), "cylinder": (1, 1, 0), "ball": (1, 1, 1)}
"""For each shape, 1 for the axes along which it is round, 0 for the others."""
PART: dict[BoxShape, float] = {"box": 1.0, "cylinder": math.pi / 4, "ball": math.pi / 6}
"""Volume of each shape relative to its bounding box."""


@ti.pyfunc
def volume(shape: ti.template(), side):  # type: ignore[valid-type]
    """Return the volume (m^3) of a shape in a box with these sides (m); for kernels and Python."""
    return ti.static(PART[shape]) * side[0] * side[1] * side[2]


@ti.pyfunc
def contains(rounded, half, away):
    """Return whether a point is in a shape or on its surface; for kernels, and for NumPy arrays in Python.

    rounded : as in ``ROUND``. half : half the sides of its box, m. away : position relative to its centre, m,
        with components along the first axis.
    """
    square, inside = 0.0 * away[0], True
    for axis in ti.static(range(3)):
        square += rounded[axis] * away[axis] * away[axis]
        inside = inside & ((rounded[axis] > 0) | (abs(away[axis]) <= half[axis]))
    return inside & (square <= half[0] * half[0])


@ti.func
def point(shape: ti.template(), half, u):  # type: ignore[valid-type]
    """Return a uniformly distributed point (m) in a shape, relative to its centre, from three numbers in
    0..1. half : half the sides of its box, m."""
    place = half * (2.0 * u - 1.0)
    if ti.static(shape != "box"):
        angle = 2.0 * ti.math.pi * u[1]
        across = half[0] * ti.sqrt(u[0])
        if ti.static(shape == "ball"):
            reach = half[0] * elementary.pow(u[0], 1.0 / 3.0)
            place[2] = reach * (2.0 * u[2] - 1.0)
            across = ti.sqrt(ti.max(reach * reach - place[2] * place[2], 0.0))
        place[0], place[1] = across * elementary.cos(angle), across * elementary.sin(angle)
    return place
