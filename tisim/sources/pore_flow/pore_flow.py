"""The flow of a fluid through a matrix of fibres and spheres, as a source that drag laws use."""

import math
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, NamedTuple, Self

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
from tisim.sources.pore_flow.interpolated_flow import InterpolatedFlow
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


class PoreFlow(InterpolatedFlow, Switched):
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


def padded(values: np.ndarray, size: int) -> np.ndarray:
    """Return the values as one row, with zeros up to a size."""
    return np.pad(values.ravel(), (0, size - values.size))
