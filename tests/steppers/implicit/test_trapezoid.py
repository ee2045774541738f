"""The adaptive implicit stepper: its iteration, its step control, and its failures."""

import numpy as np
import pytest

from tests.pairs.test_short_ranged import grains, shells
from tests.scenes import scene, simulate
from tests.steppers.charged import PUSH, W, charged, equal_steps, final
from tests.steppers.closed_forms import driven
from tests.throwaway import SoftShell, SoftShellOfAll, Trap
from tisim import InputError, Simulation
from tisim.backend.taichi import ti
from tisim.effects import Force, Gravity, parameter
from tisim.engine.loading import check_start
from tisim.state.fields import CORE
from tisim.steppers import Collocation, ErrorControl, FixedStep, IterationControl, StageControl, Trapezoid


def with_stepper(setup, stepper, **more):
    return setup.model_copy(update={"stepper": stepper, **more})


@pytest.mark.slow
def test_schedules_agree_and_momentum_is_kept():
    """With rejected attempts and list rebuilds: the same bits, and momentum to rounding."""
    setup = with_stepper(
        shells(SoftShell, np.random.default_rng(3), True),
        Trapezoid(
            control=IterationControl(first=4e-3, longest=4e-3, shortest=1e-6, tolerance=1e-9, iterations=12)
        ),
    )
    a, b = (simulate([setup], capacity=300, schedule=schedule)[0] for schedule in ("world", "particle"))
    assert a.status.ok
    assert a.work == b.work
    assert a.work["rejections"] > 3
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(a.state[name], b.state[name])
    momentum = (a.state["mass"][:, None] * (a.state["velocity"] - a.start["velocity"])).sum(axis=0)
    np.testing.assert_allclose(momentum, 0, atol=1e-11 * a.state["mass"].sum())
    assert np.abs(a.state["velocity"] - a.start["velocity"]).max() > 1


