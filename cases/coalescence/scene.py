"""A cloud of magnetised grains collapses and becomes a rubble pile (L21 section 4.2).

Grains start on a lattice in a ball around a seed particle. They have thermal velocities, spins, a common
rotation, and moments in random directions. Gravity, DMT cohesion and dipole forces hold the pile together.

Departures from L21: fewer grains, in a scaled copy of L21's cloud; a smaller seed; dipoles over all pairs,
without a cut-off; and a slower rotation, because a cloud with the printed rotation flies apart.

The collapse time of a cloud depends only on its density, so a cloud of fewer grains on the same lattice
collapses in the same time, but with weaker gravity. A cloud whose radius is s times as large is a scaled copy
if all velocities are multiplied by s and all stresses by s^2: Young's modulus, the stresses of cohesion and
magnetism, and the central pressure (L21 section 4.5). Magnetisations are then multiplied by s, and steps by
1/s. Only the number of grains across the cloud is not preserved.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.constants import Boltzmann

from tisim import Material, Particles, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.coalescence import published
from tisim.cases.common.two_spheres import hertz_duration, reduced, sphere_mass
from tisim.components.accuracy_parameter import three_digits
from tisim.effects import (
    DMT,
    DipoleDipole,
    Granular,
    HertzMaterial,
    MindlinForce,
    PermanentMoment,
    RestitutionDamping,
    RollingSDS,
    SelfGravity,
    TreeGravity,
    TruncatedDipoleDipole,
)
from tisim.effects.base import Effect
from tisim.steppers import FixedStep, Verlet

TITLE = "Magnetised grains coalesce into a rubble pile"

IMPACT = 0.02
"""Speed, m/s, of the impact whose duration sets the step: the speed of a fall onto L21's asteroid with grains
of 100 cm."""
STEPS_OF_IMPACT = 25.0
"""Number of steps in that duration."""
ROTATION = 5e-5
"""The angular velocity of the cloud, rad/s; the pile then turns at a third of the critical spin."""
DEFAULT: Mapping[str, Any] = {"number": 180, "seed_diameter": 2.0}
"""A cloud that a laptop can run; its seed has the mass of 8 of 180 grains, L21's seed that of 125 of 32
662."""
SMALL: Mapping[str, Any] = {"number": 60, "seed_diameter": 1.4}
"""A third of the grains, with the same mass ratio of the seed."""

LAW = Granular(
    normal=HertzMaterial(),
    damping=RestitutionDamping(),
    tangential=MindlinForce(),
    rolling=RollingSDS(),
    cohesion=DMT(),
)

SIZES = {
    "default": Size("180 grains of 100 cm, magnetised to 1190 A/m, in a scaled copy of L21's cloud", DEFAULT),
    "unmagnetised": Size("the same without magnetisation", {**DEFAULT, "magnetisation": 0.0}),
    "small": Size("60 grains, and a seed with the same share of the mass", SMALL),
    "l21": Size(
        "L21's 32,662 grains of 100 cm and its seed of 5 m, rotation as printed, gravity by a tree",
        {"rotation": published.ROTATIONS[1], "tree": True, "duration": published.DURATION},
    ),
    "l21_50cm": Size(
        "the same with grains of 50 cm",
        {
            "diameter": published.DIAMETERS[0], "rotation": published.ROTATIONS[1], "tree": True,
            "duration": published.DURATION,
        },
    ),
}  # fmt: skip


def lattice_ball(number: int, spacing: float, clear: float = 0.0) -> np.ndarray:
    """Return the ``number`` sites (m) of a simple cubic lattice nearest to its middle; shape (number, 3).

    Sites closer to the middle than ``clear`` (m) are left out.
    """
    half = math.ceil((3 * (number + 1) / (4 * math.pi)) ** (1 / 3) + clear / spacing) + 1
    sites = np.indices((2 * half + 1,) * 3).reshape(3, -1).T - half
    squares = (sites**2).sum(axis=1)
    sites = sites[spacing * np.sqrt(squares) >= clear]
    order = np.argsort((sites**2).sum(axis=1), kind="stable")
    return np.asarray(spacing * sites[order[:number]])


def scale_of(number: int, of: int = published.NUMBER) -> float:
    """Return the ratio of radii of a cloud of ``number`` grains and a cloud of ``of`` grains on the same
    lattice."""
    return (number / of) ** (1 / 3)


def thermal_speed(diameter: float, mass: np.ndarray) -> np.ndarray:
    """Return the standard deviation (m/s) of each velocity component for given masses (kg).

    The temperature is L21's for grains of a diameter (m).
    """
    return np.sqrt(Boltzmann * published.TEMPERATURE * diameter**3 / mass)


def grain_cloud(
    number: int, diameter: float, spacing: float, scale: float, seed_diameter: float, rotation: float,
    seed: int,
) -> Particles:  # fmt: skip
    """Return a cloud, the seed particle first; there is no seed if its diameter is 0. The total momentum is
    0."""
    clear = (seed_diameter + diameter) / 2 if seed_diameter else 0.0
    position = lattice_ball(number, spacing, clear)
    radius = np.full(number, diameter / 2)
    if seed_diameter:
        position = np.vstack([np.zeros(3), position])
        radius = np.append(seed_diameter / 2, radius)
    mass = sphere_mass(1.0, published.DENSITY) * (2 * radius) ** 3
    draw = np.random.default_rng(seed)
    velocity = scale * thermal_speed(diameter, mass)[:, None] * draw.normal(size=position.shape)
    spin = scale * draw.normal(published.SPIN_MEAN, published.SPIN_DEVIATION, position.shape)
    velocity += np.cross([0.0, 0.0, rotation], position)
    velocity -= np.average(velocity, axis=0, weights=mass)
    return Particles(
        position=position, velocity=velocity, radius=radius, mass=mass, quantities={"spin": spin}
    )


def young(scale: float, softened: float) -> float:
    """Return Young's modulus (Pa) of the grains in a cloud of a ``scale``, divided by ``softened``."""
    return scale * scale * published.YOUNG / softened


