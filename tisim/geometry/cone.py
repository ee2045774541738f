"""The surface of a cone, whole or truncated."""

from __future__ import annotations

from pydantic import model_validator

from tisim.components.component import parameter
from tisim.errors import must
from tisim.geometry.revolved import Barrel


class ConicalSurface(Barrel):
    """The surface of a cone, truncated unless a radius is 0, such as the wall of a hopper."""

    start_radius: float = parameter("m", "radius at the start", examples=[0.02], ge=0)
    end_radius: float = parameter("m", "radius at the end", examples=[0.1], ge=0)

    @model_validator(mode="after")
    def _wide(self) -> ConicalSurface:
        radii = self.start_radius, self.end_radius
        must(max(radii) > 0, f"{self.label}.start_radius and end_radius", "not both 0", radii)
        return self

    def radii(self) -> tuple[float, float]:
        return self.start_radius, self.end_radius
