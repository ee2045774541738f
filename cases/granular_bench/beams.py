"""A row of cemented spheres, held at one end and loaded at the other: a beam that bends and breaks."""

import numpy as np

from tisim import Particles, Scene
from tisim.cases.granular_bench.closed_forms import beam_deflection
from tisim.effects import Lorentz, ParallelBond
from tisim.sources import ElectricField
from tisim.steppers import FixedStep, Verlet

BEAD_RADIUS, BEAD_YOUNG, RATIO, STRENGTH, SHEAR_STRENGTH, BEAM_WIDTH = 0.01, 1e8, 2.0, 1e6, 8e5, 0.8
"""Radius of the spheres, m. Of the cement: Young's modulus, Pa, ratio of normal to shear stiffness, tensile
and shear strength, Pa, and its radius over the radius of the spheres."""
BEAM_SIDE = 2 * BEAD_RADIUS
CEMENT = BEAM_WIDTH * BEAD_RADIUS
"""The radius of the cement, m."""
AREA, SECOND = np.pi * CEMENT**2, np.pi * CEMENT**4 / 4
SPHERES = 6
"""Number of spheres in addition to the one that is held."""
LOAD = 0.25
"""Load, N."""
HELD_MASS, BEAD_MASS, DURATION = 1e9, 1e-2, 0.4
"""Mass of the held sphere and of the others, kg; duration, s."""


def beam(load: float, spheres: int = SPHERES, rises: bool = False) -> Scene:
    """Return a row of spheres along x with a load along y (N) on the last one.

    The load is constant, or rises slowly to this value. It is the force of an electric field on the charge of
    the last sphere.
    """
    place = BEAM_SIDE * np.arange(spheres + 1)[:, None] * [1.0, 0.0, 0.0]
    mass, charge = np.full(spheres + 1, BEAD_MASS), np.zeros(spheres + 1)
    mass[0], charge[-1] = HELD_MASS, 1.0
    steady, slow = (0.0, load) if rises else (load, 0.0)
    return Scene(
        name="granular_bench",
        particles=Particles(
            position=place, velocity=0 * place, radius=BEAD_RADIUS, mass=mass,
            quantities={"spin": 0 * place, "charge": charge},
        ),
        effects=(
            ParallelBond(
                young=BEAD_YOUNG, stiffness_ratio=RATIO, radius_ratio=BEAM_WIDTH, tensile_strength=STRENGTH,
                shear_strength=SHEAR_STRENGTH, gap=1e-4 * BEAD_RADIUS, damping_ratio=5.0,
            ),
            ElectricField(
                constant=(0.0, steady, 0.0), amplitude=(0.0, slow, 0.0),
                omega=(0.0, np.pi / 2 / DURATION, 0.0),
            ),
            Lorentz(),
        ),
        stepper=Verlet(control=FixedStep(dt=1e-6)),
        duration=DURATION,
    )  # fmt: skip


def bends(load: float, spheres: int = SPHERES) -> tuple[float, float]:
    """Return the deflection (m) of the end of an Euler-Bernoulli beam, and of a row of spheres.

    The row bends only between its spheres, by 1/(4 n^2) less, and shears in each bond.
    """
    smooth = beam_deflection(load, spheres * BEAM_SIDE, BEAD_YOUNG, SECOND)
    soft = BEAD_YOUNG / BEAM_SIDE / RATIO
    return smooth, smooth * (1 - 1 / (4 * spheres**2)) + spheres * load / (soft * AREA)


def breaking_load(spheres: int = SPHERES) -> float:
    """Return the load (N) at which the first bond breaks: sigma_c = P l r / I, l from the middle of that
    bond."""
    return float(STRENGTH * SECOND / (CEMENT * (spheres - 0.5) * BEAM_SIDE))
