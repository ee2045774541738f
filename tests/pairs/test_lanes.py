"""Listed pairs are computed in lanes: the bits do not depend on the number of lanes or the list rebuilds."""

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.scenes import by_id, fixed, scene
from tests.throwaway import Bridge
from tisim import Material, Simulation
from tisim.pairs import listed_pairs
from tisim.steppers import Trapezoid
from tisim.steppers.implicit.step_control import ErrorControl

RADIUS, NARROW = 0.1, 1e-6
"""A skin (m) so thin that lists are rebuilt at every move."""
MATERIALS = {"grain": Material(young=1e5, poisson=0.25, restitution=0.6, friction=0.4)}
LAWS = HERTZ_MINDLIN, Bridge(pull=3.0, rupture=0.02)


def falling(stepper, skin=None):
    """Grains of a loose lattice collide: contacts form, slide and become bridges."""
    rng = np.random.default_rng(5)
    lattice = 2.1 * RADIUS * np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return scene(
        lattice + rng.normal(size=lattice.shape) * 0.05 * RADIUS,
        -3.0 * (lattice - lattice.mean(axis=0)) + rng.normal(size=lattice.shape),
        LAWS,
        radius=RADIUS * rng.uniform(0.8, 1.0, len(lattice)),
        mass=1.0,
        stepper=stepper,
        duration=0.1,
        materials=MATERIALS,
        quantities={"spin": 5 * rng.normal(size=lattice.shape)},
        **({} if skin is None else {"skin": skin}),
    )


STEPPERS = {
    "verlet": fixed(5e-4),
    "trapezoid": Trapezoid(
        control=ErrorControl(error=1e-3, tolerance=1e-8, first=1e-4, longest=2e-3, shortest=1e-9)
    ),
}


def ends(stepper, lanes, skins):
    """Final states for each skin."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(listed_pairs, "LANES", lanes)
        simulation = Simulation(falling(stepper), worlds=len(skins))
    simulation.load([falling(stepper, skin) for skin in skins])
    simulation.run()
    results = simulation.results()
    simulation.close()
    assert all(result.status.ok for result in results), results[0].status.reason
    return [by_id(result) for result in results]


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPPERS)
def test_lanes_and_lists_change_no_bit(name):
    usual, narrow = ends(STEPPERS[name], 16, (None, NARROW))
    (alone,) = ends(STEPPERS[name], 1, (None,))
    for found in narrow, alone:
        for field, values in usual.items():
            np.testing.assert_array_equal(found[field], values, err_msg=field)
