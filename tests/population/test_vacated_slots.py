"""Removed particles: the order in which their slots are filled, and sums over all particles for an
operator."""

import numpy as np
import pytest

from tests.scenes import scene, usual
from tisim import Simulation
from tisim.backend.taichi import ti
from tisim.operators import Operator
from tisim.program import scans as prefix_sum
from tisim.state.fields import Field, WorldField

N, STEPS = 300, 6


class Cull(Operator):
    """Removes each particle in a given step, in the particle stage or in the world stage, and sums the
    masses."""

    fields = (
        Field("step_of_end", "", 1, "keep", integer=True),
        Field("by_itself", "", 1, "keep", integer=True),
    )
    world_fields = (WorldField("culled", "counter"), WorldField("culled_mass", "measure"))
    terms = 2

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.step_of_end[w, i] == s.steps[w] and s.by_itself[w, i] > 0:
            s.remove(w, i)

    @ti.func
    def each(self, s, w, i):
        terms = ti.Vector.zero(ti.f64, self.terms)
        if s.step_of_end[w, i] == s.steps[w] and s.by_itself[w, i] == 0:
            terms = ti.Vector([ti.cast(1.0, ti.f64), ti.cast(s.mass[w, i], ti.f64)])
            s.remove(w, i)
        return terms

    @ti.func
    def world(self, s, w):
        total = self.sums.total(w)
        s.culled[w] += ti.cast(total[0], ti.i64)
        s.culled_mass[w] += total[1]


def filled(order, gone):
    """The ids in memory after removals: the last particle fills the first free slot, one by one."""
    left, k = list(order), 0
    while k < len(left):
        if left[k] in gone:
            last = left.pop()
            if k < len(left):
                left[k] = last
        else:
            k += 1
    return left


@pytest.fixture(scope="module", params=["world", pytest.param("particle", marks=pytest.mark.slow)])
def culled(request):
    """Scenes, and the ids in memory after each step; slots and particles extend over several blocks."""
    rng = np.random.Generator(np.random.Philox(7))
    scenes = []
    for number in (N, N - 101, 1):
        quantities = {
            "step_of_end": rng.integers(1, STEPS + 3, number),
            "by_itself": rng.integers(0, 2, number),
        }
        scenes.append(
            scene(
                rng.normal(size=(number, 3)), np.zeros((number, 3)), (Cull(),),
                mass=rng.uniform(1.0, 2.0, number), dt=1.0, steps=STEPS, quantities=quantities,
            )
        )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prefix_sum, "LEAST_BLOCK", {"cpu": 16})
        simulation = Simulation(scenes[0], worlds=len(scenes), schedule=usual(request.param))
    simulation.load(scenes)
    states = []
    for _ in range(STEPS):
        simulation.run(steps=1)
        states.append([{name: now[name] for name in ("id", "mass", "position")} for now in simulation.states])
    yield scenes, states, simulation.results()
    simulation.close()


def test_slots_are_filled_from_the_end(culled):
    """All fields of a particle move together."""
    scenes, states, _ = culled
    for w, made in enumerate(scenes):
        start = made.particles.quantities
        order = list(range(len(made.particles.mass)))
        for step, now in enumerate(states, 1):
            ends = start["step_of_end"] == step
            for by_itself in (1, 0):
                order = filled(order, set(np.flatnonzero(ends & (start["by_itself"] == by_itself))))
            np.testing.assert_array_equal(now[w]["id"], order)
            np.testing.assert_array_equal(now[w]["mass"], made.particles.mass[order])
            np.testing.assert_array_equal(now[w]["position"], made.particles.position[order])
        assert len(order) < len(made.particles.mass) or w == 2


def test_terms_are_summed_over_all_particles(culled):
    scenes, _, results = culled
    for made, result in zip(scenes, results, strict=True):
        start = made.particles.quantities
        gone = (start["by_itself"] == 0) & (start["step_of_end"] <= STEPS)
        assert result.work["culled"] == gone.sum()
        assert result.measures["culled_mass"] == pytest.approx(made.particles.mass[gone].sum(), rel=1e-14)
