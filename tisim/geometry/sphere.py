"""The surface of a sphere."""

from tisim.backend.taichi import ti
from tisim.components.component import Vector, parameter
from tisim.geometry.surface import Surface


class SphericalSurface(Surface):
    """The surface of a sphere, with particles within or around it.

    Its place nearest to r is c + R (r - c) / |r - c|.
    """

    centre: Vector = parameter("m", "centre c", (0.0, 0.0, 0.0))
    radius: float = parameter("m", "radius R", examples=[0.1], gt=0)

    @ti.func
    def nearest(self, w, k, c, r):
        centre = self.centre(w, k)
        out = r - centre
        size = out.norm()
        # From the centre it is as far in any direction.
        up = ti.Vector([0.0, 0.0, 1.0 + 0.0 * size])
        return centre + self.radius(w, k) * ti.select(size > 0.0, out / ti.select(size > 0.0, size, 1.0), up)
