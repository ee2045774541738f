"""The surface of a cylinder, and the distance from a solid one."""

from tisim.backend.taichi import ti
from tisim.components.component import parameter
from tisim.geometry.revolved import Barrel


@ti.func
def cylinder_distance(rho, outward, end, upward, radius):
    """Return the distance (m) of a point from the surface of a solid cylinder, negative inside, and its
    gradient, a unit vector; on the axis, inside, those of the nearer end.

    rho, outward : distance from the axis, m, and the unit vector away from it.
    end, upward : distance beyond the plane of the nearer end, m, negative inside, and its unit normal.
    radius : m.
    """
    side = rho - radius
    # Inside, use the nearer of side and end; on the axis the direction to the side is undefined.
    sideways = side >= end and rho > 0.0
    distance, normal = ti.select(sideways, side, end), ti.select(sideways, outward, upward)
    if side > 0.0 and end > 0.0:
        distance = ti.sqrt(side * side + end * end)
        normal = (side * outward + end * upward) / distance
    return distance, normal


class CylindricalSurface(Barrel):
    """The surface of a cylinder, with particles within (a drum, a silo) or around it (a rod)."""

    radius: float = parameter("m", "radius", examples=[0.1], gt=0)

    def radii(self) -> tuple[float, float]:
        return self.radius, self.radius
