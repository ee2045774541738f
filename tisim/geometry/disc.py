"""A flat disc."""

from __future__ import annotations

from pydantic import model_validator

from tisim.components.component import Vector, parameter
from tisim.components.ranges import check_direction
from tisim.geometry.revolved import RevolvedSurface


class Disc(RevolvedSurface):
    """A flat disc, such as the bottom of a silo or a piston."""

    centre: Vector = parameter("m", "centre", (0.0, 0.0, 0.0))
    normal: Vector = parameter("", "direction of the normal; the sign does not matter", (0.0, 0.0, 1.0))
    radius: float = parameter("m", "radius", examples=[0.1], gt=0)

    @model_validator(mode="after")
    def _directed(self) -> Disc:
        check_direction(f"{self.label}.normal", self.normal)
        return self

    def generator(self) -> tuple[Vector, Vector, float, float, float]:
        return self.centre, self.normal, 0.0, 0.0, self.radius
