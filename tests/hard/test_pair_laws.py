"""Extreme cases of pair laws: coincident, just touching, compressed, crowded, unequal and far-away
particles."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, loads
from tests.scenes import fixed, scene, simulate
from tisim import Box, InputError
from tisim.backend.taichi import ti
from tisim.effects import Contact, Hertz
from tisim.operators import Operator
from tisim.operators.base import parameter

CROWD = 1000
BOX = Box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0))


def grains(position, radius, young=1e3, stiffness=1e3, **more):
    """Particles at rest in a periodic box, under both contact laws."""
    effects = (Contact(stiffness=stiffness), Hertz(young=young, poisson=0.25))
    n = len(position)
    more = {"velocity": np.zeros((n, 3)), "mass": np.ones(n), "dt": 1e-4, **more}
    return scene(position, effects=effects, radius=radius, domain=BOX, **more)


def run_grains(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=CROWD)


R = 0.125
PLACES = {
    "hardly apart": 1e-12 * R,
    "touching": 2 * R,
    "beyond": np.nextafter(2 * R, 1),
    "pressed": 1.8 * R,
}


def couple(d, **more):
    """Two particles of radius R at a distance, one of them on a face of the box."""
    return grains(np.array([[0, 0.5, 0.5], [d, 0.5, 0.5]]), R, **more)


@pytest.fixture(scope="module")
def couples():
    """Pairs at all these distances, run until the compressed ones have parted."""
    results = run_grains([couple(d, dt=2e-5, steps=10_000) for d in PLACES.values()])
    return dict(zip(PLACES, results, strict=True))


def test_coincident_particles_in_contact_are_refused():
    """Coincident centres have no line of centres."""
    with pytest.raises(InputError, match="particles 0 and 1 both at"):
        run_grains([couple(0.0)])


def test_touching_surfaces_exert_no_force(couples):
    """At the sum of the radii, which is a binary fraction, and beyond it the force is zero."""
    for name in ("touching", "beyond"):
        np.testing.assert_array_equal(couples[name].state["velocity"], 0.0)
        assert couples[name].status.ok
    inside, outside = loads([couple(np.nextafter(2 * R, side)) for side in (0, 1)], capacity=CROWD)
    assert 0 < inside["force"][1, 0] < 1e-15
    np.testing.assert_array_equal(outside["force"], 0.0)


def worlds_of_lists(rng):
    """Difficult cases for a cell list: name, positions, radii."""
    unlike = 2e-4 * 1e3 ** rng.uniform(0, 1, 300)
    unlike[7], unlike[8] = 0.2, 2e-4
    faces = rng.integers(0, 12, (300, 3)) / 12
    yield "radii a thousandfold apart", rng.uniform(0, 1, (300, 3)), unlike
    yield "on faces of cells and box", np.unique(faces, axis=0), 0.06
    yield "in one cell", 0.3 + 1e-3 * rng.normal(size=(60, 3)), 1e-3
    yield "in one corner", np.mod(1e-3 * rng.normal(size=(60, 3)), 1.0), 1e-3
    yield "one", np.array([[0.0, 0.5, 0.5]]), 0.1
    yield "two, across a face", np.array([[0.0, 0.5, 0.5], [0.95, 0.5, 0.5]]), 0.1


@pytest.mark.long
def test_list_forces_equal_forces_over_all_pairs(rng):
    """The forces equal a NumPy sum over all pairs, with no pair missing or repeated, and add up to zero."""
    scenes = [grains(place, np.broadcast_to(radius, len(place))) for _, place, radius in worlds_of_lists(rng)]
    contacts = []
    for state in loads(scenes, capacity=CROWD):
        place, a = state["position"], state["radius"]
        gap = place[None] - place[:, None]
        gap -= np.round(gap)
        d = np.linalg.norm(gap, axis=2) + np.eye(len(a))
        b = a[:, None]
        overlap = np.where(np.eye(len(a), dtype=bool), 0, np.maximum(a + b - d, 0))
        area = np.pi * np.maximum(a**2 - (0.5 * (d - (b**2 - a**2) / d)) ** 2, 0)
        size = 1e3 * (overlap / (a + b)) ** 2 * area
        size += 4 / 3 * 1e3 / (2 * (1 - 0.25**2)) * np.sqrt(a * b / (a + b)) * overlap**1.5
        expected = -(size[..., None] * gap / d[..., None]).sum(axis=1)
        scale = max(np.abs(size).max(), 1e-300)
        np.testing.assert_allclose(state["force"], expected, rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(state["force"].sum(axis=0), 0, atol=1e-12 * np.abs(size).sum())
        contacts.append((overlap > 0).sum() // 2)
    assert contacts[0] > 100
    assert min(contacts[1:4]) > 60
    assert contacts[4:] == [0, 1]


class Vanish(Operator):
    """Removes every particle at a given step."""

    at_step: float = parameter("", "at step", 3.0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.steps[w] == self.at_step(w):
            s.remove(w, i)


@pytest.mark.slow
def test_a_world_that_loses_all_its_particles_runs_to_its_end():
    """Sums and distances over no particles neither hang nor give NaN, and time advances."""
    places = np.random.default_rng(2).uniform(0, 1, (60, 3))
    laws = Hertz(young=1.0, poisson=0.0)
    more = {"radius": 0.1, "mass": 1.0, "stepper": fixed(1e-3), "duration": 1.0, "domain": BOX}
    scenes = [scene(places, np.zeros((60, 3)), (laws, Vanish(at_step=step)), **more) for step in (3.0, 1e9)]
    empty, full = simulate(scenes, worlds=2, capacity=60)
    for result, count in ((empty, 0), (full, 60)):
        assert result.status.ok, result.status.reason
        assert result.time == 1.0
        assert len(result.state["mass"]) == count
