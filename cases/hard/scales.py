"""Scales from nanometres to kilometres.

The same motion in units of its size, and times that do not drift in a million steps.
"""

from fractions import Fraction

import numpy as np

from tisim import Scene, Simulation
from tisim.cases.hard.granular import HERTZ_MINDLIN_LAW, GrainLaw
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import ends, given, verlet
from tisim.effects import Tether

GROWS = {
    "stiffness": 1, "rolling_stiffness": 1, "rolling_damping": 2, "twisting_friction": 1,
    "twisting_stiffness": 3, "twisting_damping": 4, "surface_energy": 1, "viscous_time": 1, "damping": 2,
    "surface_tension": 1, "volume": 3,
}  # fmt: skip
"""Exponent of the length with which each property scales, with velocities and moduli fixed, for the same
motion."""


def scaled(material, size):
    """Return a material for lengths that are ``size`` times as large."""
    return {key: value * size ** GROWS.get(key, 0) for key, value in material.items()}


def pairs_of_size(law, size):
    """Return 16 pairs of spinning grains of two materials that meet obliquely, at a length scale (m)."""
    draw, n = np.random.Generator(np.random.Philox(20040101)), 16
    radius, aside = draw.uniform(0.5, 1.4, (n, 2)), draw.uniform(0, 0.9, n)
    normal = np.stack([0 * aside, aside, np.sqrt(1 - aside**2)], axis=1)
    place, velocity = np.zeros((n, 2, 3)), np.zeros((n, 2, 3))
    place[:, :, 0] = 8.0 * (np.arange(n) - n / 2)[:, None]
    place[:, 1] += 1.001 * radius.sum(axis=1)[:, None] * normal
    velocity[:, 0, 2] = 1.0
    spin, radius = draw.normal(size=(2 * n, 3)), radius.ravel()
    return law.scene(
        size * place.reshape(-1, 3), velocity.reshape(-1, 3), spin / size,
        radius=size * radius, mass=8e3 * (size * radius) ** 3,
        first=scaled(law.lossy[0], size), second=scaled(law.lossy[1], size), material=np.arange(2 * n) % 2,
        dt=1e-4 * size, steps=12_000,
    )  # fmt: skip


@hard_case(
    "Spinning grains of 10 nm, 1 m and 1 km collide obliquely; masses span 32 decades.",
    Criterion("velocities, difference from those at 1 m, m/s of 1", 1e-9),
    Criterion("spins times the size, difference, m/s", 3e-9),
    Criterion("largest change of a velocity, m/s", least=0.3),
)
def impacts_from_nanometres_to_kilometres(law: GrainLaw = HERTZ_MINDLIN_LAW):
    """law : the law of contact."""
    sizes = (2.0**-27, 1.0, 2.0**10)
    scenes = [pairs_of_size(law, size) for size in sizes]
    nano, usual, huge = ends(scenes)
    others = ((sizes[0], nano), (sizes[2], huge))
    return (
        max(np.abs(state["velocity"] - usual["velocity"]).max() for _, state in others),
        max(np.abs(size * state["spin"] - usual["spin"]).max() for size, state in others),
        np.abs(usual["velocity"] - scenes[1].start()["velocity"]).max(),
    )


@hard_case(
    "A million steps of 0.1 s, which is no binary fraction: plain summation loses 1e-7 s and more.",
    Criterion("time, error in units of its last bit", 1),
    Criterion("steps missing", 0, 0),
    Criterion("error of plain summation, s", least=1e-7),
)
def time_of_a_million_steps():
    number = 10**6
    scene = Scene(
        particles=given((0, 0, 0), (0, 0, 0), 1e-3, 1.0, anchor=np.zeros((1, 3))),
        effects=(Tether(stiffness=(0.0, 0.0, 0.0)),),
        stepper=verlet(0.1),
        duration=1e6,
    )
    time, steps = after_steps(scene, number)
    error = abs(Fraction(time) - number * Fraction(0.1)) / Fraction(np.spacing(time))
    plain = abs(np.cumsum(np.full(number, 0.1))[-1] - float(number * Fraction(0.1)))
    return float(error), abs(number - steps), plain


def after_steps(scene, number):
    """Return the time (s) after a number of steps, and the steps that were made."""
    simulation = Simulation(scene)
    try:
        simulation.load([scene])
        simulation.run(steps=number)
        (result,) = simulation.results()
        return result.time, result.work["steps"]
    finally:
        simulation.close()
