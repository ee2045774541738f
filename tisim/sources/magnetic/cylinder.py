"""The magnetic field of any number of uniformly magnetised cylinders at any place (B16 chapter 5)."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option
from tisim.errors import must
from tisim.sources.base import add_point
from tisim.sources.magnetic.cell_sum import CellSum, Corners, cell_row, row_size
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_table import TabulatedEnds, table
from tisim.sources.magnetic.local_expansions import LEAST_GAP
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers

NEAR_REACH = LEAST_GAP - 3**0.5
"""Distance from any point of a leaf within which all cylinders are near, in half sides."""
NEAR_TOGETHER, FEWEST_TOGETHER = 8, 3
"""Number of near cylinders that a CPU evaluates together, and the smallest number for which it does."""
FEWEST_IN_CELLS = 10
"""Number of cylinders from which a sum by cells is tried as an approximation."""


def near_together() -> int:
    """Return the number of near cylinders that are evaluated together."""
    return NEAR_TOGETHER if runtime.current().device == "cpu" else 1


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
    and the others are summed in advance, as a harmonic polynomial in each cell of an octree. Outside of the
    octree all cylinders are added one by one. It is twice as wide as the box about all cylinders, or the cube
    about ``sum_box``: an octree of the box in which particles are takes less time to build than one that
    also covers periodic images. The largest error of the field, and of its gradient, is below 10^-digits of
    its mean magnitude at random places of the box. Each world of a batch has its own octree.

    Source: B16 Eqs (5.1), (5.3), (5.21).
    """

    in_cells: ClassVar[Any]
    """The octree of a world, in the bound source."""
    has_cells: ClassVar[bool]
    """Whether the sum is by cells, in the bound source."""

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
    sum_box: Corners | None = option(
        "corners of the box in which ``sum_digits`` apply, m; twice the box about all cylinders unless given",
        None,
    )

    @model_validator(mode="after")
    def _fit_for_a_table(self) -> Self:
        for k, one in enumerate(self.cylinders if self.table_digits else ()):
            rule = f"at least the radius, {one.radius:g} m, with table_digits"
            must(one.length >= one.radius, f"magnetic_cylinders.cylinders.{k}.length", rule, one.length)
        return self

    @model_validator(mode="after")
    def _a_box(self) -> Self:
        if self.sum_box is not None:
            low, high = self.sum_box
            rule = "a lower and an upper corner, which is above it in every component"
            ordered = all(a < b for a, b in zip(low, high, strict=True))
            must(ordered, "magnetic_cylinders.sum_box", rule, self.sum_box)
        return self

    def structure(self) -> tuple[Any, ...]:
        # The box changes the numbers of the octree alone, so that worlds of a batch may differ in it.
        alike = self if self.sum_box is None else self.model_copy(update={"sum_box": None})
        return super(MagneticCylinders, alike).structure()

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        short = any(one.length < one.radius for one in self.cylinders)
        by_table = () if short else (3, 4, 5)
        by_cells = (3, 4, 5) if len(self.cylinders) >= FEWEST_IN_CELLS else ()
        ways: list[tuple[int | None, int | None]] = [(digits, None) for digits in by_table]
        for digits in by_cells:
            ways += [(table, digits) for table in (digits, None) if table is None or by_table]
        ways.sort(key=lambda way: way[1] or way[0] or 0)
        # Closed forms and a sum over all, the most accurate, are the last.
        own, ways = (self.table_digits, self.sum_digits), [*ways, (None, None)]
        return tuple(self.with_digits(*way) for way in ways if way != own)

    def with_digits(self, table: int | None, cells: int | None) -> Self:
        """Return a copy with other settings of accuracy."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**given, "table_digits": table, "sum_digits": cells})

    def lookups(self) -> dict[str, np.ndarray]:
        return {} if self.table_digits is None else {"table": table(self.table_digits)[0]}

    def room_size(self) -> int:
        digits = self.sum_digits
        return super().room_size() + (row_size(self.room()["cylinders"], digits) if digits else 0)

    def derived_rows(self) -> Mapping[str, Sequence[float] | np.ndarray]:
        rows = dict(super().derived_rows())
        if self.sum_digits is not None:
            rows["cells"] = cell_row(self.cylinders, self.sum_digits, self.sum_box, self.room()["cylinders"])
        return rows

    def connect(self, peers: Peers) -> dict[str, Any]:
        bound, digits, cells = peers.bound(self), self.table_digits, self.sum_digits
        bound.cylinders.ends = ClosedEnds() if digits is None else TabulatedEnds(bound.table, digits)
        room = self.room()["cylinders"]
        in_cells = None if cells is None else CellSum(bound.cells, room, cells)
        return {**super().connect(peers), "in_cells": in_cells, "has_cells": cells is not None}

    @ti.func
    def value(self, w, r, t):
        b = 0.0 * r
        if ti.static(self.has_cells):
            b += self.by_cells(w, r, t, False)[0]
        else:
            b += self.direct_value(w, r, t)
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
        if self.magnetised(w, t) > 0:
            leaf, x, half = self.in_cells.leaf(w, r)
            first, end, listed = self.listed(w, leaf)
            if listed:
                b, gradient = self.in_cells.distant(w, leaf, x, half, slopes)
            lanes = ti.static(near_together())
            for group in range((end - first + lanes - 1) // lanes):
                start = first + group * lanes
                one, slope = self.together(w, r, start, ti.min(end - start, lanes), listed, slopes)
                b += one
                gradient += slope
        return b, gradient

    @ti.func
    def together(self, w, r, start, count, listed, slopes: ti.template()):  # type: ignore[valid-type]
        """Return the field and the gradient, 0 unless ``slopes``, of ``count`` cylinders, at most
        ``near_together``, from a place in the list of near cylinders on, or from an index on."""
        lanes = ti.static(near_together())
        b, gradient = 0.0 * r, 0.0 * r.outer_product(r)
        chosen, left = ti.Vector([0] * lanes, ti.i32), ti.Vector([1] * lanes, ti.i32)
        found = [ti.Vector([0.0 * r[0]] * lanes) for _ in ti.static(range(12 if slopes else 3))]
        for lane in range(lanes):
            chosen[lane] = start + ti.min(lane, count - 1)
            if listed:
                chosen[lane] = self.in_cells.index(w, chosen[lane])
        if ti.static(not self.table_digits) and count >= FEWEST_TOGETHER:
            # Without branches, so that compilers vectorise; then those for which this is invalid.
            for lane in range(lanes):
                one, slope, right = self.each.flux_mostly(w, chosen[lane], r)
                left[lane] = ti.select(right, 0, 1)
                for a in ti.static(range(3)):
                    found[a][lane] = one[a]
                    for c in ti.static(range(len(found) // 3 - 1)):
                        found[3 + 3 * a + c][lane] = slope[a, c]
        for lane in range(count):
            one = ti.Vector([found[a][lane] for a in ti.static(range(3))])
            slope = 0.0 * gradient
            if ti.static(slopes):
                for a, c in ti.static(ti.ndrange(3, 3)):
                    slope[a, c] = found[3 + 3 * a + c][lane]
            if left[lane] > 0:
                if ti.static(slopes):
                    one, slope = self.each.flux(w, chosen[lane], r)
                else:
                    one = self.each.flux_density(w, chosen[lane], r)
            b += one
            gradient += slope
        return b, gradient

    @ti.func
    def listed(self, w, leaf):
        """Return the range of places in the list of near cylinders of a leaf, and True; without a list the
        indices of all cylinders, and False."""
        first, end, listed = 0, self.each.size(w), False
        if leaf >= 0:
            begin, last = self.in_cells.near(w, leaf)
            if last >= begin:
                first, end, listed = begin, last, True
        return first, end, listed

    @ti.func
    def nearby(self, w, r, radius):
        first, end, listed, reach = 0, self.each.size(w), False, 0.0 * radius + ti.math.inf
        if ti.static(self.has_cells):
            leaf, _x, half = self.in_cells.leaf(w, r)
            if radius < NEAR_REACH * half:
                first, end, listed = self.listed(w, leaf)
                reach = ti.select(listed, NEAR_REACH * half, reach)
        return first, end, listed, reach

    @ti.func
    def near_body(self, w, e):
        k = e
        if ti.static(self.has_cells):
            k = self.in_cells.index(w, e)
        return k

    @ti.func
    def add_tile(self, w, r: ti.template(), t, value: ti.template(), gradient: ti.template()):  # type: ignore
        if ti.static(not self.has_cells):
            self.add_direct(w, r, t, value, gradient)
        else:
            for lane in range(ti.static(r[0].n)):
                one, slope = self.value_and_gradient(w, ti.Vector([r[0][lane], r[1][lane], r[2][lane]]), t)
                add_point(value, gradient, lane, one, slope)
