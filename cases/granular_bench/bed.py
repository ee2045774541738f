"""A bed: stiff grains fall into a cup and come to rest; ``tisim cost`` softens the grains.

Its measured quantities are the density of the bed, the load on the side of the cup, which depends on the
friction model, and the largest overlap of grains.
"""

from __future__ import annotations

import numpy as np
from scipy.constants import g as STANDARD_GRAVITY

from tisim import Result, Scene
from tisim.cases.granular_bench.closed_forms import hertz_duration, reduced
from tisim.cases.granular_bench.scene import (
    DENSITY,
    DIAMETER,
    LAW,
    ORIGIN,
    POISSON,
    grain_material,
    grains,
)
from tisim.components.accuracy_parameter import three_digits
from tisim.effects import Gravity, Walls
from tisim.geometry import CylindricalSurface, Plane
from tisim.steppers import FixedStep, Verlet

STIFF = 2e8
"""Young's modulus, Pa; glass has 5e10."""
GRAINS = {"friction": 0.5, "rolling_friction": 0.1, "restitution": 0.5}
"""The other properties of its grains."""
IMPACT = 0.5
"""Speed, m/s, of the impact whose duration sets the step: the speed of a fall from 13 mm."""
SPARSE = 0.2
"""Fraction of the space that is filled by grains at the start, before they fall."""
STEPS_OF_IMPACT = 20.0
"""Number of steps in that duration."""
MASS = DENSITY * np.pi / 6 * DIAMETER**3
"""Mass of a grain of the mean size, kg."""


def impact_time(young: float) -> float:
    """Return the duration of an elastic impact of two mean grains of a Young's modulus (Pa) at IMPACT, s."""
    modulus = young / (2 * (1 - POISSON**2))
    return float(hertz_duration(IMPACT, DIAMETER / 4, reduced(MASS, MASS), modulus))


def linear_stiffness(young: float) -> float:
    """Return the stiffness (N/m) of a linear spring with the same duration of impact."""
    return reduced(MASS, MASS) * (np.pi / impact_time(young)) ** 2


def bed(
    seed: int = 0,
    number: int = 120,
    cup: float = 2.5,
    duration: float = 0.2,
    young: float = STIFF,
    parts: float = STEPS_OF_IMPACT,
) -> Scene:
    """Return the scene of a bed.

    number : of grains. cup : its radius, in diameters of a grain. duration : s. young : Pa.
    parts : number of steps in the duration of an impact.
    """
    radius, height = cup * DIAMETER, number * DIAMETER / (6 * SPARSE * cup**2)
    material = grain_material(GRAINS, young)
    return Scene(
        name="granular_bench",
        particles=grains(number, radius, height),
        # With a stiffness too, so that Hooke's law can be compared with Hertz's.
        materials={"grain": material.model_copy(update={"stiffness": three_digits(linear_stiffness(young))})},
        effects=(
            LAW,
            Walls(name="floor", planes=[Plane(point=ORIGIN, normal=(0.0, 0.0, 1.0))]),
            Walls(
                name="side",
                cylinders=[CylindricalSurface(start=ORIGIN, end=(0.0, 0.0, 1.2 * height), radius=radius)],
            ),
            Gravity(),
        ),
        stepper=Verlet(control=FixedStep(dt=three_digits(impact_time(young) / parts))),
        duration=duration,
        seed=seed,
    )


def side_load(result: Result) -> float:
    """Return the outward force of the grains on the side of the cup at the end, divided by their weight."""
    state = result.state
    outward = state["position"][:, :2] / np.linalg.norm(state["position"][:, :2], axis=1, keepdims=True)
    push = -float((state["side_loads"][:, :2] * outward).sum())
    return push / (float(state["mass"].sum()) * STANDARD_GRAVITY)


def centre_height(result: Result) -> float:
    """Return the height of the centre of mass at the end, m; it measures the density of the bed."""
    return float(np.average(result.state["position"][:, 2], weights=result.state["mass"]))
