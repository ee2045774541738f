"""Hard superquadrics and hard ellipsoids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import HardBodies
from tisim.numerics.vectors import orientation_of
from tisim.shapes.ellipsoid import EllipsoidShape
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.superquadric import SuperquadricShape
from tisim.shapes.superquadric_pairs import closest_superquadrics, farthest_point


class SuperquadricBodies(HardBodies):
    """Hard bodies whose common normal is found by Newton's method.

    The gap of bodies that do not overlap may be a lower bound, not below 0: the iteration ends once it has
    proved that two bodies are apart.

    Source: B16 section 4.4; ``tisim/shapes/superquadric_pairs.py`` says how this method differs.
    """

    contract: ClassVar[bool] = True
    exponents_are_2: ClassVar[bool]
    """Whether all exponents are 2, which needs fewer operations."""

    @ti.func
    def semi_axes(self, w, k):
        """Return the semi-axes (m) of shape k."""
        return ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def exponents(self, w, k):
        """Return the exponents of shape k."""
        return ti.Vector([2.0, 2.0, 2.0])

    @ti.func
    def closest(self, s, w, i, j, separation):
        return self.closest_within(s, w, i, j, separation, 0.0)

    @ti.func
    def closest_within(self, s, w, i, j, separation, far):
        """Return ``closest``, for bodies that are more than ``far`` (m) apart with a lower bound of the gap
        not below ``far``."""
        here, there = s.shape[w, i], s.shape[w, j]
        return closest_superquadrics(
            ti.static(self.exponents_are_2),
            separation,
            self.turn(s, w, i),
            self.size(s, w, i) * self.semi_axes(w, here),
            self.exponents(w, here),
            self.turn(s, w, j),
            self.size(s, w, j) * self.semi_axes(w, there),
            self.exponents(w, there),
            far,
        )

    @ti.func
    def apart(self, s, w, i, j, separation, gap):
        found, _normal, _here, _there = self.closest_within(s, w, i, j, separation, gap)
        return found > gap

    @ti.func
    def support(self, s, w, i, k, direction):
        shape = s.shape[w, i]
        return farthest_point(
            ti.static(self.exponents_are_2),
            direction,
            self.turn(s, w, i),
            self.size(s, w, i) * self.semi_axes(w, shape),
            self.exponents(w, shape),
        )

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        shape = s.shape[w, i]
        semi_axes = self.size(s, w, i) * self.semi_axes(w, shape)
        return closest_superquadrics(
            ti.static(self.exponents_are_2),
            point + semi_axes[0] * outward,
            self.turn(s, w, i),
            semi_axes,
            self.exponents(w, shape),
            orientation_of(outward, along),
            semi_axes,
            self.exponents(w, shape),
            0.0,
        )


class HardSuperquadrics(SuperquadricBodies):
    """Hard superquadrics, from spheres and ellipsoids (exponents 2) to boxes with rounded edges.

    ``HardEllipsoids`` gives the same for exponents of 2 alone, and is faster.

    Source: B16 chapter 4.
    """

    superquadrics: tuple[SuperquadricShape, ...] = option(
        "the shapes of the bodies",
        examples=[(SuperquadricShape(semi_axes=(1e-3, 1e-3, 1e-3), exponents=(3.0, 3.0, 3.0)),)],
        min_length=1,
    )
    exponents_are_2: ClassVar = False

    def shapes(self) -> Sequence[ParticleShape]:
        return self.superquadrics

    @ti.func
    def semi_axes(self, w, k):
        return self.superquadrics.semi_axes(w, k)

    @ti.func
    def exponents(self, w, k):
        return self.superquadrics.exponents(w, k)


class HardEllipsoids(SuperquadricBodies):
    """Hard ellipsoids.

    Source: B16 section 4.4, for exponents of 2.
    """

    ellipsoids: tuple[EllipsoidShape, ...] = option(
        "the shapes of the ellipsoids",
        examples=[(EllipsoidShape(semi_axes=(1e-3, 1e-3, 1.5e-3)),)],
        min_length=1,
    )
    exponents_are_2: ClassVar = True

    def shapes(self) -> Sequence[ParticleShape]:
        return self.ellipsoids

    @ti.func
    def semi_axes(self, w, k):
        return self.ellipsoids.semi_axes(w, k)
