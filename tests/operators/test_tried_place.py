"""Insertion trials are compared with all particles in all blocks of memory."""

import numpy as np
import pytest

from tests.scenes import scene
from tisim import GrainClass, Simulation
from tisim.operators import InsertionByFraction, tried_place
from tisim.packing import EqualSizes

SIDE, RADIUS, BED, ADDED = 1.0, 0.1, 30, 10
"""Side of the box and radius of the grains (m), and numbers of initial and inserted grains."""


def lattice(rng):
    """Positions of grains 0.3 m apart, in random order: 27 in the box and others outside it."""
    axis = 0.2 + 0.3 * np.arange(3)
    inside = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return rng.permutation(np.concatenate([inside, inside[:3] + np.array([0.0, 0.0, 9.0])]))


@pytest.mark.long
def test_inserted_grains_overlap_no_grain_of_any_block(rng, monkeypatch):
    """The box is full except for a few gaps, so nearly every insertion trial fails."""
    monkeypatch.setattr(tried_place, "COMPARED_TOGETHER", {"cpu": 8})
    place = lattice(rng)
    fill = InsertionByFraction(
        low=(0, 0, 0), high=(SIDE,) * 3, fraction=0.5, interval=9.0, number=ADDED, tries=20_000,
        grains=[GrainClass(sizes=EqualSizes(radius=RADIUS), density=1.0)],
    )  # fmt: skip
    made = scene(place, 0 * place, (fill,), radius=RADIUS, density=1.0, dt=1e-3, steps=3)
    simulation = Simulation(made)
    simulation.load([made])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    where = result.state["position"]
    assert len(where) == BED + ADDED
    apart = np.linalg.norm(where[:, None] - where, axis=2) + 9.0 * np.eye(len(where))
    assert apart.min() >= 2 * RADIUS * (1 - 1e-6)
