"""The schedule that worlds run on unless one is given goes by the work of a step."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.effects.contact.grains import heap
from tests.scenes import fixed, scene
from tests.steppers.brownian.colloids import colloids
from tisim.backend import memory
from tisim.backend.thread import in_taichi_thread
from tisim.effects import DipoleDipole, NearField, TreeGravity
from tisim.engine.allocation import Allocation
from tisim.engine.schedule_choice import choose

TWO_THREADS = SimpleNamespace(device="cpu", threads=2)


def two(effect, **quantities):
    """Two particles that feel each other however far apart."""
    place = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    return scene(place, np.zeros((2, 3)), (effect,), stepper=fixed(1e-3), quantities=quantities)


def charges():
    return two(NearField(alpha2=1.0, strength="charge"), charge=1.0)


def dipoles():
    return two(DipoleDipole(), moment=np.ones((2, 3)))


def grains():
    return heap(np.random.default_rng(1))


CASES = {
    "few charges": (charges, 1, 100, "world"),
    "charges": (charges, 1, 500, "team"),
    "charges, a world for each thread": (charges, 2, 500, "world"),
    "dipoles": (dipoles, 1, 500, "team"),
    "masses by a tree": (lambda: two(TreeGravity()), 1, 1000, "team"),
    "grains feel those near them": (grains, 1, 1000, "world"),
    "many grains": (grains, 1, 3000, "team"),
    "each by itself": (lambda: colloids([[0.0, 0.0, 0.0]]), 1, 10, "particle"),
}
"""What is made, how many worlds with how much room, and what runs them on two threads."""


@in_taichi_thread
def chosen(made, worlds, capacity):
    """The schedule of worlds with room for so many particles."""
    with memory.collected() as trees:
        allocation = Allocation(made, worlds, capacity)
    found = choose(allocation.assembly.step, allocation.s, TWO_THREADS)
    for tree in trees:
        tree.destroy()
    return found


@pytest.mark.parametrize("what", CASES)
def test_what_is_worth_sharing_is_shared(what):
    made, worlds, capacity, expected = CASES[what]
    assert chosen(made(), worlds, capacity) == expected


def test_devices_take_phases_of_all_worlds():
    card = SimpleNamespace(device="cuda", threads=2)
    assert choose((), SimpleNamespace(worlds=1, capacity=10), card) == "particle"
