"""A uniformly magnetised cylinder."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import field_validator
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.components.ranges import check_direction
from tisim.effects.base import parameter
from tisim.geometry.cylinder import cylinder_distance
from tisim.sources.magnetic import cylinder_field
from tisim.sources.magnetic.cylinder_frame import relative_place, split_direction, split_magnetisation
from tisim.sources.magnetic.magnets import Body


class Cylinder(Body):
    """A cylinder, magnetised uniformly in any direction, or not at all."""

    axis: Vector = parameter("", "direction of the axis, of any nonzero length", (0.0, 0.0, 1.0))
    radius: float = parameter("m", "radius R", examples=[3e-4], gt=0)
    length: float = parameter("m", "length from end to end", examples=[1e-2], gt=0)

    @field_validator("axis", mode="after")
    @classmethod
    def _direction(cls, axis: Vector) -> Vector:
        check_direction("cylinder.axis", axis)
        return axis

    @property
    def direction(self) -> Vector:
        """Return the unit vector along the axis."""
        (a, b, c), (u, v, w) = split_direction(self.axis)
        return a + u, b + v, c + w

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        """Yield the columns of the given parameters, and those that kernels read instead of axis and
        magnetisation."""
        yield from super().columns()
        yield from (("lead", 3), ("rest", 3), ("across", 3), ("along", 1))

    def values(self) -> list[float]:
        lead, rest = split_direction(self.axis)
        across, along = split_magnetisation(self.axis, self.magnetisation)
        return [*super().values(), *lead, *rest, *across, along]

    @ti.func
    def place(self, w, k, r):
        """Return the position of r (m) relative to cylinder k (``relative_place``)."""
        half = 0.5 * self.length(w, k)
        return relative_place(r, self.centre(w, k), self.lead(w, k), self.rest(w, k), half)

    @ti.func
    def nearest(self, w, k, r):
        rho, outward, z, end = self.place(w, k, r)
        upward = ti.select(z < 0.0, -1.0, 1.0) * self.unit(w, k)
        return cylinder_distance(rho, outward, end, upward, self.radius(w, k))

    @ti.func
    def unit(self, w, k):
        """Return the unit vector along the axis."""
        return self.lead(w, k) + self.rest(w, k)

    @ti.func
    def shape(self, w, k, rho, z, end):
        """Return the six functions of ``cylinder_field``."""
        return cylinder_field.shape(rho, z, end, self.radius(w, k), 0.5 * self.length(w, k), self.ends)

    @ti.func
    def flux_density(self, w, k, r):
        rho, outward, z, end = self.place(w, k, r)
        return self.density(w, k, self.shape(w, k, rho, z, end), rho, outward, end)

    @ti.func
    def flux(self, w, k, r):
        rho, outward, z, end = self.place(w, k, r)
        return self.flux_of(w, k, self.shape(w, k, rho, z, end), rho, outward, end)

    @ti.func
    def flux_mostly(self, w, k, r):
        rho, outward, z, end = self.place(w, k, r)
        half = 0.5 * self.length(w, k)
        six, right = cylinder_field.mostly(rho, z, end, self.radius(w, k), half, self.ends)
        b, slope = self.flux_of(w, k, six, rho, outward, end)
        return b, slope, right

    @ti.func
    def flux_of(self, w, k, six, rho, outward, end):
        """Return B (T) and its gradient (T/m), computed from the six functions."""
        slope = cylinder_field.gradient(
            six, rho, outward, self.unit(w, k), self.across(w, k), self.along(w, k)
        )
        return self.density(w, k, six, rho, outward, end), mu_0 * slope

    @ti.func
    def density(self, w, k, six, rho, outward, end):
        """Return the flux density B = mu_0 (H + M) (T), M inside only."""
        across, along = cylinder_field.field(six, rho, outward, self.across(w, k), self.along(w, k))
        b = across + along * self.unit(w, k)
        b += ti.select(rho < self.radius(w, k) and end < 0.0, self.magnetisation(w, k), 0.0)
        return mu_0 * b
