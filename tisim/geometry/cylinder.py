"""The surface of a cylinder."""

from tisim.components.component import parameter
from tisim.geometry.revolved import Barrel


class CylindricalSurface(Barrel):
    """The surface of a cylinder, with particles within (a drum, a silo) or around it (a rod)."""

    radius: float = parameter("m", "radius", examples=[0.1], gt=0)

    def radii(self) -> tuple[float, float]:
        return self.radius, self.radius
