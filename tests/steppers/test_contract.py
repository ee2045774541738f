"""A stepper unknown to the core: implicit, with an iteration around lists and forces."""

import numpy as np
import pytest

from tests.pairs.test_short_ranged import shells
from tests.scenes import scene, simulate
from tests.self_consistent.test_self_consistent import cloud
from tests.throwaway import SoftShell, SoftShellOfAll, Trap
from tisim import Scene
from tisim.backend.taichi import ti
from tisim.effects import parameter
from tisim.program.phases import PerParticle, Phase, Repeat
from tisim.state.fields import Field, WorldField
from tisim.steppers import Controller, Step, Stepper


class Begin(Phase):
    """Sets the step length from the controller, cut at the end of the run."""

    def __init__(self, context) -> None:
        self.s, self.control = context.s, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.dt[w] = ti.min(self.control.next(s, w, 0.0), s.end[w] - s.time[w])
        s.time[w] += s.dt[w]
        s.steps[w] += 1
        s.unsolved[w] = 1.0


class Keep(PerParticle):
    """Stores the state at the beginning of the step."""

    @ti.func
    def run(self, w, i):
        s = self.s
        s.position_before[w, i], s.velocity_before[w, i] = s.position[w, i], s.velocity[w, i]
        s.force_before[w, i] = s.force[w, i]


class Correct(PerParticle):
    """v' = v + dt/m (F + F')/2, r' = r + dt (v + v')/2. Lists and forces need positions inside the domain."""

    def __init__(self, context) -> None:
        super().__init__(context.s)
        self.domain = context.domain

    @ti.func
    def run(self, w, i):
        s = self.s
        dt = ti.cast(s.dt[w], s.real)
        v = s.velocity_before[w, i] + 0.5 * dt / s.mass[w, i] * (s.force_before[w, i] + s.force[w, i])
        r = s.position_before[w, i] + 0.5 * dt * (s.velocity_before[w, i] + v)
        r = self.domain.wrap(w, r, s.time[w])
        change = self.domain.nearest(w, s.position[w, i], r, s.time[w]).norm()
        ti.atomic_max(s.largest_change[w], ti.cast(change, ti.f64))
        s.velocity[w, i], s.position[w, i] = v, r


class Judge(Phase):
    """Continues while anything moves; the pair list is rebuilt every time."""

    def __init__(self, context) -> None:
        self.s, self.tolerance = context.s, context.stepper.tolerance
        self.lists, self.listed = context.neighbour_lists, bool(context.update_lists)

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.corrections[w] += 1
        s.unsolved[w] = ti.select(s.largest_change[w] > self.tolerance(w), 1.0, 0.0)
        s.largest_change[w] = 0.0
        if ti.static(self.listed):
            self.lists.invalidate(w)


class Iteration(Repeat):
    def __init__(self, s, items) -> None:
        super().__init__(items)
        self.s = s

    @ti.func
    def pending(self, w):
        return ti.cast(self.s.unsolved[w], ti.i32)


class Implicit(Stepper):
    """Trapezoidal rule by fixed-point iteration."""

    world_fields = (
        WorldField("corrections", "counter"),
        WorldField("unsolved", "real"),
        WorldField("largest_change", "real"),
    )
    control: Controller
    tolerance: float = parameter("m", "tolerance", 1e-14, gt=0)

    def fields(self, effects):
        return (
            Field("position_before", "m", 3, "keep"),
            Field("velocity_before", "m/s", 3, "keep"),
            Field("force_before", "N", 3, "keep"),
        )

    def step(self, context):
        correct = (*context.update_lists, *context.sum_forces, Correct(context), Judge(context))
        return Step((Begin(context), Keep(context.s), Iteration(context.s, correct)))


def implicit(setup: Scene, **more) -> Scene:
    return setup.model_copy(update={"stepper": Implicit(control=setup.stepper.control, **more)})


def test_the_stepper_is_of_second_order_and_conserves_energy():
    """The trapezoidal rule conserves the energy of a linear spring exactly for any step."""
    stiffness, end = 4.0, 3.0
    steps = 2 ** np.arange(6, 11)
    scenes = [
        implicit(
            scene(
                [[1.0, 0, 0]], [[0, 1.0, 0]], (Trap(stiffness=stiffness),), mass=1.0, dt=end / n, steps=int(n)
            )
        )
        for n in steps
    ]
    results = simulate(scenes, worlds=len(scenes))
    angle = np.sqrt(stiffness) * end
    errors = [abs(r.state["position"][0, 0] - np.cos(angle)) for r in results]
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.02)
    for result, n in zip(results, steps, strict=True):
        state = result.state
        energy = 0.5 * (state["velocity"] ** 2).sum() + 0.5 * stiffness * (state["position"] ** 2).sum()
        assert energy == pytest.approx(0.5 + 0.5 * stiffness, rel=1e-12)
        assert result.work["steps"] == n
        assert result.work["corrections"] > 3 * n


def test_parameters_may_differ_per_world_and_are_written_to_files():
    setup = scene([[1.0, 0, 0]], [[0, 1.0, 0]], (Trap(stiffness=4.0),), mass=1.0, dt=0.1, steps=30)
    loose, tight = implicit(setup, tolerance=1e-4), implicit(setup, tolerance=1e-12)
    assert loose.structure() == tight.structure()
    assert Scene.from_dict(tight.to_dict()).digest() == tight.digest()
    assert "tolerance = 1e-12" in tight.to_toml()
    a, b = simulate([loose, tight], worlds=5)
    assert a.work["corrections"] < b.work["corrections"] / 2


@pytest.mark.slow
def test_lists_and_forces_in_an_iteration():
    """Short-ranged forces with lists rebuilt in the iteration equal forces over all pairs."""
    results = []
    for kind in (SoftShell, SoftShellOfAll):
        setup = implicit(shells(kind, np.random.default_rng(3), True), tolerance=1e-13)
        results += simulate([setup], capacity=300, schedule="particle")
    listed, everyone = results
    assert listed.status.ok
    assert np.abs(listed.state["velocity"] - listed.start["velocity"]).max() > 0.1
    np.testing.assert_allclose(listed.state["velocity"], everyone.state["velocity"], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_self_consistent_quantities_are_nested_iterations():
    """Induced dipoles are solved in every correction of every step; both schedules agree to the bit."""
    scenes = [implicit(cloud(1), tolerance=1e-13), implicit(cloud(2, chi=5.0), tolerance=1e-12)]
    results = [simulate(scenes, worlds=2, schedule=schedule) for schedule in ("world", "particle")]
    for a, b in zip(*results, strict=True):
        assert a.work == b.work
        assert a.work["mutual_sweeps"] > a.work["corrections"] > 20
        for name in ("position", "velocity", "dipole"):
            np.testing.assert_array_equal(a.state[name], b.state[name])
    explicit = simulate([cloud(1)], worlds=2)[0]
    np.testing.assert_allclose(results[0][0].state["position"], explicit.state["position"], rtol=0, atol=1e-4)
