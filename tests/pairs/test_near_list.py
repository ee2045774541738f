"""Lists of near pairs compared with brute force: each near pair occurs once, with the larger member first."""

import time
from typing import ClassVar

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.compare import same_result
from tests.scenes import fixed, scene
from tisim import Box, Open, Simulation
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import Agglomeration, Friction, Impact, PairEvent
from tisim.engine import allocation
from tisim.pairs import near_list
from tisim.pairs.half_list import ListSizes
from tisim.pairs.neighbour_rows import ALL_PAIRS
from tisim.steppers import Verlet

WORLDS, CAPACITY, STEPS, DT = 18, 300, 5, 1.0


class Recorder(PairEvent):
    """Counts the visits of each pair and has no effect."""

    latest: ClassVar = None

    def connect(self, peers):
        Recorder.latest = ti.field(ti.i32, (WORLDS, CAPACITY, CAPACITY))
        return {"seen": Recorder.latest}

    @ti.func
    def contact(self, s, w, i, j, separation):
        ti.atomic_add(self.seen[w, i, j], 1)
        return -1.0


DOMAINS = {
    "joined": Box(low=(-1.0, -2.0, 0.0), high=(1.0, 2.0, 1.0)),
    "control volume": Box(low=(-1.0, -2.0, 0.0), high=(1.0, 2.0, 1.0), images=False),
    "slab": Box(low=(-1.0, -2.0, 0.0), high=(1.0, 2.0, 1.0), periodic=(True, False, True)),
    "open": Open(),
}
SOME = [
    pytest.param(
        domain, id=name, marks=[pytest.mark.slow] if name in ("control volume", "open", "slab") else []
    )
    for name, domain in DOMAINS.items()
]
LOW, HIGH = np.array([-1.0, -2.0, 0.0]), np.array([1.0, 2.0, 1.0])


def clouds(rng):
    """Names, positions and radii of clouds that are easy or difficult for a cell list."""

    def anywhere(n):
        return rng.uniform(LOW, HIGH, (n, 3))

    def faces(n):
        """Positions at fractions p/q of the sides, including the faces of the box."""
        q = rng.integers(1, 13, (n, 3))
        return LOW + (HIGH - LOW) * rng.integers(0, q) / q

    corner = np.where(rng.integers(0, 2, (200, 3)), LOW, np.nextafter(HIGH, LOW))
    yield "equal", anywhere(300), 0.03
    yield "equal and dense", anywhere(300), 0.15
    yield "points", anywhere(300), 1e-6
    for name in ("radii over three decades", "and again"):
        yield name, anywhere(300), 2e-4 * 1e3 ** rng.uniform(0, 1, 300)
    yield "one giant among dwarfs", anywhere(300), np.where(np.arange(300) == 150, 0.4, 4e-4)
    yield "on faces of cells and box", faces(300), 0.02
    yield "on faces, unequal", faces(300), 2e-4 * 1e3 ** rng.uniform(0, 1, 300)
    yield "in the corners", corner, 0.01
    yield "all in one cell", np.array([0.1, 0.2, 0.3]) + 1e-6 * rng.normal(size=(120, 3)), 1e-7
    yield "all in one place", np.tile([[0.1, 0.2, 0.3]], (80, 1)), 0.01
    yield "in a plane", anywhere(200) * [1, 1, 0] + [0, 0, 0.5], 0.02
    yield "in a line", anywhere(200) * [1, 0, 0] + [0, 0, 0.5], 0.001
    yield "one", anywhere(1), 0.1
    yield "two", anywhere(2), 0.24
    yield "last without a list", anywhere(near_list.SMALL_WORLD), 0.1
    yield "first with a list", anywhere(near_list.SMALL_WORLD + 1), 0.1


