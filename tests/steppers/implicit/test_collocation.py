"""The high-order stepper: coefficients, order, requested errors, and failures."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.pairs.test_short_ranged import grains, shells
from tests.scenes import compiled, scene, simulate
from tests.steppers.charged import PUSH, W, charged, final, order
from tests.steppers.charged import equal_steps as trapezoidal_steps
from tests.steppers.closed_forms import driven
from tests.steppers.implicit.test_trapezoid import with_stepper
from tests.throwaway import SoftShell
from tisim import Box
from tisim.effects import NearField
from tisim.engine.checkpoint import restore, save
from tisim.steppers import Collocation, StageControl
from tisim.steppers.implicit.stages import highest, integrals, nodes

DURATION = 4.0
DRIVEN = {"stiffness": 8.0, "amplitude": 1.5, "omega": 2.0}
EXACT = np.array(driven(DURATION, W, 4.0, 1.5 * PUSH, 2.0))


def equal_steps(dt, stages=5):
    """Steps of one length regardless of their error, each solved to the last digits."""
    return with_error(1e3, stages, first=dt, longest=dt, shortest=dt, part=1e-17, most=1.0)


def with_error(error, stages=5, **more):
    return Collocation(stages=stages, control=StageControl(error=error, sweeps=40, **more))


ORDER_5 = (6, 12, 18)
"""Numbers of steps in DURATION for the order with five stages."""
ERRORS = 10.0 ** -np.arange(3, 12)


@pytest.fixture(scope="module")
def runs():
    """One particle in each of many worlds, with five stages."""
    stiff = {"stiffness": 2e6, "constant": 1.5, "flux": 0.0}
    circle = charged(equal_steps(2.0 / W), 2000 * np.pi / W, velocity=(0.6, -0.8, 0.0))
    named = {
        "circle": circle,
        "long": charged(with_error(1e-8, first=10.0, longest=10.0), 1e-2, **stiff),
        "stuck": charged(with_error(1e-8, first=1e-2, longest=1e-2, shortest=1e-2), 1.0, **stiff),
        "free": charged(with_error(1e-8), 1e-2, flux=0.0, velocity=(0.0, 1.0, 0.0)),
        "rest": charged(with_error(1e-8), 1e-2, flux=0.0),
    }
    named |= {f"steps {n}": charged(equal_steps(DURATION / n), DURATION, **DRIVEN) for n in ORDER_5}
    named |= {f"error {e}": charged(with_error(e), DURATION, **DRIVEN) for e in ERRORS}
    results = simulate(list(named.values()), worlds=len(named), capacity=1)
    return dict(zip(named, results, strict=True))


def off(results):
    """Relative difference between the velocity and the closed form."""
    return np.array([np.linalg.norm(final(r)[:2] - EXACT) for r in results]) / np.linalg.norm(EXACT)


def test_coefficients():
    """Values of E. Hairer, G. Wanner, section IV.5, the trapezoidal rule, and the order of the quadrature."""
    np.testing.assert_allclose(nodes(3), [0, 1 / 2, 1], atol=1e-15)
    table = [[0, 0, 0], [5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]]
    np.testing.assert_allclose(integrals(3), table, atol=1e-15)
    np.testing.assert_allclose(integrals(2), [[0, 0], [1 / 2, 1 / 2]], atol=1e-15)
    for stages in range(3, 9):
        weights, c = integrals(stages)[-1], nodes(stages)
        for power in range(2 * stages - 2):
            assert weights @ c**power == pytest.approx(1 / (power + 1), rel=1e-12)
        # The error functional is 0 for polynomials of degree s - 2, and positive for the next degree.
        assert highest(stages) @ c ** (stages - 2) == pytest.approx(0.0, abs=1e-12)
        assert highest(stages) @ c ** (stages - 1) > 0.0


@pytest.mark.slow
def test_order_of_five_stages(runs):
    """2 s - 2 = 8, for a driven particle in a magnetic field."""
    errors = off(runs[f"steps {n}"] for n in ORDER_5)
    assert order(ORDER_5, errors) == pytest.approx(8.0, abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(("stages", "steps"), [(3, (16, 32, 64, 128)), (4, (8, 16, 32))])
def test_order_of_fewer_stages(stages, steps):
    scenes = [charged(equal_steps(DURATION / n, stages), DURATION, **DRIVEN) for n in steps]
    errors = off(simulate(scenes, worlds=len(scenes), capacity=1))
    assert order(steps, errors) == pytest.approx(2 * stages - 2, abs=0.3)


@pytest.mark.slow
def test_the_requested_error_is_met_with_more_work(runs):
    """Over nine decades the error is near or below the requested one and decreases with it, and the work
    increases."""
    results = [runs[f"error {e}"] for e in ERRORS]
    errors, work = off(results), np.array([r.work["force_evaluations"] for r in results])
    assert (errors < 2 * ERRORS).all()
    assert (errors[2:] < errors[:-2]).all()
    assert (work[2:] > work[:-2]).all()
    # Relative to the displacement the estimate falls as dt^5, so a decade takes 10^(1/5) times the steps.
    assert work[-1] < 10 ** (8 / 5) * work[0]
    assert all(r.work["solver_iterations"] < 2.2 * (r.work["steps"] + r.work["rejections"]) for r in results)


@pytest.mark.long
def test_a_checkpoint_continues_to_the_same_bits(runs, tmp_path):
    """The data for the prediction of the next step are stored too, and exactly the requested steps are
    taken."""
    assert runs
    scenes = [charged(with_error(e), DURATION, **DRIVEN) for e in ERRORS[:3]]
    simulation = compiled(scenes[0], worlds=len(runs), capacity=1)

    def ends():
        simulation.run()
        return [(r.state, r.work, r.time) for r in simulation.results()]

    simulation.load(scenes)
    simulation.run(steps=5)
    assert [r.work["steps"] for r in simulation.results()] == [5, 5, 5]
    save(simulation, tmp_path / "c.h5")
    whole = ends()
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    for (state, *rest), (expected, *others) in zip(ends(), whole, strict=True):
        assert rest == others
        for name, values in state.items():
            np.testing.assert_array_equal(values, expected[name], err_msg=name)


def test_speed_is_kept_by_a_rotation(runs):
    """The method is symmetric: with w dt = 2 the rotation by B keeps the speed over a thousand periods."""
    assert np.linalg.norm(final(runs["circle"])) == pytest.approx(1.0, rel=1e-10)


def test_a_step_too_long_is_rejected(runs):
    """The first step is a thousand times too long for the spring; attempts are rejected until one
    converges."""
    result = runs["long"]
    assert result.work["rejections"] >= 3
    # x = q E/k (1 - cos(sqrt(k/m) t)) for 3 C in 1.5 V/m at 2e6 N/m, 2 kg.
    speed = 4.5 / 2e6 * 1e3 * np.sin(1e3 * 1e-2)
    assert final(result)[0] == pytest.approx(speed, rel=1e-6)


def test_unsolvable_steps_name_time_particle_and_force(runs):
    """It fails at the shortest step allowed, and the state of the last good step is kept."""
    failed = runs["stuck"]
    assert (
        "cannot be solved even at the shortest step, by effects.tether, at particle 0" in failed.status.reason
    )
    np.testing.assert_array_equal(failed.state["position"], failed.start["position"])
    assert failed.time == 0.0


def test_particles_at_rest_have_no_error(runs):
    """No velocity and no force would give 0/0; also no force on a moving particle."""
    for name, place in (("rest", 0.0), ("free", 1e-2)):
        assert runs[name].status.ok
        assert runs[name].state["position"][0, 1] == pytest.approx(place, abs=1e-15)


SIZE = 14.0
"""Side of a box, m."""


def cloud(error, size=SIZE):
    """Sixteen particles that attract and repel each other, some across a face of the box.

    No particle has two nearly equidistant images of a neighbour, at which the force would jump.
    """
    rng = np.random.default_rng(5)
    places = np.stack(np.meshgrid([0.5, 1.5], [0.5, 1.5], [0.5, 1.5, 2.5, 3.5]), -1).reshape(-1, 3)
    setup = scene(
        places + rng.uniform(-0.1, 0.1, places.shape),
        rng.normal(0, 1.0, places.shape),
        (NearField(alpha1=0.3, beta1=1, alpha2=0.2, beta2=2),),
        mass=1.0,
        stepper=with_error(error),
        duration=1.5,
        domain=Box(low=(0.0, 0.0, 0.0), high=(size,) * 3),
    )
    return setup


def cloud_by_scipy(setup, size=SIZE):
    """The same motion from NumPy and SciPy's DOP853."""
    r, v = np.asarray(setup.particles.position), np.asarray(setup.particles.velocity)

    def rates(_, y):
        places, speeds = y.reshape(2, *r.shape)
        d = places[None] - places[:, None]
        d -= size * np.round(d / size)
        distance = np.linalg.norm(d, axis=-1) + np.eye(len(places))
        # Z16 (7.23): attraction alpha1/d, repulsion alpha2/d^2, along the line of centres.
        push = (0.3 / distance - 0.2 / distance**2) / distance
        return np.concatenate([speeds.ravel(), (push[..., None] * d).sum(axis=1).ravel()])

    solution = solve_ivp(
        rates, (0, setup.duration), np.concatenate([r, v]).ravel(), "DOP853", rtol=1e-10, atol=1e-10
    )
    return solution.y[:, -1].reshape(2, *r.shape)


