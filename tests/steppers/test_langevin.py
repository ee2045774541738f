"""Langevin dynamics: statistics of free and trapped particles, motion without heat, and a NumPy reference."""

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_continuous_lyapunov, solve_discrete_lyapunov

from tests.scenes import compiled, roundoff
from tests.steppers.charged import order
from tests.steppers.langevin_reference import (
    FRICTION,
    HEAT,
    MASS,
    RADIUS,
    SPEED,
    TEMPERATURE,
    TIME,
    VISCOSITY,
    maps,
    particles,
    run,
    step,
)
from tisim.steppers import Brownian, DriftLimit

MANY = 20_000
SIGMAS = 5.0
"""Confidence of every statistical bound: one in two million fails by chance, and seeds are fixed."""


def check_variance(sample, expected, what=""):
    """The variance of n normal numbers of mean 0 has the relative error sqrt(2/n)."""
    assert np.mean(sample**2) / expected == pytest.approx(1.0, abs=SIGMAS * np.sqrt(2 / sample.size)), what
    assert abs(sample.mean()) < SIGMAS * np.sqrt(expected / sample.size), what


def thermal(seed=3):
    return SPEED * np.random.default_rng(seed).normal(size=(MANY, 3))


@pytest.mark.parametrize("a", [1e-6, 0.3, 1.9, 2.1, 30.0])
def test_steps_are_those_of_the_reference(a):
    """The noise of each step is that of a particle without forces, which starts at rest; both worlds have the
    same seed. 1.9 and 2.1 are on both sides of the two forms of tanh."""
    start, speed = 3e-9 * np.array([1.0, -2.0, 0.5]), SPEED * np.array([0.5, 1.0, -2.0])
    omega, shear, fall, wind = 0.5 / a if a > 1 else 0.5, 0.2, 0.3, 0.7
    free = particles(a, 4, seed=9)
    bound = particles(a, 4, 1, start, speed, omega, shear, fall, wind, seed=9)
    simulation = compiled(free, 6, 20_000)
    simulation.load([free, bound])
    rest, r, v = np.zeros(3), start / (a * TIME), speed

    def force(r):
        return -((omega * a) ** 2) * r - np.array([0.0, fall * SPEED * a, 0.0])

    def flow(r):
        return np.array([shear * a * r[1], 0.0, wind * SPEED])

    for _ in range(4):
        simulation.run(steps=1)
        velocity = simulation.s.read("velocity")
        g = (velocity[0, 0] - np.exp(-a) * rest) / (SPEED * np.sqrt(-np.expm1(-2 * a)))
        rest = velocity[0, 0]
        r, v = step(r, v, g, a, force, flow, SPEED**2)
        np.testing.assert_allclose(velocity[1, 0], v, rtol=0, atol=1e-12 * np.abs(v).max())
        place = simulation.s.read("position")[1, 0] / (a * TIME)
        np.testing.assert_allclose(place, r, rtol=0, atol=1e-12 * np.abs(r).max())
    assert np.abs(rest).max() > 0.1 * SPEED * np.sqrt(-np.expm1(-2 * a))


def test_free_particles_have_the_correlations_of_an_ornstein_uhlenbeck_process():
    """Velocities: variance kT/m, correlation exp(-gamma t/m). Displacements: <x^2> = 2 kT/gamma (t - m/gamma
    (1 - exp(-gamma t/m))), from flight to diffusion."""
    start = thermal()
    scenes = [particles(a, 100, MANY, velocity=start, seed=k) for k, a in enumerate((0.002, 0.05))]
    simulation = compiled(scenes[0], 6, 20_000)
    simulation.load(scenes)
    for steps in (5, 15, 80):
        simulation.run(steps=steps)
        for result, a in zip(simulation.results(), (0.002, 0.05), strict=True):
            v, path = result.state["velocity"], result.state["position"]
            t = result.work["steps"] * a
            check_variance(v, SPEED**2, t)
            rest = v - np.exp(-t) * start
            check_variance(rest, SPEED**2 * -np.expm1(-2 * t), t)
            check_variance(path, 2 * HEAT / FRICTION * TIME * (t + np.expm1(-t)), t)
            assert abs(np.mean(rest * start)) < SIGMAS * SPEED * rest.std() / np.sqrt(rest.size)
    assert stats.kstest(v.ravel() / SPEED, "norm").pvalue > 1e-6


