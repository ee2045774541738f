"""Agglomeration in thermochemically reacting granular flow (Z04), and its inverse problem.

Z04 is T. I. Zohdi, A computational framework for agglomeration in thermochemically reacting granular flows,
Proc. R. Soc. Lond. A 460 (2004) 3421-3445.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tisim import Box, Cloud, Result, Scene
from tisim.effects.friction import Friction
from tisim.effects.heating import DeformationWork, Heating
from tisim.effects.impact import Impact
from tisim.effects.reaction import Reaction
from tisim.effects.softening import Softening
from tisim.operators.agglomeration import Agglomeration
from tisim.operators.cooling import Cooling
from tisim.operators.fragmentation import Fragmentation

HALF_SIDE = 0.01
"""D, half the side of the control volume, m (Z04 section 8)."""
DURATION = 0.01
"""s (Z04 section 8)."""
MEAN_VELOCITY = (100.0, 10.0, 10.0)
"""m/s (Z04 section 7)."""

BEST = {
    "relative_velocity": 0.92344 * 200, "length_ratio": 0.79041, "density": 0.66527e4, "hardness": 0.26548e6,
    "heat_capacity": 0.89815 * 2000, "friction": 0.13456, "temperature": 0.50218e3,
    "activation_energy": 0.35241e3, "reaction": 0.17765e7, "surface_energy": 0.83685e16,
}  # fmt: skip


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
            Fragmentation(
                surface_energy=design["surface_energy"],
                grain_mass=design["density"] * 4 / 3 * np.pi * radius**3,
            ),
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
