"""A random cloud of grains under all laws of Z04: they collide, heat up, soften, react, merge and break."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tisim import Box, Particles, Scene
from tisim.effects import (
    Agglomeration,
    DeformationWork,
    Effect,
    Friction,
    Heating,
    Impact,
    Reaction,
    Softening,
)
from tisim.operators import Cooling, Fragmentation
from tisim.steppers import Stepper, Verlet

STONE = 2000.0
"""Density of the grains, kg/m^3."""
STONE_RADIUS = 1e-3
"""Radius of a grain, m."""
STONE_MASS = STONE * 4 / 3 * np.pi * STONE_RADIUS**3
"""Mass of a grain of this density and radius, kg."""
STONE_HEAT_CAPACITY = 500.0
"""Heat capacity of the grains, J/(kg K)."""
BONDING_HARDNESS = 1.0
"""A hardness at which all grains bond, Pa."""


def laws(
    hardness: float = BONDING_HARDNESS,
    surface_energy: float = 1e16,
    grain_mass: float = STONE_MASS,
    threshold: float = 2 ** (-1 / 3),
    activation_energy: float = 0.0,
    reaction: float = 1e3,
) -> tuple[Effect, ...]:
    """Return all impact laws of Z04; by default the hardness does not depend on temperature."""
    return (
        Impact(hardness=hardness),
        Friction(coefficient=0.1),
        Heating(heat_capacity=STONE_HEAT_CAPACITY),
        DeformationWork(),
        Softening(activation_energy=activation_energy),
        Reaction(energy_density=reaction),
        Fragmentation(surface_energy=surface_energy, grain_mass=grain_mass, threshold=threshold),
        Agglomeration(),
    )


def flow(
    seed: int = 0,
    grains: int = 100,
    hardness: float = 3e5,
    surface_energy: float = 1e16,
    grain_mass: float = STONE_MASS,
    threshold: float = 0.5,
    duration: float = 1e-3,
    side: float = 0.02,
    images: bool = False,
    stepper: Stepper | None = None,
    sizes: float = 1.0,
) -> Scene:
    """Return a random cloud under all of Z04's physics. sizes : the largest radius over the smallest."""
    draw = np.random.Generator(np.random.Philox(seed))
    radius = STONE_RADIUS * sizes ** -draw.uniform(0, 1, grains)
    return Scene(
        particles=Particles(
            position=draw.uniform(-side / 2, side / 2, (grains, 3)),
            velocity=np.array([100.0, 10, 10]) + draw.uniform(-1, 1, (grains, 3)) * [150.0, 15, 15],
            radius=radius,
            density=STONE,
            quantities={"temperature": draw.uniform(200, 600, grains)},
        ),
        effects=(*laws(hardness, surface_energy, grain_mass, threshold, 300.0, 2e4), Cooling()),
        domain=Box(low=(-side / 2,) * 3, high=(side / 2,) * 3, images=images),
        stepper=stepper or Verlet(),
        duration=duration,
        seed=seed,
    )


def energy(state: Mapping[str, np.ndarray], heat_capacity: float = STONE_HEAT_CAPACITY) -> float:
    """Return the energy balance (J): kinetic energy, heat, and losses to cooling and new surface, less
    supplied energy."""
    kinetic = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
    heat = heat_capacity * (state["mass"] * state["temperature"]).sum()
    spent = sum(state[name].sum() for name in ("cooling_loss", "fracture_energy") if name in state)
    supplied = sum(state[name].sum() for name in ("reaction_heat", "deformation_work") if name in state)
    return kinetic + heat + spent - supplied
