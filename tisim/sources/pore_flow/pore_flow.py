"""The flow of a fluid through a matrix of fibres and spheres, as a source that drag laws use."""

import math
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import field_validator, model_validator

from tisim.backend.taichi import ti
from tisim.compiling import compiling
from tisim.components.component import Vector, rounded
from tisim.components.ranges import check_direction
from tisim.effects.base import SceneParts
from tisim.errors import Words, must
from tisim.sources.base import option, parameter
from tisim.sources.magnetic.cylinder import Cylinder
from tisim.sources.magnetic.sphere import Sphere
from tisim.sources.pore_flow.solids import Column, Grid, SolidBody, SolidCylinder, SolidSphere
from tisim.sources.pore_flow.stokes_flow import TOLERANCES, WALL_TOLERANCE, stokes_flow
from tisim.sources.switched import NO_END, Switched

AXIS_NAMES = ("x", "y", "z")
KEPT_FLOW_BYTES = 1_200_000_000
"""Memory of solved flows that are kept for later scenes of the process, at least one of them. Each scene of a
batch asks for its flow several times, so the flows of a batch should fit; others are solved again."""
NUMBERS_PER_CELL = 4
"""Three components of the velocity, and the distance from the nearest surface."""
ONE_CELL = (1, 1, 1)
WHOLE_PERIODS = 1e-9
"""Relative rounding of the number of periods of the flow in a domain."""


class UnitFlow(NamedTuple):
    """A flow with a superficial velocity of 1 along its pressure gradient.

    velocity : on faces, shape (3, nx, ny, nz). distance : of the corners of cells from the nearest surface,
        in units of ``PoreFlow.shortest_length``, shape (nx, ny, nz). mean : superficial velocity, shape (3,).
        permeability : m^2.
    """

    velocity: np.ndarray
    distance: np.ndarray
    mean: np.ndarray
    permeability: float

    @property
    def nbytes(self) -> int:
        """Return the memory of the arrays."""
        return self.velocity.nbytes + self.distance.nbytes


_solved: OrderedDict[tuple[Any, ...], UnitFlow] = OrderedDict()


