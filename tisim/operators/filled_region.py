"""The region of space that an insertion fills, as kernels see it."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Effect, option, parameter
from tisim.errors import must
from tisim.numerics import elementary


class FilledRegion(Effect):
    """A region is a box, or the upright cylinder or the ball that touches its faces; spheres lie
    wholly in it."""

    contract: ClassVar[bool] = True

    low: Vector = parameter("m", "lower corner of the box", examples=[(0.0, 0.0, 0.0)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.1, 0.1, 0.1)])
    shape: Literal["box", "cylinder", "ball"] = option(
        "what of the box is filled: all, or what is round in it: the cylinder along z, the ball", "box"
    )

    @model_validator(mode="after")
    def _round(self) -> Self:
        side = [b - a for a, b in zip(self.low, self.high, strict=True)]
        must(min(side) > 0, f"{self.label}.high", "above low in every component", self.high)
        alike = {"box": side[:1], "cylinder": side[:2], "ball": side}[self.shape]
        equal = max(alike) - min(alike) <= 1e-9 * max(alike)
        must(equal, f"{self.label}.high", f"as far from low along each axis as a {self.shape} is", self.high)
        return self

    def check_room(self, radius: float) -> None:
        """Raise InputError unless a sphere of this radius (m) has room in it."""
        narrowest = min(b - a for a, b in zip(self.low, self.high, strict=True))
        rule = f"at least {2 * radius:g} m from low along each axis, the diameter of its largest grain"
        must(narrowest >= 2 * radius, f"{self.label}.high", rule, self.high)

    @ti.func
    def volume(self, w):
        """Return its volume, m^3."""
        side = self.high(w) - self.low(w)
        part = ti.static({"box": 1.0, "cylinder": 0.7853981633974483, "ball": 0.5235987755982988}[self.shape])
        return part * side[0] * side[1] * side[2]

    @ti.func
    def contains(self, w, r):
        """Return whether a point (m) is in it."""
        half, away = 0.5 * (self.high(w) - self.low(w)), r - 0.5 * (self.high(w) + self.low(w))
        inside = ti.abs(away[2]) <= half[2]
        if ti.static(self.shape == "box"):
            inside = inside and ti.abs(away[0]) <= half[0] and ti.abs(away[1]) <= half[1]
        elif ti.static(self.shape == "cylinder"):
            inside = inside and away[0] * away[0] + away[1] * away[1] <= half[0] * half[0]
        else:
            inside = away.norm_sqr() <= half[0] * half[0]
        return inside

    @ti.func
    def point(self, w, radius, u):
        """Return a centre (m) for a sphere of this radius (m), evenly by three numbers in 0..1."""
        half = 0.5 * (self.high(w) - self.low(w)) - radius
        place = half * (2.0 * u - 1.0)
        if ti.static(self.shape != "box"):
            angle = 2.0 * ti.math.pi * u[1]
            across = half[0] * ti.sqrt(u[0])
            if ti.static(self.shape == "ball"):
                reach = half[0] * elementary.pow(u[0], 1.0 / 3.0)
                place[2] = reach * (2.0 * u[2] - 1.0)
                across = ti.sqrt(ti.max(reach * reach - place[2] * place[2], 0.0))
            place[0], place[1] = across * elementary.cos(angle), across * elementary.sin(angle)
        return 0.5 * (self.high(w) + self.low(w)) + place
