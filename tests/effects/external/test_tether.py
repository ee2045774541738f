"""The tether to the initial position, and gravity, against their NumPy references."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, close, cloud, fields_beside_the_core, loads, vector
from tests.scenes import scene, simulate
from tisim import InputError
from tisim.effects import Gravity, Tether


def stiffnesses(rng):
    return [tuple(float(k) for k in rng.uniform(0, 5, 3)) for _ in range(WORLDS)]


def test_a_tether_pulls_to_the_initial_position(rng):
    """The anchor is a copy of the initial position, bit for bit, and is constant."""
    scenes = [cloud(rng, (Tether(stiffness=k),), dt=0.1, steps=3) for k in stiffnesses(rng)]
    for one, result in zip(scenes, simulate(scenes, worlds=WORLDS, capacity=16), strict=True):
        np.testing.assert_array_equal(result.state["anchor"], result.start["position"])
        away = result.state["position"] - result.start["position"]
        assert np.abs(away).max() > 0.1
        close(result.state["force"], -np.array(one.effects[0].stiffness) * away)


def test_a_tether_to_an_anchor_that_the_start_gives(rng):
    anchors = rng.normal(size=(WORLDS, 12, 3))
    scenes = [
        cloud(rng, (Tether(stiffness=k),), quantities={"anchor": anchor})
        for k, anchor in zip(stiffnesses(rng), anchors, strict=True)
    ]
    for one, anchor, state in zip(scenes, anchors, loads(scenes), strict=True):
        close(state["force"], -np.array(one.effects[0].stiffness) * (state["position"] - anchor))


@pytest.mark.long
def test_gravity(rng):
    scenes = [cloud(rng, (Gravity(acceleration=vector(rng)),)) for _ in range(WORLDS)]
    for one, state in zip(scenes, loads(scenes), strict=True):
        close(state["force"], state["mass"][:, None] * np.array(one.effects[0].acceleration))
    assert Gravity().acceleration == (0.0, 0.0, -9.80665)


def test_only_a_tether_needs_an_anchor():
    for effect, more in ((Gravity(), set()), (Tether(stiffness=(1, 1, 1)), {"anchor"})):
        assert fields_beside_the_core(scene([[0, 0, 0]], [[0, 0, 0]], (effect,))) == {"force"} | more
        assert not effect.offers("velocity_jacobian")


def test_invalid_values_are_refused():
    with pytest.raises(InputError, match=r"^tether.stiffness.2 must be given; received nothing$"):
        Tether(stiffness=(1, 2))