class PoreFlow(Switched):
    """A pressure gradient drives a viscous fluid slowly between fibres and spheres at rest; drag laws use its
    velocity.

        eta Lap v - grad p = 0,    div v = 0,    v = 0 on bodies and walls

    The equations are solved once for each matrix, when a scene is compiled, on a grid of ``cells`` over the
    box; see ``stokes_flow``. The velocity is proportional to the pressure gradient, or to the superficial
    velocity: scenes that differ in these only share a solution. The pore Reynolds number must be far below 1.

    Between the faces of the grid, quadratic splines along a component and linear ones across it give a
    continuous velocity V without divergence, so that a fluid with uniform density remains so. But splines do
    not vanish at a surface. In a layer of one cell in front of it, of thickness b, the velocity at a distance
    d is therefore taken from V at the distance b on the same normal n:

        v = d/b V_t + (d/b)^2 V_n n,    d < b

    V_t and V_n are the components of V along the surface and along its normal. A flow without slip and
    without divergence has these powers, so that the divergence remains small. Distances are interpolated
    linearly between the corners of cells. The gradient neglects the curvature of surfaces in this layer.

    The matrix continues periodically across the faces of the box, as do bodies that cross them. A flow with
    ``outside = "uniform"`` belongs to a filter in free space: outside of the box the fluid has the
    superficial velocity everywhere, and layers of the box without bodies keep the jump at its faces small.

    With ``column``, the faces of the box around ``axis`` are walls: of a duct, or of a round tube that
    touches them. The velocity is 0 in walls and beyond.

    The fluid rests before ``begin`` and from ``end`` on; it starts and stops within the time R^2 rho/eta of a
    pore, which is neglected.

    Source: B16 section 7.2.2 (Darcy's law).
    """

    quantity = "flow_velocity"
    kinked: ClassVar[bool] = True

    low: Vector = parameter("m", "lower corner of the box of the matrix", examples=[(-5e-4, -5e-4, -5e-4)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(5e-4, 5e-4, 5e-4)])
    direction: Vector = parameter(
        "",
        "direction of the driving force, opposite to the pressure gradient; of any length",
        (0.0, 0.0, 1.0),
    )
    pressure_gradient: float | None = parameter(
        "Pa/m", "magnitude of the mean pressure gradient, unless the speed is given", None, ge=0
    )
    speed: float | None = parameter(
        "m/s",
        "component of the superficial velocity along the direction, unless the pressure gradient is given",
        None,
        ge=0,
        examples=[1e-3],
    )
    viscosity: float = parameter("Pa s", "dynamic viscosity eta of the fluid", examples=[1e-3], gt=0)
    cylinders: tuple[Cylinder, ...] = option(
        "the fibres; worlds of a batch may have different ones",
        (),
        examples=[(Cylinder(radius=1e-4, length=5e-4),)],
    )
    spheres: tuple[Sphere, ...] = option("spheres; worlds may have different ones", (), examples=[()])
    cells: tuple[int, int, int] = option(
        "cells of the grid along x, y and z; worlds may have different ones", (64, 64, 64)
    )
    column: Column = option("walls around the matrix: none, a rectangular duct or a round tube", "none")
    axis: Literal["x", "y", "z"] = option("axis along which a duct or a tube is open", "z")
    outside: Literal["periodic", "uniform"] = option(
        "velocity outside of the box: of its periodic images, or the superficial velocity", "periodic"
    )
    tolerance: float = parameter(
        "", "velocity at walls over the mean velocity", WALL_TOLERANCE, ge=TOLERANCES[0], le=TOLERANCES[1]
    )
    begin: float = parameter("s", "time from which on the fluid flows", 0.0, ge=0)
    end: float = parameter("s", "time at which the flow ends", NO_END, gt=0)

    if TYPE_CHECKING:
        grid: ClassVar[Any]
        depth: ClassVar[Any]
        sides: ClassVar[Any]
        mean: ClassVar[Any]
        scale: ClassVar[Any]

    @field_validator("direction", mode="after")
    @classmethod
    def _direction(cls, direction: Vector) -> Vector:
        check_direction("pore_flow.direction", direction)
        return direction

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        label, given = self.label, (self.pressure_gradient is not None) + (self.speed is not None)
        rule = f"given, or {label}.speed, and not both"
        must(given == 1, f"{label}.pressure_gradient", rule, Words("both" if given else "neither"))
        ordered = all(a < b for a, b in zip(self.low, self.high, strict=True))
        must(ordered, f"{label}.high", f"above {label}.low in every component", self.high)
        must(min(self.cells) >= 1, f"{label}.cells", "whole numbers, at least 1", self.cells)
        free = self.column == "none"
        some = bool(self.cylinders or self.spheres) or not free
        rule = "given, or spheres, or a column with walls"
        must(some, f"{label}.cylinders", rule, Words("none of them"))
        must(free or self.outside == "periodic", f"{label}.outside", "'periodic' with a column", self.outside)
        across = [c for a, c in zip(AXIS_NAMES, self.direction, strict=True) if a != self.axis]
        along = free or not any(across)
        must(along, f"{label}.direction", f"along the {self.column}, {self.axis}", self.direction)
        return self

    def values(self) -> list[float]:
        # Kernels read the derived ``scale`` in place of the one that is given.
        given = {"pressure_gradient": self.pressure_gradient or 0.0, "speed": self.speed or 0.0}
        return super(PoreFlow, self.model_copy(update=given)).values()

    def solids(self) -> list[SolidBody]:
        """Return the bodies of the matrix."""
        return [
            *(SolidCylinder(one.centre, one.direction, one.radius, one.length) for one in self.cylinders),
            *(SolidSphere(one.centre, one.radius) for one in self.spheres),
        ]

    def solve(self) -> UnitFlow:
        """Return the flow for a superficial velocity of 1 along the direction; solved once in a process for
        each matrix. InputError if the fluid cannot pass."""
        n = np.array(self.direction) / np.abs(self.direction).max()
        n /= np.linalg.norm(n)
        solids = self.solids()
        box = (self.low, self.high, self.cells, self.column, self.axis)
        key = (tuple(solids), *box, tuple(n.tolist()), self.tolerance)
        if key not in _solved:
            with compiling():
                flow = stokes_flow(
                    solids, self.low, self.high, self.cells, (-n).tolist(), 1.0, self.column,
                    AXIS_NAMES.index(self.axis), self.tolerance,
                )  # fmt: skip
            along = float(flow.mean_velocity @ n)
            velocity = flow.velocity / along
            # Tiny numbers could not be stored in f32.
            velocity[np.abs(velocity) < 1e-30] = 0.0
            distance = flow.grid.distances(None, solids) / self.shortest_length()
            _solved[key] = UnitFlow(velocity, distance, flow.mean_velocity / along, flow.permeability)
        _solved.move_to_end(key)
        while len(_solved) > 1 and sum(one.nbytes for one in _solved.values()) > KEPT_FLOW_BYTES:
            _solved.popitem(last=False)
        return _solved[key]

    def superficial_speed(self) -> float:
        """Return the component of the superficial velocity along the direction (m/s)."""
        if self.speed is not None:
            return self.speed
        return self.solve().permeability * (self.pressure_gradient or 0.0) / self.viscosity

    def permeability(self) -> float:
        """Return the permeability along the direction (m^2)."""
        return self.solve().permeability

    def strongest(self) -> float:
        largest = np.abs(self.solve().velocity).max(axis=(1, 2, 3))
        return float(np.linalg.norm(largest) * self.superficial_speed())

    def shortest_length(self) -> float:
        sides = np.subtract(self.high, self.low) / self.cells
        return float(sides[np.array(self.cells) > 1].min(initial=max(sides)))

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        low, high = scene.domain.bounds()
        if self.outside != "periodic" or low is None or high is None:
            return
        periods = (high - low) / np.subtract(self.high, self.low)
        for axis, joined, number in zip(AXIS_NAMES, scene.domain.joined(), periods, strict=True):
            fits = not joined or abs(number / max(round(number), 1) - 1) < WHOLE_PERIODS
            rule = f"a whole part of the side of the periodic domain along {axis}"
            must(fits, f"the box of {self.label}", rule, Words(f"{1 / number:g} of it"))

    def derived_rows(self) -> Mapping[str, Sequence[float] | np.ndarray]:
        flow = self.solve()
        room = self.room()["grid"]
        return {
            "grid": padded(flow.velocity, 3 * room),
            "depth": padded(flow.distance, room),
            "sides": [*self.cells, *self._grid.shape],
            "mean": flow.mean,
            "scale": [self.superficial_speed()],
            "unit": [self.shortest_length()],
        }

    def needed_room(self) -> dict[str, int]:
        return {**super().needed_room(), "grid": rounded(math.prod(self._grid.shape))}

    def room_size(self) -> int:
        return super().room_size() + NUMBERS_PER_CELL * self.room()["grid"]

    def structure(self) -> tuple[Any, ...]:
        return super(PoreFlow, self.with_room(self.room()).model_copy(update={"cells": ONE_CELL})).structure()

    @property
    def walled(self) -> tuple[bool, bool, bool]:
        """Return the axes along which the box has walls."""
        return self._grid.walled

    @property
    def _grid(self) -> Grid:
        spacing = np.subtract(self.high, self.low) / self.cells
        return Grid(np.array(self.low), spacing, self.cells, self.column, AXIS_NAMES.index(self.axis))

    @ti.func
    def value(self, w, r, t):
        return self.value_and_gradient(w, r, t)[0]

    @ti.func
    def gradient(self, w, r, t):
        return self.value_and_gradient(w, r, t)[1]

    @ti.func
    def value_and_gradient(self, w, r, t):
        v, slope = self.interpolate(w, r)
        flows = ti.select(self.acts(w, t), 1.0, 0.0)
        return flows * v, flows * slope

    @ti.func
    def interpolate(self, w, r):
        """Return velocity (m/s) and gradient (1/s) at r (m)."""
        place, inside, per = self.place(w, r)
        near, normal, thickness = self.surface(w, place, per)
        # In the layer, the velocity above r at its edge.
        part = ti.min(ti.max(near, 0.0), 1.0)
        place += (1.0 - part) * thickness * per * normal
        v, slope = self.between(w, place, per)
        along = v.dot(normal)
        edge = v
        v = part * edge + (part * part - part) * along * normal
        if near < 1.0:
            slope -= (slope @ normal).outer_product(normal)
            slope = part * slope + (part * part - part) * normal.outer_product(normal @ slope)
            rise = (edge + (2.0 * part - 1.0) * along * normal) / thickness
            slope += ti.select(near > 0.0, rise, 0.0 * rise).outer_product(normal)
        for a in ti.static(range(3)):
            for b in ti.static(range(3)):
                slope[a, b] = ti.select(inside, self.scale(w, 0) * slope[a, b], 0.0)
            v[a] = self.scale(w, 0) * ti.select(inside, v[a], self.mean(w, a))
        return v, slope

    @ti.func
    def surface(self, w, place, per):
        """Return the distance of a place from the nearest surface, in layers, the unit vector along which it
        increases, which is 0 far away, and the thickness of the layer (m)."""
        corner = ti.floor(place)
        x, first = place - corner, ti.cast(corner, ti.i32)
        near, normal = 0.0 * x[0], 0.0 * x
        n, at = self.shape(w), ti.Matrix.zero(ti.i32, 3, 2)
        for b, i in ti.static(ti.ndrange(3, 2)):
            at[b, i] = wrapped(first[b] + i, n[b])
        for i, j, k in ti.static(ti.ndrange(2, 2, 2)):
            d = self.depth(w, (at[0, i] * n[1] + at[1, j]) * n[2] + at[2, k])
            p, q, s = x[0] if i else 1.0 - x[0], x[1] if j else 1.0 - x[1], x[2] if k else 1.0 - x[2]
            near += p * q * s * d
            normal[0] += (d if i else -d) * q * s
            normal[1] += p * (d if j else -d) * s
            normal[2] += p * q * (d if k else -d)
        normal *= per
        size = normal.norm()
        normal *= ti.select(size > 0.0, 1.0 / ti.select(size > 0.0, size, 1.0), 0.0)
        # One cell along the normal, of cells with different sides.
        across = (per * normal).norm()
        thickness = 1.0 / ti.select(across > 0.0, across, per.max())
        return near * self.unit(w, 0) / thickness, normal, thickness

    @ti.func
    def between(self, w, place, per):
        """Return velocity and gradient (1/m) from splines, in units of the superficial speed."""
        v, slope = 0.0 * place, 0.0 * place.outer_product(place)
        n = self.shape(w)
        for a in ti.static(range(3)):
            at, weight, change = self.splines(place, n, a)
            for i in ti.static(range(3 if a == 0 else 2)):
                for j in ti.static(range(3 if a == 1 else 2)):
                    for k in ti.static(range(3 if a == 2 else 2)):
                        u = self.grid(w, ((a * n[0] + at[0, i]) * n[1] + at[1, j]) * n[2] + at[2, k])
                        v[a] += u * weight[0, i] * weight[1, j] * weight[2, k]
                        slope[a, 0] += u * change[0, i] * weight[1, j] * weight[2, k]
                        slope[a, 1] += u * weight[0, i] * change[1, j] * weight[2, k]
                        slope[a, 2] += u * weight[0, i] * weight[1, j] * change[2, k]
            for b in ti.static(range(3)):
                slope[a, b] *= per[b]
        return v, slope

    @ti.func
    def place(self, w, r):
        """Return r in cells from the lower corner, moved into the box or the middle of a wall; whether the
        velocity there is interpolated; and the cells per length (1/m) by which it changes."""
        place, inside, per = 0.0 * r, True, 0.0 * r
        for a in ti.static(range(3)):
            n, whole = self.sides(w, a), self.sides(w, 3 + a)
            per[a] = n / (self.high(w)[a] - self.low(w)[a])
            place[a] = (r[a] - self.low(w)[a]) * per[a]
            if ti.static(self.walled[a]):
                place[a] = ti.min(ti.max(place[a], -0.5), n + 0.5)
                per[a] = ti.select(place[a] > -0.5 and place[a] < n + 0.5, per[a], 0.0)
            elif ti.static(self.outside == "uniform"):
                inside = inside and place[a] >= 0.0 and place[a] <= n
                place[a] = ti.min(ti.max(place[a], 0.0), n)
            else:
                place[a] -= whole * ti.floor(place[a] / whole)
        return place, inside, per

    @ti.func
    def splines(self, place, n, a: ti.template()):  # type: ignore[valid-type]
        """Return the indices of the faces along each axis on which component a depends, of n in all, their
        weights, and the derivatives of these by the place."""
        at = ti.Matrix.zero(ti.i32, 3, 3)
        weight, change = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
        for b in ti.static(range(3)):
            if ti.static(a == b):
                nearest = ti.floor(place[b] + 0.5)
                x = place[b] - nearest
                for i in ti.static(range(3)):
                    at[b, i] = wrapped(ti.cast(nearest, ti.i32) - 1 + i, n[b])
                weight[b, 0], weight[b, 1], weight[b, 2] = (
                    0.5 * (0.5 - x) ** 2,
                    0.75 - x * x,
                    0.5 * (0.5 + x) ** 2,
                )
                change[b, 0], change[b, 1], change[b, 2] = x - 0.5, -2.0 * x, x + 0.5
            else:
                lower = ti.floor(place[b] - 0.5)
                x = place[b] - 0.5 - lower
                for i in ti.static(range(2)):
                    at[b, i] = wrapped(ti.cast(lower, ti.i32) + i, n[b])
                weight[b, 0], weight[b, 1] = 1.0 - x, x
                change[b, 0], change[b, 1] = -1.0, 1.0
        return at, weight, change

    @ti.func
    def shape(self, w):
        """Return the cells of the grid along each axis, with cells inside walls."""
        return ti.Vector([ti.cast(self.sides(w, 3 + a), ti.i32) for a in ti.static(range(3))])


@ti.func
def wrapped(i, n):
    """Return the index of the periodic image, among n cells, of cell i."""
    # Faster than the remainder of whole numbers.
    k = i - n * ti.cast(ti.floor(ti.cast(i, float) / n), ti.i32)
    # A place that is no number must not read other memory.
    return ti.max(0, ti.min(k, n - 1))


def padded(values: np.ndarray, size: int) -> np.ndarray:
    """Return the values as one row, with zeros up to a size."""
    return np.pad(values.ravel(), (0, size - values.size))
