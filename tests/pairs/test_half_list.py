"""Half lists of pairs for short-ranged forces compared with brute force, and the order of pairs in chunks."""

import re

import numpy as np
import pytest

from tests.pairs.test_near_list import DOMAINS, clouds, motion, near_pairs
from tests.scenes import scene
from tests.throwaway import SoftShell
from tisim import InputError, Simulation
from tisim.backend import memory, runtime
from tisim.backend.layout import Builder
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import PairForce, parameter
from tisim.engine import monitor, replay
from tisim.pairs import half_list, pair_chunks
from tisim.program import scans as prefix_sum
from tisim.steppers import Boris, FixedStep

WORLDS, CAPACITY, STEPS, DT, GAP, SLOTS = 18, 300, 4, 1.0, 0.02, 32


class Idle(PairForce):
    """Acts within a gap, but with zero force."""

    short_ranged = True
    gap: float = parameter("m", "gap", gt=0)

    @ti.func
    def reach(self, s, w, i):
        return self.gap(w)


@in_taichi_thread
def listed(simulation):
    """Pairs of each world by index, as the chunks hold them; asserts that each is in the right chunk."""
    p, counts = simulation.assembly.pairs, simulation.s.count.to_numpy()
    first, second, fetched = (column.to_numpy() for column in (p.first, p.second, p.fetched))
    begin, outer, end = (column.to_numpy() for column in (p.begin, p.outer, p.end))
    fetch_begin, fetch_count = p.fetch_begin.to_numpy(), p.fetch_count.to_numpy()
    pairs = []
    for w, n in enumerate(counts):
        chunks, found, left = -(-n // p.chunk), [], {i: [] for i in range(n)}
        for c in range(chunks):
            assert begin[w, c] == (end[w, c - 1] if c else 0), "chunks follow each other"
            for m in range(begin[w, c], end[w, c]):
                i, j = int(first[w, m]), int(second[w, m])
                homes = {i // p.chunk, j // p.chunk}
                assert c in homes
                assert (len(homes) == 1) == (m < outer[w, c])
                if m >= outer[w, c]:
                    left[j if i // p.chunk == c else i].append(m)
                found.append((i, j))
        for i in range(n):
            told = fetched[w, fetch_begin[w, i] : fetch_begin[w, i] + fetch_count[w, i]]
            assert told.tolist() == sorted(left[i])
        pairs.append(found)
    return pairs


@pytest.mark.long
@pytest.mark.parametrize("schedule", ["world", pytest.param("particle", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "domain", ["joined", *(pytest.param(d, marks=pytest.mark.slow) for d in ("slab", "open"))]
)
def test_every_near_pair_is_listed_once(rng, monkeypatch, domain, schedule):
    """Checked at the start and after steps in which a few particles move far; dense clouds make the list
    grow."""
    monkeypatch.setattr(pair_chunks, "CHUNK_SLOTS", SLOTS)
    # Sums extend over many blocks.
    monkeypatch.setitem(prefix_sum.LEAST_BLOCK, "cpu", 2)
    domain, names, scenes = DOMAINS[domain], [], []
    for name, position, radius in clouds(rng):
        names.append(name)
        n = len(position)
        scenes.append(
            scene(
                position,
                motion(rng, n) * 0.1,
                (Idle(gap=GAP),),
                radius=radius if np.ndim(radius) else np.full(n, radius),
                mass=1.0,
                domain=domain,
                dt=DT,
                steps=STEPS + 1,
            )
        )
    simulation = Simulation(scenes[0], WORLDS, CAPACITY, schedule)
    row = simulation.assembly.pairs.half_list.row
    simulation.load(scenes)
    assert simulation.assembly.pairs.half_list.row > row
    for step in range(STEPS):
        results = simulation.results()
        for name, result, pairs in zip(names, results, listed(simulation), strict=False):
            where, state = f"{name}, step {step}", result.state
            assert all(i < j for i, j in pairs), where
            assert len(set(pairs)) == len(pairs), where
            near = near_pairs(state["position"], state["radius"], domain, GAP * (1 - 1e-12))
            missed = {tuple(sorted(pair)) for pair in near} - set(pairs)
            assert not missed, f"{where}: missed {sorted(missed)[:5]}"
        simulation.run(steps=1)
        assert (simulation.s.read("status")[: len(scenes)] == 0).all()
    # The list must be useful: for equal particles it holds a small part of all pairs.
    assert len(listed(simulation)[0]) < 0.1 * 300 * 299 / 2
    simulation.close()


class SolidShell(SoftShell):
    """A soft shell that counts as solid."""

    solid = True


def burst(seed=2, n=240):
    """A cloud that contracts, so that its list overflows during the run."""
    draw = np.random.default_rng(seed)
    position = draw.uniform(-1.0, 1.0, (n, 3))
    return scene(
        position,
        -0.9 * position,
        (SolidShell(stiffness=1e-3, width=0.05),),
        radius=0.02,
        mass=1.0,
        dt=5e-3,
        steps=180,
    )


@pytest.fixture(scope="module")
def simulation_of_bursts():
    """A simulation whose list has overflowed during its run."""
    simulation = Simulation(burst())
    simulation.load(burst())
    simulation.run()
    yield simulation
    simulation.close()


@pytest.mark.long
def test_a_list_overflow_does_not_stop_solid_particles(simulation_of_bursts):
    """The step after the growth of the list must not be mistaken for one in which particles pass through each
    other."""
    (result,) = simulation_of_bursts.results()
    assert result.status.ok, result.status.reason
    assert result.time == burst().duration
    assert simulation_of_bursts.assembly.pairs.half_list.row > half_list.ListSizes().row


@pytest.fixture
def fresh():
    """A simulation whose list has its initial length."""
    simulation = Simulation(burst())
    yield simulation
    simulation.close()


@pytest.fixture
def kept(monkeypatch):
    """8 MB of cached memory, which is freed on request."""

    @in_taichi_thread
    def keep():
        builder = Builder()
        builder.dense(ti.i, 2**20).place(ti.field(ti.f64))
        return [memory.Tree(builder)]

    kept = keep()
    monkeypatch.setattr(memory, "reclaimers", [*memory.reclaimers, lambda: kept and kept.pop().destroy()])
    return kept


@pytest.mark.slow
def test_an_overflowing_list_grows_without_changing_bits(fresh, kept, monkeypatch):
    """Compared are a run that grows its list, a run whose list is long enough, and runs with given skins.

    The list can grow only after the cached memory is freed.
    """
    simulation, rows, ends = fresh, [], []
    simulation.load(burst())
    without = memory.bytes_in_use() - kept[0].bytes
    monkeypatch.setattr(runtime, "memory", lambda: 2 * without + 400_000)
    for skin in (None, None, 0.002, 0.02):
        simulation.load(burst().model_copy(update={"skin": skin}))
        simulation.run()
        ends += simulation.results()
        rows.append(simulation.assembly.pairs.half_list.row)
    assert half_list.ListSizes().row < rows[0] == rows[1]
    assert not kept
    for end in ends:
        assert end.status.ok, end.status.reason
        for name, values in ends[0].state.items():
            np.testing.assert_array_equal(values, end.state[name], err_msg=name)
        assert ends[0].work == end.work


@pytest.mark.slow
def test_the_skin_follows_the_speed_also_with_two_moves_in_a_step():
    """The stepper of Boris reports the displacement before the list is built."""
    speed, dt, diameter = 1.0, 1e-3, 0.2
    made = scene(
        [[0, 0, 0], [0, 0, 2]],
        [[speed, 0, 0], [-speed, 0, 0]],
        (SoftShell(stiffness=1.0, width=1e-9),),
        radius=diameter / 2,
        mass=1.0,
        stepper=Boris(control=FixedStep(dt=dt)),
        duration=200 * dt,
    )
    simulation = Simulation(made)
    simulation.load(made)
    simulation.run()
    u = speed * dt / 2 / diameter / (1 - half_list.REACH_PART)
    # The skin of x diameters minimises the cost 2 u / x * REBUILD_COST + n (1 + x)^3.
    x = np.linspace(0.01, 0.5, 4901)
    cost = 2 * u / x * half_list.REBUILD_COST + half_list.FEWEST_PAIRS * (1 + x) ** 3
    assert chosen_skin(simulation) == pytest.approx(diameter * x[np.argmin(cost)], rel=1e-2)
    simulation.close()


@in_taichi_thread
def chosen_skin(simulation):
    return simulation.assembly.pairs.half_list.grid.skin[0, 0]


@pytest.mark.slow
def test_lists_do_not_grow_beyond_the_memory_of_the_machine(monkeypatch):
    """The last good state is kept, and another simulation can still be made."""
    made = burst()
    simulation = Simulation(made)
    simulation.load(made)
    row = simulation.assembly.pairs.half_list.row
    # Free the memory that earlier tests have left.
    memory.reclaim()
    present = memory.bytes_in_use()
    monkeypatch.setattr(runtime, "memory", lambda: present + 1000)
    simulation.run()
    assert simulation.assembly.pairs.half_list.row == row
    (result,) = simulation.results()
    message = (
        r"lists of \d+ pairs for a particle, .* memory of all fields must be within the .* GB that are left"
    )
    assert result.status.failed
    assert re.search(message, result.status.reason)
    assert 0 < result.time < made.duration
    with pytest.raises(InputError, match=r"memory for 1 x \d+ particles must be within the \d+ GB"):
        Simulation(made)
    monkeypatch.undo()
    simulation.load(made)
    simulation.run()
    assert simulation.results()[0].status.ok
    simulation.close()


@pytest.mark.long
def test_the_first_list_of_a_run_is_independent_of_earlier_runs(simulation_of_bursts):
    simulation, made = simulation_of_bursts, burst()
    skins = []
    for _ in range(2):
        simulation.load(made)
        skins.append(chosen_skin(simulation))
        simulation.run(steps=100)
    assert skins[0] == skins[1] < chosen_skin(simulation)


@pytest.mark.long
def test_repeated_loads_allocate_only_once(simulation_of_bursts, monkeypatch):
    """Large systems are checked on the device."""
    monkeypatch.setattr(monitor, "LARGE", 1)
    simulation = simulation_of_bursts
    for _ in range(3):
        simulation.load(burst())
    trees = len(simulation.trees)
    simulation.load(burst())
    assert len(simulation.trees) == trees


def through_a_ring(steps=60, n=18, dt=0.05, window=0.06, gap=0.01):
    """A grain flies through a ring of larger grains, all of which are in its list within ``window``."""
    small, large = 1.0, 1.5
    width = np.sqrt((2 * small + large + gap) ** 2 - window**2)
    angle = 2 * np.pi * np.arange(n) / n
    ring = width * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    position = np.concatenate([[[-1.513, 0.0, 0.0]], ring])
    velocity = np.zeros_like(position)
    velocity[0, 0] = 1.0
    law = SoftShell(stiffness=1e-9, width=gap)
    radius = np.concatenate([[small], np.full(n, large)])
    return scene(position, velocity, (law,), radius=radius, mass=1.0, dt=dt, steps=steps)


@pytest.mark.slow
def test_a_list_overflow_missing_in_the_replay_stops_no_world(monkeypatch):
    """In a replay from an image the list is rebuilt in other steps, none of them in the ring.

    The list then does not overflow, and the world must not fail.
    """
    monkeypatch.setattr(replay, "EVERY", 0.0)
    monkeypatch.setattr(replay, "IMAGES", np.inf)
    made = through_a_ring()
    simulation = Simulation(made)
    row = simulation.assembly.pairs.half_list.row
    simulation.load(made)
    # An image four steps before the list overflows, in step 31.
    simulation.run(steps=27)
    simulation.run()
    (result,) = simulation.results()
    assert result.status.ok, result.status.reason
    assert result.work["steps"] == 60
    assert simulation.assembly.pairs.half_list.row > row
    simulation.close()
