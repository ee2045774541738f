"""The matrix of a packed filter: fibres of one size at random places in random directions.

Rods are packed in a periodic cube (cases/packing), and each becomes a cylinder with the length and the
diameter of its straight part, which lies within the rod. Fibres therefore never overlap, and the solid
fraction is below the packing fraction of the rods with their caps.

The cube is periodic across the flow. Along the flow it is cut open, and may be repeated. Fibres are cut out
by their centres, so that they protrude from both faces of the matrix by up to half their length.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from tisim import run
from tisim.analysis import PackedBodies
from tisim.cases.common.runs import sound
from tisim.cases.packing.scene import packed_by
from tisim.components.component import Vector
from tisim.errors import must
from tisim.shapes import SpherocylinderShape
from tisim.sources import Cylinder
from tisim.steppers import EnergyMinimisation

LOOSE = 0.03
"""Packing fraction of the random start of rods."""
FLOW_DIRECTION: Vector = (0.0, 0.0, 1.0)
"""Direction of the flow."""
KEPT_MATRICES = 16
"""Matrices that are kept in memory, as each start of a design asks for its own again."""
LONGEST_PACKING = 3e4
"""Largest number of evaluations of the forces of a packing, of 1 s each, s."""


@dataclass(frozen=True)
class Matrix:
    """The fibres of a filter.

    diameter : D of a fibre, m. aspect : L/D. fraction : volume of the fibres over the volume of the matrix.
    layers : cubes along the flow, which are copies of one packing. seed : of the packing. width : least side
    of the cube over the length of a rod with its caps; 2 or more, so that a rod touches no two images of
    another.
    """

    diameter: float = 0.4e-3
    aspect: float = 5.0
    fraction: float = 0.2
    layers: int = 1
    seed: int = 0
    width: float = 2.05

    @property
    def length(self) -> float:
        """Return the length L of a fibre, m."""
        return self.aspect * self.diameter

    @property
    def number(self) -> int:
        """Return the number of fibres of a cube."""
        side = self.width * (self.aspect + 1)
        return int(np.ceil(self.fraction * side**3 / (np.pi / 4 * self.aspect)))

    @property
    def side(self) -> float:
        """Return the side of a cube, m."""
        volume = self.number * np.pi / 4 * self.diameter**2 * self.length / self.fraction
        return float(np.cbrt(volume))

    @property
    def depth(self) -> float:
        """Return the length of the matrix along the flow, m."""
        return self.layers * self.side

    @property
    def density(self) -> float:
        """Return the number of fibres in a volume, 1/m^3."""
        return self.number / self.side**3

    def fibres(self) -> tuple[Cylinder, ...]:
        """Return the fibres with centres in the box -side/2..side/2 by -side/2..side/2 by 0..depth (m), not
        magnetised.

        InputError if rods of this aspect ratio jam before they have the fraction.
        """
        centres, axes = _packing(self.aspect, self.fraction, self.number, self.seed)
        centres = (centres - 0.5 * (1 - np.array(FLOW_DIRECTION))) * self.side
        return tuple(
            Cylinder(
                centre=_vector(centre + layer * self.side * np.array(FLOW_DIRECTION)),
                axis=_vector(axis),
                radius=self.diameter / 2,
                length=self.length,
            )
            for layer in range(self.layers)
            for centre, axis in zip(centres, axes, strict=True)
        )

    def with_images(self, fibres: tuple[Cylinder, ...], reach: float, bulk: bool) -> tuple[Cylinder, ...]:
        """Return the fibres, and after them their periodic images that come nearer than ``reach`` (m) to the
        matrix: across the flow, and in the bulk also along it."""
        size = np.array([self.side, self.side, self.depth])
        middle, images = np.array([0.0, 0.0, self.depth / 2]), []
        turns = [range(-k, k + 1) for k in np.ceil((reach + self.length) / size).astype(int)]
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
def _packing(aspect: float, fraction: float, number: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return centres in units of the side, each from 0 to 1, and unit vectors along the axes, shape (n, 3)
    each."""
    rod = SpherocylinderShape(length=aspect, diameter=1.0)
    wanted = fraction * rod.volume() / (np.pi / 4 * aspect)
    must(0 < wanted < 1, "fraction of fibres", "one at which rods with their caps fill less than the space",
         fraction)  # fmt: skip
    stepper = EnergyMinimisation(target=wanted, fraction_step=0.02, tolerance=1e-3, patience=200)
    made = packed_by(stepper, rod, number, min(LOOSE, wanted), seed=seed)
    (result,) = sound(run([made.model_copy(update={"duration": LONGEST_PACKING})]))
    reached = result.measures["packing_fraction"]
    rule = (
        f"at most {fraction * reached / wanted:.3f} for fibres of L/D = {aspect:g}, at which they are jammed"
    )
    must(reached > (1 - 1e-5) * wanted, "fraction of fibres", rule, fraction)
    packing = PackedBodies.from_result(result)
    return (packing.position - packing.low) / (packing.high - packing.low), packing.axes()[:, 2]


def _vector(v: np.ndarray) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])
