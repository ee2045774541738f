"""The region of space that an insertion fills, as seen by kernels."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Effect, option, parameter
from tisim.errors import must
from tisim.geometry import round_box


class FilledRegion(Effect):
    """A region is a box, or the largest upright cylinder or ball in it; spheres lie wholly inside it."""

    contract: ClassVar[bool] = True

    low: Vector = parameter("m", "lower corner of the box", examples=[(0.0, 0.0, 0.0)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.1, 0.1, 0.1)])
    shape: round_box.BoxShape = option(
        "filled part of the box: all of it, or the cylinder along z or the ball that touches its faces", "box"
    )

    @model_validator(mode="after")
    def _round(self) -> Self:
        side = [b - a for a, b in zip(self.low, self.high, strict=True)]
        must(min(side) > 0, f"{self.label}.high", "above low in every component", self.high)
        alike = {"box": side[:1], "cylinder": side[:2], "ball": side}[self.shape]
        equal = max(alike) - min(alike) <= 1e-9 * max(alike)
        must(
            equal,
            f"{self.label}.high",
            f"equally far from low along the axes in which a {self.shape} is round",
            self.high,
        )
        return self

    def check_fits(self, radius: float) -> None:
        """Raise InputError unless a sphere of this radius (m) fits into the region."""
        narrowest = min(b - a for a, b in zip(self.low, self.high, strict=True))
        rule = f"at least {2 * radius:g} m from low along each axis, the diameter of its largest grain"
        must(narrowest >= 2 * radius, f"{self.label}.high", rule, self.high)

    @ti.func
    def volume(self, w):
        """Return the volume of the region, m^3."""
        return round_box.volume(self.shape, self.high(w) - self.low(w))

    @ti.func
    def contains(self, w, r):
        """Return whether a point (m) is in the region."""
        half, away = 0.5 * (self.high(w) - self.low(w)), r - 0.5 * (self.high(w) + self.low(w))
        return round_box.contains(ti.static(round_box.ROUND[self.shape]), half, away)

    @ti.func
    def point(self, w, radius, u):
        """Return the centre (m) of a sphere of this radius (m), uniformly distributed, from three numbers in
        0..1."""
        half = 0.5 * (self.high(w) - self.low(w)) - radius
        return 0.5 * (self.high(w) + self.low(w)) + round_box.point(self.shape, half, u)
