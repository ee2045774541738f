"""The matrix of a packed filter: fibres of one size at random places in random directions.

Rods are packed in a periodic cube (cases/packing), and each becomes a cylinder with the length and the
diameter of its straight part, which lies within the rod. Fibres therefore never overlap, and the solid
fraction is below the packing fraction of the rods with their caps.

The cube is periodic across the flow. Along the flow it is cut open, and may be repeated. Fibres are cut out
by their centres, so that they protrude from both faces of the matrix by up to half their length.

With ``tube``, rods are packed in a round tube in place of a cube, as in B16's separation cells of 20 and
40 mm: 2 to 10 lengths of the fibres of 4 to 11 mm (section 7.3.2).

With ``parallel``, all fibres have one direction, as in the matrix of fibres across the field that B16
proposes (section 6.5). They are added one by one at random places that are free (random sequential
addition).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Literal

import numpy as np

from tisim import Box, run
from tisim.analysis import PackedBodies
from tisim.cases.common.runs import sound
from tisim.cases.packing.scene import packed_by
from tisim.components.component import Vector
from tisim.errors import must
from tisim.geometry import CylindricalContainer
from tisim.shapes import SpherocylinderShape
from tisim.sources import Cylinder, magnetise
from tisim.sources.magnetic import soft_magnet, stoner_wohlfarth
from tisim.sources.pore_flow.pore_flow import AXIS_NAMES
from tisim.steppers import EnergyMinimisation

LOOSE = 0.03
"""Packing fraction of the random start of rods."""
FLOW_DIRECTION: Vector = (0.0, 0.0, 1.0)
"""Direction of the flow."""
KEPT_MATRICES = 16
"""Matrices that are kept in memory, as each start of a design asks for its own again."""
LONGEST_PACKING = 3e4
"""Largest number of evaluations of the forces of a packing, of 1 s each, s."""
STEEL_SATURATION = 2.2e6
"""Saturation magnetisation of the fibres, A/m (B16 section 7.3.4)."""
IMAGE_REACH = 1.0
"""Distance from the matrix up to which there are fibres, in lengths of a fibre."""
MOST_PLACES_TRIED = 200_000
"""Random places that are tried for parallel fibres."""
CLEAR = 1.001
"""Colloids start outside the fibres, enlarged by this factor."""


@dataclass(frozen=True)
class Matrix:
    """The fibres of a filter.

    diameter : D of a fibre, m. aspect : L/D. fraction : volume of the fibres over the volume of the matrix.
    layers : cubes, or lengths of tube, along the flow, which are copies of one packing. seed : of the
    packing. width : least side of the cube, or length of the tube, over the length of a rod with its caps; 2
    or more, so that a rod touches no two images of another. tube : diameter of the tube over the same length;
    None for a cube that is periodic across the flow. parallel : axis along which all fibres lie; None for
    fibres in random directions.
    """

    diameter: float = 0.4e-3
    aspect: float = 5.0
    fraction: float = 0.2
    layers: int = 1
    seed: int = 0
    width: float = 2.05
    tube: float | None = None
    parallel: Literal["x", "y", "z"] | None = None

    @property
    def length(self) -> float:
        """Return the length L of a fibre, m."""
        return self.aspect * self.diameter

    @property
    def across(self) -> float | None:
        """Return the diameter of the tube, D; None for a cube."""
        return None if self.tube is None else self.tube * (self.aspect + 1)

    @property
    def number(self) -> int:
        """Return the number of fibres of a cube or of a length of tube."""
        side = self.width * (self.aspect + 1)
        section = side**2 if self.across is None else np.pi / 4 * self.across**2
        return int(np.ceil(self.fraction * section * side / (np.pi / 4 * self.aspect)))

    @property
    def sides(self) -> tuple[float, float, float]:
        """Return the sides of the cube, or of the box around a length of tube, m."""
        volume = self.number * np.pi / 4 * self.diameter**2 * self.length / self.fraction
        if self.across is None:
            cube = float(np.cbrt(volume))
            return cube, cube, cube
        wide = self.across * self.diameter
        return wide, wide, float(volume / (np.pi / 4 * wide**2))

    @property
    def section(self) -> float:
        """Return the area across the flow, m^2."""
        wide = self.sides[0]
        return float(wide**2 * (1 if self.tube is None else np.pi / 4))

    @property
    def depth(self) -> float:
        """Return the length of the matrix along the flow, m."""
        return self.layers * self.sides[2]

    @property
    def density(self) -> float:
        """Return the number of fibres in a volume, 1/m^3."""
        return self.number / (self.section * self.sides[2])

    def fibres(self) -> tuple[Cylinder, ...]:
        """Return the fibres, not magnetised. They are around the axis z, and their centres at 0..depth (m)
        along it.

        InputError if fibres of this aspect ratio jam before they have the fraction.
        """
        if self.parallel is None:
            centres, axes = _packing(self.aspect, self.fraction, self.number, self.seed, self.across)
        else:
            must(self.tube is None, "tube", "left out with parallel fibres", self.tube)
            axis = AXIS_NAMES.index(self.parallel)
            side = self.sides[0] / self.diameter
            centres = _parallel(self.aspect, self.fraction, self.number, self.seed, axis, side)
            axes = np.tile(np.eye(3)[axis], (self.number, 1))
        centres = (centres - 0.5 * (1 - np.array(FLOW_DIRECTION))) * self.sides
        return tuple(
            Cylinder(
                centre=_vector(centre + layer * self.sides[2] * np.array(FLOW_DIRECTION)),
                axis=_vector(axis),
                radius=self.diameter / 2,
                length=self.length,
            )
            for layer in range(self.layers)
            for centre, axis in zip(centres, axes, strict=True)
        )

    def with_images(self, fibres: tuple[Cylinder, ...], reach: float, bulk: bool) -> tuple[Cylinder, ...]:
        """Return the fibres, and after them their periodic images that come nearer than ``reach`` (m) to the
        matrix: across the flow of a cube, and in the bulk also along it."""
        size = np.array([*self.sides[:2], self.depth])
        middle, images = np.array([0.0, 0.0, self.depth / 2]), []
        turns = [range(-k, k + 1) for k in np.ceil((reach + self.length) / size).astype(int)]
        if self.tube is not None:
            turns[:2] = range(1), range(1)
        if not bulk:
            turns[2] = range(1)
        for turn in product(*turns):
            for body in fibres if any(turn) else ():
                centre = np.asarray(body.centre) + turn * size
                outside = np.abs(centre - middle) - size / 2
                outside -= 0.5 * body.length * np.abs(body.direction) + body.radius
                if (outside < reach).all():
                    images.append(body.model_copy(update={"centre": _vector(centre)}))
        return (*fibres, *images)


@lru_cache(KEPT_MATRICES)
def magnets_of(
    matrix: Matrix, flux: Vector, bulk: bool, mutual: bool, saturated: bool
) -> tuple[Cylinder, ...]:
    """Return the magnetised fibres of a matrix in a field of a flux density (T), followed by their images.

    bulk : whether there are images along the flow. mutual, saturated : see PackedFilter.
    """
    fibres = matrix.fibres()
    every = matrix.with_images(fibres, IMAGE_REACH * matrix.length, bulk)
    if mutual:
        own = magnetise(every, flux, STEEL_SATURATION, None if saturated else math.inf)[: len(fibres)]
    else:
        own = tuple(magnetised(one, flux, saturated) for one in fibres)
    # The outermost images lack neighbours; all images are magnetised as their fibres.
    return matrix.with_images(own, IMAGE_REACH * matrix.length, bulk)


def magnetised(body: Cylinder, flux: Vector, saturated: bool) -> Cylinder:
    """Return a fibre of steel, which is soft or always saturated, alone in a field (T)."""
    law = stoner_wohlfarth.magnetisation if saturated else soft_magnet.magnetisation
    m = law(body.axis, body.radius, body.length, STEEL_SATURATION, flux)
    return body.model_copy(update={"magnetisation": m})


def in_pores(number: int, fibres: Sequence[Cylinder], box: Box, seed: int, tube: bool = False) -> np.ndarray:
    """Return random positions in a box, or in a tube along z in it, outside the fibres, m, shape
    (number, 3)."""
    generator = np.random.default_rng([seed, 0x904E5])
    centre, axis = (np.array([getattr(one, name) for one in fibres]) for name in ("centre", "direction"))
    radius, half = np.array([(one.radius, one.length / 2) for one in fibres]).T * CLEAR
    found = np.empty((0, 3))
    while len(found) < number:
        tried = generator.uniform(box.low, box.high, (number, 3))
        inside = np.hypot(tried[:, 0], tried[:, 1]) * CLEAR > box.high[0] if tube else np.zeros(number, bool)
        for k in range(len(fibres)):
            away = tried - centre[k]
            along = away @ axis[k]
            across = np.linalg.norm(away - along[:, None] * axis[k], axis=1)
            inside |= (across < radius[k]) & (np.abs(along) < half[k])
        found = np.concatenate([found, tried[~inside]])
    return found[:number]


@lru_cache(KEPT_MATRICES)
def _packing(
    aspect: float, fraction: float, number: int, seed: int, across: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres in units of the sides, each from 0 to 1, and unit vectors along the axes, shape (n, 3)
    each. across : diameter of a tube, D; None for a cube."""
    rod = SpherocylinderShape(length=aspect, diameter=1.0)
    wanted = fraction * rod.volume() / (np.pi / 4 * aspect)
    must(0 < wanted < 1, "fraction of fibres", "one at which rods with their caps fill less than the space",
         fraction)  # fmt: skip
    stepper = EnergyMinimisation(target=wanted, fraction_step=0.02, tolerance=1e-3, patience=200)
    container = None if across is None else CylindricalContainer(diameter=across)
    made = packed_by(stepper, rod, number, min(LOOSE, wanted), container, seed=seed)
    (result,) = sound(run([made.model_copy(update={"duration": LONGEST_PACKING})]))
    reached = result.measures["packing_fraction"]
    rule = (
        f"at most {fraction * reached / wanted:.3f} for fibres of L/D = {aspect:g}, at which they are jammed"
    )
    must(reached > (1 - 1e-5) * wanted, "fraction of fibres", rule, fraction)
    packing = PackedBodies.from_result(result)
    sides = packing.high - packing.low
    if across is not None:
        # The tube grows with the rods, beyond the box of their start.
        sides[:2] = across * packing.scale[0]
    return 0.5 + (packing.position - (packing.low + packing.high) / 2) / sides, packing.axes()[:, 2]


@lru_cache(KEPT_MATRICES)
def _parallel(aspect: float, fraction: float, number: int, seed: int, axis: int, side: float) -> np.ndarray:
    """Return centres of parallel cylinders in units of the side (D) of a periodic cube, from 0 to 1, shape
    (n, 3). axis : 0, 1 or 2, along which they lie."""
    generator = np.random.default_rng([seed, 0x9A2A11E1])
    across = [b for b in range(3) if b != axis]
    found = np.empty((0, 3))
    for place in generator.uniform(size=(MOST_PLACES_TRIED, 3)):
        away = side * np.abs((found - place + 0.5) % 1 - 0.5)
        if ((np.hypot(*away[:, across].T) > 1) | (away[:, axis] > aspect)).all():
            found = np.vstack([found, place])
        if len(found) == number:
            return found
    most, tries = fraction * len(found) / number, f"{MOST_PLACES_TRIED} tries found no further free place"
    rule = f"at most {most:.3f} for parallel fibres of L/D = {aspect:g}, as {tries}"
    must(False, "fraction of fibres", rule, fraction)
    raise AssertionError


def _vector(v: np.ndarray) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])
