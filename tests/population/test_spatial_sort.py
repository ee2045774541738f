"""Particles are sorted in memory during a run; results keep the order of the start."""

import itertools

import numpy as np
import pytest

from tests.compare import same_result
from tests.effects.contact import sheared
from tests.effects.contact.grains import heap
from tests.scenes import by_id
from tisim import Simulation
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.engine import checkpoint
from tisim.geometry import Plane
from tisim.operators import Outflow, Passage
from tisim.pairs import pair_chunks
from tisim.population import spatial_sort

pytestmark = pytest.mark.long

GRAINS, STEPS, EVERY = 200, 100, 40
THROWN = 3


def bed(seed, n=GRAINS, exit_height=-1e3):
    """Grains in random order in a cell too small for them; grains below a height (m) are counted and
    removed."""
    made = heap(np.random.default_rng(seed), n, side=2.7, dt=2e-4, steps=STEPS)
    planes = [Plane(point=(0.0, 0.0, exit_height))]
    return made.model_copy(
        update={"effects": (*made.effects, Passage(planes=planes), Outflow(planes=planes))}
    )


def made(patch, schedule, least, worlds=2, scene=None):
    patch.setattr(pair_chunks, "CHUNK_SLOTS", 32)
    patch.setattr(spatial_sort, "SORTED_FROM", least)
    patch.setattr(spatial_sort, "SORT_EVERY", EVERY)
    return Simulation(scene or bed(0), worlds=worlds, capacity=GRAINS, schedule=schedule)


@pytest.fixture(scope="module")
def simulation():
    """Worlds of 150 or more particles are sorted."""
    with pytest.MonkeyPatch.context() as patch:
        simulation = made(patch, "world", 150)
    yield simulation
    simulation.close()


@pytest.fixture(scope="module")
def unsorted():
    with pytest.MonkeyPatch.context() as patch:
        simulation = made(patch, "particle", GRAINS + 1)
    yield simulation
    simulation.close()


def ends(simulation, scenes):
    simulation.load(scenes)
    simulation.run()
    results = simulation.results()
    assert all(result.status.ok for result in results), results[0].status.reason
    return results


@pytest.fixture(scope="module")
def usual(simulation):
    return ends(simulation, [bed(1), bed(2, 140)])


def test_memory_is_sorted_but_results_are_not(simulation, usual):
    sorted_ids, others = simulation.s.read("id")
    assert (np.diff(sorted_ids) < 0).any()
    assert (np.diff(others[:140]) == 1).all()
    for result in usual:
        n = len(result.state["id"])
        np.testing.assert_array_equal(result.state["id"], np.arange(n))
        np.testing.assert_array_equal(result.state["radius"], result.start["radius"])


def neighbour_distance(simulation):
    """Mean distance between particles that are adjacent in memory."""
    return np.linalg.norm(np.diff(simulation.s.read("position")[0], axis=0), axis=1).mean()


def test_neighbours_lie_near_each_other(simulation, usual):
    simulation.load([bed(1)])
    before = neighbour_distance(simulation)
    simulation.run(steps=1)
    assert neighbour_distance(simulation) < 0.6 * before


def test_batches_and_restarts_do_not_change_bits(simulation, usual, tmp_path):
    same_result(ends(simulation, [bed(2, 140), bed(1)])[1], usual[0])
    for stop in (EVERY, EVERY + 7):
        simulation.load([bed(1), bed(2, 140)])
        simulation.run(steps=stop)
        simulation.checkpoint(tmp_path / "half.h5")
        kept = simulation.results()
        simulation.run(steps=3)
        simulation.restore(tmp_path / "half.h5")
        simulation.run()
        for found, expected in zip(simulation.results(), usual, strict=True):
            same_result(found, expected)
        for state, expected in zip(checkpoint.snapshot(tmp_path / "half.h5").states, kept, strict=True):
            np.testing.assert_array_equal(state["position"], expected.state["position"])


def alike(found, expected):
    """Equal grains and quantities, to rounding."""
    assert found.work == expected.work
    assert found.measures == pytest.approx(expected.measures, rel=1e-9)
    one, other = by_id(found), by_id(expected)
    np.testing.assert_array_equal(one["id"], other["id"])
    for name in ("position", "velocity", "spin", "force", "granular_past"):
        values, scale = [one[name], other[name]], np.abs(other[name]).max()
        if name == "granular_past":
            # The partners of a grain may be stored in any order.
            values = [np.sort(each.reshape(len(each), -1)) for each in values]
        np.testing.assert_allclose(*values, rtol=0, atol=1e-9 * scale, err_msg=name)


@pytest.mark.slow
def test_results_equal_an_unsorted_run_to_rounding(unsorted, usual):
    assert unsorted.sort is None
    alike(usual[0], ends(unsorted, [bed(1)])[0])


