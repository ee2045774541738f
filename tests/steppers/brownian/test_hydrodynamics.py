"""Hydrodynamic interaction of Brownian particles, compared with matrices from the papers."""

import numpy as np
import pytest
from scipy import stats

from tests.scenes import compiled, simulate
from tests.steppers.brownian.colloids import (
    DIFFUSIVITY,
    HEAT,
    MOBILITY,
    RADIUS,
    SIGMAS,
    VISCOSITY,
    Stop,
    colloids,
)
from tests.steppers.brownian.mobility_reference import expansion, matrix, oseen, rotne_prager
from tisim import Box, InputError, Simulation
from tisim.accuracy.quantity import reference_runs, usual
from tisim.accuracy.sweep import methods
from tisim.backend.runtime import memory
from tisim.engine.checkpoint import restore, save
from tisim.steppers import Brownian

WORLDS, CAPACITY = 8, 40
SOFTNESS = 1 / (6 * np.pi * VISCOSITY)
TENSORS = {"oseen": oseen, "rotne-prager": rotne_prager}
DIRECTION = np.array([2.0, -1.0, 2.0]) / 3

slow = pytest.mark.slow
noises = pytest.mark.parametrize("noise", ["exact", pytest.param("fast", marks=pytest.mark.long)])
tensors = pytest.mark.parametrize("hydrodynamics", [pytest.param("oseen", marks=slow), "rotne-prager"])


def crowd(seed, n=12, side=6.0, sizes=4.0):
    """Random spheres, some inside others; the radii differ by up to a factor ``sizes``."""
    draw = np.random.default_rng(seed)
    radius = RADIUS * sizes ** draw.uniform(0, 1, n)
    return draw.uniform(-side / 2, side / 2, (n, 3)) * RADIUS, radius


def lattice(seed):
    """Spheres near sites so far apart that the Oseen tensor is positive definite."""
    draw = np.random.default_rng(seed)
    place = 6.0 * np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3)
    return (place + draw.uniform(-0.5, 0.5, (8, 3))) * RADIUS, RADIUS * draw.uniform(0.7, 1.4, 8)


def make(where, hydrodynamics="rotne-prager", noise="exact", **more):
    position, radius = where
    return colloids(position, radius=tuple(radius), hydrodynamics=hydrodynamics, noise=noise, **more)


def run(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=CAPACITY)


def pairs():
    """Two spheres: separate, touching, overlapping, one inside the other, internally touching, and
    concentric."""
    for one, other in ((1.0, 1.0), (1.0, 3.0)):
        for distance in (1e3, 4.5, one + other, 0.8 * (one + other), other - one, 0.5 * (other - one), 0.0):
            yield (
                np.array([-distance / 2 * DIRECTION, distance / 2 * DIRECTION]) * RADIUS,
                np.array([one, other]) * RADIUS,
            )


@pytest.mark.parametrize("hydrodynamics", TENSORS)
def test_tensors_have_no_divergence(hydrodynamics):
    """sum_b dD_ab/dr_b = 0 in every branch, from central differences, so the drift needs no correction."""
    places = [(1.0, 1.0, 2.5), (1.0, 3.0, 4.2)]
    if hydrodynamics == "rotne-prager":
        places += [(1.0, 1.0, 1.2), (1.0, 3.0, 2.7), (1.0, 3.0, 1.5)]
    for one, other, distance in places:
        divergence, h = np.zeros(3), 1e-5
        for b in range(3):
            shift = h * np.eye(3)[b]
            blocks = [TENSORS[hydrodynamics](distance * DIRECTION + x, one, other) for x in (shift, -shift)]
            divergence += (blocks[0] - blocks[1])[:, b] / (2 * h)
        np.testing.assert_allclose(divergence, 0, atol=1e-9)


@noises
@tensors
def test_velocities_follow_forces_at_once(hydrodynamics, noise):
    """v_i = sum_j D_ij F_j / kT with springs to the origin and weight, for every branch of the tensor."""
    cases = [lattice(k) for k in range(4)]
    if hydrodynamics == "rotne-prager":
        cases += [crowd(k) for k in range(4)] + list(pairs())
    weight = 9.81e6
    more = {"trap": 100.0, "fall": weight, "temperature": 0.0, "dt": 1e-12}
    scenes = [make(where, hydrodynamics, noise, **more) for where in cases]
    results = [r for k in range(0, len(scenes), WORLDS) for r in run(scenes[k : k + WORLDS])]
    for (position, radius), result in zip(cases, results, strict=True):
        assert result.status.ok, result.status.reason
        force = -100.0 / MOBILITY * position
        force[:, 1] -= weight * 1000.0 * 4 / 3 * np.pi * radius**3
        full = SOFTNESS * matrix(TENSORS[hydrodynamics], position, radius)
        expected = (full @ force.ravel()).reshape(-1, 3)
        size = np.abs(expected).max()
        np.testing.assert_allclose(result.state["velocity"], expected, rtol=0, atol=1e-12 * size)


