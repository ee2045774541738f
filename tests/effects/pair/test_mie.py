"""Mie's potential against the gradient of its energy in NumPy."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, pairs
from tests.scenes import scene
from tisim import InputError, Scene
from tisim.effects import Mie


def crowd(rng, law, n=12, spread=1.0):
    """Grains of unlike sizes on a disturbed lattice, some of them overlapping."""
    sites = (
        np.argwhere(np.ones((8, 8, 8)))[rng.permutation(512)[:n]]
        if n > 27
        else np.argwhere(np.ones((3,) * 3))
    )
    place = 0.2 * spread * (sites[:n] + rng.uniform(-0.1, 0.1, (n, 3)))
    radius = rng.uniform(0.09, 0.1, n)
    return scene(place, np.zeros((n, 3)), (law,), radius=radius, mass=1.0)


def within(law, d, sigma):
    return d < (law.cutoff or (law.n / law.m) ** (1 / (law.n - law.m))) * sigma


def potential(law, d, sigma):
    """B16 (6.18). J."""
    n, m = law.n, law.m
    return n / (n - m) * (n / m) ** (m / (n - m)) * law.epsilon * ((sigma / d) ** n - (sigma / d) ** m)


def reference(law, state):
    """The derivative of the potential, by a central difference of fourth order, within the cut-off."""
    n, d = pairs(state)
    sigma, h = state["radius"][:, None] + state["radius"], 1e-4 * d
    at = [potential(law, d + k * h, sigma) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h)
    near = within(law, d, sigma) & ~np.eye(len(d), dtype=bool)
    return (np.where(near, slope, 0)[..., None] * n).sum(axis=1)


def check(scenes):
    for one, state in zip(scenes, loads(scenes), strict=True):
        law, force = one.effects[0], state["force"]
        expected = reference(law, state)
        assert np.abs(expected).max() > 0
        close(force, expected, 1e-8)
        balanced(state)


def test_hard_spheres_of_b16_and_wells(rng):
    """Exponents 30 and 15: repulsion alone, or attraction up to a cut-off, in one batch."""
    check([crowd(rng, Mie(epsilon=float(rng.uniform(1, 2)))) for _ in range(4)])
    check([crowd(rng, Mie(epsilon=1.0, cutoff=cut)) for cut in (1.02, 1.3, 2.5)])


@pytest.mark.slow
@pytest.mark.parametrize(("n", "m"), [(12, 6), (9.5, 4)])
def test_other_powers(n, m, rng):
    check([crowd(rng, Mie(epsilon=1.0, n=n, m=m, cutoff=2.5)) for _ in range(WORLDS)])


@pytest.mark.slow
def test_over_the_pair_list(rng):
    """With enough particles for the pair list to be used."""
    many = crowd(rng, Mie(epsilon=1.0, cutoff=1.8), n=400)
    (state,) = loads([many], capacity=400)
    close(state["force"], reference(many.effects[0], state), 1e-8)
    balanced(state)


def test_repulsion_ends_smoothly_at_the_bottom_of_the_well():
    """Two particles at distances around sigma 2^(1/15), from B16 (6.19): energy -eps and no force there; no
    force beyond."""
    bottom, sigma = 2 ** (1 / 15), 0.2

    def force(law, distance):
        setup = scene([[0, 0, 0], [distance, 0, 0]], np.zeros((2, 3)), (law,), radius=0.1, mass=1.0)
        return loads([setup])[0]["force"][1, 0]

    hard, well = Mie(epsilon=3.0), Mie(epsilon=3.0, cutoff=10.0)
    assert potential(well, sigma * bottom, sigma) == pytest.approx(-3.0, rel=1e-9)
    assert force(hard, sigma) > 0
    assert force(hard, sigma) == pytest.approx(force(well, sigma), rel=1e-14)
    steep = 3.0 / sigma
    assert 0 < force(hard, sigma * bottom * (1 - 1e-9)) < 1e-5 * steep
    assert force(hard, sigma * bottom * (1 + 1e-9)) == 0
    assert force(well, sigma * bottom * 1.01) < -0.1 * steep


def test_mie_needs_no_fields_and_survives_files():
    setup = scene([[0, 0, 0]], [[0, 0, 0]], (Mie(epsilon=1e-19),))
    assert fields_beside_the_core(setup) == {"force"}
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert again.structure() == setup.structure()


WRONG = {
    "mie.n must be greater than m, 15; received 15": {"n": 15},
    "mie.m must be greater than 0; received 0": {"m": 0},
    "mie.epsilon must be greater than 0.0; received -1": {"epsilon": -1},
    "mie.cutoff must be greater than 0.0; received 0": {"cutoff": 0},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        Mie(**{"epsilon": 1.0, **WRONG[message]})
    assert str(fault.value) == message
