"""The tree of cells over particles: its order, its boxes and the moments of its cells, against NumPy."""

import numpy as np
import pytest
from scipy.constants import G

from tests.effects.gravitation.clouds import CAPACITY, THETAS, ball, loads_of
from tests.scenes import compiled, scene
from tisim.backend.thread import in_taichi_thread
from tisim.effects import TreeGravity
from tisim.effects.gravitation.cell_tree import FAN, LEAF

NUMBERS = (CAPACITY, 700, 17, 1)
"""Numbers of particles in the worlds: one has two blocks of the sort, some have one leaf."""


@pytest.fixture(scope="module")
def trees():
    """Scenes, and the tree and moments of their worlds."""
    rng = np.random.Generator(np.random.Philox(3))
    scenes = []
    for n in NUMBERS:
        # Many particles share cells of the curve; they stay in the order of their indices.
        place = np.concatenate([ball(rng, n - n // 3), 1e-7 * ball(rng, n // 3)])
        place = place[rng.permutation(n)]
        scenes.append(scene(place, 0 * place, (TreeGravity(),), mass=rng.uniform(1, 2, n)))
    loads_of(scenes)
    simulation = compiled(scenes[0], worlds=len(THETAS), capacity=CAPACITY)
    return scenes, simulation.assembly.long_range["tree_gravity"]


def numbers(column):
    """The values of a field."""
    return in_taichi_thread(column.to_numpy)()


def test_particles_are_sorted_by_their_keys_and_then_by_number(trees):
    scenes, total = trees
    order, key, place = (numbers(column) for column in (total.t.order, total.t.sort.key, total.t.place))
    assert max(NUMBERS) > total.t.sort.block
    for w, n in enumerate(NUMBERS):
        own = order[w, :n]
        np.testing.assert_array_equal(np.sort(own), np.arange(n))
        steps, ties = np.diff(key[w, :n]), np.diff(own)
        assert (steps >= 0).all()
        assert (ties[steps == 0] > 0).all()
        assert n < 100 or (steps == 0).sum() > 10
        np.testing.assert_array_equal(place[w, :n], scenes[w].particles.position[own])


def test_every_cell_has_the_box_and_the_moments_of_its_particles(trees):
    scenes, total = trees
    t, m = total.t, total.moments
    columns = {name: numbers(getattr(t, name)) for name in ("low", "high", "population", "levels", "order")}
    names = ("total", "centre", "diagonal", "mixed", "extent", "opens_within")
    columns |= {name: numbers(getattr(m, name)) for name in names}
    for w, n in enumerate(NUMBERS):
        place, order = scenes[w].particles.position, columns["order"][w, :n]
        mass = np.broadcast_to(scenes[w].particles.mass, n)[order]
        place, span, level = place[order], LEAF, 0
        while True:
            assert columns["population"][w, level] == -(-n // span)
            for k in range(-(-n // span)):
                c, own = t.firsts[level] + k, slice(k * span, min((k + 1) * span, n))
                r, strength = place[own], G * mass[own]
                centre = strength @ r / strength.sum()
                x = r - centre
                second = np.einsum("i,ia,ib->ab", strength, x, x)
                np.testing.assert_array_equal(columns["low"][w, c], r.min(axis=0))
                np.testing.assert_array_equal(columns["high"][w, c], r.max(axis=0))
                assert columns["total"][w, c] == pytest.approx(strength.sum(), rel=1e-13)
                np.testing.assert_allclose(columns["centre"][w, c], centre, rtol=0, atol=1e-13)
                scale = 1e-12 * strength.sum()
                np.testing.assert_allclose(columns["diagonal"][w, c], np.diag(second), rtol=0, atol=scale)
                mixed = second[[1, 2, 0], [2, 0, 1]]
                np.testing.assert_allclose(columns["mixed"][w, c], mixed, rtol=0, atol=scale)
                farthest = np.linalg.norm(x, axis=1).max()
                assert farthest * (1 - 1e-12) - 1e-13 <= columns["extent"][w, c] <= 3 * farthest + 1e-13
                assert columns["opens_within"][w, c] == pytest.approx((columns["extent"][w, c] / 0.5) ** 2)
            if span >= n:
                break
            span, level = span * FAN, level + 1
        assert columns["levels"][w] == level + 1
