"""The space a scene lives in: open, or a box whose opposite faces are joined."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Component, Vector, option, parameter
from tisim.errors import must
from tisim.numerics.ieee import same


class Domain(Component):
    """This is unbounded space, and the contract of a domain."""

    contract: ClassVar[bool] = True

    def bounds(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the corners in m, shape (3,) each; None where there are none."""
        return None, None

    def joined(self) -> bool:
        """Return whether opposite faces are joined."""
        return False

    def periodic(self) -> bool:
        """Return whether particles see each other across joined faces."""
        return False

    @ti.func
    def wrap(self, w, r):
        """Return the place (m) inside the domain of a particle that has moved to r."""
        return r

    @ti.func
    def lost(self, w, r):
        """Return whether r is so far out that rounding has taken its place inside."""
        return 0

    @ti.func
    def separation(self, w, a, b):
        """Return the vector (m) from a to b as contacts and forces see it."""
        return b - a

    @ti.func
    def nearest(self, w, a, b):
        """Return the shortest vector (m) from a to b, across joined faces where there are any."""
        return b - a

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
    """The domain is a box; what leaves it through one face comes back through the opposite one.

    With images, particles also see each other across the faces: a periodic system. Without, it is the control
    volume of Z04 section 7: a grain that leaves comes back on the other side with the same velocity, and
    meets there whatever is there. (The paper reverses the coordinate; the two differ by twice the overshoot,
    and translation keeps the particle inside.)

    Source: Z04 section 7.
    """

    low: Vector = parameter("m", "lower corner of the box", examples=[(-0.01, -0.01, -0.01)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.01, 0.01, 0.01)])
    images: bool = option("whether particles see each other across the faces", True)

    @model_validator(mode="after")
    def _ordered(self) -> Box:
        ordered = all(a < b for a, b in zip(self.low, self.high, strict=True))
        must(ordered, "box.high", "above box.low in every component", self.high)
        volume = math.prod(b - a for a, b in zip(self.low, self.high, strict=True))
        must(math.isfinite(volume), "volume of the box", "a finite number", volume)
        return self

    def bounds(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        return np.asarray(self.low), np.asarray(self.high)

    def joined(self) -> bool:
        return True

    def periodic(self) -> bool:
        return self.images

    @ti.func
    def origin(self, w):
        return self.low(w)

    @ti.func
    def side(self, w):
        return self.high(w) - self.low(w)

    @ti.func
    def wrap(self, w, r):
        low, side = self.low(w), self.side(w)
        inside = r
        for k in ti.static(range(3)):
            # Not x - side * floor(...) for all: that would round what has not moved across a face.
            if not (r[k] >= low[k] and r[k] < low[k] + side[k]):
                inside[k] = r[k] - side[k] * ti.floor((r[k] - low[k]) / side[k])
                # Rounding can land exactly on the upper face, which is the lower one.
                if inside[k] >= low[k] + side[k]:
                    inside[k] = low[k]
        return inside

    @ti.func
    def lost(self, w, r):
        # A number so large that a thousandth of the side is below half of its last digit.
        return same(r + 1e-3 * self.side(w), r).any()

    @ti.func
    def nearest(self, w, a, b):
        side = self.side(w)
        d = b - a
        # Both places lie in the box, so one turn is enough.
        for k in ti.static(range(3)):
            d[k] -= ti.select(d[k] > 0.5 * side[k], side[k], 0.0)
            d[k] += ti.select(d[k] < -0.5 * side[k], side[k], 0.0)
        return d

    @ti.func
    def separation(self, w, a, b):
        d = b - a
        if ti.static(self.images):
            d = self.nearest(w, a, b)
        return d
