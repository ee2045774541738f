"""Agglomeration in thermochemically reacting granular flow (Z04), and its inverse problem.

Z04 is T. I. Zohdi, A computational framework for agglomeration in thermochemically reacting granular flows,
Proc. R. Soc. Lond. A 460 (2004) 3421-3445. Equal grains with random velocities collide, heat, soften, react,
bond and break; the inverse problem asks for the flow that grows the largest grains.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from cases.agglomeration_accuracy import quantities
from cases.agglomeration_strings import designs
from cases.case import Case, Check, Size
from optimize.problem.genome import Gene, Genome
from optimize.problem.problem import Problem
from tisim import Box, Cloud, Result, Scene
from tisim.effects import Agglomeration, DeformationWork, Friction, Heating, Impact, Reaction, Softening
from tisim.errors import must
from tisim.operators import Cooling, Fragmentation
from tisim.plotting.cloud import cloud

HALF_SIDE = 0.01
"""D, half the side of the control volume, m (Z04 section 8)."""
DURATION = 0.01
"""s (Z04 section 8)."""
MEAN_VELOCITY = (100.0, 10.0, 10.0)
"""m/s (Z04 section 7)."""

GENES = (
    Gene("relative_velocity", "m/s", 20.0, 200.0),
    Gene("length_ratio", "", 0.4, 0.8),
    Gene("density", "kg/m^3", 1e3, 1e4),
    Gene("hardness", "Pa", 1e5, 1e6),
    Gene("heat_capacity", "J/(kg K)", 2e2, 2e3),
    # The upper end cannot be read in the copy at hand; see FACTORS in agglomeration_strings.
    Gene("friction", "", 0.01, 0.1),
    Gene("temperature", "K", 1e2, 1e3),
    Gene("activation_energy", "J/mol", 1e2, 1e3),
    Gene("reaction", "J/m^2", 1e6, 1e7),
)
"""Z04 section 8: the search ranges."""

SURFACE_ENERGY = {
    # As printed. Nothing breaks anywhere in it.
    "paper": Gene("surface_energy", "J/m^2", 1e6, 1e16, "log"),
    # From where nearly every hard impact breaks an agglomerate to where none does. Measured with the best
    # string and 1000 grains: breakages per grain 1.4 at 1e2, 0.1 at 1e4, 1e-4 at 1e5; Pi 0.90, 0.79, 0.76.
    "fragmenting": Gene("surface_energy", "J/m^2", 1e2, 1e5, "log"),
}
"""Variants of the inverse problem, by what the surface energy may be."""

BEST = designs()[0]
"""The string of rank 1 of Z04."""

SIZES = {
    "small": Size(
        "60 grains; a look in seconds",
        {"grains": 60},
        {
            "options": {"population": 10, "parents": 4},
            "generations": 3,
            "ensemble": {"tolerance": 5e-3, "max_starts": 12, "confirm": 12},
        },
    ),
    "default": Size(
        "250 grains, 8 generations of 20; about a minute on 2 cores",
        {"grains": 250},
        {"generations": 8, "ensemble": {"tolerance": 1e-3, "min_starts": 8, "block": 8, "confirm": 24}},
    ),
    "paper": Size(
        "1000 grains, 25 generations of 20, as Z04 section 8; under 10 minutes on 2 cores",
        {"grains": 1000},
        {"generations": 25, "ensemble": {"tolerance": 5e-4, "min_starts": 12, "block": 12, "confirm": 48}},
    ),
}


def scene(design: Mapping[str, float], seed: int, grains: int = 1000, duration: float = DURATION) -> Scene:
    """The flow of a design from one random start."""
    radius = design["length_ratio"] * HALF_SIDE / grains ** (1 / 3)
    v = design["relative_velocity"]
    return Scene(
        name="agglomeration",
        particles=Cloud(
            number=grains, radius=radius, density=design["density"], mean_velocity=MEAN_VELOCITY,
            deviation=(v, 0.1 * v, 0.1 * v), temperature=design["temperature"],
        ),
        effects=(
            Impact(hardness=design["hardness"]),
            Friction(coefficient=design["friction"]),
            Heating(heat_capacity=design["heat_capacity"]),
            DeformationWork(),
            Softening(activation_energy=design["activation_energy"]),
            Reaction(energy_density=design["reaction"]),
            Fragmentation(surface_energy=design["surface_energy"]),
            Agglomeration(),
            Cooling(),
        ),
        domain=Box(low=(-HALF_SIDE,) * 3, high=(HALF_SIDE,) * 3, images=False),
        duration=duration,
        seed=seed,
    )  # fmt: skip


def cost(result: Result) -> float:
    """Pi = 1 - b_f / b*, b_f the mean final radius and b* that of all the mass in one sphere (Z04 7.1)."""
    whole = np.cbrt((result.start["radius"] ** 3).sum())
    return float(1.0 - result.state["radius"].mean() / whole)


def scene_for(size: str, seed: int) -> Scene:
    """The flow of the paper's best string."""
    return scene(BEST, seed, **CASE.size(size).scene)


def problem(size: str = "default", variant: str = "paper") -> Problem:
    """The inverse problem of Z04 section 7: the flow whose grains grow the most."""
    must(variant in SURFACE_ENERGY, "variant", f"one of {', '.join(SURFACE_ENERGY)}", variant)
    settings = CASE.size(size).scene
    edge, energy = settings["grains"] ** (1 / 3), SURFACE_ENERGY[variant]
    return Problem(
        name=f"agglomeration-{size}" if variant == "paper" else f"agglomeration-{variant}-{size}",
        title=f"{CASE.title}: the largest grains, {settings['grains']} at the start",
        description=f"the largest grains; surface energy {energy.low:g} to {energy.high:g} {energy.unit}",
        genome=Genome((*GENES, energy)),
        scene=lambda design, seed: scene(design, seed, **settings),
        objective=cost,
        symbol="Pi",
        picture=lambda scene, result: cloud(result),
        derived={
            "b_f / b_0": lambda pi: edge * (1.0 - pi),
            "n_f": lambda pi: (edge * (1.0 - pi)) ** 3,
        },
    )


def check() -> Iterator[Check]:
    """Z04's closed forms, and what must be conserved."""
    # Imported late: the checks run scenes of this module.
    from cases import agglomeration_checks

    yield from agglomeration_checks.checks()


CASE = Case(
    name="agglomeration",
    title="Agglomeration in thermochemically reacting granular flow",
    source="T. I. Zohdi, Proc. R. Soc. Lond. A 460 (2004) 3421-3445",
    sizes=SIZES,
    scene=scene_for,
    check=check,
    quantities=quantities,
    problem=problem,
    variants=tuple(SURFACE_ENERGY),
)
