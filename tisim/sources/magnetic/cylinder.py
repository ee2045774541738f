"""The magnetic field of any number of uniformly magnetised cylinders at any place (B16 chapter 5)."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import model_validator

from tisim.effects.base import Effect, option
from tisim.errors import InputError, must
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_table import TabulatedEnds, table
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers


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
