"""Ewald sums of dipoles: forces, torques and moments in periodic boxes, beside sums in NumPy."""

import numpy as np

from tests.effects.contact.loads import close, loads
from tests.effects.magnetic.ewald import EwaldSum
from tests.scenes import scene
from tisim import Box
from tisim.effects import EwaldDipoleDipole, PermanentMoment

SIDES = np.array([4.0, 5.0, 4.4])
"""m."""
WAVES = (10, 13, 11)


def box(sides=SIDES, periodic=(True, True, True)):
    return Box(low=(-1.0, 0.0, 0.5), high=tuple(np.array([-1.0, 0.0, 0.5]) + sides), periodic=periodic)


def magnets(rng, law, domain, n=16, radius=0.1):
    """Permanent magnets at random."""
    low, high = domain.bounds()
    return scene(
        rng.uniform(low, high, (n, 3)),
        np.zeros((n, 3)),
        (PermanentMoment(), law),
        radius=radius,
        mass=1.0,
        quantities={"moment": 1e3 * rng.normal(size=(n, 3))},
        domain=domain,
    )


def test_forces_and_torques_are_those_in_numpy(rng):
    """In boxes, and with settings, of their own in each world."""
    scenes = []
    for k in range(4):
        law = EwaldDipoleDipole(
            cutoff=float(rng.uniform(1.4, 1.65)),
            accuracy=10.0 ** -rng.uniform(2, 3),
            waves=WAVES,
            demagnetising_factors=(0.0, 0.0, 0.0) if k == 0 else (0.2, 0.3, 0.4),
        )
        scenes.append(magnets(rng, law, box(SIDES * rng.uniform(0.9, 1.0, 3))))
    for one, state in zip(scenes, loads(scenes), strict=True):
        expected = EwaldSum(one.effects[1], one.domain, state["position"], state["moment"])
        close(state["force"], expected.force(), 1e-11)
        close(state["torque"], np.cross(state["moment"], expected.field()), 1e-11)
        assert np.linalg.norm(state["force"].sum(axis=0)) < 1e-12 * np.abs(state["force"]).sum()
