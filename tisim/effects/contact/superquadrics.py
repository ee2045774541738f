"""Particles that are superquadrics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import field_validator

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import Shaped
from tisim.numerics.vectors import conjugate, rotated, turn_between
from tisim.shapes.particle_shape import ParticleShape, converted
from tisim.shapes.superquadric import SuperquadricShape
from tisim.shapes.superquadric_pairs import closest_superquadrics
from tisim.shapes.superquadric_points import ELLIPSOIDS, ROD, SUPERQUADRICS, WITH_RODS, farthest_point


class Superquadrics(Shaped):
    """Particles are superquadrics: ellipsoids for exponents of 2, which approach boxes for large ones."""

    contract: ClassVar[bool] = True

    superquadrics: tuple[SuperquadricShape, ...] = option(
        "the shapes of the superquadrics",
        examples=[(SuperquadricShape(semi_axes=(1e-3, 1e-3, 2e-3), exponents=(4.0, 4.0, 4.0)),)],
        min_length=1,
    )

    @field_validator("superquadrics", mode="before")
    @classmethod
    def _as_superquadrics(cls, shapes: Any) -> Any:
        names = "superquadric_shape, ellipsoid_shape or sphere_shape"
        return converted(SuperquadricShape, names, f"{cls.kind()}.superquadrics", shapes)

    def shapes(self) -> Sequence[ParticleShape]:
        return self.superquadrics

    @property
    def ellipsoids(self) -> bool:
        """Return whether all exponents are 2, for which kernels are simpler."""
        return all(set(one.exponents) == {2.0} for one in self.superquadrics)

    @property
    def family(self) -> int:
        """Return the family of the bodies for the narrow phase (tisim/shapes/superquadric_points.py)."""
        return ELLIPSOIDS if self.ellipsoids else SUPERQUADRICS

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure(), self.family)

    @ti.func
    def superquadric_index(self, s, w, i):
        """Return the index of the shape of a body among the superquadrics."""
        return s.shape[w, i]

    @ti.func
    def semi_axes(self, s, w, i):
        """Return the semi-axes (m) of a superquadric."""
        return self.size(s, w, i) * self.superquadrics.semi_axes(w, self.superquadric_index(s, w, i))

    @ti.func
    def exponents(self, s, w, i):
        """Return the exponents of a superquadric."""
        return self.superquadrics.exponents(w, self.superquadric_index(s, w, i))

    @ti.func
    def between(self, s, w, i, j, q_i, q_j, separation, far):
        # The narrow phase is in f64 and returns its results in the precision of the separation.
        gap, normal, here, there = closest_superquadrics(
            self.family,
            ti.cast(separation, ti.f64),
            q_i,
            self.semi_axes(s, w, i),
            self.exponents(s, w, i),
            q_j,
            self.semi_axes(s, w, j),
            self.exponents(s, w, j),
            far,
        )
        return ti.cast(gap, s.real), ti.cast(normal, s.real), ti.cast(here, s.real), ti.cast(there, s.real)

    @ti.func
    def farthest(self, s, w, i, q, direction):
        """Return the point (m) of a superquadric that is farthest along a unit vector, relative to its
        centre, for the orientation q."""
        inside = ti.cast(rotated(conjugate(q), direction), ti.f64)
        a, g = self.semi_axes(s, w, i), self.exponents(s, w, i)
        return rotated(q, ti.cast(farthest_point(self.family, inside, a, g), s.real))

    @ti.func
    def beside_rod(self, s, w, i, q, separation, axis, half, radius):
        zero = 0.0 * separation[0]
        z = ti.Vector([zero, zero, zero + 1.0])
        turn = turn_between(z, ti.select(axis.norm_sqr() > 0.0, axis, z))
        gap, normal, here, _there = closest_superquadrics(
            WITH_RODS,
            ti.cast(separation, ti.f64),
            q,
            self.semi_axes(s, w, i),
            self.exponents(s, w, i),
            turn,
            ti.Vector([radius, radius, half + radius]),
            ti.Vector([zero + 2.0, zero + 2.0, zero + ROD]),
            ti.math.inf,
        )
        return ti.cast(gap, s.real), ti.cast(normal, s.real), ti.cast(here, s.real)
