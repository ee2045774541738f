"""The inverse problems of packing: bodies that pack most densely, and packings for filters and catalysts.

A design is a shape and a mixture of two sizes of it. Its bodies are packed by energy minimisation, the
quickest way to a density that depends on the start alone. Boxes must be at least twice as wide as the largest
body is long, so designs of long bodies and of unequal sizes have more bodies; a design that needs more than
the size of the search allows is refused. A design whose bodies nevertheless grow longer fails in its run.

In the variant "permeable" a packing is judged by its surface in a volume, on which particles are caught or
molecules react, and by the permeability after Kozeny and Carman. From k = (1 - phi)^3/(C s^2) follows that
of packings with the same surface s, the loosest is the most permeable.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.figure import Figure

from tisim import Result, Scene
from tisim.analysis import PackedBodies, nematic_order, packing_fraction, permeability, specific_surface
from tisim.cases.case import searched_size
from tisim.cases.packing.measures import fraction_of, mean_contacts
from tisim.cases.packing.scene import DIAMETER, SIZES, TITLE, packed_by
from tisim.cases.packing.snapshots import draw_by_contacts
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem
from tisim.plotting.style import empty
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.shapes.particle_shape import ParticleShape
from tisim.steppers import EnergyMinimisation

VARIANTS = ("densest", "superquadrics", "permeable")
MIXTURE_GENES = (Gene("size_ratio", "", 1.0, 2.0), Gene("large_share", "", 0.3, 0.9))
GENES = {
    "densest": (Gene("aspect", "", 1.0, 3.0), *MIXTURE_GENES),
    "superquadrics": (
        Gene("length", "", 1.0, 2.0),
        Gene("thickness", "", 0.5, 1.0),
        Gene("exponent", "", 2.0, 5.0),
    ),
    "permeable": (Gene("diameter", "m", 0.5e-3, 2e-3, "log"), Gene("aspect", "", 1.0, 6.0), *MIXTURE_GENES),
}
WANTED = {
    "densest": "the rods, of one size or two, that pack most densely",
    "superquadrics": "the superquadrics of one size that pack most densely",
    "permeable": "the front of surface and permeability of packed rods, for a filter or a catalyst",
}
"""The goal of each variant of the problem."""
MEANINGS = {
    "packing fraction": "volume of the bodies over the volume of the box",
    "surface": "surface of the bodies over the volume of the box",
    "permeability": "after Kozeny and Carman, with the constant 5",
    "length": "longest over middle semi-axis",
    "thickness": "shortest over middle semi-axis",
    "exponent": "of the superquadric: 2 for an ellipsoid, larger with flatter faces",
    "aspect": "length of a rod with its caps over its diameter, L/D + 1",
    "diameter": "diameter of a rod of the mean volume",
    "size_ratio": "size of the larger bodies over the smaller ones",
    "large_share": "share of the volume of the bodies that the larger ones have",
}
FEWEST_LARGE = 20
"""Least number of larger bodies of a mixture. Fewer of them jam at densities that differ by a tenth."""
DENSE, SLENDER = 0.8, 4.0
"""Packing fractions that are not expected to be exceeded: DENSE, and SLENDER over the aspect ratio."""
SEARCH_START = 0.2
"""Packing fraction of the start of a design."""
QUICK = EnergyMinimisation(precision=1e-3, tolerance=1e-3, patience=100, fraction_step=0.03)
"""The packing stepper of a search. With twice the patience 50 rods of Lambda = 1.5 take 1.6 times the
evaluations, and end at the same mean density."""
SEARCHED = {"small": {"number": 40, "most": 200}, "default": {"number": 80, "most": 400}}
"""Least and largest number of bodies of a design, by size."""
LONGEST_RUN = 1e6
"""Largest number of evaluations, of 1 s each, s."""


@dataclass(frozen=True)
class PackingDesign:
    """The bodies of a design: a shape in two sizes.

    ratio : of the two sizes. share : of the volume, that the larger bodies have. number : least number of
    bodies. most : largest number of bodies.
    """

    shape: ParticleShape
    ratio: float
    share: float
    number: int
    most: int

    def bodies(self) -> int:
        """Return the number of bodies: ``number``, or more, to keep the box twice as wide as the largest body
        is long, with FEWEST_LARGE of them. InputError for more than ``most``."""
        length, volume = 2 * self.shape.bounding_radius(), self.shape.volume()
        aspect = length / (2 * float(self.shape.half_extents().min()))
        large = self.share * min(DENSE, SLENDER / aspect) * (2 * length) ** 3 / volume
        large = max(large, FEWEST_LARGE if self.share < 1 else 0)
        needed = ceil(large * (1 + (1 - self.share) / self.share * self.ratio**3))
        rule = f"at most {self.most}, for a box twice as wide as the largest is long"
        must(needed <= self.most, "bodies of the design", rule, needed)
        return max(self.number, needed)

    def scene(self, seed: int) -> Scene:
        """Return the scene that packs the design, from the random start of a seed."""
        sizes = (self.ratio, self.share)
        packed = packed_by(QUICK, self.shape, self.bodies(), SEARCH_START, sizes=sizes, seed=seed)
        return packed.model_copy(update={"duration": LONGEST_RUN})


def shape_of(design: Mapping[str, float]) -> ParticleShape:
    """Return the shape of a design: a superquadric, or a rod if the design has an aspect ratio."""
    if "aspect" in design:
        across = design.get("diameter", DIAMETER)
        return SpherocylinderShape(length=(design["aspect"] - 1) * across, diameter=across)
    half = DIAMETER / 2
    return SuperquadricShape(
        semi_axes=(design["thickness"] * half, half, design["length"] * half),
        exponents=3 * (design["exponent"],),
    )


def growth(packing: PackedBodies) -> float:
    """Return the ratio by which bodies have grown in a run, the box of which keeps its size."""
    return float(np.cbrt((packing.scale**3).mean()))


def surface(result: Result) -> float:
    """Return the specific surface of a packing of bodies of the designed size, 1/m."""
    packing = PackedBodies.from_result(result)
    return specific_surface(packing) * growth(packing)


def designed_permeability(result: Result) -> float:
    """Return the permeability of a packing of bodies of the designed size, m^2."""
    packing = PackedBodies.from_result(result)
    return permeability(packing) / growth(packing) ** 2


DENSEST = (Objective("packing fraction", fraction_of, maximise=True),)
OBJECTIVES = {
    "densest": DENSEST,
    "superquadrics": DENSEST,
    "permeable": (
        Objective("surface", surface, "1/m", maximise=True),
        Objective("permeability", designed_permeability, "m^2", maximise=True),
    ),
}


def problem(size: str = "default", variant: str = "densest") -> Problem:
    """Return the search for packings of a variant."""
    must(variant in GENES, "variant", f"one of {', '.join(GENES)}", variant)
    searched_size(size, SIZES)
    limits, names = SEARCHED[size], [gene.name for gene in GENES[variant]]

    def scene(design: Mapping[str, float], seed: int) -> Scene:
        sizes = design.get("size_ratio", 1.0), design.get("large_share", 1.0)
        return PackingDesign(shape_of(design), *sizes, **limits).scene(seed)

    return Problem(
        name=f"packing-{variant}" + ("" if size == "default" else f"-{size}"),
        title=TITLE,
        description=WANTED[variant],
        genome=Genome(GENES[variant]),
        scene=scene,
        objective=OBJECTIVES[variant],
        meanings={name: MEANINGS[name] for name in (*names, *(one.name for one in OBJECTIVES[variant]))},
        picture=lambda scene, result: picture(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
    """Return further properties of the packing of a design."""
    packing = PackedBodies.from_result(result)
    return {
        "bodies": float(len(packing)),
        "packing fraction": packing_fraction(packing),
        "contact number": mean_contacts(result),
        "nematic order S": nematic_order(packing.axes()[:, 2]).order,
    }


def picture(result: Result) -> Figure:
    """Draw a packing, coloured by contacts."""
    figure = empty(5.6, 5.2)
    draw_by_contacts(figure.subplots(), PackedBodies.from_result(result))
    return figure