@pytest.mark.slow
def test_grains_are_removed_from_a_sorted_world(simulation, unsorted, tmp_path):
    """Compared with an unsorted world, in a batch, and in a restarted run."""
    leaving = bed(3, exit_height=0.4)
    # Removed grains are replaced by grains from the end, so the order of ids alone does not prove the sort.
    assert simulation.sort is not None
    assert unsorted.sort is None
    (alone,) = ends(simulation, [leaving])
    assert (np.diff(simulation.s.read("id")[0, : len(alone.state["id"])]) < 0).any()
    assert 20 < alone.work["outflow"] == GRAINS - len(alone.state["id"]) < GRAINS - 100
    assert alone.measures["passed_mass"] == alone.measures["outflow_mass"] > 0
    alike(alone, ends(unsorted, [leaving])[0])
    same_result(ends(simulation, [bed(1), leaving])[1], alone)
    simulation.load([leaving])
    simulation.run(steps=EVERY + 7)
    assert 0 < simulation.results()[0].work["outflow"] < alone.work["outflow"]
    simulation.checkpoint(tmp_path / "half.h5")
    simulation.run(steps=3)
    simulation.restore(tmp_path / "half.h5")
    simulation.run()
    same_result(simulation.results()[0], alone)


def test_a_failure_after_a_sort_names_the_particle_and_keeps_the_state(simulation, usual):
    """A grain becomes so fast that the state is not finite, after another particle has taken its slot in
    memory."""

    def thrown(steps=None):
        simulation.load([bed(1), bed(2, 140)])
        simulation.run(steps=EVERY + 1)
        velocity = simulation.states[0]["velocity"].copy()
        velocity[THROWN] = (1e200, 0.0, 0.0)
        simulation.states[0]["velocity"] = velocity
        simulation.run(steps=steps)
        return simulation.results()

    failed, other = thrown()
    same_result(other, usual[1])
    assert simulation.s.read("id")[0, THROWN] != THROWN
    assert not failed.status.ok
    assert f"at particle {THROWN}" in failed.status.reason
    good = failed.work["steps"] - EVERY - 1
    same_result(thrown(good)[0], failed)


def test_states_written_between_runs_reach_the_right_particles(simulation, usual):
    simulation.load([bed(1)])
    simulation.run(steps=EVERY + 1)
    velocity = simulation.state["velocity"].copy()
    velocity[3] = (1.0, 2.0, 3.0)
    simulation.state["velocity"] = velocity
    np.testing.assert_array_equal(simulation.state["velocity"], velocity)
    memory = simulation.s.read("id")[0]
    np.testing.assert_array_equal(simulation.s.read("velocity")[0, memory == 3], [[1.0, 2.0, 3.0]])


@pytest.mark.slow
def test_both_schedules_have_the_same_bits(usual):
    with pytest.MonkeyPatch.context() as patch:
        other = made(patch, "particle", 150)
    for found, expected in zip(ends(other, [bed(1), bed(2, 140)]), usual, strict=True):
        same_result(found, expected)
    other.close()


@pytest.mark.slow
def test_grains_in_shear_equal_the_reference(rng):
    """Face crossings and images of particles in shear follow the repeatedly sorted particles."""
    crowd = sheared.crowd(rng, n=GRAINS, sides=1.5 * sheared.SIDES)
    with pytest.MonkeyPatch.context() as patch:
        simulation = made(patch, "world", GRAINS, scene=crowd)
    (result,) = ends(simulation, [crowd])
    assert (np.diff(simulation.s.read("id")[0]) < 0).any()
    simulation.close()
    reference = sheared.ShearedGrains(crowd)
    reference.run(sheared.STEPS, sheared.DT)
    place, velocity = sheared.inside(crowd.domain, reference.x, reference.v, result.time)
    sides = np.subtract(crowd.domain.high, crowd.domain.low)
    off = result.state["position"] - place
    # On a face one image may stand for the other.
    assert np.abs(off - sides * np.round(off / sides)).max() < 1e-10
    for name, values in {"velocity": velocity, "spin": reference.w}.items():
        scale = np.abs(values).max()
        np.testing.assert_allclose(result.state[name], values, rtol=0, atol=1e-10 * scale, err_msg=name)


def bricks(dims):
    """The cells of a grid in order: bricks along x, then y, then z, and the same for the cells in each
    brick."""
    numbers = [range(0, n, spatial_sort.BRICK) for n in dims]
    for z, y, x in itertools.product(*reversed(numbers)):
        ends = [min(k + spatial_sort.BRICK, n) for k, n in zip((x, y, z), dims, strict=True)]
        for inner in itertools.product(range(z, ends[2]), range(y, ends[1]), range(x, ends[0])):
            yield inner[::-1]


def test_cells_are_numbered_brick_by_brick(simulation):
    grid = simulation.assembly.sort.grid

    @ti.kernel
    def number(x: ti.i32, y: ti.i32, z: ti.i32) -> ti.i32:
        return grid.cell_index(0, 0, ti.Vector([x, y, z]))

    @in_taichi_thread
    def numbers(dims):
        for k, n in enumerate(dims):
            grid.dims[0, 0, k] = n
        grid.offset[0, 0] = 0
        return [number(*at) for at in bricks(dims)]

    for dims in ((9, 17, 5), (8, 1, 10)):
        assert numbers(dims) == list(range(np.prod(dims)))
