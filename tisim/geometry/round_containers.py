"""Containers with one curved wall: a cylinder and a sphere."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import parameter
from tisim.errors import must
from tisim.geometry.container import Axes, Container
from tisim.geometry.shape import SEAM
from tisim.geometry.tessellation import sphere_surface, surface_of_revolution
from tisim.numerics.vectors import normal_to


def away_from(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance (m) of points from the origin, shape (n,), and the unit vectors to them; x at the
    origin."""
    distance = np.linalg.norm(places, axis=1)
    outward = places / np.where(distance > 0, distance, 1.0)[:, None]
    outward[distance == 0] = np.eye(places.shape[1])[0]
    return distance, outward


class CylindricalContainer(Container):
    """A cylinder along z with periodic ends, in the middle of the box.

    Its diameter D_cyl keeps its ratio to D, and only its length decreases in a contraction.

    Source: B16 section 2.2.4, Fig. 2.3.
    """

    curved: ClassVar[bool] = True

    diameter: float = parameter("D", "diameter D_cyl", examples=[3.0], ge=1)

    def walled(self) -> Axes:
        return True, True, False

    def scaled(self) -> Axes:
        return True, True, False

    def walls(self) -> int:
        return 1

    def volume_in(self, side: np.ndarray, unit: float) -> float:
        return float(np.pi / 4 * (self.diameter * unit) ** 2 * side[2])

    def box_of(self, volume: float, unit: float) -> np.ndarray:
        across = self.diameter * unit
        return np.array([across, across, volume / (np.pi / 4 * across**2)])

    def distances(self, places: np.ndarray, side: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
        rho, outward = away_from(places[:, :2] - side[:2] / 2)
        normal = np.column_stack([outward, np.zeros(len(places))])
        return (self.diameter * unit / 2 - rho)[:, None], normal[:, None]

    def points(self, numbers: np.ndarray, side: np.ndarray, unit: float, margin: float) -> np.ndarray:
        rho, angle = (self.diameter * unit / 2 - margin) * np.sqrt(numbers[:, 0]), 2 * np.pi * numbers[:, 1]
        x, y = rho * np.cos(angle), rho * np.sin(angle)
        return np.column_stack([side[0] / 2 + x, side[1] / 2 + y, side[2] * numbers[:, 2]])

    def triangles(self, side: np.ndarray, unit: float) -> np.ndarray:
        radius = self.diameter * unit / 2
        profile = np.array([[radius, 0.0], [radius, side[2]]])
        return surface_of_revolution(profile, np.array([*side[:2] / 2, 0.0]), np.array([0.0, 0.0, 1.0]))

    @ti.func
    def volume(self, w, side, unit):
        across = self.diameter(w) * unit
        return 0.25 * ti.math.pi * across * across * side[2]

    @ti.func
    def wall(self, w, k, place, side, unit):
        away = place - 0.5 * side
        away[2] = 0.0 * away[2]
        rho = away.norm()
        x = ti.Vector([0.0 * rho + 1.0, 0.0 * rho, 0.0 * rho])
        outward = ti.select(rho > 0.0, away / ti.select(rho > 0.0, rho, 1.0), x)
        return 0.5 * self.diameter(w) * unit - rho, outward

    @ti.func
    def along(self, w, k, outward):
        return ti.Vector([0.0 * outward[0], 0.0 * outward[0], 0.0 * outward[0] + 1.0])


class SphericalContainer(Container):
    """A sphere that touches the faces of the box, which is a cube."""

    curved: ClassVar[bool] = True

    def walled(self) -> Axes:
        return True, True, True

    def walls(self) -> int:
        return 1

    def volume_in(self, side: np.ndarray, unit: float) -> float:
        return float(np.pi / 6 * side[0] ** 3)

    def box_of(self, volume: float, unit: float) -> np.ndarray:
        return np.full(3, np.cbrt(6 / np.pi * volume))

    def check_box(self, side: np.ndarray) -> None:
        cube = bool(np.ptp(side) <= SEAM * side.max())
        must(cube, "domain", f"a cube around a {self.kind()}", side.tolist())

    def distances(self, places: np.ndarray, side: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
        distance, outward = away_from(places - side / 2)
        return (side[0] / 2 - distance)[:, None], outward[:, None]

    def points(self, numbers: np.ndarray, side: np.ndarray, unit: float, margin: float) -> np.ndarray:
        r, z = (side[0] / 2 - margin) * np.cbrt(numbers[:, 0]), 2 * numbers[:, 1] - 1
        across, angle = np.sqrt(1 - z * z), 2 * np.pi * numbers[:, 2]
        direction = np.column_stack([across * np.cos(angle), across * np.sin(angle), z])
        return side / 2 + r[:, None] * direction

    def triangles(self, side: np.ndarray, unit: float) -> np.ndarray:
        return sphere_surface(side / 2, float(side[0]) / 2)

    @ti.func
    def volume(self, w, side, unit):
        return ti.math.pi / 6.0 * side[0] * side[0] * side[0]

    @ti.func
    def wall(self, w, k, place, side, unit):
        away = place - 0.5 * side
        distance = away.norm()
        x = ti.Vector([0.0 * distance + 1.0, 0.0 * distance, 0.0 * distance])
        outward = ti.select(distance > 0.0, away / ti.select(distance > 0.0, distance, 1.0), x)
        return 0.5 * side[0] - distance, outward

    @ti.func
    def along(self, w, k, outward):
        return normal_to(outward)
