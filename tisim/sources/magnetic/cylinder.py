"""The magnetic field of any number of uniformly magnetised cylinders at any place (B16 chapter 5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Self

import numpy as np
from pydantic import field_validator, model_validator
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.components.ranges import check_direction
from tisim.effects.base import Effect, option, parameter
from tisim.errors import InputError, must
from tisim.geometry.cylinder import cylinder_distance
from tisim.sources.magnetic import cylinder_field
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_frame import place, split_direction, split_magnetisation
from tisim.sources.magnetic.cylinder_table import TabulatedEnds, table
from tisim.sources.magnetic.magnets import Body, Magnets
from tisim.state.bound import Peers


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
        """Return the position of r (m) relative to cylinder k: distance from the axis, unit vector away from
        the axis, coordinate along the axis from the centre, and distance beyond the nearer end, negative
        before it."""
        rho, outward, foot, z = place(r, self.centre(w, k), self.lead(w, k), self.rest(w, k))
        side = ti.select(foot + z < 0.0, -1.0, 1.0)
        return rho, outward, foot + z, (side * foot - 0.5 * self.length(w, k)) + side * z

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


class MagneticCylinders(Magnets):
    """Uniformly magnetised cylinders make a magnetic field, the sum over all of them; they do not magnetise
    each other.

        B = mu_0 (H + M) inside,    mu_0 H outside

    Field and gradient are closed forms in complete elliptic integrals, with series near the axis and far
    away.

    In f64, for lengths of 1/10 to 2000 radii and any direction, their errors are below 1e-12, plus 1e-15 R/d
    at a distance d from the rim, because positions are known only up to rounding. The error of B is relative
    to |B|. The error of the gradient is relative to |grad B| + |B|/l, because the gradient passes through 0
    in the middle; l is the distance to the rim, with R added to its component across the axis. These errors
    hold for the numbers as given. Rounding of the given axis and magnetisation of a long cylinder that is
    magnetised along its axis adds a magnetisation across it; this changes the field beside the cylinder by
    the order of 1e-16 (length/R)^2, relative.

    The field jumps at the surface, and grows as a logarithm at the rims; the values returned there are
    finite. With ``table_digits``, field and gradient are read from a table, which is made and whose error is
    measured when a scene is compiled; cylinders must then be at least as long as their radius.

    Source: B16 Eqs (5.1), (5.3), (5.21).
    """

    cylinders: tuple[Cylinder, ...] = option("the cylinders; worlds of a batch may have different numbers")
    table_digits: int | None = option(
        "digits of accuracy of field and gradient from a table; closed forms unless given",
        None,
        ge=2,
        le=6,
    )

    @model_validator(mode="after")
    def _fit_for_a_table(self) -> Self:
        for k, one in enumerate(self.cylinders if self.table_digits else ()):
            rule = f"at least the radius, {one.radius:g} m, with table_digits"
            must(one.length >= one.radius, f"magnetic_cylinders.cylinders.{k}.length", rule, one.length)
        return self

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        if self.table_digits is not None:
            return ()
        try:
            return tuple(self.with_table(digits) for digits in (3, 4, 5))
        except InputError:
            return ()

    def with_table(self, digits: int) -> Self:
        """Return a copy that reads its field from a table; InputError if a cylinder is too short."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**given, "table_digits": digits})

    def lookups(self) -> dict[str, np.ndarray]:
        return {} if self.table_digits is None else {"cells": table(self.table_digits)[0]}

    def connect(self, peers: Peers) -> dict[str, Any]:
        bound, digits = peers.bound(self), self.table_digits
        bound.cylinders.ends = ClosedEnds() if digits is None else TabulatedEnds(bound.cells, digits)
        return super().connect(peers)
