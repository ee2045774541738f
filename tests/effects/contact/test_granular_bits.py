"""Grains with contact history: the same bits for every way to run them, and equal to NumPy if a grain is
removed."""

import subprocess
import sys

import numpy as np
import pytest

from tests.compare import same_arrays
from tests.device.launches import assert_launches
from tests.effects.contact.grains import heap, reference
from tests.scenes import by_id
from tisim import RunError, Simulation
from tisim.backend import memory, runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import parameter
from tisim.engine import compiled_worlds
from tisim.operators import Operator
from tisim.pairs import pair_chunks
from tisim.pairs.half_list import ListSizes
from tisim.program.team import Teams

# Grains overlap deeply at the start here, on purpose.
pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning"),
]

GRAINS, STEPS, DT = 150, 120, 2e-4
CHUNK_SLOTS = 32
"""Small, so that most pairs span two chunks."""


class TakeAway(Operator):
    """One particle is removed after a time."""

    after: float = parameter("s", "time", ge=0)
    which: float = parameter("", "its id", ge=0)

    @ti.func
    def world(self, s, w):
        if s.time[w] >= self.after(w):
            for i in range(s.count[w]):
                if s.id[w, i] == ti.cast(self.which(w), ti.i32):
                    s.remove(w, i)


def bed(seed, after=1e9, which=7):
    """Grains in a cell too small for them."""
    made = heap(np.random.default_rng(seed), GRAINS, side=2.45, dt=DT, steps=STEPS)
    return made.model_copy(update={"effects": (*made.effects, TakeAway(after=after, which=which))})


def simulated(schedule):
    """A simulation of three beds, with small chunks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pair_chunks, "CHUNK_SLOTS", CHUNK_SLOTS)
        return Simulation(bed(0), worlds=3, capacity=GRAINS, schedule=schedule)


def ends(simulation, scenes):
    """Run scenes; return their final states by id."""
    simulation.load(scenes)
    simulation.run()
    results = simulation.results()
    assert all(result.status.ok for result in results), results[0].status.reason
    return [by_id(result) for result in results]


@pytest.fixture(scope="module")
def simulation():
    made = simulated("particle")
    yield made
    made.close()


@pytest.fixture(scope="module")
def usual(simulation):
    """Final states of three beds side by side."""
    return ends(simulation, [bed(k) for k in range(3)])


@pytest.mark.long
def test_the_same_bits_alone_in_a_batch_and_restarted(simulation, usual, tmp_path):
    same_arrays(ends(simulation, [bed(2)])[0], usual[2])
    simulation.load([bed(k) for k in range(3)])
    simulation.run(steps=STEPS // 2)
    simulation.checkpoint(tmp_path / "half.h5")
    simulation.run(steps=7)
    simulation.load([bed(k) for k in range(3)])
    simulation.restore(tmp_path / "half.h5")
    simulation.run()
    for result, expected in zip(simulation.results(), usual, strict=True):
        assert result.work["steps"] == STEPS
        same_arrays(by_id(result), expected)


def test_the_same_bits_with_any_skin(simulation, usual):
    """Lists are built at other times, and contain other pairs."""
    skins = (2e-3, 2e-2, 0.1)
    for found in ends(simulation, [bed(2).model_copy(update={"skin": skin}) for skin in skins]):
        same_arrays(found, usual[2])
    assert [skin_of(simulation, w) for w in range(3)] == list(skins)


@in_taichi_thread
def skin_of(simulation, w):
    return simulation.assembly.pairs.half_list.grid.skin[w, 0]


def test_a_step_takes_few_launches(simulation):
    """Two more launches than for a step without an operator that removes grains: operators act between two
    fillings of slots, after which forces may be summed again."""
    simulation.load([bed(k) for k in range(3)])
    assert_launches(simulation, 64, each=5)


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["world", "team"])
def test_the_same_bits_on_all_schedules(usual, monkeypatch, schedule):
    if schedule == "team":
        # All threads process the three beds one after the other.
        monkeypatch.setattr(compiled_worlds, "Teams", lambda *of: Teams(*of[:-1], number=1))
    simulation = simulated(schedule)
    for found, expected in zip(ends(simulation, [bed(k) for k in range(3)]), usual, strict=True):
        same_arrays(found, expected)
    simulation.close()


@pytest.mark.slow
def test_removing_a_grain_keeps_the_history_of_others(simulation):
    """In NumPy, a row and a column are deleted; here indices change and lists are rebuilt."""
    made = [bed(5, after=(60 - 0.5) * DT, which=which) for which in (0, 77, 149)]
    for which, one, found in zip((0, 77, 149), made, ends(simulation, made), strict=True):
        known = reference(one)
        known.run(60, DT)
        assert (known.past[which] != 0).any() or (known.past[:, which] != 0).any()
        known.remove(which)
        known.run(STEPS - 60, DT)
        assert len(found["mass"]) == GRAINS - 1
        np.testing.assert_allclose(found["velocity"], known.v, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found["spin"], known.w, rtol=0, atol=1e-8)


ELSEWHERE = """
import sys
import numpy as np
from tests.effects.contact.test_granular_bits import bed, ends, simulated
from tisim.backend import runtime

kept = {}
for name, settings in {"one": {"threads": 1}, "two": {"threads": 2}, "f32": {"precision": "f32"}}.items():
    runtime.init(device="cpu", **settings)
    simulation = simulated("particle")
    for state, seed in zip(ends(simulation, [bed(k) for k in range(3)]), range(3), strict=True):
        kept.update({f"{name}/{seed}/{key}": values for key, values in state.items()})
    simulation.close()
np.savez(sys.argv[1], **kept)
"""


@pytest.mark.slow
def test_the_same_bits_on_one_and_two_threads(usual, tmp_path):
    command = [sys.executable, "-c", ELSEWHERE, str(tmp_path / "results.npz")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert runtime.current().precision == "f64"
    with np.load(tmp_path / "results.npz") as stored:
        for k, expected in enumerate(usual):
            for name, values in expected.items():
                np.testing.assert_array_equal(stored[f"one/{k}/{name}"], values)
                np.testing.assert_array_equal(stored[f"two/{k}/{name}"], values)
            moved = np.abs(expected["velocity"] - stored[f"f32/{k}/velocity"])
            assert 0 < np.median(moved) < 1e-3


@pytest.mark.slow
def test_failing_to_grow_lists_leaves_the_simulation_usable(simulation, monkeypatch):
    """The contact history is stored beside the pairs, in fields that are allocated before the memory limit is
    checked."""
    row = simulation.assembly.pairs.half_list.row
    present = memory.bytes_in_use()
    monkeypatch.setattr(runtime, "memory", lambda: present + 1000)
    with pytest.raises(RunError, match=r"lists of 99 pairs for a particle"):
        simulation.grow_lists(ListSizes(99, 99))
    monkeypatch.undo()
    assert simulation.assembly.pairs.half_list.row == row
    assert len(ends(simulation, [bed(1)])) == 1
    assert all(tree.alive for tree in simulation.trees)
