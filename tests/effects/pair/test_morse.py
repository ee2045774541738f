"""Morse's potential against the gradient of its energy in NumPy."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, pairs
from tests.effects.pair.test_mie import crowd
from tests.scenes import scene, simulate
from tisim import InputError, Scene
from tisim.effects import Morse
from tisim.testing import assert_contracts


def potential(law, d, touch):
    """Without the shift at the cut-off. J."""
    e = np.exp(-law.alpha * (d - touch))
    return law.depth * (e**2 - 2 * e)


def reference(law, state):
    """The derivative of the potential, by a central difference of fourth order, within the cut-off."""
    n, d = pairs(state)
    touch, h = state["radius"][:, None] + state["radius"], 1e-4 * d
    at = [potential(law, d + k * h, touch) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h)
    near = (d < law.cutoff * touch) & ~np.eye(len(d), dtype=bool)
    return (np.where(near, slope, 0)[..., None] * n).sum(axis=1)


def test_forces_are_the_gradient_of_the_potential(rng):
    """Repulsion alone, and attraction up to a cut-off, with several decay lengths, in one batch."""
    values = ((1.0, 20.0, 1.0), (2.0, 60.0, 1.3), (0.5, 5.0, 2.5))
    scenes = [crowd(rng, Morse(depth=depth, alpha=alpha, cutoff=cut)) for depth, alpha, cut in values]
    for one, state in zip(scenes, loads(scenes), strict=True):
        expected = reference(one.effects[0], state)
        assert np.abs(expected).max() > 0
        close(state["force"], expected, 1e-8)
        balanced(state)


@pytest.mark.slow
def test_over_the_pair_list(rng):
    """With enough particles for the pair list to be used."""
    many = crowd(rng, Morse(depth=1.0, alpha=30.0, cutoff=1.8), n=400)
    (state,) = loads([many], capacity=400)
    close(state["force"], reference(many.effects[0], state), 1e-8)
    balanced(state)


def test_the_well_has_its_depth_at_touch_and_the_force_ends_at_the_cutoff():
    """Morse (1929): the minimum is -D at r_0, where U'' = 2 a^2 D; the attraction is largest, a D / 2, at
    r_0 + ln 2 / a."""
    depth, alpha, touch = 3.0, 40.0, 0.2
    law = Morse(depth=depth, alpha=alpha, cutoff=1.5)

    def force(distance):
        setup = scene([[0, 0, 0], [distance, 0, 0]], np.zeros((2, 3)), (law,), radius=0.1, mass=1.0)
        return loads([setup])[0]["force"][1, 0]

    assert potential(law, touch, touch) == -depth
    small = 1e-6
    assert (force(touch - small) - force(touch + small)) / (2 * small) == pytest.approx(2 * alpha**2 * depth)
    assert force(touch + np.log(2) / alpha) == pytest.approx(-alpha * depth / 2)
    assert force(1.5 * touch * (1 - 1e-9)) < 0
    assert force(1.5 * touch * (1 + 1e-9)) == 0


def test_the_step_of_a_collision_follows_from_its_closest_approach():
    """The stiffness is the largest second derivative on the way from the cut-off to the turning point."""
    law, mass, touch, speed = Morse(depth=2e-3, alpha=900.0, cutoff=1.8), 0.3, 0.01, 0.25
    d = np.linspace(0.0, law.cutoff * touch, 400_001)[1:]
    energy = potential(law, d[-1], touch) + 0.5 * mass * speed**2
    way = d[potential(law, d, touch) <= energy]
    e = np.exp(-law.alpha * (way - touch))
    curvature = 2 * law.alpha**2 * law.depth * e * (2 * e - 1)
    assert way[0] > d[0]
    assert law.largest_stiffness(mass, touch, speed) == pytest.approx(curvature.max(), rel=1e-3)
    # A collision with more energy than U(0) has no turning point.
    through = law.largest_stiffness(mass, touch, 1e4)
    e = np.exp(law.alpha * touch)
    assert through == pytest.approx(2 * law.alpha**2 * law.depth * e * (2 * e - 1))
    # At rest within the well, it is the curvature at the bottom.
    still = Morse(depth=2e-3, alpha=900.0, cutoff=1.0).largest_stiffness(mass, touch, 0.0)
    assert still == pytest.approx(2 * law.alpha**2 * law.depth)
    # A steep wall, whose exponential would overflow.
    assert np.isfinite(Morse(depth=1.0, alpha=1e6, cutoff=0.5).largest_stiffness(mass, touch, speed))
    start = {"mass": np.array([2 * mass]), "radius": np.array([touch / 2])}
    assert law.critical_step(start, speed, ()) == pytest.approx(
        2 * np.sqrt(mass / law.largest_stiffness(mass, touch, speed))
    )


def test_a_bound_pair_oscillates_with_the_frequency_of_the_well():
    """Small oscillations: omega = a sqrt(2 D / m*)."""
    depth, alpha, mass = 1e-3, 500.0, 2e-6
    period = 2 * np.pi / (alpha * np.sqrt(2 * depth / (mass / 2)))
    apart = 2e-3 + 1e-6
    pair = scene([[0, 0, 0], [apart, 0, 0]], np.zeros((2, 3)), (Morse(depth=depth, alpha=alpha, cutoff=3.0),),
                 radius=1e-3, mass=mass, dt=period / 2000, steps=1000)  # fmt: skip
    # In the simulation whose initial forces the tests above read.
    (result,) = simulate([pair], worlds=WORLDS, capacity=16)
    result.check()
    gap = result.state["position"][1, 0] - result.state["position"][0, 0] - 2e-3
    assert gap == pytest.approx(-1e-6, rel=5e-3)


def test_contracts_and_files():
    setup = scene([[0, 0, 0]], [[0, 0, 0]], (Morse(depth=1e-19, alpha=1e4, cutoff=2.0),))
    assert fields_beside_the_core(setup) == {"force"}
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert again.structure() == setup.structure()
    two = scene([[0, 0, 0], [0.19, 0, 0]], np.zeros((2, 3)), (Morse(depth=1.0, alpha=30.0, cutoff=2.0),),
                radius=0.1, mass=1.0)  # fmt: skip
    assert_contracts(two)


@pytest.mark.parametrize("name", ["depth", "alpha", "cutoff"])
def test_invalid_values_are_refused(name):
    with pytest.raises(InputError) as fault:
        Morse(**{"depth": 1.0, "alpha": 1.0, "cutoff": 2.0, name: 0})
    assert str(fault.value) == f"morse.{name} must be greater than 0.0; received 0"
