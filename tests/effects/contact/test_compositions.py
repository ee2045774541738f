"""Composed contact laws against the NumPy reference, with two materials, between grains and at walls."""

import numpy as np
import pytest

from tests.effects.contact.compositions import LAWS, TWO, grains, heap, loaded
from tests.effects.contact.grains import reference, run
from tests.effects.contact.test_granular_impacts import couple_energies
from tests.scenes import by_id
from tisim.analysis.beds import contacts
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.report.contact_network import normal_forces

# Grains overlap deeply at the start here, on purpose.
pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning"),
]


EACH = [name if name == "jkr" else pytest.param(name, marks=pytest.mark.slow) for name in LAWS]
"""A composition takes seconds to compile."""


@pytest.mark.parametrize("name", EACH)
def test_steps_equal_the_reference(name, rng):
    """Every part of a law acts, stores history, sticks and slides; pairs of materials follow their rules, or
    a table."""
    made = [heap(name, rng), heap(name, rng, pairs=True)]
    for steps in (1, 100):
        for one, result in zip(made, run(made, steps=steps), strict=True):
            known, state = reference(one), by_id(result)
            known.run(steps, 1e-4)
            for field, values in (("position", known.x), ("velocity", known.v), ("spin", known.w)):
                np.testing.assert_allclose(
                    state[field], values, rtol=0, atol=1e-11 * np.abs(values).max(), err_msg=field
                )
            assert steps == 1 or min(known.sliding, known.sticking) > 300


@pytest.mark.parametrize("name", EACH)
def test_normal_forces_in_numpy_are_those_of_grains_at_rest(name, rng):
    """Their sum on each grain, at the start, is the force that the kernel has summed."""
    n, (soft, hard) = 40, TWO[name]
    radius = rng.uniform(0.1, 0.3, n)
    setup = grains(
        name, rng.uniform(0, 1.0, (n, 3)), np.zeros((n, 3)), radius=radius, mass=radius**3,
        first=soft, second=hard, material=np.arange(n) % 2,
    )  # fmt: skip
    simulation = loaded([setup])
    simulation.first.advance(1)
    order = np.argsort(simulation.s.read("id")[0, :n])
    summed, state = simulation.s.read("force")[0, :n][order], setup.start()
    i, j = contacts(state["position"], radius).T
    apart = state["position"][j] - state["position"][i]
    distance = np.linalg.norm(apart, axis=1)
    force = normal_forces(OverlappingPairs(state, i, j, radius[i] + radius[j] - distance, setup.acting()))
    along, expected = (force / distance)[:, None] * apart, np.zeros((n, 3))
    np.add.at(expected, i, -along)
    np.add.at(expected, j, along)
    assert len(i) > 30
    np.testing.assert_allclose(summed, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def couples(name, rng, each=16, **more):
    """Pairs of spinning grains, far from each other, that collide; a third of the impacts are grazing."""
    radius, mass = rng.uniform(0.3, 1, (each, 2)), rng.uniform(0.5, 2, (each, 2))
    grazing = 1 - 10 ** rng.uniform(-6, -2, each)
    aside = np.where(rng.uniform(size=each) < 0.3, grazing, rng.uniform(0, 1, each))
    first = 10.0 * np.arange(each)[:, None] * [1.0, 0.0, 0.0]
    normal = np.stack([0 * aside, aside, np.sqrt(1 - aside**2)], axis=1)
    second = first + radius.sum(axis=1)[:, None] * normal
    v, speed = np.zeros((each, 2, 3)), 10 ** rng.uniform(0, 1, each)
    v[:, 0, 2] = speed
    place = np.stack([first, second], axis=1).reshape(-1, 3)
    spin = (rng.normal(size=(each, 2, 3)) * speed[:, None, None]).reshape(-1, 3)
    soft, hard = TWO[name]
    return grains(
        name,
        place,
        v.reshape(-1, 3),
        spin,
        radius=radius.ravel(),
        mass=mass.ravel(),
        first=soft,
        second=hard,
        material=np.arange(2 * each) % 2,
        dt=5e-5,
        steps=8000,
        **more,
    )


@pytest.mark.parametrize("name", EACH)
def test_impacts_never_gain_energy_and_conserve_momentum(name, rng):
    """For grains of two materials that have collided and separated; adhesive ones have dissipated more."""
    met = 0
    for result in run([couples(name, rng) for _ in range(8)]):
        start, end = result.start, by_id(result)
        before, after = couple_energies(start), couple_energies(end)
        apart = np.linalg.norm(np.diff(end["position"].reshape(-1, 2, 3), axis=1)[:, 0], axis=1)
        parted = apart > 0.05 + end["radius"].reshape(-1, 2).sum(axis=1)
        met += ((after != before) & parted).sum()
        assert (after[parted] <= before[parted] * (1 + 1e-5)).all()
        for sums in momenta(start), momenta(end):
            np.testing.assert_allclose(sums, momenta(start), rtol=0, atol=1e-11 * np.abs(sums).max())
    assert met > 30


def momenta(state):
    """Momentum of each pair, and its angular momentum about the origin."""
    momentum = state["mass"][:, None] * state["velocity"]
    inertia = 0.4 * (state["mass"] * state["radius"] ** 2)[:, None]
    turning = np.cross(state["position"], momentum) + inertia * state["spin"]
    return np.concatenate([momentum, turning], axis=1).reshape(-1, 2, 6).sum(axis=1)
