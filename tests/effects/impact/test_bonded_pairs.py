"""A bonded pair at relative rest is in contact, not colliding: one impact, for any motion of the pair."""

import numpy as np
import pytest

from tests.scenes import HEAT_CAPACITY, momentum, roundoff, scene, simulate
from tisim import Box
from tisim.effects import Friction, Gravity, Heating, Impact, Reaction
from tisim.operators import Fragmentation

PAIRS = 24
ALPHA, AREA = 10.0, 0.3
SIDE = 0.2
"""J/m^2, heat of reaction; contact area of an elastic touch over the area of a bond; m."""


def pairs(rng, boost=0.0, gravity=0.0, breaks=False, across=False):
    """Pairs that bond in the first step, at 1 to 100 m/s and any angle, and then stay in contact for 200
    steps."""
    laws = (
        Impact(hardness=1e-3, initial_area=AREA),
        Friction(coefficient=0.1),
        Heating(heat_capacity=HEAT_CAPACITY),
        Reaction(energy_density=ALPHA),
        Fragmentation(surface_energy=1e-3 if breaks else 1e16),
        Gravity(acceleration=(0.0, 0.0, -gravity)),
    )
    scenes = []
    for _ in range(PAIRS):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        radius = 1e-3 * np.array([1.0, rng.uniform(2, 4) if breaks else 4.0 ** rng.uniform()])
        place = np.array([SIDE / 2 - 1e-5, 0, 0]) if across else rng.uniform(-SIDE / 4, SIDE / 4, 3)
        push = rng.normal(size=3)
        push *= np.sign(push @ normal) * 10.0 ** rng.uniform(0, 2)
        touch = 1 - 1e4 * roundoff()
        centres = place + radius[:, None] * touch * np.array([-normal, normal])
        scenes.append(
            scene(
                (centres + SIDE / 2) % SIDE - SIDE / 2,
                rng.normal(size=3) * boost + np.array([push, -rng.uniform() * push]),
                laws,
                radius=radius,
                dt=1e-7,
                steps=200,
                quantities={"temperature": 300.0},
                domain=Box(low=(-SIDE / 2,) * 3, high=(SIDE / 2,) * 3),
            )
        )
    return scenes


LOADS = {
    "at rest": {},
    "fast": {"boost": 1.0},
    "faster": {"boost": 1e3},
    "falling": {"boost": 1.0, "gravity": 1e6},
    "across a face": {"boost": 1.0, "across": True},
    "breaking": {"boost": 1.0, "breaks": True},
}


def run(load):
    rng = np.random.Generator(np.random.Philox(20))
    return simulate(pairs(rng, **LOADS[load]), worlds=PAIRS, capacity=64)


def check(results, breaks, rounding):
    for result in results:
        assert result.status.ok, result.status.reason
        assert result.work["impacts"] == 1
        assert (result.work["bonds"], result.work["fractures"] > 0) == (1 - breaks, breaks)
        once = 2 * ALPHA * np.pi * result.start["radius"].min() ** 2
        assert result.state["reaction_heat"].sum() == pytest.approx(once, rel=rounding)


@pytest.mark.long
@pytest.mark.parametrize(
    "load", [pytest.param(load, marks=pytest.mark.slow if load == "breaking" else ()) for load in LOADS]
)
def test_a_bonded_pair_collides_once(load):
    results = run(load)
    check(results, load == "breaking", 1e-13)
    for result in results:
        speed = np.ptp(result.state["velocity"], axis=0).max()
        scale = np.abs(result.start["mass"][:, None] * result.start["velocity"]).sum()
        assert speed <= 1e-15 * np.abs(result.state["velocity"]).max() * (1 + 200 * (load == "falling"))
        if load != "falling":
            gain = momentum(result.state) - momentum(result.start)
            np.testing.assert_allclose(gain, 0, rtol=0, atol=1e-15 * scale)


def summaries():
    """Impacts, and heat over the heat of one impact, for every load. Shape (loads, pairs, 2)."""
    return [
        [
            [
                r.work["impacts"],
                r.state["reaction_heat"].sum() / (2 * ALPHA * np.pi * r.start["radius"].min() ** 2),
            ]
            for r in run(load)
        ]
        for load in LOADS
    ]


@pytest.mark.slow
def test_a_bonded_pair_collides_once_in_single_precision(single):
    counts = np.array(single("effects.impact.test_bonded_pairs", "summaries"))
    assert (counts[..., 0] == 1).all()
    np.testing.assert_allclose(counts[..., 1], 1, rtol=1e-5)