def test_concentric_spheres_and_a_sedimenting_pair():
    """Concentric spheres drag each other by the mobility of the larger one.

    For a sedimenting pair the factor is 1 + 3a/(2r) - (a/r)^3 along and 1 + 3a/(4r) + (a/r)^3/2 across the
    line of centres (J. Rotne, S. Prager 1969).
    """
    one = make((np.zeros((2, 3)), [RADIUS, 2 * RADIUS]), fall=9.81, temperature=0.0)
    apart = 2.5
    along, across = (
        make(([[0, 0, 0], apart * RADIUS * np.array(d)], [RADIUS] * 2), fall=9.81, temperature=0.0)
        for d in ([0, 1.0, 0], [1.0, 0, 0])
    )
    small = -4 / 3 * np.pi * RADIUS**3 * 1000.0 * 9.81
    expected = (
        [(1 + 8 / 2) * small * MOBILITY, (1 + 8) * small * MOBILITY / 2],
        [small * MOBILITY * (1 + 3 / (2 * apart) - apart**-3)] * 2,
        [small * MOBILITY * (1 + 3 / (4 * apart) + apart**-3 / 2)] * 2,
    )
    for result, velocity in zip(run([one, along, across]), expected, strict=True):
        np.testing.assert_allclose(result.state["velocity"][:, 1], velocity, rtol=1e-12)


def shifts(scenes, steps):
    """Noise displacements in each step over sqrt(2 dt), shape (steps, worlds, 3n).

    Also returns the random numbers they are made of, and the positions before each step.
    """
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    n = len(scenes[0].particles.position)
    shifts_, normals, places = [], [], []
    for _ in range(steps):
        before = simulation.s.read("position")[:, :n]
        simulation.run(steps=1)
        dt = simulation.s.read("dt")[:, None, None]
        shift = simulation.s.read("position")[:, :n] - before - simulation.s.read("velocity")[:, :n] * dt
        shifts_.append((shift / np.sqrt(2 * dt)).reshape(WORLDS, -1))
        normals.append(simulation.s.read("gauss")[:, :n].reshape(WORLDS, -1))
        places.append(before)
    return np.array(shifts_), np.array(normals), np.array(places)


@tensors
def test_exact_noise_has_the_covariance_2_d_dt(hydrodynamics):
    """C C^T = D to rounding, and the noise multiplied by C^-1 is standard normal and uncorrelated.

    There are 11 particles because the decomposition takes them in pairs.
    """
    cases = [lattice(k) if hydrodynamics == "oseen" else crowd(k, 11) for k in range(WORLDS)]
    scenes = [make(c, hydrodynamics, dt=1e-6, steps=1000, seed=k) for k, c in enumerate(cases)]
    displacements, normals, places = shifts(scenes, 60)
    whitened = np.zeros_like(displacements)
    for w, (_, radius) in enumerate(cases):
        for k in range(len(displacements)):
            full = HEAT * SOFTNESS * matrix(TENSORS[hydrodynamics], places[k, w], radius)
            factor = np.linalg.cholesky(full)
            np.testing.assert_allclose(
                displacements[k, w], factor @ normals[k, w], rtol=0, atol=1e-9 * factor.max()
            )
            whitened[k, w] = np.linalg.solve(factor, displacements[k, w])
    n = whitened.shape[-1]
    covariance = np.einsum("kwa,kwb->ab", whitened, whitened) / (whitened.size / n)
    sigma = np.sqrt((1 + np.eye(n)) / (whitened.size / n))
    assert np.abs((covariance - np.eye(n)) / sigma).max() < SIGMAS
    assert stats.kstest(whitened.ravel(), "norm").pvalue > 1e-6


