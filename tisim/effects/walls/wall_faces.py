"""Walls at the periodic faces of a box.

A grain at one face does not feel a wall at the opposite face. So a surface must stay farther from periodic
faces than the largest grain reaches, or be the same at both faces, throughout the motion of its body. A floor
that continues flat from one face to the other is the same at both; so is a duct of several pieces that
extends beyond both.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np

from tisim.domains.domain import Domain
from tisim.effects.walls.motion import Motion
from tisim.errors import Words, must
from tisim.geometry.shape import SEAM, Shape
from tisim.geometry.triangles import TriangulatedSurface

FIRST_PLACES, MOST_PLACES, FEWEST_PLACES = 4000, 2**22, 200
"""Numbers of random points at which a body is compared at two faces: the first number, doubled up to the
largest, until at least FEWEST_PLACES points are near the body."""
SAME_DISTANCE = 1e-4
"""Tolerance of distances from the body, over the interaction range, besides the rounding of coordinates in
f32."""


def check_faces(
    shapes: Iterable[tuple[str, Shape]], motion: Motion, domain: Domain, reach: float, duration: float
) -> None:
    """Raise InputError for a shape that comes within reach (m) of a joined face in a run of some duration
    (s), unless the body is the same at the opposite face. shapes : each with its name for messages."""
    (low, high), joined = domain.bounds(), np.array(domain.joined())
    if low is None or high is None or not joined.any():
        return
    shapes = list(shapes)
    body = [shape for _, shape in shapes]
    for name, shape in shapes:
        at_start = _ends(shape, motion, low, high, reach, 0.0)
        for axis in np.flatnonzero(joined & _ends(shape, motion, low, high, reach, duration)):
            if _is_alike(body, motion, int(axis), low, high, reach, duration):
                continue
            rule = (
                f"farther than the largest radius, {reach:g} m, from the periodic faces of the box along "
                f"{'xyz'[axis]}, or be the same at both, as a flat floor is: it does not act through "
                "them"
            )
            received = "one that ends or bends there" + ("" if at_start[axis] else " as it moves")
            must(False, name, rule, Words(received))


def _ends(
    shape: Shape, motion: Motion, low: np.ndarray, high: np.ndarray, reach: float, duration: float
) -> np.ndarray:
    """Return the axes along which a shape ends or bends within reach of a face at some time: shape (3,)."""
    ends = np.zeros(3, bool)
    shifts = np.array(motion.shifts(duration))
    travel = np.ptp(shifts, axis=0)
    for shift in shifts:
        ends |= shape.ends_at(low - shift, high - shift, reach)
        if isinstance(shape, TriangulatedSurface):
            # Between the extremes of a motion a different part of it may pass a face.
            for axis in np.flatnonzero(travel):
                ends[axis] |= shape.ends_at(low - shift, high - shift, reach + travel[axis])[axis]
    turning = motion.axis()
    if turning is not None and duration > 0 and not shape.turns_into_itself(*turning):
        ends |= _ends_turned(shape, *turning, low, high, reach)
    return ends


def _ends_turned(
    shape: Shape, centre: np.ndarray, axis: np.ndarray, low: np.ndarray, high: np.ndarray, reach: float
) -> np.ndarray:
    """Return the same for a shape that rotates about an axis; it may be anywhere in a ring around the
    axis."""
    # Along the axis of rotation nothing changes.
    turned = np.abs(axis) < 1.0 - SEAM
    if (extent := shape.extent()) is None:
        return turned
    corners = np.array(list(product(*np.stack(extent, axis=1)))) - centre
    along = corners @ axis
    widest = np.linalg.norm(corners - along[:, None] * axis, axis=1).max() * np.sqrt(1.0 - axis**2)
    lowest = centre + np.minimum(along.min() * axis, along.max() * axis) - widest
    highest = centre + np.maximum(along.min() * axis, along.max() * axis) + widest
    near: np.ndarray = (lowest - reach < low) | (highest + reach > high)
    return turned & near


def _is_alike(
    body: list[Shape], motion: Motion, axis: int, low: np.ndarray, high: np.ndarray, reach: float,
    duration: float,
) -> bool:  # fmt: skip
    """Return whether a body is the same at both faces across an axis: points within reach (m) of one face
    have the same distance from it as their images at the other face."""
    turning, shifts = motion.axis(), np.array(motion.shifts(duration))
    if turning is not None and not all(shape.turns_into_itself(*turning) for shape in body):
        return False
    if np.ptp(shifts[:, axis]) > 0:
        # Between the extremes of the motion the parts may be arranged differently.
        return False
    apart = np.zeros(3)
    apart[axis] = high[axis] - low[axis]
    tolerance = SAME_DISTANCE * reach + float(np.finfo(np.float32).eps * np.abs([low, high]).max())
    return all(
        _is_alike_at(body, shift, axis, low, high, apart, reach, tolerance)
        for shift in np.unique(shifts, axis=0)
    )


def _is_alike_at(
    body: list[Shape], shift: np.ndarray, axis: int, low: np.ndarray, high: np.ndarray, apart: np.ndarray,
    reach: float, tolerance: float,
) -> bool:  # fmt: skip
    """Return this for one displacement (m) of the body, by comparison at random points."""
    rng, found, number = np.random.Generator(np.random.Philox(0)), 0, FIRST_PLACES
    while number <= MOST_PLACES:
        places = rng.uniform(low, high, (number, 3))
        # Points on either side of the lower face, and their images on either side of the upper one.
        places[:, axis] = low[axis] + rng.uniform(-reach, reach, number)
        # For each shape, as a mesh with too many triangles does not give distances and is then refused.
        here, there = (
            np.array([shape.distances(at - shift) for shape in body]) for at in (places, places + apart)
        )
        if not (np.isfinite(here).all() and np.isfinite(there).all()):
            return False
        here, there = here.min(axis=0), there.min(axis=0)
        near = np.minimum(np.abs(here), np.abs(there)) < reach
        if not (np.abs(here - there)[near] < tolerance).all():
            return False
        found += int(near.sum())
        if found >= FEWEST_PLACES:
            return True
        number *= 2
    return False
