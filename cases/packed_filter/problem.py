"""The inverse problems of packed_filter: the matrix and the field that capture most at the least pressure,
and those that divide colloids most sharply by size.

A design is the diameter, the aspect ratio and the solid fraction of the fibres, and the field. In the variant
"pressure" all designs let the same flow through a matrix of the same depth, and the search finds the front of
captured fraction and pressure drop. The speed of the flow is a gene of the other variants. "throughput" has
it as a third objective, as the slowest flow is the best in the other two. In "select" a filter is wanted that
captures colloids larger than ``CUT`` and lets smaller ones pass: the difference of the captured fractions of
both is maximised.

The field remains on, and the field and the flow of each design are resolved between its fibres. The matrix is
one cube of a packing, whose side ``depth`` differs between designs. Captured fraction and pressure drop are
taken to a matrix of the depth ``DEPTH``: the fraction that passes is P^(DEPTH/depth) in each class of
colloids by size, as if layers captured independently of each other, and the pressure drop is proportional to
the depth.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tisim import Result, Scene
from tisim.cases.case import searched_size
from tisim.cases.packed_filter.matrix import Matrix
from tisim.cases.packed_filter.measures import (
    captured_fraction,
    matrix_box,
    penetration_of_layers,
    pressure_drop,
    superficial_velocity,
)
from tisim.cases.packed_filter.pictures import caught
from tisim.cases.packed_filter.scene import MEAN_RADIUS, SIZES, TITLE, PackedFilter
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem

DEPTH = 10e-3
"""Depth of the matrix to which designs are compared, m."""
CUT = MEAN_RADIUS
"""Magnetic radius that divides colloids to be captured from those to pass, m."""
SPEED = 2e-4
"""Superficial velocity of the designs of variant "pressure", m/s."""
FIBRE_GENES = (
    Gene("diameter", "m", 0.2e-3, 0.8e-3, "log"),
    Gene("aspect", "L/D", 1.5, 5.0),
    Gene("fraction", "", 0.05, 0.35),
    Gene("flux", "T", 0.05, 1.5, "log"),
)
SPEED_GENE = Gene("speed", "m/s", 2e-5, 5e-3, "log")
GENES = {
    "pressure": FIBRE_GENES,
    "throughput": (*FIBRE_GENES, SPEED_GENE),
    "select": (*FIBRE_GENES, SPEED_GENE),
}
WANTED = {
    "throughput": "the front of captured fraction, pressure drop and throughput",
    "pressure": "the front of captured fraction and pressure drop, at a given flow",
    "select": f"the filter that divides colloids most sharply at a magnetic radius of {1e9 * CUT:g} nm",
}
"""The goal of each variant of the problem."""
MEANINGS = {
    "captured": f"captured fraction of the colloids in a matrix {1e3 * DEPTH:g} mm deep",
    "pressure drop": f"of a matrix {1e3 * DEPTH:g} mm deep, at the speed of the water",
    "throughput": "volume of water per area of the matrix and time",
    "selectivity": f"captured fraction of colloids above {1e9 * CUT:g} nm minus the fraction of those below",
    "diameter": "of the fibres",
    "aspect": "length of a fibre over its diameter",
    "fraction": "volume of the fibres over the volume of the matrix",
    "flux": "flux density of the applied field",
    "speed": "superficial velocity of the water",
}
SEARCHED: dict[str, dict[str, Any]] = {
    "small": {"number": 100, "resolution": 5.0, "digits": None},
    "default": {"number": 300, "resolution": 8.0},
}
"""Colloids of a run, cells of its flow over D and digits of the sum of its field, by size. An octree for each
design takes longer than it saves for some hundred colloids."""
MORE_COLLOIDS = {"pressure": 1, "throughput": 1, "select": 4}
"""Factor of the number of colloids by variant: the difference of two fractions is noisier than a fraction.
With 100 colloids its standard deviation between starts is 0.15, with 400 it is 0.07."""
FEWEST_FIBRES = 30
"""Least number of fibres of a design."""
TRANSITS = 4.0
"""Duration of a run over the time in which the mean flow passes the whole length of the flow."""


def designed(design: Mapping[str, float], seed: int, **settings: Any) -> PackedFilter:
    """Return the filter of a design; each seed has a packing of its own."""
    aspect, fraction = design["aspect"], design["fraction"]
    width = np.cbrt(FEWEST_FIBRES * np.pi / 4 * aspect / fraction) / (aspect + 1)
    matrix = Matrix(design["diameter"], aspect, fraction, seed=seed, width=max(Matrix.width, float(width)))
    speed = design.get("speed", SPEED)
    transit = (matrix.depth + 2 * matrix.length + matrix.diameter) / speed
    return PackedFilter(
        matrix,
        "dynamic",
        flux=design["flux"],
        speed=speed,
        feed=0.1 * transit,
        duration=TRANSITS * transit,
        **settings,
    )


def depth(result: Result) -> float:
    """Return the depth of the matrix of a run, m."""
    low, high = matrix_box(result.scene)
    return float(high[2] - low[2])


def captured(result: Result, which: np.ndarray | None = None) -> float:
    """Return the captured fraction of the colloids, or of some of them, in a matrix of depth DEPTH."""
    return 1 - penetration_of_layers(result, DEPTH / depth(result), which)


def pressure(result: Result) -> float:
    """Return the pressure drop over a matrix of depth DEPTH, Pa."""
    return pressure_drop(result) * DEPTH / depth(result)


def selectivity(result: Result) -> float:
    """Return the captured fraction of colloids above CUT minus the fraction of those below."""
    large = result.state["radius"] > CUT
    return captured(result, large) - captured(result, ~large)


FRONT = (Objective("captured", captured, maximise=True), Objective("pressure drop", pressure, "Pa"))
OBJECTIVES = {
    "pressure": FRONT,
    "throughput": (*FRONT, Objective("throughput", superficial_velocity, "m/s", maximise=True)),
    "select": (Objective("selectivity", selectivity, maximise=True),),
}


def problem(size: str = "default", variant: str = "pressure") -> Problem:
    """Return the search for packed filters of a variant."""
    must(variant in GENES, "variant", f"one of {', '.join(GENES)}", variant)
    searched_size(size, SIZES)
    names = [gene.name for gene in GENES[variant]]
    limits = {**SEARCHED[size], "number": MORE_COLLOIDS[variant] * SEARCHED[size]["number"]}

    def scene(design: Mapping[str, float], seed: int) -> Scene:
        return designed(design, seed, **limits).scene(seed)

    return Problem(
        name=f"packed-filter-{variant}" + ("" if size == "default" else f"-{size}"),
        title=TITLE,
        description=WANTED[variant],
        genome=Genome(GENES[variant]),
        scene=scene,
        objective=OBJECTIVES[variant],
        meanings={name: MEANINGS[name] for name in (*names, *(one.name for one in OBJECTIVES[variant]))},
        picture=lambda scene, result: caught(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
    """Return further properties of a design."""
    large = result.state["radius"] > CUT
    return {
        "fibres": float(designed(design, 0, number=1).matrix.number),
        "depth of the matrix that was run, mm": 1e3 * depth(result),
        "captured fraction in it": captured_fraction(result),
        f"captured fraction above {1e9 * CUT:g} nm, {1e3 * DEPTH:g} mm": captured(result, large),
        f"captured fraction below {1e9 * CUT:g} nm, {1e3 * DEPTH:g} mm": captured(result, ~large),
        f"pressure drop of {1e3 * DEPTH:g} mm, Pa": pressure(result),
    }
