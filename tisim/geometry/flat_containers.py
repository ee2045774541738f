"""Containers between planes: a wedge and a box."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector, option, parameter
from tisim.errors import must
from tisim.geometry.container import Axes, Container
from tisim.geometry.tessellation import box_faces, fan

SLOPE_PLANE, BACK_PLANE = 1, 2
"""Walls of a wedge; wall 0 is the bottom."""


class WedgeContainer(Container):
    """A right triangular prism with periodic ends, its apex line along z through the lower corner of the box.

    The bottom is the plane y = 0, the slope y = x tan(angle), and the back x = l_w. Length l_w and height
    h_w = l_w tan(angle) keep their ratios to D, and only the width w_w along z decreases in a contraction.
    The shortest wedge that holds rods of length L and radius R has one row of them along its slope:

        l_min = R/tan(angle/2) + R + L cos(angle)                                                (2.12)
        phi = pi R^2 (4/3 R + L)/(R l_min^2 tan(angle))                                          (2.13)

    Source: B16 sections 2.2.4 and 2.4, Figs 2.3 and 2.9.
    """

    length: float = parameter("D", "length l_w of the bottom", examples=[10.0], gt=0)
    angle: float = parameter(
        "rad", "angle between bottom and slope", examples=[math.pi / 6], gt=0, lt=math.pi / 2
    )

    @model_validator(mode="after")
    def _holds_a_sphere(self) -> Self:
        least = self.shortest(self.angle)
        rule = f"at least {least:.6g} D, to hold a sphere at this angle"
        must(self.length >= least * (1 - 1e-12), f"{self.label}.length", rule, self.length)
        return self

    @staticmethod
    def shortest(angle: float, aspect_ratio: float = 1.0) -> float:
        """Return the length l_min (D) of the shortest wedge for one row of rods (2.12).

        angle : of the wedge (rad). aspect_ratio : Lambda = L/D + 1.
        """
        return 0.5 / math.tan(angle / 2) + 0.5 + (aspect_ratio - 1) * math.cos(angle)

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield from (("cosine", 1), ("sine", 1))

    def values(self) -> list[float]:
        return [*super().values(), math.cos(self.angle), math.sin(self.angle)]

    def walled(self) -> Axes:
        return True, True, False

    def scaled(self) -> Axes:
        return True, True, False

    def walls(self) -> int:
        return 3

    def volume_in(self, side: np.ndarray, unit: float) -> float:
        return float((self.length * unit) ** 2 * math.tan(self.angle) / 2 * side[2])

    def box_of(self, volume: float, unit: float) -> np.ndarray:
        long = self.length * unit
        high = long * math.tan(self.angle)
        return np.array([long, high, volume / (long * high / 2)])

    def distances(self, places: np.ndarray, side: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
        c, s = math.cos(self.angle), math.sin(self.angle)
        x, y = places[:, 0], places[:, 1]
        outward = np.array([[0.0, -1.0, 0.0], [-s, c, 0.0], [1.0, 0.0, 0.0]])
        distance = np.column_stack([y, s * x - c * y, self.length * unit - x])
        return distance, np.tile(outward, (len(places), 1, 1))

    def points(self, numbers: np.ndarray, side: np.ndarray, unit: float, margin: float) -> np.ndarray:
        # The points away from the walls form a smaller wedge, with its apex on the bisector.
        apex = margin / math.tan(self.angle / 2)
        x = (self.length * unit - margin - apex) * np.sqrt(numbers[:, 0])
        y = x * math.tan(self.angle) * numbers[:, 1]
        return np.column_stack([apex + x, margin + y, side[2] * numbers[:, 2]])

    def triangles(self, side: np.ndarray, unit: float) -> np.ndarray:
        long = self.length * unit
        high, across = long * math.tan(self.angle), np.array([0.0, 0.0, side[2]])
        apex, foot, top = np.array([[0.0, 0.0, 0.0], [long, 0.0, 0.0], [long, high, 0.0]])
        walls = [(apex, foot), (apex, top), (foot, top)]
        return np.concatenate([fan(np.array([a, b, b + across, a + across])) for a, b in walls])

    @ti.func
    def volume(self, w, side, unit):
        long = self.length(w) * unit
        return 0.5 * long * long * self.sine(w) / self.cosine(w) * side[2]

    @ti.func
    def centre(self, w, side):
        return 0.0 * side

    @ti.func
    def wall(self, w, k, place, side, unit):
        zero = 0.0 * place[0]
        distance, outward = place[1], ti.Vector([zero, zero - 1.0, zero])
        if k == SLOPE_PLANE:
            distance = self.sine(w) * place[0] - self.cosine(w) * place[1]
            outward = ti.Vector([zero - self.sine(w), zero + self.cosine(w), zero])
        elif k == BACK_PLANE:
            distance = self.length(w) * unit - place[0]
            outward = ti.Vector([zero + 1.0, zero, zero])
        return distance, outward

    @ti.func
    def along(self, w, k, outward):
        # The length of the bottom, the slope, or the height of the back.
        return ti.Vector([ti.abs(outward[1]), ti.abs(outward[0]), 0.0 * outward[2]])


class BoxContainer(Container):
    """A box with hard faces along some axes, and periodic along the others.

    The faces of the domain are its walls, and keep their places while bodies grow. Along an axis with a given
    width the walls are that far apart, and the width keeps its ratio to D.
    """

    hard: Axes = option("axes along which the box has hard faces", (True, True, True))
    width: Vector = parameter(
        "D", "width along each axis that keeps its ratio to D; 0 for the width of the box", (0.0, 0.0, 0.0)
    )

    @model_validator(mode="after")
    def _sound(self) -> Self:
        name, scaled = self.label, self.scaled()
        must(any(self.hard), f"{name}.hard", "true for at least one axis", self.hard)
        for width, hard in zip(self.width, self.hard, strict=True):
            rule = "0, or at least 1 D along an axis with hard faces"
            must(width == 0 or (hard and width >= 1), f"{name}.width", rule, self.width)
        must(not all(scaled), f"{name}.width", "0 along one axis, so that the box can contract", self.width)
        return self

    def structure(self) -> tuple[Any, ...]:
        # The axes along which positions grow are compiled in.
        return (*super().structure(), self.scaled())

    def walled(self) -> Axes:
        return self.hard

    def scaled(self) -> Axes:
        x, y, z = self.width
        return x > 0, y > 0, z > 0

    def walls(self) -> int:
        return 2 * sum(self.hard)

    def axis_of(self, wall: int) -> int:
        """Return the axis normal to a wall; walls are in the order of the axes, the lower one first."""
        return [axis for axis in range(3) if self.hard[axis]][wall // 2]

    def widths(self, side: np.ndarray, unit: float) -> np.ndarray:
        """Return the widths (m, shape (3,))."""
        return np.where(self.scaled(), np.array(self.width) * unit, side)

    def volume_in(self, side: np.ndarray, unit: float) -> float:
        return float(np.prod(self.widths(side, unit)))

    def box_of(self, volume: float, unit: float) -> np.ndarray:
        given = np.array([width for width in self.width if width > 0]) * unit
        rest = (volume / np.prod(given)) ** (1 / (3 - len(given)))
        return self.widths(np.full(3, rest), unit)

    def distances(self, places: np.ndarray, side: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
        axes, half = np.repeat(np.flatnonzero(self.hard), 2), self.widths(side, unit) / 2
        sign = np.tile([-1.0, 1.0], len(axes) // 2)
        distance = half[axes] - sign * (places - side / 2)[:, axes]
        return distance, np.tile(sign[:, None] * np.eye(3)[axes], (len(places), 1, 1))

    def points(self, numbers: np.ndarray, side: np.ndarray, unit: float, margin: float) -> np.ndarray:
        wide = self.widths(side, unit) - 2 * margin * np.array(self.hard)
        return side / 2 + wide * (numbers - 0.5)

    def triangles(self, side: np.ndarray, unit: float) -> np.ndarray:
        half = self.widths(side, unit) / 2
        return box_faces(side / 2 - half, side / 2 + half, np.flatnonzero(self.hard).tolist())

    @ti.func
    def widths_of(self, w, side, unit):
        """Return the widths (m)."""
        wide, given = side, self.width(w)
        for k in ti.static(range(3)):
            if ti.static(self.scaled()[k]):
                wide[k] = given[k] * unit
        return wide

    @ti.func
    def volume(self, w, side, unit):
        wide = self.widths_of(w, side, unit)
        return wide[0] * wide[1] * wide[2]

    @ti.func
    def wall(self, w, k, place, side, unit):
        away, half = place - 0.5 * side, 0.5 * self.widths_of(w, side, unit)
        sign = ti.select(k % 2 == 0, -1.0, 1.0)
        distance, outward = 0.0 * place[0], 0.0 * place
        for wall in ti.static(range(0, self.walls(), 2)):
            axis = ti.static(self.axis_of(wall))
            if k // 2 == wall // 2:
                distance = half[axis] - sign * away[axis]
                outward[axis] = sign
        return distance, outward

    @ti.func
    def along(self, w, k, outward):
        return ti.abs(ti.Vector([outward[2], outward[0], outward[1]]))
