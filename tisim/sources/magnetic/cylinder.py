"""The magnetic field of any number of uniformly magnetised cylinders at any place (B16 chapter 5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option
from tisim.errors import must
from tisim.sources.base import add_point
from tisim.sources.magnetic.cell_sum import CellSum, cell_row
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_table import TabulatedEnds, table
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers

MANY = 10
"""Number of cylinders from which a sum by cells is tried as an approximation."""


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
    finite.

    Two settings exchange accuracy for time; both errors are measured when a scene is compiled. With
    ``table_digits``, field and gradient of each cylinder are read from a table; cylinders must then be at
    least as long as their radius. With ``sum_digits``, only the cylinders near a place are added one by one,
    and the others are summed in advance, as a harmonic polynomial in each cell of an octree. The octree is
    twice as wide as the box about all cylinders; outside of it all cylinders are added one by one. The
    largest error of the field, and of its gradient, is then below 10^-digits of its mean magnitude at random
    places between the cylinders. Each world of a batch has its own octree.

    Source: B16 Eqs (5.1), (5.3), (5.21).
    """

    cylinders: tuple[Cylinder, ...] = option("the cylinders; worlds of a batch may have different numbers")
    table_digits: int | None = option(
        "digits of accuracy of field and gradient from a table; closed forms unless given",
        None,
        ge=2,
        le=6,
    )
    sum_digits: int | None = option(
        "digits of accuracy of the sum over the cylinders by cells; each cylinder is added unless given",
        None,
        ge=2,
        le=5,
    )

    @model_validator(mode="after")
    def _fit_for_a_table(self) -> Self:
        for k, one in enumerate(self.cylinders if self.table_digits else ()):
            rule = f"at least the radius, {one.radius:g} m, with table_digits"
            must(one.length >= one.radius, f"magnetic_cylinders.cylinders.{k}.length", rule, one.length)
        return self

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        if self.table_digits is not None or self.sum_digits is not None:
            return ()
        short = any(one.length < one.radius for one in self.cylinders)
        by_table = () if short else (3, 4, 5)
        by_cells = (3, 4, 5) if len(self.cylinders) >= MANY else ()
        ways = [(table, None) for table in by_table]
        for digits in by_cells:
            ways += [(table, digits) for table in (digits, None) if table is None or by_table]
        ways.sort(key=lambda way: way[1] or way[0] or 0)
        return tuple(self.with_digits(*way) for way in ways)

    def with_digits(self, table: int | None, cells: int | None) -> Self:
        """Return a copy with other settings of accuracy."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**given, "table_digits": table, "sum_digits": cells})

    def lookups(self) -> dict[str, np.ndarray]:
        return {} if self.table_digits is None else {"table": table(self.table_digits)[0]}

    def derived_rows(self) -> Mapping[str, Sequence[float] | np.ndarray]:
        own = {} if self.sum_digits is None else {"cells": cell_row(self.cylinders, self.sum_digits)}
        return {**super().derived_rows(), **own}

    def connect(self, peers: Peers) -> dict[str, Any]:
        bound, digits, cells = peers.bound(self), self.table_digits, self.sum_digits
        bound.cylinders.ends = ClosedEnds() if digits is None else TabulatedEnds(bound.table, digits)
        capacity = Cylinder.list_capacity(len(self.cylinders))
        in_cells = None if cells is None else CellSum(bound.cells, capacity, cells)
        return {**super().connect(peers), "in_cells": in_cells, "has_cells": cells is not None}

    @ti.func
    def value(self, w, r, t):
        b = 0.0 * r
        if ti.static(not self.has_cells):
            b = self.direct_value(w, r, t)
        else:
            b = self.by_cells(w, r, t, False)[0]
        return b

    @ti.func
    def value_and_gradient(self, w, r, t):
        b, gradient = 0.0 * r, 0.0 * r.outer_product(r)
        if ti.static(not self.has_cells):
            b, gradient = self.direct(w, r, t)
        else:
            b, gradient = self.by_cells(w, r, t, True)
        return b, gradient

    @ti.func
    def by_cells(self, w, r, t, slopes: ti.template()):  # type: ignore[valid-type]
        """Return the field at r from the cell around it, and the gradient, 0 unless ``slopes``."""
        b, gradient = 0.0 * r, 0.0 * r.outer_product(r)
        leaf, x, half = self.in_cells.leaf(w, r)
        first, end, listed = 0, self.magnetised(w, t), False
        if leaf >= 0 and end > 0:
            begin, last = self.in_cells.near(w, leaf)
            if last >= begin:
                first, end, listed = begin, last, True
                b, gradient = self.in_cells.distant(w, leaf, x, half, slopes)
        for e in range(first, end):
            k = e
            if listed:
                k = self.in_cells.index(w, e)
            if ti.static(slopes):
                one, slope = self.each.flux(w, k, r)
                b += one
                gradient += slope
            else:
                b += self.each.flux_density(w, k, r)
        return b, gradient

    @ti.func
    def add_tile(self, w, r: ti.template(), t, value: ti.template(), gradient: ti.template()):  # type: ignore
        if ti.static(not self.has_cells):
            self.add_direct(w, r, t, value, gradient)
        else:
            for lane in range(ti.static(r[0].n)):
                one, slope = self.value_and_gradient(w, ti.Vector([r[0][lane], r[1][lane], r[2][lane]]), t)
                add_point(value, gradient, lane, one, slope)