@pytest.mark.slow
def test_acceleration_finds_the_same_solution_in_fewer_iterations():
    """Anderson acceleration with stiff repulsion and torques: less than 0.8 of the work, and agreement to
    1e-9 m."""
    plain, mixed = (
        simulate(
            [
                with_stepper(
                    shells(SoftShell, np.random.default_rng(3), True),
                    equal_steps(1e-3, tolerance=1e-12, acceleration=how),
                    duration=0.02,
                )
            ],
            capacity=300,
        )[0]
        for how in ("none", "anderson")
    )
    assert mixed.status.ok
    assert mixed.work["steps"] == plain.work["steps"]
    assert mixed.work["force_evaluations"] < 0.8 * plain.work["force_evaluations"]
    np.testing.assert_allclose(mixed.state["position"], plain.state["position"], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_acceleration_with_rotating_grains():
    """Torques are mixed together with forces; the solution equals plain iteration."""
    plain, mixed = (
        simulate(
            [with_stepper(grains(n=60), equal_steps(5e-4, tolerance=1e-12, acceleration=how), duration=0.01)],
            capacity=160,
        )[0]
        for how in ("none", "anderson")
    )
    assert mixed.status.ok
    assert np.abs(mixed.state["spin"]).max() > 0.1
    np.testing.assert_allclose(mixed.state["spin"], plain.state["spin"], rtol=0, atol=1e-7)
    np.testing.assert_allclose(mixed.state["velocity"], plain.state["velocity"], rtol=0, atol=1e-8)


def oscillator(stepper, duration=3.0, stiffness=4.0):
    return scene(
        [[1.0, 0, 0]],
        [[0, 1.0, 0]],
        (Trap(stiffness=stiffness),),
        mass=1.0,
        stepper=stepper,
        duration=duration,
    )


@pytest.mark.slow
def test_a_step_too_long_is_rejected_not_blown_up():
    """dt_0 is a thousand times too long: attempts are rejected until one converges, and the rest is right."""
    control = ErrorControl(first=10.0, longest=10.0, shortest=1e-9, error=1e-5, tolerance=1e-7)
    (result,) = simulate([oscillator(Trapezoid(control=control), stiffness=1e6, duration=1e-2)], worlds=2)
    assert result.status.ok
    assert result.work["rejections"] >= 3
    assert result.state["position"][0, 0] == pytest.approx(np.cos(1e3 * 1e-2), abs=2e-3)


@pytest.mark.long
def test_unsolvable_steps_name_time_particle_and_force():
    """The shortest step allowed is too long for the spring of one world; the other world continues."""
    control = IterationControl(first=1e-2, longest=1e-2, shortest=1e-2)
    stiff, soft = (oscillator(Trapezoid(control=control), stiffness=k) for k in (1e7, 1.0))
    failed, fine = simulate([stiff, soft], worlds=2)
    assert fine.status.ok
    assert not failed.status.ok
    assert (
        "cannot be solved even at the shortest step, by effects.trap, at particle 0" in failed.status.reason
    )
    np.testing.assert_array_equal(failed.state["position"], failed.start["position"])
    assert failed.time == 0.0


@pytest.mark.slow
def test_unsolvable_coupled_steps_are_named_too():
    """For interacting particles too, the state of the last good step is kept."""
    setup = with_stepper(
        shells(SoftShell, np.random.default_rng(3), True),
        Trapezoid(control=IterationControl(first=0.05, longest=0.05, shortest=0.05)),
    )
    (result,) = simulate([setup], capacity=300)
    assert (
        "cannot be solved even at the shortest step, by effects.soft_shell, at particle"
        in result.status.reason
    )
    assert np.isfinite(result.state["velocity"]).all()


class Late(Force):
    """No force up to a time, then one that is not finite."""

    when: float = parameter("s", "when")

    @ti.func
    def force(self, s, w, i, t):
        return ti.select(t > self.when(w), ti.math.inf, 0.0) * s.velocity[w, i]


@pytest.mark.long
@pytest.mark.parametrize("kind", [Trapezoid, pytest.param(Collocation, marks=pytest.mark.slow)])
def test_the_named_force_is_evaluated_at_the_failing_step(kind):
    """At the end of the last good step another force is the largest."""
    control = {Trapezoid: IterationControl(first=0.05, longest=0.05, shortest=0.01),
               Collocation: StageControl(first=0.05, longest=0.05, shortest=0.01)}[kind]  # fmt: skip
    effects = (
        Gravity(acceleration=(0.0, 0.0, -1.0)),
        SoftShellOfAll(stiffness=1.0, width=0.1),
        Late(when=0.52),
    )
    place, drift = [[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 0, 0]]
    stepper = kind(control=control)
    setup = scene(place, drift, effects, mass=1.0, stepper=stepper, duration=1.0)
    (result,) = simulate([setup], worlds=2)
    assert "by effects.late, at particle 0" in result.status.reason
    assert 0.4 < float(result.status.reason.split()[4]) <= 0.52
    assert np.isfinite(result.state["velocity"]).all()


@pytest.mark.slow
def test_particles_at_rest_have_no_error():
    """No velocity and no force would give 0/0 in the error norm; also a world in which no particle moves."""
    (result,) = simulate([oscillator(Trapezoid(), duration=1e-2, stiffness=0.0)], worlds=2)
    still = scene(
        [[0, 0, 0]], [[0, 0, 0]], (Trap(stiffness=1.0),), mass=1.0, stepper=Trapezoid(), duration=1e-2
    )
    (rest,) = simulate([still], worlds=2)
    for end, place in ((result, [1.0, 1e-2, 0]), (rest, [0, 0, 0])):
        assert end.status.ok
        np.testing.assert_allclose(end.state["position"][0], place, rtol=0, atol=1e-15)


@pytest.mark.long
def test_steps_of_the_paper_grow_and_shrink_with_the_iteration():
    """Z16's control: from dt_0 the step grows to dt_lim in an easy problem, and K stays below K_d."""
    (result,) = simulate([oscillator(Trapezoid(), duration=0.1)], worlds=2)
    # 0.1 s in steps of dt_lim is 400; growing from 1e-5 s by at most 4 takes three more.
    assert 400 <= result.work["particle_steps"] <= 405
    assert result.work["rejections"] == 0
    assert result.work["solver_iterations"] <= 2 * result.work["particle_steps"]


@pytest.mark.slow
def test_time_does_not_drift():
    """A million steps of 1e-6 s end at exactly one second, and the position of the oscillator is right."""
    setup = oscillator(equal_steps(1e-6, tolerance=1e-6), duration=1.0)
    (result,) = simulate([setup], worlds=2)
    assert result.time == 1.0
    assert result.work["particle_steps"] == 1_000_000
    assert result.state["position"][0, 0] == pytest.approx(np.cos(2.0), abs=1e-9)


@pytest.mark.long
def test_linear_terms_in_velocity_are_solved_exactly():
    """The rotation by B converges at w dt = 20, where plain iteration diverges, and keeps the speed."""
    setup = charged(equal_steps(20.0 / 3.0, tolerance=1e-12), 20.0, velocity=(0.6, -0.8, 0.0))
    (result,) = simulate([setup], worlds=1, capacity=1)
    assert result.status.ok
    assert result.work["force_evaluations"] == result.work["particle_steps"]
    assert np.linalg.norm(result.state["velocity"]) == pytest.approx(1.0, rel=1e-12)


def test_the_force_of_the_previous_iterate_suffices():
    """A step starts with the force from which its last iterate was made.

    At any tolerance the error equals the error of the fully solved rule, with little more than one force
    evaluation in a step.
    """
    errors, sums = [], []
    for tolerance in (1e-2, 1e-12):
        setup = charged(
            equal_steps(4.0 / 800, tolerance=tolerance), 4.0, stiffness=8.0, amplitude=1.5, omega=2.0
        )
        (result,) = simulate([setup], worlds=1, capacity=1)
        errors.append(np.linalg.norm(final(result)[:2] - driven(4.0, W, 4.0, 1.5 * PUSH, 2.0)))
        sums.append(result.work["force_evaluations"] / result.work["particle_steps"])
    assert errors[0] == pytest.approx(errors[1], rel=0.01)
    assert sums[0] < 1.05
    assert sums[1] > 2.5


@pytest.mark.long
def test_only_needed_fields_are_allocated():
    """No spins without torques; for one particle no sums or iterates; without acceleration no stored
    iterates."""
    alone = Simulation(oscillator(Trapezoid()))
    fields = {f.name for f in alone.s.fields}
    assert "own_dt" in fields
    assert not fields & {"spin", "torque", "iterate_change", "force_used"}
    assert not alone.assembly.buffers
    alone.close()


def test_wrong_control_is_refused():
    with pytest.raises(InputError, match=r"trapezoid\.control must be"):
        Trapezoid(control=FixedStep(dt=1e-3))
    with pytest.raises(InputError, match=r"iteration_control\.longest must be at least shortest; received"):
        IterationControl(longest=1e-6, shortest=1e-5)


def test_a_stride_below_the_path_in_the_shortest_step_is_refused():
    """It could not be kept, and all steps would be the shortest. Particles that interact may move together at
    any speed, and 0 sets no limit."""
    start = {"velocity": np.array([[1.0, 0.0, 0.0], [4.0, 0.0, 0.0]]), "mass": np.array([2.0, 1.0])}
    rule = r"0, or at least the path of the fastest particle in the shortest step"
    for control in (IterationControl, StageControl):
        for independent, path in ((True, 4e-12), (False, 2e-12)):
            with pytest.raises(
                InputError, match=rf"^stepper\.control\.stride must be {rule}, {path:g} m; received"
            ):
                control(stride=0.99 * path).check_start(start, False, independent)
            control(stride=1.01 * path).check_start(start, False, independent)
        control().check_start(start, False, True)
    fast = {"velocity": np.array([[1e155, 1e155, 0.0]]), "mass": np.ones(1)}
    with pytest.raises(InputError, match=r"inf m; received 1\.0$"):
        IterationControl(stride=1.0).check_start(fast, False, True)


def test_a_stride_is_refused_before_a_run():
    stepper = Trapezoid(control=IterationControl(stride=1e-100))
    setup = scene([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], (Gravity(),), stepper=stepper)
    with pytest.raises(InputError, match=r"^stepper\.control\.stride must be 0, or at least the path"):
        check_start(CORE, setup, setup.start())
