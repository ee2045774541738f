"""Particles that are rods or superquadrics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.rods import Rods
from tisim.effects.contact.superquadrics import Superquadrics
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.superquadric_points import ROD, WITH_RODS


class Mixture(Rods, Superquadrics):
    """Particles are rods, spheres or superquadrics in one scene.

    The field ``shape`` counts the rods first and then the superquadrics. Two rods touch as in ``Rods``, and
    any other pair by the common normal of its surfaces, as in ``Superquadrics``.
    """

    contract: ClassVar[bool] = True

    def shapes(self) -> Sequence[ParticleShape]:
        return *self.rods, *self.superquadrics

    @property
    def rod_shapes(self) -> int:
        """Return the number of shapes that are rods."""
        return len(self.rods)

    @property
    def spheres(self) -> bool:
        # Its superquadrics turn, even if all its rods are spheres.
        return False

    @property
    def family(self) -> int:
        return WITH_RODS

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure(), self.rod_shapes)

    @ti.func
    def is_rod(self, s, w, i):
        """Return whether a body is a rod."""
        return s.shape[w, i] < self.rod_shapes

    @ti.func
    def rod_index(self, s, w, i):
        return ti.min(s.shape[w, i], self.rod_shapes - 1)

    @ti.func
    def superquadric_index(self, s, w, i):
        return ti.max(s.shape[w, i] - self.rod_shapes, 0)

    @ti.func
    def semi_axes(self, s, w, i):
        """Return the semi-axes (m) of a superquadric, or the numbers by which kernels know a rod."""
        axes = Superquadrics.semi_axes(self, s, w, i)
        if self.is_rod(s, w, i):
            radius = self.rod_radius(s, w, i)
            axes = ti.Vector([radius, radius, self.half(s, w, i) + radius])
        return axes

    @ti.func
    def exponents(self, s, w, i):
        powers = Superquadrics.exponents(self, s, w, i)
        if self.is_rod(s, w, i):
            powers = ti.Vector([2.0 + 0.0 * powers[0], 2.0 + 0.0 * powers[0], ROD + 0.0 * powers[0]])
        return powers

    @ti.func
    def between(self, s, w, i, j, q_i, q_j, separation, far):
        gap, normal = 0.0 * separation[0], 0.0 * separation
        here, there = 0.0 * separation, 0.0 * separation
        if self.is_rod(s, w, i) and self.is_rod(s, w, j):
            gap, normal, here, there = Rods.between(self, s, w, i, j, q_i, q_j, separation, far)
        else:
            gap, normal, here, there = Superquadrics.between(self, s, w, i, j, q_i, q_j, separation, far)
        return gap, normal, here, there

    @ti.func
    def beside_rod(self, s, w, i, q, separation, axis, half, radius):
        gap, normal, here = 0.0 * separation[0], 0.0 * separation, 0.0 * separation
        if self.is_rod(s, w, i):
            gap, normal, here = Rods.beside_rod(self, s, w, i, q, separation, axis, half, radius)
        else:
            gap, normal, here = Superquadrics.beside_rod(self, s, w, i, q, separation, axis, half, radius)
        return gap, normal, here
