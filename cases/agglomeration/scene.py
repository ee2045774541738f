"""Agglomeration in thermochemically reacting granular flow (Z04).

Z04 is T. I. Zohdi, A computational framework for agglomeration in thermochemically reacting granular flows,
Proc. R. Soc. Lond. A 460 (2004) 3421-3445. Equal grains with random velocities collide, heat, soften, react,
bond and break.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tisim import Box, Cloud, Scene
from tisim.cases.agglomeration import fields
from tisim.cases.agglomeration.published_strings import designs
from tisim.cases.case import Size, size_named
from tisim.effects import Agglomeration, DeformationWork, Friction, Heating, Impact, Reaction, Softening
from tisim.operators import Cooling, Fragmentation
from tisim.steppers import ApproachTime, Verlet

TITLE = "Agglomeration in thermochemically reacting granular flow"

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
