"""Single precision.

Numbers with 24 bits, far from the origin and at the scale of colloids.
"""

import numpy as np
from scipy.constants import Boltzmann, mu_0

from tisim import Scene
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.moments import magnetised
from tisim.cases.hard.runs import by_id, ends, given, single_precision, solved, verlet
from tisim.effects import Contact, DipoleDipole, Mie, MutualLangevinMoment, NearField
from tisim.sources import MagneticField


@hard_case(
    "Grains that touch 1 km from the origin, at which single-precision positions are 6e-5 m apart.",
    Criterion("momentum over the sum of its magnitudes", 3e-7),
    Criterion("force at the stored positions, error over the largest", 1e-5),
)
def far_from_the_origin():
    strength, radius, stiffness = 1e-3, 1e-2, 1e3
    places = [
        np.array([1e3, -1e3, 1e3]) + np.array([[0, 0, 0], [gap, 0, 0], [0, gap, 0]])
        for gap in (1e-4, 1e-3, 1e-2)
    ]
    with single_precision():
        states = ends([
            Scene(
                particles=given(place, np.zeros((3, 3)), radius, 1.0),
                effects=(NearField(alpha1=strength, alpha2=strength), Contact(stiffness=stiffness)),
                stepper=verlet(1e-9),
                duration=5e-8,
            )
            for place in places
        ])  # fmt: skip
    drift, error = [], []
    for place, state in zip(places, states, strict=True):
        velocity = state["velocity"].astype(float)
        there = place.astype(np.float32).astype(float)
        gap = there[None] - there[:, None]
        d = np.linalg.norm(gap, axis=2) + np.eye(3)
        push = stiffness * (1 - d / (2 * radius)) ** 2 * np.pi * (radius**2 - d**2 / 4)
        size = strength / d - strength / d**2 - push
        expected = (size[..., None] * gap / d[..., None]).sum(axis=1) * 5e-8
        drift.append(np.abs(velocity.sum(axis=0)).max() / np.abs(velocity).sum())
        error.append(np.abs(velocity - expected).max() / np.abs(expected).max())
    return max(drift), max(error)


def colloids():
    """Return forces (N) and moments (A m^2) of B16's largest and smallest particles in contact, and moments
    (over 1/mu_0) of a dense lattice, which converge to rounding although the tolerance is below it."""
    effects = (
        MagneticField(constant=(0.3, 0, 0.4)),
        MutualLangevinMoment(temperature=298.0),
        DipoleDipole(),
        Mie(epsilon=100 * Boltzmann * 298.0),
    )
    numbers = []
    for radius, moment in ((25e-9, 0.016e-16), (212e-9, 19.35e-16)):
        place = 1.9 * radius * np.array([[0, 0, 0], [0.6, 0, 0.8]])
        scene = Scene(
            particles=given(
                place, 0 * place, radius, 2000.0 * 4 / 3 * np.pi * radius**3, saturation_moment=moment,
                domain_moment=2e-19,
            ),
            effects=effects,
            stepper=verlet(1e-12),
            duration=1e-12,
        )  # fmt: skip
        (state,) = ends([scene])
        numbers += [state["force"].astype(float), state["moment"].astype(float)]
    draw = np.random.default_rng(0)
    lattice = 2.06 * np.argwhere(np.ones((4, 4, 4))) + 0.02 * draw.normal(size=(64, 3))
    (result,) = sound(solved([magnetised(lattice, relaxation=0.75, tolerance=1e-12)]))
    return [*numbers, mu_0 * by_id(result.state)["moment"].astype(float)]


@hard_case(
    "Colloids with moments of 1e-18 A m^2 and energies of 1e-19 J, and a dense lattice of mu_r = 1e6.",
    Criterion("forces and moments against double precision, over the largest", 2e-5),
)
def colloids_of_nanometres():
    fine = colloids()
    with single_precision():
        rough = colloids()
    return [
        max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip(rough, fine, strict=True))
    ]  # fmt: skip
