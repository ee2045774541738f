"""Particles that are rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import field_validator

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import Shaped
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape, converted
from tisim.shapes.rod_pairs import closest_rods, closest_spheres
from tisim.shapes.spherocylinder import SpherocylinderShape


class Rods(Shaped):
    """Particles are spherocylinders, or spheres, which are spherocylinders of length 0."""

    contract: ClassVar[bool] = True

    rods: tuple[SpherocylinderShape, ...] = option(
        "the shapes of the rods", examples=[(SpherocylinderShape(length=4e-3, diameter=1e-3),)], min_length=1
    )

    @field_validator("rods", mode="before")
    @classmethod
    def _as_rods(cls, shapes: Any) -> Any:
        return converted(
            SpherocylinderShape, "spherocylinder_shape or sphere_shape", f"{cls.kind()}.rods", shapes
        )

    def shapes(self) -> Sequence[ParticleShape]:
        return self.rods

    @property
    def spheres(self) -> bool:
        """Return whether all rods are spheres, whose pairs take a fraction of the time of rods."""
        return all(one.length == 0.0 for one in self.rods)

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure(), self.spheres)

    @ti.func
    def axis(self, q):
        """Return the unit vector along a rod of orientation q."""
        return rotated(q, ti.Vector([0.0 * q[0], 0.0 * q[0], 1.0 + 0.0 * q[0]]))

    @ti.func
    def rod_index(self, s, w, i):
        """Return the index of the shape of a body among the rods."""
        return s.shape[w, i]

    @ti.func
    def half(self, s, w, i):
        """Return half the length (m) of the segment of a rod."""
        return 0.5 * self.size(s, w, i) * self.rods.length(w, self.rod_index(s, w, i))

    @ti.func
    def rod_radius(self, s, w, i):
        """Return the radius (m) of a rod."""
        return 0.5 * self.size(s, w, i) * self.rods.diameter(w, self.rod_index(s, w, i))

    @ti.func
    def between(self, s, w, i, j, q_i, q_j, separation, far):
        radius_i, radius_j = self.rod_radius(s, w, i), self.rod_radius(s, w, j)
        gap, normal, here, there = closest_spheres(separation, radius_i, radius_j, self.axis(q_i))
        if ti.static(not self.spheres):
            gap, normal, here, there = closest_rods(
                separation,
                self.axis(q_i),
                self.half(s, w, i),
                radius_i,
                self.axis(q_j),
                self.half(s, w, j),
                radius_j,
            )
        return gap, normal, here, there

    @ti.func
    def beside_rod(self, s, w, i, q, separation, axis, half, radius):
        own = self.axis(q), self.half(s, w, i), self.rod_radius(s, w, i)
        gap, normal, here, _there = closest_rods(separation, own[0], own[1], own[2], axis, half, radius)
        return gap, normal, here
