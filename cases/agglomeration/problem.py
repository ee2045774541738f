"""The inverse problem of agglomeration: the flow that grows the largest grains (Z04 section 7), with or
without charges and fields."""

import numpy as np

from tisim import Result
from tisim.cases.agglomeration.fields import FIELD_GENES
from tisim.cases.agglomeration.scene import SIZES, TITLE, scene
from tisim.cases.case import size_named
from tisim.errors import must
from tisim.optimize import Gene, Genome, Problem
from tisim.plotting.cloud import cloud

GENES = (
    Gene("relative_velocity", "m/s", 20.0, 200.0),
    Gene("length_ratio", "", 0.4, 0.8),
    Gene("density", "kg/m^3", 1e3, 1e4),
    Gene("hardness", "Pa", 1e5, 1e6),
    Gene("heat_capacity", "J/(kg K)", 2e2, 2e3),
    # The upper end cannot be read in the copy at hand; see FACTORS in ``scene``.
    Gene("friction", "", 0.01, 0.1),
    Gene("temperature", "K", 1e2, 1e3),
    Gene("activation_energy", "J/mol", 1e2, 1e3),
    # The lower end cannot be read in the copy at hand; 1e6 is ours. The upper end is one of FACTORS.
    Gene("reaction", "J/m^2", 1e6, 1e7),
)
"""The search ranges of Z04 section 7, with ends of our choice if they cannot be read in the copy at hand."""

# The upper end is as printed. The lower end cannot be read in the copy at hand; 1e6 is ours. No grain breaks
# anywhere in this range.
UNBREAKABLE = Gene("surface_energy", "J/m^2", 1e6, 1e16, "log")
VARIANTS = {
    "paper": (UNBREAKABLE,),
    # From a surface energy at which nearly every hard impact breaks an agglomerate to one at which none
    # does. Measured with the best design and 1000 grains: breakages per grain 1.4 at 1e2, 0.1 at 1e4, 1e-4 at
    # 1e5; Pi 0.90, 0.79, 0.76.
    "fragmenting": (Gene("surface_energy", "J/m^2", 1e2, 1e5, "log"),),
    "fields": (UNBREAKABLE, *FIELD_GENES),
}
"""Genes that each variant of the inverse problem adds to GENES: surface energy, and charges and fields."""

MEANINGS = {
    "Pi": "1 - b_f/b*, b* the radius of one sphere of all the mass; 0 if all grains have merged",
    "b_f / b_0": "final over initial mean radius",
    "n_f": "(b_f/b_0)^3, number of initial grains in a grain of the final mean radius",
}


def cost(result: Result) -> float:
    """Return Pi = 1 - b_f / b*, with b_f the mean final radius and b* the radius of one sphere of all the
    mass (Z04 7.1)."""
    whole = np.cbrt((result.start["radius"] ** 3).sum())
    return max(0.0, float(1.0 - result.state["radius"].mean() / whole))  # below 0 by rounding only


def problem(size: str = "default", variant: str = "paper") -> Problem:
    """Return the inverse problem of Z04 section 7: find the flow that grows the largest grains."""
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    settings = size_named(size, SIZES).scene
    energy, *fields = VARIANTS[variant]
    edge = settings["grains"] ** (1 / 3)
    searched = f"surface energy {energy.low:g} to {energy.high:g} {energy.unit}"
    searched += f"; {len(fields)} genes of charges and fields" if fields else ""
    return Problem(
        name=f"agglomeration-{size}" if variant == "paper" else f"agglomeration-{variant}-{size}",
        title=f"{TITLE}: the largest grains, {settings['grains']} at the start",
        description=f"the largest grains; {searched}",
        genome=Genome((*GENES, energy, *fields)),
        scene=lambda design, seed: scene(design, seed, **settings),
        objective=cost,
        symbol="Pi",
        picture=lambda scene, result: cloud(result),
        derived={
            "b_f / b_0": lambda pi: edge * (1.0 - pi),
            "n_f": lambda pi: (edge * (1.0 - pi)) ** 3,
        },
        meanings=MEANINGS,
    )
