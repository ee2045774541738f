"""The surface of a sphere, and the distance from a ball."""

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Vector, parameter
from tisim.geometry.shape import same_line
from tisim.geometry.surface import Surface


@ti.func
def ball_distance(r, centre, radius):
    """Return the distance (m) of r (m) from the surface of a ball, negative inside, and its gradient, a unit
    vector."""
    d = r - centre
    size = d.norm()
    # At the centre all directions are equally far.
    up = ti.Vector([0.0, 0.0, 1.0 + 0.0 * size])
    return size - radius, ti.select(size > 0.0, d / ti.select(size > 0.0, size, 1.0), up)


class SphericalSurface(Surface):
    """The surface of a sphere, with particles within or around it.

    The point nearest to r is c + R (r - c) / |r - c|.
    """

    envelope: ClassVar[bool] = True

    centre: Vector = parameter("m", "centre c", (0.0, 0.0, 0.0))
    radius: float = parameter("m", "radius R", examples=[0.1], gt=0)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.centre) - self.radius, np.array(self.centre) + self.radius

    def turns_into_itself(self, centre: np.ndarray, axis: np.ndarray) -> bool:
        return same_line(np.array(self.centre), axis, centre, axis)

    def distances(self, places: np.ndarray) -> np.ndarray:
        away: np.ndarray = np.linalg.norm(places - np.array(self.centre), axis=1) - self.radius
        return np.abs(away)

    def tangent_planes(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float, float]]:
        return np.array(self.centre), np.zeros(3), (1.0, 0.0, self.radius, 0.0)

    @ti.func
    def tangents(self, w, k):
        centre, zero = self.centre(w, k), 0.0 * self.radius(w, k)
        return centre, 0.0 * centre, ti.Vector([zero + 1.0, zero, self.radius(w, k), zero])

    @ti.func
    def nearest(self, w, k, c, r):
        centre, radius = self.centre(w, k), self.radius(w, k)
        return centre + radius * ball_distance(r, centre, radius)[1]
