"""The magnetic field of uniformly magnetised cylinders, any number of them, anywhere (B16 chapter 5)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import field_validator

from tisim._taichi import ti
from tisim.effect import Source, parameter
from tisim.errors import must
from tisim.sources import cylinder_field
from tisim.spec import Spec, Vector

MU_0 = 1.25663706127e-6
"""Magnetic constant, N/A^2 (CODATA 2022)."""


class Cylinder(Spec):
    """A cylinder: a solid body, and a magnet when it is magnetised, uniformly and in any direction.

    centre, axis : of any length but 0; made a unit vector. length : from end to end. magnetisation : M.
    """

    centre: Vector = parameter("m", (0.0, 0.0, 0.0))
    axis: Vector = parameter("", (0.0, 0.0, 1.0))
    radius: float = parameter("m", gt=0)
    length: float = parameter("m", gt=0)
    magnetisation: Vector = parameter("A/m", (0.0, 0.0, 0.0))

    @field_validator("axis", mode="after")
    @classmethod
    def _unit(cls, axis: Vector) -> Vector:
        size = float(np.linalg.norm(axis))
        must(0 < size < np.inf, "cylinder.axis", "a direction", axis)
        # One that is of unit length to rounding stays as it is: files give back the same bits.
        return axis if abs(size - 1) < 1e-15 else tuple(float(x / size) for x in axis)  # type: ignore[return-value]

    @ti.func
    def place(self, w, k, r):
        """Where r lies: distance from the axis of cylinder k, unit vector from it, and place along it."""
        d = r - self.centre(w, k)
        axis = self.axis(w, k)
        z = d.dot(axis)
        across = d - z * axis
        rho = across.norm()
        return rho, across / ti.select(rho > 0.0, rho, 1.0), z

    @ti.func
    def shape(self, w, k, rho, z):
        """The six functions of ``cylinder_field``."""
        return cylinder_field.shape(rho, z, self.radius(w, k), 0.5 * self.length(w, k))

    @ti.func
    def across_and_along(self, w, k):
        """The magnetisation across the axis, and its component along it."""
        m, axis = self.magnetisation(w, k), self.axis(w, k)
        along = m.dot(axis)
        return m - along * axis, along

    @ti.func
    def flux_density(self, w, k, six, rho, outward, z):
        """B = mu_0 (H + M), M inside only."""
        m_across, m_along = self.across_and_along(w, k)
        across, along = cylinder_field.field(six, rho, outward, m_across, m_along)
        b = across + along * self.axis(w, k)
        if rho < self.radius(w, k) and ti.abs(z) < 0.5 * self.length(w, k):
            b += self.magnetisation(w, k)
        return MU_0 * b

    @ti.func
    def flux_gradient(self, w, k, six, rho, outward):
        """dB_i/dr_k, away from the surface."""
        m_across, m_along = self.across_and_along(w, k)
        return MU_0 * cylinder_field.gradient(six, rho, outward, self.axis(w, k), m_across, m_along)


class MagneticCylinders(Source):
    """B of uniformly magnetised cylinders: the sum over all of them. They do not magnetise each other.

    cylinders : any number of them, which may differ per world.
    Field and gradient are closed forms in complete elliptic integrals, with series about the axis and far
    away; relative errors stay below 1e-12 for lengths of 1/50 to 1000 radii. Where the field has no value -
    on the surface, where it jumps, and at the rims, where it grows as a logarithm - it is finite.
    Source: B16 Eqs (5.1), (5.3), (5.21).
    """

    quantity: ClassVar[str] = "magnetic_flux_density"
    cylinders: tuple[Cylinder, ...]

    @ti.func
    def value(self, w, r, t):
        b = 0.0 * r
        for k in range(self.cylinders.size(w)):
            rho, outward, z = self.cylinders.place(w, k, r)
            six = self.cylinders.shape(w, k, rho, z)
            b += self.cylinders.flux_density(w, k, six, rho, outward, z)
        return b

    @ti.func
    def gradient(self, w, r, t):
        return self.value_and_gradient(w, r, t)[1]

    @ti.func
    def value_and_gradient(self, w, r, t):
        b, gradient = 0.0 * r, 0.0 * r.outer_product(r)
        for k in range(self.cylinders.size(w)):
            rho, outward, z = self.cylinders.place(w, k, r)
            six = self.cylinders.shape(w, k, rho, z)
            b += self.cylinders.flux_density(w, k, six, rho, outward, z)
            gradient += self.cylinders.flux_gradient(w, k, six, rho, outward)
        return b, gradient