@pytest.mark.slow
def test_pairs_in_a_box():
    """Agrees with SciPy to 1e-6, and the momentum is conserved."""
    setup = cloud(1e-8)
    (a,) = simulate([setup], capacity=16)
    assert a.status.ok
    assert np.abs(a.state["position"] - a.start["position"]).max() > SIZE / 2
    places, speeds = cloud_by_scipy(setup)
    np.testing.assert_allclose(a.state["velocity"], speeds, atol=1e-6)
    np.testing.assert_allclose((a.state["position"] - places + SIZE / 2) % SIZE - SIZE / 2, 0, atol=1e-6)
    np.testing.assert_allclose(a.state["velocity"].sum(axis=0), a.start["velocity"].sum(axis=0), atol=1e-11)


@pytest.mark.slow
def test_lists_and_torques():
    """Short-ranged forces with lists, including rejected attempts, give the same bits on both schedules.

    Rotating grains with contact history agree with the trapezoidal rule.
    """
    setup = with_stepper(shells(SoftShell, np.random.default_rng(3), True), with_error(1e-5, first=4e-3))
    a, b = (simulate([setup], capacity=300, schedule=schedule)[0] for schedule in ("world", "particle"))
    assert a.status.ok
    assert a.work == b.work
    np.testing.assert_array_equal(a.state["position"], b.state["position"])
    # The contact history is updated once a step, with an error of first order in the step.
    apart = []
    for dt in (5e-5, 2.5e-5):
        setup = with_stepper(grains(n=60), equal_steps(dt), duration=0.01)
        spins = [
            simulate([with_stepper(setup, stepper)], capacity=160)[0].state["spin"]
            for stepper in (equal_steps(dt), trapezoidal_steps(dt, tolerance=1e-12))
        ]
        apart.append(np.abs(spins[0] - spins[1]).max())
        assert np.abs(spins[0]).max() > 1.0
    assert apart[1] < 0.6 * apart[0] < 0.01
