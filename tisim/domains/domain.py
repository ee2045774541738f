"""The domain of a scene: open space, or a box with opposite faces joined along chosen axes."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Component, Vector, option, parameter
from tisim.errors import must
from tisim.numerics.ieee import same

Axes = tuple[bool, bool, bool]
"""A value for each axis: x, y and z."""
NO_AXIS: Axes = (False, False, False)


class Domain(Component):
    """Unbounded space, and the contract of a domain."""

    contract: ClassVar[bool] = True

    def bounds(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the corners in m, shape (3,) each; None if there are none."""
        return None, None

    def joined(self) -> Axes:
        """Return the axes along which opposite faces are joined, so that a particle that leaves through one
        face enters through the other."""
        return NO_AXIS

    def imaged(self) -> Axes:
        """Return the axes along which particles interact across joined faces."""
        return NO_AXIS

    def cyclic(self) -> Axes:
        """Return the axes along which rows of cells continue across joined faces."""
        return self.joined()

    def shears(self) -> bool:
        """Return whether images move relative to the box."""
        return False

    def edges(self, time: float) -> np.ndarray:
        """Return the edge vectors of the box (m) at a time (s), one row per axis, shape (3, 3). Along joined
        axes they lead from a particle to its images."""
        low, high = self.bounds()
        return np.zeros((3, 3)) if low is None or high is None else np.diag(high - low)

    def streaming_velocity(self, position: np.ndarray) -> np.ndarray:
        """Return ``streaming`` (m/s) at positions (m), shape (n, 3)."""
        return np.zeros_like(position)

    @ti.func
    def wrap(self, w, r, t):
        """Return the position (m) inside the domain, at time t (s), of a particle that has moved to r."""
        return r

    @ti.func
    def put(self, s, w, i, r, t):
        """Put a particle that has moved to r (m) inside the domain, at time t (s)."""
        s.position[w, i] = self.wrap(w, r, t)

    @ti.func
    def lost(self, w, r):
        """Return whether r is so far outside that rounding has lost its position within the box."""
        return 0

    @ti.func
    def separation(self, w, a, b, t):
        """Return the vector (m) from a to b, at time t (s), that contacts and forces use."""
        return b - a

    @ti.func
    def nearest(self, w, a, b, t):
        """Return the shortest vector (m) from a to b, at time t (s), across joined faces if there are any."""
        return b - a

    @ti.func
    def relative_velocity(self, s, w, i, j, separation):
        """Return the velocity (m/s), relative to particle i, of j or of the image of j that is at
        ``separation`` (m) from i."""
        return s.velocity[w, j] - s.velocity[w, i]

    @ti.func
    def shear_rate(self, w):
        """Return the shear rate (1/s): the velocity of images relative to the box over their distance."""
        return 0.0

    @ti.func
    def streaming(self, w, r):
        """Return the velocity (m/s) at r of the mean flow in which images move."""
        return ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def turn(self, w, a, b):
        """Return which image of b, across faces that move relative to each other, is nearest to a: -1, 0 or
        1."""
        return 0

    @ti.func
    def seen_from(self, w, r, turn, t):
        """Return the position (m) from which particles appear as their images of this ``turn`` appear from
        r."""
        return r

    @ti.func
    def origin(self, w):
        """Return the lower corner (m) of a box."""
        return ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def side(self, w):
        """Return the side lengths (m) of a box."""
        return ti.Vector([0.0, 0.0, 0.0])


class Open(Domain):
    """Unbounded space."""


class Box(Domain):
    """A box; a particle that leaves it along a periodic axis re-enters through the opposite face.

    Along any other axis space continues beyond the faces, which do not confine particles: use walls to
    confine grains. Such faces only define the volume of the box, the region in which a random start places
    whole spheres, and the box that is drawn.

    With images, particles also interact across joined faces: in this periodic system each particle interacts
    with the nearest image of every other particle only. A box is refused if two particles could touch on both
    sides at once, or if the interaction range of a short-ranged law, between centres, exceeds half a side at
    the start. For a force between all pairs only the contribution of the nearest image is summed, and the
    force jumps when another image becomes the nearest.

    Without images the box is the control volume of Z04 section 7: a grain that leaves re-enters on the other
    side with the same velocity, and may overlap particles there. (The paper reverses the coordinate; the two
    differ by twice the overshoot, and translation keeps the particle inside.)

    Source: Z04 section 7.
    """

    low: Vector = parameter("m", "lower corner of the box", examples=[(-0.01, -0.01, -0.01)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.01, 0.01, 0.01)])
    periodic: Axes = option("whether the box is periodic along x, y and z", (True, True, True))
    images: bool = option("whether particles interact across periodic faces", True)

    @model_validator(mode="after")
    def _ordered(self) -> Box:
        ordered = all(a < b for a, b in zip(self.low, self.high, strict=True))
        must(ordered, f"{self.label}.high", f"above {self.label}.low in every component", self.high)
        volume = math.prod(b - a for a, b in zip(self.low, self.high, strict=True))
        must(math.isfinite(volume), "volume of the box", "a finite number", volume)
        return self

    def bounds(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        return np.asarray(self.low), np.asarray(self.high)

    def joined(self) -> Axes:
        return self.periodic

    def imaged(self) -> Axes:
        return self.periodic if self.images else NO_AXIS

    @ti.func
    def origin(self, w):
        return self.low(w)

    @ti.func
    def side(self, w):
        return self.high(w) - self.low(w)

    @ti.func
    def wrap(self, w, r, t):
        low, side, place = self.low(w), self.side(w), r
        for k in ti.static(range(3)):
            if ti.static(self.periodic[k]):
                place[k], _turns = self.enter(low[k], side[k], r[k])
        return place

    @ti.func
    def enter(self, low, side, x):
        """Return the position (m) of x between two faces a ``side`` apart, and the number of sides that were
        subtracted."""
        inside, turns = x, 0.0 * x
        # Only if x is outside: x - side * floor(...) would round positions that have not crossed a face.
        if not (x >= low and x < low + side):
            turns = ti.floor((x - low) / side)
            inside = x - side * turns
            # Rounding can give exactly the upper face, which is identical to the lower one.
            if inside >= low + side:
                inside = low
                turns += 1.0
        return inside, turns

    @ti.func
    def lost(self, w, r):
        # The coordinate is so large that a thousandth of the side is below half a unit in the last place.
        blurred, lost = same(r + 1e-3 * self.side(w), r), 0
        for k in ti.static(range(3)):
            if ti.static(self.periodic[k]):
                lost += blurred[k]
        return lost

    @ti.func
    def nearest(self, w, a, b, t):
        return self.shortest(w, b - a)

    @ti.func
    def shortest(self, w, apart):
        """Return the shortest image (m) of a separation vector of at most one and a half sides."""
        side, d = self.side(w), apart
        for k in ti.static(range(3)):
            if ti.static(self.periodic[k]):
                d[k] -= ti.select(d[k] > 0.5 * side[k], side[k], 0.0)
                d[k] += ti.select(d[k] < -0.5 * side[k], side[k], 0.0)
        return d

    @ti.func
    def separation(self, w, a, b, t):
        d = b - a
        if ti.static(self.images):
            d = self.nearest(w, a, b, t)
        return d
