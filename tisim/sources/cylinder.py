"""The magnetic field of uniformly magnetised cylinders, any number of them, anywhere (B16 chapter 5)."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import Field as Option
from pydantic import field_validator, model_validator
from scipy.constants import mu_0

from tisim._taichi import ti
from tisim.effect import Effect, parameter
from tisim.errors import InputError, must
from tisim.ranges import check_direction
from tisim.sources import cylinder_field
from tisim.sources.cylinder_end import ClosedEnds
from tisim.sources.cylinder_table import TabulatedEnds, table
from tisim.sources.magnets import Body, Magnets
from tisim.spec import Vector


class Cylinder(Body):
    """A cylinder, magnetised uniformly and in any direction, or not at all.

    centre; axis : of any length but 0, made a unit vector; radius; length : from end to end;
    magnetisation : M.
    """

    axis: Vector = parameter("", (0.0, 0.0, 1.0))
    radius: float = parameter("m", gt=0)
    length: float = parameter("m", gt=0)

    @field_validator("axis", mode="after")
    @classmethod
    def _unit(cls, axis: Vector) -> Vector:
        check_direction("cylinder.axis", axis)
        size = float(np.linalg.norm(axis))
        # One that is of unit length to rounding stays as it is: files give back the same bits.
        return axis if abs(size - 1) < 1e-15 else (axis[0] / size, axis[1] / size, axis[2] / size)

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
    def magnetised(self, w, k):
        """The magnetisation across the axis, and its component along it."""
        m, axis = self.magnetisation(w, k), self.axis(w, k)
        along = m.dot(axis)
        return m - along * axis, along

    @ti.func
    def nearest(self, w, k, r):
        rho, outward, z = self.place(w, k, r)
        side, end = rho - self.radius(w, k), ti.abs(z) - 0.5 * self.length(w, k)
        upward = ti.select(z < 0.0, -1.0, 1.0) * self.axis(w, k)
        # Inside, the nearer of side and end; on the axis there is no way to the side.
        sideways = side >= end and rho > 0.0
        distance, normal = ti.select(sideways, side, end), ti.select(sideways, outward, upward)
        if side > 0.0 and end > 0.0:
            distance = ti.sqrt(side * side + end * end)
            normal = (side * outward + end * upward) / distance
        return distance, normal

    @ti.func
    def shape(self, w, k, rho, z):
        """The six functions of ``cylinder_field``."""
        return cylinder_field.shape(rho, z, self.radius(w, k), 0.5 * self.length(w, k), self.ends)

    @ti.func
    def flux_density(self, w, k, r):
        rho, outward, z = self.place(w, k, r)
        return self.density(w, k, self.shape(w, k, rho, z), rho, outward, z)

    @ti.func
    def flux(self, w, k, r):
        rho, outward, z = self.place(w, k, r)
        six = self.shape(w, k, rho, z)
        m_across, m_along = self.magnetised(w, k)
        slope = cylinder_field.gradient(six, rho, outward, self.axis(w, k), m_across, m_along)
        return self.density(w, k, six, rho, outward, z), mu_0 * slope

    @ti.func
    def density(self, w, k, six, rho, outward, z):
        """B = mu_0 (H + M), M inside only."""
        m_across, m_along = self.magnetised(w, k)
        across, along = cylinder_field.field(six, rho, outward, m_across, m_along)
        b = across + along * self.axis(w, k)
        if rho < self.radius(w, k) and ti.abs(z) < 0.5 * self.length(w, k):
            b += self.magnetisation(w, k)
        return mu_0 * b


class MagneticCylinders(Magnets):
    """B of uniformly magnetised cylinders: the sum over all of them. They do not magnetise each other.

    cylinders : any number of them, which may differ per world.
    table_digits : with these many digits field and gradient are read from a table, made when a scene is
        compiled, where its error is measured; cylinders must then be at least as long as their radius.
    Without it they are closed forms in complete elliptic integrals, with series about the axis and far away.
    In f64, for lengths of 1/10 to 2000 radii, their errors are below 1e-12, and 1e-15 R/d more at a distance
    d from the rim, as places are known to rounding only: that of B relative to |B|, that of its gradient to
    |grad B| + |B|/l, l the distance to the rim with R added across, as it passes through 0 in the middle.
    Where the field has no value - on the surface, where it jumps, and at the rims, where it grows as a
    logarithm - it is finite.
    Source: B16 Eqs (5.1), (5.3), (5.21).
    """

    cylinders: tuple[Cylinder, ...]
    table_digits: int | None = Option(None, ge=2, le=6)

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
            return tuple(type(self)(cylinders=self.cylinders, table_digits=digits) for digits in (3, 4, 5))
        except InputError:
            return ()

    def lookups(self) -> dict[str, np.ndarray]:
        return {} if self.table_digits is None else {"cells": table(self.table_digits)[0]}

    def connect(self, peers: tuple[Any, ...]) -> dict[str, Any]:
        digits, cells = self.table_digits, self.__dict__.get("cells")
        self.cylinders.__dict__["ends"] = ClosedEnds() if digits is None else TabulatedEnds(cells, digits)
        return super().connect(peers)
