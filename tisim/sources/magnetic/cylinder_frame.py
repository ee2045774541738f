"""The directions of a cylinder, computed with 50 digits, and positions relative to it without cancellation.

Beside the middle of a long cylinder that is magnetised along its axis, the field is only of the order of
(R/L)^2 M. A magnetisation across the axis would cause a field of the order of M, so even the part across the
axis that rounding adds determines the field. Far along the axis, the distance of a point from the axis is a
small difference of large numbers.
"""

from __future__ import annotations

import math
from decimal import Decimal, localcontext

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.numerics.ieee import rounded_vector

DIGITS, BITS = 50, 24
"""Decimal digits used here, and bits of the leading part of a unit vector; the product of two such parts is
exact."""
LARGEST_PLACE = 1e37
"""Largest coordinate (m) along an axis that is split, within the range of f32."""


def split_direction(axis: Vector) -> tuple[Vector, Vector]:
    """Return the unit vector along an axis as the sum of a vector of ``BITS`` bits and the rounded rest."""
    with localcontext(prec=DIGITS):
        a = [Decimal(c) for c in axis]
        size = _dot(a, a).sqrt()
        lead = [_leading(float(c / size)) for c in a]
        rest = [float(c / size - Decimal(high)) for c, high in zip(a, lead, strict=True)]
    return _vector(lead), _vector(rest)


def split_magnetisation(axis: Vector, magnetisation: Vector) -> tuple[Vector, float]:
    """Return the magnetisation (A/m) across an axis, and its component along it, each rounded once."""
    with localcontext(prec=DIGITS):
        a, m = [Decimal(c) for c in axis], [Decimal(c) for c in magnetisation]
        square = _dot(a, a)
        share = _dot(a, m) / square
        across = [float(mi - share * ai) for mi, ai in zip(m, a, strict=True)]
        return _vector(across), float(share * square.sqrt())


def _dot(a: list[Decimal], b: list[Decimal]) -> Decimal:
    return sum((x * y for x, y in zip(a, b, strict=True)), Decimal(0))


def _leading(c: float) -> float:
    fraction, power = math.frexp(c)
    return math.ldexp(round(math.ldexp(fraction, BITS)), power - BITS)


def _vector(components: list[float]) -> Vector:
    x, y, z = components
    return x, y, z


@ti.func
def place(r, centre, lead, rest):
    """Return the position of r relative to an axis: its distance from the axis, the unit vector away from the
    axis, and its coordinate along the axis as a sum of two numbers, of which the first has the bits of f32.

    The error is at the level of rounding of the distance from the axis, at any distance from the centre. r,
    centre : m. lead, rest : the direction, from ``split_direction``.
    """
    # r - centre = d + lost, exactly (D. E. Knuth, The Art of Computer Programming, volume 2, 4.2.2).
    d = rounded_vector(r - centre, lead[0])
    subtracted = rounded_vector(r - d, lead[0])
    again = rounded_vector(d + subtracted, lead[0])
    rounding_error = rounded_vector(r - again, lead[0]) + rounded_vector(subtracted - centre, lead[0])
    axis = lead + rest
    along = ti.min(ti.max(d.dot(axis), -LARGEST_PLACE), LARGEST_PLACE)
    foot = ti.cast(ti.cast(along, ti.f32), float)
    near = rounded_vector(d - foot * lead, lead[0]) + (rounding_error - foot * rest)
    z = near.dot(axis)
    across = near - z * axis
    rho = across.norm()
    return rho, across / ti.select(rho > 0.0, rho, 1.0), foot, z


@ti.func
def relative_place(r, centre, lead, rest, half):
    """Return the position of r (m) relative to a cylinder of length 2 ``half``: distance from the axis, unit
    vector away from the axis, coordinate along the axis from the centre, and distance beyond the nearer end,
    negative before it."""
    rho, outward, foot, z = place(r, centre, lead, rest)
    side = ti.select(foot + z < 0.0, -1.0, 1.0)
    return rho, outward, foot + z, (side * foot - half) + side * z
