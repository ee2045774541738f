"""Walls at the periodic faces of a box.

A grain at one face does not feel a wall at the opposite one. So a surface must stay farther from those faces
than the largest grain reaches, or be the same at both, wherever the motion of its body takes it: as a floor
that goes on flat from one to the other does, or a duct of several pieces that reaches beyond both.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np

from tisim.components.domain import Domain
from tisim.effects.motion.base import Motion
from tisim.errors import Words, must
from tisim.geometry.shape import SEAM, Shape
from tisim.geometry.triangles import TriangulatedSurface

COMPARED_PLACES, TRIES, FEWEST_PLACES = 200_000, 20, 200
"""Numbers of places at which a body is compared at two faces, at most so often; and how many of them must be
near it."""
SAME_DISTANCE = 1e-4
"""Distances from it may differ by this part of the reach, and by what single precision rounds coordinates."""


def check_faces(
    shapes: Iterable[tuple[str, Shape]], motion: Motion, domain: Domain, reach: float, duration: float
) -> None:
    """Raise InputError where a shape, called so in messages, comes within reach (m) of a joined face in a run
    of some duration (s), unless the body is the same at the opposite one."""
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
                f"{'xyz'[axis]}, or be the same at both, as one that goes on flat: it is not felt through "
                "them"
            )
            received = "one that ends or bends there" + ("" if at_start[axis] else " as it moves")
            must(False, name, rule, Words(received))


def _ends(
    shape: Shape, motion: Motion, low: np.ndarray, high: np.ndarray, reach: float, duration: float
) -> np.ndarray:
    """Return along which axes it ends, or bends, within reach of a face at some time, shape (3,)."""
    ends = np.zeros(3, bool)
    shifts = np.array(motion.shifts(duration))
    travel = np.ptp(shifts, axis=0)
    for shift in shifts:
        ends |= shape.ends_at(low - shift, high - shift, reach)
        if isinstance(shape, TriangulatedSurface):
            # Between the extremes of a motion another part of it may pass a face.
            for axis in np.flatnonzero(travel):
                ends[axis] |= shape.ends_at(low - shift, high - shift, reach + travel[axis])[axis]
    turning = motion.axis()
    if turning is not None and duration > 0 and not shape.turns_into_itself(*turning):
        ends |= _ends_turned(shape, *turning, low, high, reach)
    return ends


def _ends_turned(
    shape: Shape, centre: np.ndarray, axis: np.ndarray, low: np.ndarray, high: np.ndarray, reach: float
) -> np.ndarray:
    """Return the same of a shape that turns about an axis, by the ring around it that it may come into."""
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
    """Return whether a body is as far from places within reach (m) of the two faces across an axis as from
    their images, by places at random."""
    turning, shifts = motion.axis(), np.array(motion.shifts(duration))
    if turning is not None and not all(shape.turns_into_itself(*turning) for shape in body):
        return False
    if np.ptp(shifts[:, axis]) > 0:
        # Between the extremes of the motion its parts may lie otherwise.
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
    """Return the same for one displacement (m) of the body."""
    rng, found = np.random.Generator(np.random.Philox(0)), 0
    for _ in range(TRIES):
        places = rng.uniform(low, high, (COMPARED_PLACES, 3))
        # On either side of the lower face, and their images on either side of the upper one.
        places[:, axis] = low[axis] + rng.uniform(-reach, reach, COMPARED_PLACES)
        here, there = (
            np.min([shape.distances(at - shift) for shape in body], axis=0) for at in (places, places + apart)
        )
        near = np.minimum(np.abs(here), np.abs(there)) < reach
        if not (np.abs(here - there)[near] < tolerance).all():
            return False
        found += int(near.sum())
        if found >= FEWEST_PLACES:
            return True
    return False
