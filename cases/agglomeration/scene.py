"""Agglomeration in thermochemically reacting granular flow (Z04).

Z04 is T. I. Zohdi, A computational framework for agglomeration in thermochemically reacting granular flows,
Proc. R. Soc. Lond. A 460 (2004) 3421-3445. Equal grains with random velocities collide, heat, soften, react,
bond and break. The six best individuals of its tables 1 to 3 are here in SI units.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tisim import Box, Cloud, Scene
from tisim.cases.agglomeration import fields
from tisim.cases.case import Size, size_named
from tisim.effects import Agglomeration, DeformationWork, Friction, Heating, Impact, Reaction, Softening
from tisim.operators import Cooling, Fragmentation
from tisim.steppers import ApproachTime, Verlet

TITLE = "Agglomeration in thermochemically reacting granular flow"

KEYS = (
    "relative_velocity", "length_ratio", "density", "hardness", "heat_capacity",
    "friction", "temperature", "activation_energy", "reaction", "surface_energy",
)  # fmt: skip
FACTORS = (200.0, 1.0, 1e4, 1e6, 2e3, 0.1, 1e3, 1e3, 1e7, 1e16)
"""The tables of Z04 print each value divided by these factors, which are the upper ends of the search ranges
except for L. The exponent at the head of the friction column cannot be read in the copy at hand. By the same
rule it is 0.1, which puts all six individuals inside the printed range."""
PRINTED = (
    (0.92344, 0.79041, 0.66527, 0.26548, 0.89815, 0.13456, 0.50218, 0.35241, 0.17765, 0.83685),
    (0.99307, 0.79510, 0.90509, 0.49048, 0.94075, 0.17535, 0.62494, 0.12457, 0.20836, 0.85267),
    (0.96042, 0.79726, 0.66773, 0.39772, 0.34235, 0.11000, 0.21911, 0.19785, 0.19901, 0.93462),
    (0.93911, 0.79280, 0.53228, 0.20459, 0.98942, 0.15624, 0.90323, 0.38558, 0.15209, 0.91321),
    (0.84977, 0.79226, 0.91791, 0.15671, 0.96995, 0.10455, 0.36270, 0.32326, 0.20403, 0.80388),
    (0.16761, 0.79362, 0.93962, 0.10877, 0.95669, 0.15099, 0.52338, 0.29311, 0.11186, 0.25457),
)
"""The six individuals as Z04 tables 1 and 2 print them."""
PUBLISHED_COSTS = (0.67708, 0.79078, 0.79636, 0.79957, 0.80036, 0.80691)
"""The cost Pi of each individual in Z04 table 3."""


def designs() -> list[dict[str, float]]:
    """Return the six individuals in SI units, best first."""
    return [dict(zip(KEYS, np.multiply(row, FACTORS).tolist(), strict=True)) for row in PRINTED]


HALF_SIDE = 0.01
"""D, half the side of the control volume, m (Z04 section 8)."""
DURATION = 0.01
"""The simulated time of a flow, s (Z04 section 8)."""
MEAN_VELOCITY = (100.0, 10.0, 10.0)
"""The mean velocity of the grains at the start, m/s (Z04 section 7)."""

BEST = designs()[0]
"""The design of rank 1 in Z04, in SI units."""


def _search(evaluations: int, published: Mapping[str, Any]) -> dict[str, Any]:
    """Return the search settings for a number of runs; published : the settings of Zohdi's own algorithm."""
    usual = {"generations": evaluations, "max_evaluations": evaluations}
    return {**usual, "methods": {"zohdi": published}}


SIZES = {
    "small": Size(
        "60 grains; runs in seconds",
        {"grains": 60},
        _search(400, {
            "options": {"population": 10, "parents": 4}, "generations": 3,
            "ensemble": {"tolerance": 5e-3, "max_starts": 12, "confirm": 12},
        }),
    ),
    "default": Size(
        "250 grains, a search of 800 runs; about a minute on 2 cores",
        {"grains": 250},
        _search(800, {
            "generations": 8, "ensemble": {"tolerance": 1e-3, "min_starts": 8, "block": 8, "confirm": 24},
        }),
    ),
    "paper": Size(
        "1000 grains, a search of 1600 runs; Zohdi's algorithm has 25 generations of 20 (Z04 8)",
        {"grains": 1000},
        _search(1600, {
            "generations": 25, "ensemble": {"tolerance": 5e-4, "min_starts": 12, "block": 12, "confirm": 48},
        }),
    ),
}  # fmt: skip


def scene(design: Mapping[str, float], seed: int, grains: int = 1000, duration: float = DURATION) -> Scene:
    """Return the flow of a design from one random start, with charges and fields if the design has their
    genes.

    With fields, grains also interact across the faces of the box: the mean velocity carries all grains
    through the faces repeatedly, and this must not affect their attraction.
    """
    radius = design["length_ratio"] * HALF_SIDE / grains ** (1 / 3)
    v = design["relative_velocity"]
    charged = fields.has_fields(design)
    spheres = {"radius": radius, "density": design["density"]}
    return Scene(
        name="agglomeration",
        particles=Cloud(
            number=grains, mean_velocity=MEAN_VELOCITY, deviation=(v, 0.1 * v, 0.1 * v),
            temperature=design["temperature"],
            **({"grains": fields.charged_classes(design, radius)} if charged else spheres),
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
            *(fields.forces(design) if charged else ()),
        ),
        domain=Box(low=(-HALF_SIDE,) * 3, high=(HALF_SIDE,) * 3, images=charged),
        stepper=fields.stepper(design, radius) if charged else Verlet(control=ApproachTime()),
        duration=duration,
        seed=seed,
    )  # fmt: skip


def scene_for(size: str, seed: int) -> Scene:
    """Return the flow of the best design of Z04."""
    return scene(BEST, seed, **size_named(size, SIZES).scene)


def fields_scene_for(size: str, seed: int) -> Scene:
    """Return the same flow with charges and fields."""
    return scene({**BEST, **fields.SHOWN}, seed, **size_named(size, SIZES).scene)