@tensors
def test_fast_noise_is_the_truncated_expansion(hydrodynamics):
    cases = [lattice(k) if hydrodynamics == "oseen" else crowd(k, 10) for k in range(WORLDS)]
    scenes = [make(c, hydrodynamics, "fast", dt=1e-6, steps=1000, seed=k) for k, c in enumerate(cases)]
    displacements, normals, places = shifts(scenes, 2)
    for w, (_, radius) in enumerate(cases):
        for k in range(len(displacements)):
            truncated = expansion(HEAT * SOFTNESS * matrix(TENSORS[hydrodynamics], places[k, w], radius))
            np.testing.assert_allclose(
                displacements[k, w], truncated @ normals[k, w], rtol=0, atol=1e-9 * truncated.max()
            )


def off(position, radius):
    """Largest error of the covariances of the expansion, relative to sqrt(D_ii D_jj)."""
    full = matrix(rotne_prager, position, radius)
    truncated = expansion(full)
    size = np.sqrt(np.diag(full))
    return np.abs((truncated @ truncated.T - full) / np.outer(size, size)).max()


def cloud(n, side, seed=0):
    """Random unit spheres in a box, without overlap."""
    draw, centres = np.random.default_rng(seed), []
    while len(centres) < n:
        place = draw.uniform(0, side, 3)
        if all(np.linalg.norm(place - other) > 2 for other in centres):
            centres.append(place)
    return np.array(centres), np.ones(n)


def test_the_error_of_the_expansion():
    """Variances are right.

    Covariances of two near spheres differ by less than the 5 % of D_ii of B16 6.3; in a cloud the error is
    much larger.
    """
    for r, most in ((2.0, 0.025), (3.0, 0.015), (10.0, 0.001)):
        pair = np.array([[0, 0, 0], [r, 0, 0]]), np.ones(2)
        full = matrix(rotne_prager, *pair)
        truncated = expansion(full)
        np.testing.assert_allclose(np.diag(truncated @ truncated.T), np.diag(full), rtol=1e-13)
        assert most / 3 < off(*pair) < most
    assert 0.05 < off(*cloud(100, 100.0)) < 0.1
    assert 0.2 < off(*cloud(100, 20.0)) < 0.3


