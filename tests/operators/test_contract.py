"""Guarantees of the core to operators: rules 8 and 12 of tisim/effects/base."""

from __future__ import annotations

import numpy as np
import pytest

from tests.scenes import by_id, scene, usual
from tests.throwaway import SoftShell, SoftShellOfAll
from tisim import Box, InputError, Simulation, run
from tisim.backend.taichi import ti
from tisim.effects import Agglomeration, Impact
from tisim.operators import Operator
from tisim.operators.base import adding
from tisim.state.fields import Field, WorldField
from tisim.steppers import ApproachTime, Verlet


class Census(Operator):
    """Counts its calls, although no pair events occur."""

    world_fields = (WorldField("censuses", "counter"),)

    @ti.func
    def world(self, s, w):
        s.censuses[w] += 1


class Poison(Operator):
    """Makes one component of one particle NaN after a number of steps."""

    axis: int = 0

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.steps[w] == 20 and i == 7:
            s.position[w, i][self.axis] = ti.sqrt(-s.mass[w, i])


@pytest.mark.parametrize("wrong", [{"slots": 3}, {"integer": True}, {"components": 3, "slots": 3}])
def test_a_field_that_could_not_be_merged_is_refused(wrong):
    """The refusal comes when the scene is made, not at a merge, where the compiler would stop or a fraction
    would be lost."""
    with pytest.raises(TypeError, match="field tag"):
        Field("tag", "", **wrong)


def test_an_operator_with_a_capacity_must_add_particles():
    """Without the base class it would get no memory, and would append nothing."""

    class Crowd:
        label = "crowd"

        def capacity(self, masses):
            return 2 * len(masses)

    rule = "effects.crowd must be of a class derived from AddsParticles, because it defines capacity"
    with pytest.raises(InputError, match=f"^{rule}; received Crowd$"):
        adding([Census(), Crowd()])


def test_an_operator_sees_every_world_once_a_step():
    result = run(scene([[0, 0, 0]], [[0, 0, 0]], (Census(),), dt=0.1, steps=10))
    assert result.work["censuses"] == 10


class Take(Operator):
    """Removes a particle in the world stage."""

    terms = 1

    @ti.func
    def each(self, s, w, i):
        if s.id[w, i] == 1:
            s.remove(w, i)
        return ti.Vector([ti.cast(0.0, ti.f64)])

    @ti.func
    def world(self, s, w):
        pass


class Tally(Operator):
    """Counts the particles for which it is called."""

    world_fields = (WorldField("tallied", "counter"),)
    terms = 1

    @ti.func
    def each(self, s, w, i):
        return ti.Vector([ti.cast(1.0, ti.f64)])

    @ti.func
    def world(self, s, w):
        s.tallied[w] += ti.cast(self.sums.total(w)[0], ti.i64)


def test_removed_particles_are_skipped_by_later_operators():
    place = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    result = run(scene(place, np.zeros((3, 3)), (Take(), Tally()), dt=0.1, steps=1))
    assert len(result.state["mass"]) == 2 == result.work["tallied"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("schedule", "axis", "images"),
    [("world", 0, True), pytest.param("particle", 2, False, marks=pytest.mark.slow)],
)
def test_a_nan_among_listed_particles_is_a_clear_failure(schedule, axis, images, rng):
    """The world has too many particles for an all-pairs search, and the bad particle belongs to no cell."""
    wanted = scene(
        rng.uniform(0, 1, (300, 3)),
        rng.normal(size=(300, 3)),
        (SoftShell(stiffness=1.0, width=0.05), Poison(axis=axis)),
        radius=0.01,
        dt=1e-4,
        steps=40,
        domain=Box(low=(0, 0, 0), high=(1, 1, 1), images=images),
    )
    simulation = Simulation(wanted, schedule=usual(schedule))
    simulation.load([wanted])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    assert not result.status.ok
    assert "not finite" in result.status.reason
    assert all(np.isfinite(values).all() for values in result.state.values())


@pytest.mark.slow
def test_a_merger_at_a_face_ends_inside_and_can_restart():
    """Two grains bond in the last step across a face of the box."""
    wanted = scene(
        [[0.9993, 0.5, 0.5], [0.0011, 0.5, 0.5]],
        [[10.0, 0, 0], [-10.0, 0, 0]],
        (Impact(hardness=1.0), Agglomeration()),
        radius=1e-3,
        dt=1e-6,
        steps=1,
        domain=Box(low=(0, 0, 0), high=(1, 1, 1)),
    )
    state = run(wanted).state
    assert len(state["mass"]) == 1
    assert ((state["position"] >= 0) & (state["position"] < 1)).all()


class Teleport(Operator):
    """Every tenth step, moves the first grain of a world across the box and out of it."""

    @ti.func
    def world(self, s, w):
        if s.steps[w] % 10 == 0:
            s.position[w, 0] += ti.Vector([0.7, 0.9, 1.3])
            s.invalidate_lists(w)


@pytest.mark.slow
def test_lists_follow_changes_by_operators(rng):
    """A grain that is moved collides with the grains at its new position, which is wrapped into the box."""
    results = []
    position, velocity = rng.uniform(0.0, 1.0, (200, 3)), rng.normal(size=(200, 3))
    for kind in (SoftShell, SoftShellOfAll):
        made = scene(
            position,
            velocity,
            (kind(stiffness=1.0, width=0.05), Teleport()),
            radius=0.03,
            dt=1e-3,
            steps=45,
            domain=Box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)),
        )
        results.append(run(made))
    listed, everyone = (by_id(result) for result in results)
    assert ((listed["position"] >= 0) & (listed["position"] < 1)).all()
    np.testing.assert_allclose(listed["position"], everyone["position"], rtol=0, atol=1e-9)


class Leave(Operator):
    """Removes the last particle in the first step."""

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.id[w, i] == 2 and s.steps[w] == 1:
            s.remove(w, i)


@pytest.mark.long
def test_step_control_sees_the_pairs_that_a_removal_leaves():
    """A gap of 0.8 m at 1 m/s takes one step of 0.5 s, the longest, and one of 0.3 s until the surfaces
    meet."""
    wanted = scene(
        [[0, 0, 0], [1, 0, 0], [0, 9, 0]], [[1, 0, 0], [0, 0, 0], [0, 0, 0]], (Leave(),),
        radius=0.1, dt=1, steps=2,
    ).model_copy(update={"stepper": Verlet(control=ApproachTime(longest=0.5))})  # fmt: skip
    simulation = Simulation(wanted)
    simulation.load([wanted])
    simulation.run(steps=2)
    (result,) = simulation.results()
    assert len(result.state["mass"]) == 2
    assert result.time == pytest.approx(0.8, rel=1e-5)
