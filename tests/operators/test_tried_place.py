"""Places that an insertion tries are compared with all particles, whatever block of memory they are in."""

import numpy as np
import pytest

from tests.scenes import scene
from tisim import GrainClass, Simulation
from tisim.operators import InsertionByFraction, tried_place
from tisim.packing import EqualSizes

SIDE, RADIUS, BED, ADDED = 1.0, 0.1, 30, 10
"""m, m; grains that lie in the box, and those that are put between them."""


def lattice(rng):
    """Places of grains 0.3 m apart, of 27 in the box, in any order, and of others outside of it."""
    axis = 0.2 + 0.3 * np.arange(3)
    inside = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return rng.permutation(np.concatenate([inside, inside[:3] + np.array([0.0, 0.0, 9.0])]))


@pytest.mark.long
def test_grains_are_put_where_none_of_any_block_is(rng, monkeypatch):
    """In a box that is full but for a few gaps, where nearly each place that is tried is taken."""
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
