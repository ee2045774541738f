"""Cheap scenes with closed forms: an oscillator and freely flying grains."""

from __future__ import annotations

import numpy as np

from tests.scenes import scene
from tisim import Box, Cloud, Scene, steppers
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement, kinetic_energy
from tisim.components.serialization import load
from tisim.effects import Tether
from tisim.steppers import FixedStep, Stepper, Verlet

RATE, SPEED, DURATION, STEP = 3.0, 1.0, 2.0, 0.001
"""sqrt(k/m) (1/s), initial speed (m/s), duration (s) and time step (s) of the oscillator."""


def oscillator(dt=STEP):
    """A tethered particle of 2 kg with an initial velocity."""
    tether = Tether(stiffness=(2.0 * RATE**2,) * 3)
    more = {"mass": 2.0, "stepper": Verlet(control=FixedStep(dt=dt)), "duration": DURATION}
    return scene([[0.0, 0.0, 0.0]], [[SPEED, 0.0, 0.0]], (tether,), **more)


def place(result):
    """The displacement of the oscillator in closed form, m."""
    return np.array([[SPEED / RATE * np.sin(RATE * result.time), 0.0, 0.0]])


KNOWN, UNKNOWN = Quantity("known", displacement, place), Quantity("unknown", displacement)
"""The displacement, compared with the closed form and with a reference run."""

GRAINS, GRAIN, MEAN, DEVIATION = 5, 0.25, 2.0, 3.0
"""Number of grains, mass (kg), mean velocity and its standard deviation along x (m/s) of a drifting cloud."""


def drift(seed=0):
    """Grains with random velocities that fly freely through a box."""
    radius = 0.01
    return Scene(
        particles=Cloud(
            number=GRAINS, radius=radius, density=GRAIN / (4 / 3 * np.pi * radius**3),
            mean_velocity=(MEAN, 0.0, 0.0), deviation=(DEVIATION, 0.0, 0.0),
        ),
        domain=Box(low=(0.0,) * 3, high=(1.0,) * 3),
        stepper=Verlet(control=FixedStep(dt=0.05)),
        duration=0.2,
        seed=seed,
    )  # fmt: skip


def energy(result=None):
    """Expected kinetic energy of the drifting cloud, J: <v^2> = mean^2 + deviation^2 / 3."""
    return 0.5 * GRAINS * GRAIN * (MEAN**2 + DEVIATION**2 / 3)


ENERGY = Quantity("kinetic energy", kinetic_energy, energy, random=True)


def only(patch, *kinds):
    """Restrict the alternatives of a scene's own stepper to these kinds, as each of them is compiled."""
    load(steppers)
    for kind in Stepper.known().values():
        if kind not in kinds:
            patch.setattr(kind, "alternatives", classmethod(lambda cls, effects, dt: ()))