@pytest.mark.parametrize("a", [0.2, 5.0, 100.0])
def test_diffusion_and_drift_do_not_depend_on_the_step(a):
    """After n steps <x^2> = 2 kT/gamma (t - dt/2 coth(a/2) (1 - c^n)), the sum over the steps; particles
    drift at F/gamma."""
    fall, n = 0.5, 60
    (result,) = run([particles(a, n, MANY, velocity=thermal(), fall=fall, seed=2)])
    path, v = result.state["position"], result.state["velocity"]
    late = a / 2 / np.tanh(a / 2) * -np.expm1(-a * n)
    expected = 2 * HEAT / FRICTION * TIME * (a * n - late)
    # Gravity has accelerated the particles from rest.
    down = -fall * SPEED * TIME * (a * n - late)
    check_variance(path - [0.0, down, 0.0], expected, a)
    check_variance(v[:, [0, 2]], SPEED**2, a)
    terminal = -fall * SPEED * np.sqrt(a / 2 / np.tanh(a / 2)) * -np.expm1(-a * n)
    check_variance(v[:, 1] - terminal, SPEED**2, a)


@pytest.mark.slow
def test_trapped_particles_have_the_variance_kt_over_k_at_any_step():
    """0.42 of the critical step. Schemes with half of the noise on each side of the drift give 1.21."""
    trials = [(0.2, 0.7), (2.0, 0.7), (10.0, 0.7), (10.0, 0.1)]
    scenes = [
        particles(a, round(60 * (1 + a) / square), MANY // 2, trap=np.sqrt(square) / a, seed=k)
        for k, (a, square) in enumerate(trials)
    ]
    for (a, square), result in zip(trials, run(scenes), strict=True):
        stiffness = square / (a * TIME) ** 2 * MASS
        check_variance(result.state["position"], HEAT / stiffness, (a, square))
        scale = np.tanh(a / 2) / (a / 2)
        check_variance(result.state["velocity"], SPEED**2 * (1 - scale * square / 4), (a, square))


def test_variances_in_a_trap_by_the_step():
    """Of the map of a step: the position exactly, the velocity with an error of second order."""
    steps = 2.0 ** -np.arange(1, 6)
    errors = []
    for dt in steps:
        forward, noise = maps(0.8 * dt, dt**2)
        variance = solve_discrete_lyapunov(forward, noise @ noise.T)
        assert variance[0, 0] * dt**2 == pytest.approx(1.0, rel=1e-12)
        assert variance[0, 1] == pytest.approx(0.0, abs=1e-12)
        errors.append(1 - variance[1, 1])
    assert order(1 / steps, np.array(errors)) == pytest.approx(2.0, abs=0.01)


def test_moments_in_time_are_of_second_order():
    """Weak order: covariances of position and velocity in a trap, from a cold start, at a time of 1.5."""
    friction, number = 0.8, 2 ** np.arange(3, 8)
    rates = np.array([[0.0, 1.0], [-1.0, -friction]])
    still = solve_continuous_lyapunov(rates, -np.diag([0.0, 2 * friction]))
    flow = expm(1.5 * rates)
    exact = still - flow @ still @ flow.T
    errors = []
    for n in number:
        dt = 1.5 / n
        forward, noise = maps(friction * dt, dt**2)
        covariance = np.zeros((2, 2))
        for _ in range(n):
            covariance = forward @ covariance @ forward.T + noise @ noise.T
        unit = np.diag([dt, 1.0])
        errors.append(np.abs(unit @ covariance @ unit - exact)[np.triu_indices(2)])
    for column in np.array(errors).T:
        assert order(number, column) == pytest.approx(2.0, abs=0.05)


def test_without_heat_a_particle_is_slowed_and_falls_by_stokes_drag():
    """v = v_0 exp(-gamma t/m) exactly; the path m/gamma (v_0 - v) - g t^2 ... to second order."""
    number, end, speed = np.array([4, 8, 16, 32]), 2.0, 3.0
    scenes = [
        particles(end / n, n, velocity=[speed * SPEED, 0, 0], fall=0.5, temperature=0.0)
        for n in number.tolist()
    ]
    gone = -np.expm1(-end)
    errors = []
    for result in run(scenes):
        (v,), (r,) = result.state["velocity"] / SPEED, result.state["position"] / (SPEED * TIME)
        assert v[0] == pytest.approx(speed * np.exp(-end), rel=1e-12)
        errors.append([r[0] - speed * gone, v[1] + 0.5 * gone, r[1] + 0.5 * (end - gone)])
    for column in np.abs(errors).T:
        assert order(number, column) == pytest.approx(2.0, abs=0.03)
        assert column[-1] < 1e-3


@pytest.mark.parametrize("a", [0.1, 50.0])
def test_a_uniform_flow_carries_particles_along(a):
    """A particle that moves with the fluid keeps its velocity, and its path is exact."""
    (result,) = run([particles(a, 10, velocity=[0, 0, 0.4 * SPEED], wind=0.4, temperature=0.0)])
    np.testing.assert_allclose(result.state["velocity"][0], [0, 0, 0.4 * SPEED], rtol=500 * roundoff())
    np.testing.assert_allclose(
        result.state["position"][0, 2], 0.4 * SPEED * result.time, rtol=500 * roundoff()
    )


def test_motion_in_a_shear_flow_is_of_second_order():
    number, end, rate = np.array([8, 16, 32, 64]), 3.0, 0.7

    def accelerate(t, z):
        _, y, vx, vy = z
        return [vx, vy, rate * y - vx, -vy]

    exact = solve_ivp(accelerate, (0, end), [0.0, 0.3, 0.0, 1.0], rtol=1e-12, atol=1e-14).y[:, -1]
    unit = SPEED * TIME
    scenes = [
        particles(
            end / n, n, position=[0, 0.3 * unit, 0], velocity=[0, SPEED, 0], shear=rate, temperature=0.0
        )
        for n in number.tolist()
    ]
    errors = []
    for result in run(scenes):
        (v,), (r,) = result.state["velocity"] / SPEED, result.state["position"] / unit
        errors.append(np.abs([r[0] - exact[0], v[0] - exact[2]]))
    for column in np.transpose(errors):
        assert order(number, column) == pytest.approx(2.0, abs=0.05)


def test_strong_friction_gives_brownian_dynamics():
    """In steps of 200 m/gamma in a trap, from its centre: <x^2> = kT/k (1 - exp(-2 k t/gamma)), as by
    ``brownian``, but without the error of Euler's steps."""
    a, part, n = 200.0, 0.1, 12
    trap = np.sqrt(part / a)
    fluid = {"temperature": TEMPERATURE, "viscosity": VISCOSITY}
    euler = Brownian(**fluid, control=DriftLimit(longest=a * TIME, shortest=1e-3 * a * TIME, drift=1e6))
    (inertial,) = run([particles(a, n, MANY, trap=trap, seed=1)])
    (without,) = run([particles(a, n, MANY, trap=trap, stepper=euler, seed=2)])
    stiffness = MASS * (trap / TIME) ** 2
    width = HEAT / stiffness * -np.expm1(-2 * part * n)
    check_variance(inertial.state["position"], width)
    bias = (1 - (1 - part) ** (2 * n)) / (1 - part / 2) / -np.expm1(-2 * part * n)
    assert bias > 1.03
    check_variance(without.state["position"], width * bias)
    assert inertial.work["steps"] == n
    assert np.abs(inertial.state["position"]).max() < RADIUS
