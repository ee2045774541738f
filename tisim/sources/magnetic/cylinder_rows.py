"""Cylinders as rows of an array, for kernels that compute input for a scene rather than a scene."""

from collections.abc import Sequence

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.sources.magnetic.cylinder_body import Cylinder


def rows(cylinders: Sequence[Cylinder]) -> np.ndarray:
    """Return the numbers of cylinders in the precision of the run, a row for each."""
    real = np.float64 if runtime.current().real == ti.f64 else np.float32
    return np.array([one.values() for one in cylinders], real)


def _slots() -> dict[str, int]:
    slots, slot = {}, 0
    for name, size in Cylinder.columns():
        slots[name], slot = slot, slot + size
    return slots


SLOTS = _slots()
"""Column of each quantity in a row; vectors occupy three."""


@ti.func
def vector(rows: ti.template(), k, name: ti.template()):  # type: ignore[valid-type]
    """Return a vector of cylinder k."""
    return ti.Vector([rows[k, ti.static(SLOTS[name] + a)] for a in ti.static(range(3))])


@ti.func
def number(rows: ti.template(), k, name: ti.template()):  # type: ignore[valid-type]
    """Return a number of cylinder k."""
    return rows[k, ti.static(SLOTS[name])]


@ti.func
def placed(rows: ti.template(), k):  # type: ignore[valid-type]
    """Return centre (m), both parts of the direction, radius and half length (m) of cylinder k."""
    return (
        vector(rows, k, "centre"),
        vector(rows, k, "lead"),
        vector(rows, k, "rest"),
        number(rows, k, "radius"),
        0.5 * number(rows, k, "length"),
    )