def rubble(scale: float, softened: float = 1.0) -> Material:
    """Return the material of the grains in a cloud of a ``scale``; stresses are multiplied by its square.

    Young's modulus is also divided by ``softened``.
    """
    stress = scale * scale
    return Material(
        young=young(scale, softened),
        poisson=published.POISSON,
        restitution=published.RESTITUTION,
        friction=published.FRICTION,
        rolling_friction=published.ROLLING_FRICTION,
        rolling_stiffness=stress * published.ROLLING_STIFFNESS,
        rolling_damping=scale * published.ROLLING_DAMPING,
        surface_energy=stress * published.SURFACE_ENERGY,
    )


def step(diameter: float, scale: float, softened: float = 1.0, parts: float = STEPS_OF_IMPACT) -> float:
    """Return a step (s): the duration of an impact of two grains at scale * IMPACT, divided by ``parts``."""
    mass = sphere_mass(diameter, published.DENSITY)
    modulus = young(scale, softened) / (2 * (1 - published.POISSON**2))
    lasts = hertz_duration(scale * IMPACT, diameter / 4, reduced(mass, mass), modulus)
    return three_digits(float(lasts) / parts)


def rubble_laws(magnetisation: float, tree: bool) -> tuple[Effect, ...]:
    """Return the interactions of grains with a magnetisation (A/m).

    With ``tree``, gravity is computed by a tree and dipoles have L21's cut-off. Without it, both are sums
    over all pairs, which is no slower for few grains.
    """
    sums: tuple[Effect, ...]
    if tree:
        sums = (TreeGravity(), TruncatedDipoleDipole(cutoff=published.CUTOFF))
    else:
        sums = (SelfGravity(), DipoleDipole())
    return (LAW, PermanentMoment(magnetisation=magnetisation), *sums)


def scene(
    number: int = published.NUMBER,
    diameter: float = published.DIAMETERS[1],
    magnetisation: float = published.MAGNETISATIONS[-1],
    rotation: float = ROTATION,
    seed_diameter: float = published.SEED_DIAMETER,
    spacing: float = published.SPACING,
    of: int = published.NUMBER,
    duration: float = 10_000.0,
    tree: bool = False,
    softened: float = 1.0,
    parts: float = STEPS_OF_IMPACT,
    seed: int = 0,
    name: str = "coalescence",
) -> Scene:
    """Return a cloud that collapses.

    number : of grains, without the seed particle. diameter : of the grains, m.
    magnetisation : of the grains in L21's cloud, A/m. rotation : of the cloud, rad/s.
    seed_diameter : m; 0 for no seed particle. spacing : of the lattice, m.
    of : number of grains in the cloud of L21 of which this is a copy. duration : s.
    tree : whether gravity is computed by a tree and dipoles have L21's cut-off; otherwise both are over all
    pairs.
    softened : divisor of Young's modulus. parts : number of steps in the duration of an impact.
    """
    scale = scale_of(number, of)
    return Scene(
        name=name,
        particles=grain_cloud(number, diameter, spacing, scale, seed_diameter, rotation, seed),
        materials={"rubble": rubble(scale, softened)},
        effects=rubble_laws(scale * magnetisation, tree),
        stepper=Verlet(control=FixedStep(dt=step(diameter, scale, softened, parts))),
        duration=duration,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the cloud of a size."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
