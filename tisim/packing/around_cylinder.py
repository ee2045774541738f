"""Random initial positions of spheres around a cylinder (B16 Fig. 6.2)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import field_validator
from scipy.spatial import cKDTree

from tisim.components.component import Vector, option, parameter
from tisim.components.ranges import check_direction, check_resolved
from tisim.domains.domain import Domain
from tisim.errors import InputError, must
from tisim.geometry.directions import along_axis
from tisim.packing.placement import Placement

MAX_ROUNDS = 200
"""The region counts as full after this number of rounds; each round has as many insertion trials as there are
spheres."""


class RandomAroundCylinder(Placement):
    """Spheres at random positions completely inside a layer around a cylinder, or a part of the layer.

    The layer is the difference between the cylinder and one that is larger by ``thickness`` on all sides. The
    part "side" is beside the lateral surface; "top" is beyond both ends, from the axis to the outer radius;
    "all" is both. The paper draws its regions SIDE and TOP and gives their widths only in a figure; here the
    caller sets the width, and the two parts together fill the layer.

    Source: B16 section 6.3.
    """

    centre: Vector = parameter("m", "centre of the cylinder", (0.0, 0.0, 0.0))
    axis: Vector = parameter("", "direction of the axis, of any length but 0", (0.0, 0.0, 1.0))
    radius: float = parameter("m", "radius of the cylinder", examples=[0.01], gt=0)
    length: float = parameter("m", "length of the cylinder", examples=[0.04], gt=0)
    thickness: float = parameter("m", "thickness of the layer", examples=[0.01], gt=0)
    part: Literal["all", "top", "side"] = option("part of the layer that is filled", "all")

    @field_validator("axis", mode="after")
    @classmethod
    def _direction(cls, axis: Vector) -> Vector:
        check_direction("random_around_cylinder.axis", axis)
        return axis

    def volume(self) -> float:
        """Return the volume of the part, m^3."""
        outer = np.pi * (self.radius + self.thickness) ** 2
        side = (outer - np.pi * self.radius**2) * self.length
        return float((self.part != "top") * side + (self.part != "side") * 2 * outer * self.thickness)

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        number, radius = len(radii), float(radii.max())
        must(bool((radii == radius).all()), "spheres around a cylinder", "of one radius", float(radii.min()))
        rule = f"above a diameter, {2 * radius:g} m"
        must(self.thickness > 2 * radius, "thickness", rule, self.thickness)
        must(self.part != "side" or self.length > 2 * radius, "length", rule, self.length)
        farthest = np.abs(self.centre) + self.radius + self.length / 2 + self.thickness
        check_resolved("places around the cylinder", farthest, radius)
        most = self.volume() / (4 / 3 * np.pi * radius**3)
        rule = f"at most the number that fits around the cylinder, less than {most:.4g}"
        must(number <= most, "cloud.number", rule, number)
        generator = np.random.default_rng([seed, 0x6C61796572])
        centres = np.empty((0, 3))
        for _ in range(MAX_ROUNDS):
            centres = _without_overlaps(
                np.vstack([centres, self._tries(number, radius, generator)]), 2 * radius
            )[:number]
            if len(centres) == number:
                break
        else:
            raise InputError(
                "cloud.number must be at most the number that fits around the cylinder, "
                f"{len(centres)} here; "
                f"received {number}"
            )
        return along_axis(centres, self.axis) + np.asarray(self.centre)

    def _tries(self, number: int, radius: float, generator: np.random.Generator) -> np.ndarray:
        """Return uniformly distributed points (m) of the part, in a frame with z along the cylinder axis."""
        inner, outer = self.radius + radius, self.radius + self.thickness - radius
        # Half of the region beside the cylinder, including corners that belong to the part; then the region
        # beyond the ends.
        height = self.length / 2 + (-radius if self.part == "side" else radius)
        depth = self.thickness - 2 * radius
        side = (self.part != "top") * (outer**2 - inner**2) * height
        top = (self.part != "side") * outer**2 * depth
        beside = generator.random(number) * (side + top) < side
        rho = np.sqrt(generator.uniform(np.where(beside, inner**2, 0.0), outer**2))
        part = generator.random(number)
        z = np.where(beside, part * height, self.length / 2 + radius + part * depth)
        angle = generator.uniform(0.0, 2 * np.pi, number)
        up = generator.choice([-1.0, 1.0], number)
        return np.stack([rho * np.cos(angle), rho * np.sin(angle), up * z], axis=1)


def _without_overlaps(points: np.ndarray, distance: float) -> np.ndarray:
    """Return the points (m) without those nearer than a distance (m) to an earlier point."""
    free = np.ones(len(points), bool)
    for i, j in sorted(cKDTree(points).query_pairs(distance)):
        free[j] &= not free[i]
    return points[free]
