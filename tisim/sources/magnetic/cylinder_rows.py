"""Cylinders as rows of an array, for kernels that compute input for a scene rather than a scene."""

from collections.abc import Sequence

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.sources.magnetic import cylinder_field
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_frame import relative_place


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
def axis(rows: ti.template(), k):  # type: ignore[valid-type]
    """Return the unit vector along the axis of cylinder k."""
    return vector(rows, k, "lead") + vector(rows, k, "rest")


@ti.func
def shape_at(rows: ti.template(), k, r, ends: ti.template()):  # type: ignore[valid-type]
    """Return the six functions of ``cylinder_field`` of cylinder k at r (m), the distance from its axis, and
    the unit vector away from it."""
    half, radius = 0.5 * number(rows, k, "length"), number(rows, k, "radius")
    lead, rest = vector(rows, k, "lead"), vector(rows, k, "rest")
    rho, outward, z, end = relative_place(r, vector(rows, k, "centre"), lead, rest, half)
    return cylinder_field.shape(rho, z, end, radius, half, ends), rho, outward
