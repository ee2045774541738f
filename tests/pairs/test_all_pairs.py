"""Sums over all pairs in tiles of particles: the same bits for any number and order of worlds."""

import numpy as np
import pytest
from scipy.constants import g

from tests.scenes import fixed, scene, simulate
from tisim import Box
from tisim.effects import Gravity, NearField
from tisim.engine import compiled_worlds
from tisim.pairs.pair_sum import TILE
from tisim.program.team import Teams

NUMBERS = (1, TILE - 1, TILE, TILE + 1, 2 * TILE + 6)
CAPACITY = max(NUMBERS)
"""Not a multiple of TILE, so the last tile overlaps the previous one."""
LAW = NearField(alpha1=0.5, alpha2=0.1, strength="mass")


def cloud(n, seed=0, **more):
    rng = np.random.default_rng(seed)
    position = rng.uniform(0, 1, (n, 3))
    return scene(
        more.pop("position", position), np.zeros((n, 3)), (LAW, Gravity()), mass=rng.uniform(1, 2, n),
        radius=1e-3, stepper=fixed(1e-4), duration=3e-4, domain=Box(low=(0, 0, 0), high=(1, 1, 1)), **more,
    )  # fmt: skip


def forces(state):
    """Forces from NumPy with nearest images, each sum in the order of the other particles."""
    d = state["position"][None] - state["position"][:, None]
    d -= np.round(d)
    distance = np.linalg.norm(d, axis=2) + np.eye(len(d))
    size = state["mass"][:, None] * state["mass"] * (0.5 / distance - 0.1 / distance**2) / distance
    return (size[..., None] * d).sum(axis=1) - state["mass"][:, None] * [0, 0, g]


@pytest.fixture(scope="module")
def usual():
    """Clouds of all sizes in one batch, after three steps."""
    return simulate([cloud(n, n) for n in NUMBERS], worlds=len(NUMBERS), capacity=CAPACITY, schedule="world")


def test_forces_in_every_tile_are_their_numpy_reference(usual):
    for result in usual:
        expected = forces(result.state)
        np.testing.assert_allclose(
            result.state["force"], expected, rtol=0, atol=1e-12 * max(np.abs(expected).max(), 1.0)
        )


@pytest.mark.long
@pytest.mark.parametrize(
    ("schedule", "capacity", "numbers"),
    [
        ("particle", CAPACITY, NUMBERS),
        ("team", CAPACITY, NUMBERS),
        pytest.param("world", 4 * TILE, NUMBERS, marks=pytest.mark.slow),
        ("world", TILE - 1, NUMBERS[:2]),
    ],
    ids=["a launch per phase", "a team", "more capacity", "too little capacity for a tile"],
)
def test_the_same_bits(usual, monkeypatch, schedule, capacity, numbers):
    """For any capacity, with and without tiles, and on all schedules, including one team for all worlds."""
    if schedule == "team":
        monkeypatch.setattr(compiled_worlds, "Teams", lambda *of: Teams(*of[:-1], number=1))
    again = simulate(
        [cloud(n, n) for n in numbers], worlds=len(NUMBERS), capacity=capacity, schedule=schedule
    )
    for a, b in zip(usual, again, strict=False):
        for name, values in a.state.items():
            np.testing.assert_array_equal(values, b.state[name], err_msg=name)


@pytest.mark.parametrize("pair", [(3, 5), (TILE - 1, TILE), (5, CAPACITY - 1)])
def test_coincident_particles_are_named_and_affect_no_other_world(usual, pair):
    """Both if they share a tile and if they do not."""
    position = np.random.default_rng(1).uniform(0, 1, (CAPACITY, 3))
    position[pair[1]] = position[pair[0]]
    scenes = [
        cloud(NUMBERS[0], NUMBERS[0]),
        cloud(CAPACITY, position=position),
        *(cloud(n, n) for n in NUMBERS[2:]),
    ]
    results = simulate(scenes, worlds=len(NUMBERS), capacity=CAPACITY, schedule="world")
    reason = results[1].status.reason
    assert not results[1].status.ok
    assert "near_field" in reason
    assert f"at particle {pair[0]}" in reason
    for at in (0, 2, 3, 4):
        np.testing.assert_array_equal(results[at].state["force"], usual[at].state["force"])
