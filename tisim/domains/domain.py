"""The space a scene lives in: open, or a box whose opposite faces are joined along the axes of choice."""

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
"""An answer for each axis: x, y and z."""
NO_AXIS: Axes = (False, False, False)


class Domain(Component):
    """This is unbounded space, and the contract of a domain."""

    contract: ClassVar[bool] = True

    def bounds(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the corners in m, shape (3,) each; None where there are none."""
        return None, None

    def joined(self) -> Axes:
        """Return along which axes opposite faces are joined, so that what leaves by one enters by the
        other."""
        return NO_AXIS

    def imaged(self) -> Axes:
        """Return along which axes particles see each other across joined faces."""
        return NO_AXIS

    def cyclic(self) -> Axes:
        """Return along which axes a row of cells goes on across joined faces."""
        return self.joined()

    def shears(self) -> bool:
        """Return whether images move past the box."""
        return False

    def edges(self, time: float) -> np.ndarray:
        """Return the edges of the box (m) as vectors, a row for each axis, shape (3, 3): along joined axes
        they lead from a particle to its images at a time (s)."""
        low, high = self.bounds()
        return np.zeros((3, 3)) if low is None or high is None else np.diag(high - low)

    def streaming_velocity(self, position: np.ndarray) -> np.ndarray:
        """Return ``streaming`` (m/s) at places (m), shape (n, 3)."""
        return np.zeros_like(position)

    @ti.func
    def wrap(self, w, r, t):
        """Return the place (m) inside the domain, at time t (s), of a particle that has moved to r."""
        return r

    @ti.func
    def put(self, s, w, i, r, t):
        """Put a particle that has moved to r (m) inside the domain, at time t (s)."""
        s.position[w, i] = self.wrap(w, r, t)

    @ti.func
    def lost(self, w, r):
        """Return whether r is so far out that rounding has taken its place inside."""
        return 0

    @ti.func
    def separation(self, w, a, b, t):
        """Return the vector (m) from a to b, at time t (s), as contacts and forces see it."""
        return b - a

    @ti.func
    def nearest(self, w, a, b, t):
        """Return the shortest vector (m) from a to b, at time t (s), across joined faces where there are
        any."""
        return b - a

    @ti.func
    def relative_velocity(self, s, w, i, j, separation):
        """Return the velocity (m/s) relative to particle i of j, or of that image of it which is at
        ``separation`` (m) from i."""
        return s.velocity[w, j] - s.velocity[w, i]

    @ti.func
    def shear_rate(self, w):
        """Return the rate (1/s) at which images move past the box, over their distance."""
        return 0.0

    @ti.func
    def streaming(self, w, r):
        """Return the velocity (m/s) at r of the flow that images take part in."""
        return ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def turn(self, w, a, b):
        """Return which image of b, in faces that move past each other, is the nearest to a: -1, 0 or 1."""
        return 0

    @ti.func
    def seen_from(self, w, r, turn, t):
        """Return the place (m) from which particles themselves are seen as their images of this ``turn`` are
        from r."""
        return r

    @ti.func
    def origin(self, w):
        """Return the lower corner (m), where the domain is a box."""
        return ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def side(self, w):
        """Return the sides (m), where the domain is a box."""
        return ti.Vector([0.0, 0.0, 0.0])


class Open(Domain):
    """The domain is all of space."""


class Box(Domain):
    """The domain is a box; what leaves it along a periodic axis comes back through the opposite face.

    Along any other axis space goes on beyond the faces, which hold nothing back: put walls there where grains
    must stay. The faces then only say where a random start has room for whole spheres, what volume it is, and
    what is drawn as the box.

    With images, particles also see each other across joined faces: a periodic system, in which each sees the
    nearest image of another, and no other. Two that could touch on both sides at once are refused, and so are
    short-ranged laws that, when they begin, reach from centre to centre farther than half a side. Of a
    force between all pairs only the part of the nearest image is summed, and it jumps where another becomes
    the nearest.

    Without images it is the control volume of Z04 section 7: a grain that leaves comes back on the other side
    with the same velocity, and meets there whatever is there. (The paper reverses the coordinate; the two
    differ by twice the overshoot, and translation keeps the particle inside.)

    Source: Z04 section 7.
    """

    low: Vector = parameter("m", "lower corner of the box", examples=[(-0.01, -0.01, -0.01)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.01, 0.01, 0.01)])
    periodic: Axes = option("whether opposite faces are joined along x, y and z", (True, True, True))
    images: bool = option("whether particles see each other across joined faces", True)

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
        """Return the place (m) of x between two faces a ``side`` apart, and how many sides up it was."""
        inside, turns = x, 0.0 * x
        # Not x - side * floor(...) for all: that would round what has not moved across a face.
        if not (x >= low and x < low + side):
            turns = ti.floor((x - low) / side)
            inside = x - side * turns
            # Rounding can land exactly on the upper face, which is the lower one.
            if inside >= low + side:
                inside = low
                turns += 1.0
        return inside, turns

    @ti.func
    def lost(self, w, r):
        # A number so large that a thousandth of the side is below half of its last digit.
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
        """Return the shortest vector (m) between two that are ``apart`` by at most one and a half sides."""
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