@slow
@noises
def test_noise_and_drift_exclude_fixed_particles(noise):
    """One sphere starts beyond the place and is fixed in the first step; from then on it drags no other
    sphere."""
    position, radius = crowd(3, 10)
    position[0] = position[5] + [0.1 * RADIUS, 0, 0]
    scene = make((position, radius), noise=noise, trap=100.0, steps=2, dt=1e-9, seed=4,
                 extra=(Stop(place=position[:, 0].max() - 0.01 * RADIUS),))  # fmt: skip
    simulation = compiled(scene, WORLDS, CAPACITY)
    simulation.load([scene])
    simulation.run(steps=1)
    fixed = simulation.s.read("fixed")[0, :10] == 1
    before = simulation.s.read("position")[0, :10]
    simulation.run(steps=1)
    after, velocity = (simulation.s.read(name)[0, :10] for name in ("position", "velocity"))
    assert fixed.sum() >= 1
    np.testing.assert_array_equal(after[fixed], before[fixed])
    free = ~fixed
    full = matrix(rotne_prager, before[free], radius[free])
    expected = (SOFTNESS * full @ (-100.0 / MOBILITY * before[free]).ravel()).reshape(-1, 3)
    np.testing.assert_allclose(velocity[free], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    factor = (np.linalg.cholesky if noise == "exact" else expansion)(HEAT * SOFTNESS * full)
    kicks = (factor @ simulation.s.read("gauss")[0, :10][free].ravel()).reshape(-1, 3)
    shift = (after[free] - before[free] - 1e-9 * velocity[free]) / np.sqrt(2e-9)
    np.testing.assert_allclose(shift, kicks, rtol=0, atol=1e-9 * np.abs(kicks).max())


@slow
@noises
def test_any_number_but_0_fixes(noise):
    position, radius = crowd(3, 10)
    free = [0] * 8
    scenes = [
        make((position, radius), noise=noise, trap=100.0, steps=2, dt=1e-9, seed=4, extra=(Stop(place=1.0),),
             quantities={"fixed": [number, number, *free]})
        for number in (1, 2)
    ]  # fmt: skip
    one, two = run(scenes)
    np.testing.assert_array_equal(one.state["position"], two.state["position"])
    np.testing.assert_array_equal(one.state["position"][:2], position[:2])


@slow
@noises
def test_oseen_tensor_of_near_spheres_is_refused(noise):
    """The tensor is not positive definite below 3/2 R: the world stops with time and particle, others
    continue."""
    places = [(np.array([[9, 0, 0], [0, 0, 0], [gap, 0, 0]]) * RADIUS, [RADIUS] * 3) for gap in (1.499, 1.6)]
    near, far = (make(where, "oseen", noise, steps=3, dt=1e-9) for where in places)
    stopped, fine = run([near, far])
    assert fine.status.ok, fine.status.reason
    reason = stopped.status.reason
    assert "found at t = 0 s: the diffusion matrix is not positive definite" in reason
    assert f"at particle {2 if noise == 'exact' else 1}" in reason
    np.testing.assert_array_equal(stopped.state["position"], stopped.start["position"])


@noises
def test_concentric_spheres_and_a_heap_stay_finite(noise):
    """The Rotne-Prager matrix is singular there, but not worse: two equal concentric spheres stay
    together."""
    position, radius = crowd(2, 30, side=1.0, sizes=1.0)
    position[7] = position[3]
    (result,) = run([make((position, radius), noise=noise, steps=20, dt=1e-5)])
    assert result.status.ok, result.status.reason
    apart = np.linalg.norm(result.state["position"][7] - result.state["position"][3])
    assert np.isfinite(result.state["position"]).all()
    if noise == "exact":
        assert apart < 1e-4 * RADIUS


@slow
@pytest.mark.parametrize("noise", ["exact", pytest.param("fast", marks=pytest.mark.slow)])
def test_the_bits_do_not_depend_on_schedule_batch_or_portions(noise, tmp_path):
    scenes = [
        make(crowd(k, 35), noise=noise, trap=300.0, drift=0.2, dt=1e-3, steps=20, seed=k) for k in range(8)
    ]
    usual = run(scenes)
    assert all(result.status.ok for result in usual)
    assert usual[2].work["steps"] > 25
    others = [simulate(scenes, WORLDS, CAPACITY, schedule="particle")[2], simulate([scenes[2]], 1, 35)[0]]
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    simulation.run(steps=9)
    save(simulation, tmp_path / "c.h5")
    simulation.run(steps=2)
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    for other in (*others, simulation.results()[2]):
        assert other.work == usual[2].work
        for name, values in usual[2].state.items():
            np.testing.assert_array_equal(other.state[name], values, err_msg=name)


@pytest.mark.slow
@slow
def test_interaction_does_not_change_the_equilibrium():
    """Overlapping spheres in traps of their own width: each coordinate keeps the variance kT/k.

    Drift and noise come from the same matrix.
    """
    rate = DIFFUSIVITY / RADIUS**2
    n, steps = 20, 400
    draw = np.random.default_rng(8)
    scenes = [
        make(
            (RADIUS * draw.normal(size=(n, 3)), [RADIUS] * n), trap=rate, dt=0.02 / rate, steps=steps, seed=k
        )
        for k in range(64)
    ]
    results = simulate(scenes, 64, n)
    places = np.array([result.state["position"] for result in results]) / RADIUS
    assert (places**2).mean() == pytest.approx(1.0, abs=0.02 + SIGMAS * np.sqrt(2 / places.size))


def test_cost_compares_exact_and_fast_noise():
    """Both noises are listed, each with its step length, but no stepper for inertial particles.

    The costs are compared at equal errors of a statistic.
    """
    scene = make(lattice(0), trap=20.0)
    methods_ = methods(scene, 1e-4, 1e-6, (1.0, 0.0), (), 8)
    turned = {
        (type(m.base.stepper), m.base.stepper.noise, *m.accuracy_parameter.orders)
        for m in methods_
        if m.accuracy_parameter
    }
    assert {(Brownian, noise, "longest", "drift") for noise in ("exact", "fast")} <= turned
    assert {kind for kind, *_ in turned} == {Brownian}
    assert [attempt.method.base.stepper.noise for attempt in reference_runs(methods_, 0.0)] == ["exact"] * 2
    assert [quantity.random for quantity in usual(scene)] == [True]


def test_matrices_larger_than_the_memory_are_refused():
    scene = make((np.zeros((1, 3)), np.array([RADIUS])))
    capacity = int(np.sqrt(memory() / 4) / 3) + 100
    with pytest.raises(InputError, match=r"memory for diffusion matrices must be within the \d+ GB"):
        Simulation(scene, capacity=capacity)


def test_interaction_in_a_periodic_box_is_refused():
    box = Box(low=(-1e-5,) * 3, high=(1e-5,) * 3)
    with pytest.raises(InputError, match=r"brownian.hydrodynamics must be none in a periodic box; received"):
        make(lattice(0), domain=box)
    make(lattice(0), "none", domain=box)