def motion(rng, n):
    """Most particles drift together; a few are much faster."""
    v = np.array([0.3, 0.0, -0.2]) + rng.normal(size=(n, 3)) * 0.01
    v[:: max(n // 5, 1)] += rng.normal(size=v[:: max(n // 5, 1)].shape) * 0.3
    return v


def near_pairs(position, radius, domain, horizon):
    """Pairs (larger, smaller) with surfaces within the horizon, from a k-d tree."""
    reach = 2 * radius.max() + horizon
    low, high = domain.bounds()
    periodic = np.array(domain.imaged())
    side = (high - low)[periodic] if periodic.any() else np.array([])
    if (reach > side / 2).any():
        pairs = np.array(np.triu_indices(len(position), 1)).T
    else:
        places, sides = position.copy(), np.zeros(3)
        if periodic.any():
            places[:, periodic], sides[periodic] = np.mod(position - low, high - low)[:, periodic], side
        tree = cKDTree(places, boxsize=sides if periodic.any() else None)
        pairs = tree.query_pairs(reach, output_type="ndarray")
    gap = position[pairs[:, 1]] - position[pairs[:, 0]]
    gap[:, periodic] -= side * np.round(gap[:, periodic] / side)
    near = np.linalg.norm(gap, axis=1) <= radius[pairs].sum(axis=1) + horizon
    pairs = np.sort(pairs[near], axis=1)
    swap = radius[pairs[:, 1]] > radius[pairs[:, 0]]
    pairs[swap] = pairs[swap][:, ::-1]
    return {tuple(pair) for pair in pairs.tolist()}


@pytest.mark.slow
@pytest.mark.parametrize("domain", SOME)
def test_every_near_pair_occurs_once_with_the_larger_member_first(rng, domain):
    """Checked at the start and after steps in which a few particles move far."""
    names, scenes = [], []
    for name, position, radius in clouds(rng):
        names.append(name)
        n = len(position)
        scenes.append(
            scene(
                position,
                motion(rng, n) * 0.1,
                (Recorder(),),
                radius=radius if np.ndim(radius) else np.full(n, radius),
                density=1.0,
                domain=domain,
                dt=DT,
                steps=STEPS + 3,
            )
        )
    simulation = Simulation(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    counts_on_device = Recorder.latest
    # Rows that were too short at first have been searched partly.
    in_taichi_thread(counts_on_device.fill)(0)
    simulation.begin()
    for step in range(STEPS):
        counts = in_taichi_thread(counts_on_device.to_numpy)()
        in_taichi_thread(counts_on_device.fill)(0)
        for w, (name, result) in enumerate(zip(names, simulation.results(), strict=True)):
            state, n = result.state, len(result.state["mass"])
            table = counts[w, :n, :n]
            owner, other = np.nonzero(table)
            larger = state["radius"][owner] > state["radius"][other]
            equal = state["radius"][owner] == state["radius"][other]
            where = f"{name}, step {step}"
            assert table.max(initial=0) <= 1, where
            assert (larger | (equal & (owner < other))).all(), where
            start = result.start
            reach = start["radius"].max()
            extent = np.ptp(start["position"], axis=0) + 2 * reach
            if any(domain.joined()):
                extent = np.where(domain.joined(), HIGH - LOW, extent)
            spacing = (np.prod(extent) / n) ** (1 / 3)
            horizon = near_list.HORIZON * spacing * (1 - 1e-12) if n > near_list.SMALL_WORLD else np.inf
            near = near_pairs(state["position"], state["radius"], domain, min(horizon, 10.0))
            missed = near - set(zip(owner.tolist(), other.tolist(), strict=True))
            assert not missed, f"{where}: missed {sorted(missed)[:5]}"
        grid = simulation.assembly.lists.near.grid
        cells = in_taichi_thread(grid.total.to_numpy)()[: len(scenes)]
        assert (cells <= grid.max_cells).all(), "cells beyond their memory"
        row = simulation.assembly.lists.near.row
        simulation.run(steps=1)
        if simulation.assembly.lists.near.row > row:
            # Rows that were too short have been searched partly, and then again.
            in_taichi_thread(counts_on_device.fill)(0)
            simulation.run(steps=1)
        assert (simulation.s.read("status")[: len(scenes)] == 0).all()
    # The cell list must be useful: for equal particles it visits a small part of all pairs.
    assert counts[0].sum() < 0.1 * 300 * 299 / 2


def crowd(rng, stepper, grains=300):
    """Grains that collide and merge until lists are replaced by an all-pairs search."""
    return scene(
        rng.uniform(-0.01, 0.01, (grains, 3)),
        np.array([100.0, 0, 0]) + rng.uniform(-1, 1, (grains, 3)) * [100, 10, 10],
        (Impact(hardness=2e6), Friction(coefficient=0.1), Agglomeration()),
        radius=4e-4 * 4.0 ** rng.uniform(0, 1, grains),
        domain=Box(low=(-0.01,) * 3, high=(0.01,) * 3, images=True),
        stepper=stepper,
        duration=4e-4,
    )


@pytest.fixture
def outcome(monkeypatch):
    """Run a scene with other settings of the near list and an initial row capacity."""

    def run(start, capacity=None, **settings):
        with monkeypatch.context() as patch:
            for name, value in settings.items():
                assert hasattr(near_list, name)
                patch.setattr(near_list, name, value)
            if capacity:
                patch.setattr(allocation, "ListSizes", lambda: ListSizes(near=capacity))
            simulation = Simulation(start)
            simulation.load([start])
            simulation.run()
            (result,) = simulation.results()
            simulation.close()
        assert result.status.ok
        return result

    return run


@pytest.mark.slow
def test_results_do_not_depend_on_the_skin(rng, outcome):
    """Lists rebuilt in every step and too short for most grains give the same bits, also with adaptive
    steps."""
    start = crowd(rng, Verlet())
    usual = outcome(start)
    assert usual.work["merges"] > 50
    assert usual.work["impacts"] > usual.work["merges"]
    same_result(usual, outcome(start, capacity=2, STEPS_OF_SKIN=0.0))


@pytest.mark.slow
def test_results_do_not_depend_on_lists_at_all(rng, outcome):
    """With fixed steps, cell lists and an all-pairs search give the same bits."""
    start = crowd(rng, fixed(4e-6))
    usual = outcome(start)
    assert usual.work["impacts"] > 100
    same_result(usual, outcome(start, SMALL_WORLD=10**4))


def falling_together(steps=40, dt=1e-4, radius=1e-4):
    """Distant grains contract until each has all others near it; a grain of 20 times the radius falls onto
    them."""
    site = 14 * radius * (np.arange(5) - 2.0)
    position = np.stack(np.meshgrid(site, site, site), axis=-1).reshape(-1, 3)
    position += 0.3 * radius * np.sin(np.arange(375.0)).reshape(-1, 3)
    velocity = -position / (steps * dt)
    half = 200 * radius
    return scene(
        np.concatenate([position, [[0.0, 0.0, 60 * radius]]]),
        np.concatenate([velocity, [[0.0, 0.0, -40 * radius / (steps * dt)]]]),
        (Impact(hardness=1e12),),
        radius=np.append(np.full(len(position), radius), 20 * radius),
        density=2000.0,
        domain=Box(low=(-half,) * 3, high=(half,) * 3),
        dt=dt,
        steps=steps,
    )


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["world", "particle"])
def test_overflowing_rows_grow_without_changing_bits(schedule):
    """Compared with a world that searches all pairs; one grain has 20 times the radius of the others."""
    start = falling_together()
    simulation = Simulation(start, 2, schedule=schedule)
    row = simulation.assembly.lists.near.row
    simulation.load([start, start])
    assert simulation.assembly.lists.near.row == row
    simulation.s.write("listed_above", np.array([0, ALL_PAIRS]))
    simulation.begin()
    compiled = simulation.setup_s
    began = time.perf_counter()
    simulation.run()
    seconds = time.perf_counter() - began
    # Compiling steps for longer lists does not count as run time.
    assert simulation.setup_s > compiled
    assert simulation.wall_s < seconds - (simulation.setup_s - compiled)
    listed, all_pairs = simulation.results()
    assert simulation.assembly.lists.near.row > max(row, 24)
    assert listed.work["impacts"] > 50
    same_result(listed, all_pairs)
    simulation.close()
