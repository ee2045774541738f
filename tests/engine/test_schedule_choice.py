"""The default schedule of worlds depends on the work of a step."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.effects.contact.grains import heap
from tests.scenes import fixed, laws, scene
from tests.steppers.brownian.colloids import colloids
from tisim.backend import memory
from tisim.backend.thread import in_taichi_thread
from tisim.effects import DipoleDipole, NearField
from tisim.engine.allocation import Allocation
from tisim.engine.compiled_worlds import choose, members
from tisim.program.phases import Phase
from tisim.program.team import MOST_LOOKS, Teams

TWO_THREADS = SimpleNamespace(device="cpu", threads=2)


def two(*effects, **quantities):
    """Two particles that interact at any distance."""
    place = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    return scene(place, np.zeros((2, 3)), effects, stepper=fixed(1e-3), quantities=quantities)


def charges():
    return two(NearField(alpha2=1.0, strength="charge"), charge=1.0)


def dipoles():
    return two(DipoleDipole(), moment=np.ones((2, 3)))


def merging():
    """Sums of forces occur twice in a step: they are computed again after events."""
    return scene([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], np.zeros((2, 3)), (NearField(alpha2=1.0), *laws()))


def grains():
    return heap(np.random.default_rng(1))


CASES = {
    "few charges": (charges, 1, 100, "world"),
    "charges": (charges, 1, 500, "team"),
    "charges, a world for each thread": (charges, 2, 500, "world"),
    "dipoles": (dipoles, 1, 500, "team"),
    "few that also merge": (merging, 1, 200, "world"),
    "grains feel those near them": (grains, 1, 1000, "world"),
    "many grains": (grains, 1, 3000, "team"),
    "each by itself": (lambda: colloids([[0.0, 0.0, 0.0]]), 1, 10, "particle"),
}
"""A scene, the number of worlds, their capacity, and the expected schedule on two threads."""


@in_taichi_thread
def chosen(made, worlds, capacity):
    """The schedule for worlds of this capacity."""
    with memory.collected() as trees:
        allocation = Allocation(made, worlds, capacity)
    found = choose(allocation.assembly.step, allocation.s, TWO_THREADS)
    for tree in trees:
        tree.destroy()
    return found


@pytest.mark.parametrize("what", CASES)
def test_the_schedule_follows_the_work_of_a_step(what):
    made, worlds, capacity, expected = CASES[what]
    assert chosen(made(), worlds, capacity) == expected


def test_more_threads_share_more_work():
    step, worlds = (Phase(),), SimpleNamespace(capacity=5000)
    assert [members(step, worlds, threads) for threads in (1, 2, 64)] == [1, 2, 5]


def test_the_patience_of_a_team_is_bounded():
    assert Teams(1, 10**12, 2, 1).late == MOST_LOOKS


def test_devices_use_the_particle_schedule():
    card = SimpleNamespace(device="cuda", threads=2)
    assert choose((), SimpleNamespace(worlds=1, capacity=10), card) == "particle"
