"""Brownian particles without hydrodynamic interaction, compared with closed forms."""

import numpy as np
import pytest
from scipy import stats

from tests.scenes import compiled, simulate
from tests.steppers.brownian.colloids import DIFFUSIVITY, RADIUS, SIGMAS, Stop, colloids, run
from tisim import Box, InputError, Open, Simulation
from tisim.effects import ContactDissipation, Force, Hertz, Impact, StokesDrag
from tisim.engine.checkpoint import restore, save
from tisim.steppers.brownian import brownian
from tisim.steppers.brownian.independent import IndependentBrownianSteps
from tisim.steppers.brownian.vectorised import VectorisedBrownianSteps

MANY = 10_000

both = pytest.mark.parametrize("together", [False, True], ids=["by themselves", "together"])


def moved(result):
    assert result.status.ok, result.status.reason
    return result.state["position"] - result.start["position"]


def check_variance(sample, expected, what=""):
    """The variance of n normal numbers of mean 0 has the relative error sqrt(2/n)."""
    assert np.mean(sample**2) / expected == pytest.approx(1.0, abs=SIGMAS * np.sqrt(2 / sample.size)), what
    assert abs(sample.mean()) < SIGMAS * np.sqrt(expected / sample.size), what


def check_same(a, b):
    assert b.status.ok, b.status.reason
    assert a.work == b.work
    for name, values in a.state.items():
        np.testing.assert_array_equal(b.state[name], values, err_msg=name)


@both
def test_free_diffusion_is_normal_with_variance_2dt_for_each_radius(together):
    n = 600 if together else MANY
    radius = np.where(np.arange(n) % 2, 4 * RADIUS, RADIUS)
    apart = np.arange(n)[:, None] * [1e-5, 0, 0]
    scene = colloids(apart, together, steps=3, radius=tuple(radius), seed=5)
    (result,) = run([scene])
    standard = moved(result) / np.sqrt(2 * DIFFUSIVITY * RADIUS / radius * scene.duration)[:, None]
    for kind in (standard[::2], standard[1::2]):
        check_variance(kind, 1.0)
    assert stats.kstest(standard.ravel(), "norm").pvalue > 1e-6
    # Different axes of a particle, and neighbouring particles, are uncorrelated.
    for a, b in ((standard[:, 0], standard[:, 1]), (standard[:-1, 2], standard[1:, 2])):
        assert abs(np.mean(a * b)) < SIGMAS / np.sqrt(len(a))


@both
def test_sedimentation_at_stokes_velocity_and_shear_without_heat(together):
    """At T = 0 there is no noise: v = mu F + u(r), to rounding, with Euler steps."""
    radius, shear, dt, steps = np.array([1e-7, 3e-7]), 5.0, 1e-3, 40
    begin = np.array([[0, 1e-5, 0], [0, -2e-5, 1e-4]])
    more = {"radius": tuple(radius), "temperature": 0.0}
    (result,) = run([colloids(begin, together, shear=shear, fall=9.81, dt=dt, steps=steps, **more)])
    fall = -2 / 9 * 1000.0 * 9.81 * radius**2 / 1e-3
    np.testing.assert_allclose(result.state["velocity"][:, 1], fall, rtol=1e-12)
    expected = begin.copy()
    for _ in range(steps):
        expected += dt * np.stack([shear * expected[:, 1], fall, 0 * fall], axis=1)
    np.testing.assert_allclose(result.state["position"], expected, rtol=0, atol=1e-17)


def test_remaining_steps_count_intervals():
    """There are 300 longest steps, many of which a launch takes for a single colloid."""
    scene = colloids(np.zeros((1, 3)), steps=300)
    simulation = compiled(scene, 5, 10_000)
    simulation.load([scene])
    simulation.run(steps=100)
    assert simulation.remaining_steps() == pytest.approx(200, abs=1)


def test_diffusion_in_shear():
    """<x^2> = 2Dt (1 + (rate t)^2/3), <xy> = D rate t^2 (R. T. Foister, T. G. M. van de Ven 1980).

    The integrals are replaced by sums over the n Euler steps.
    """
    shear, dt, n = 50.0, 1e-3, 40
    (result,) = run([colloids(np.zeros((MANY, 3)), shear=shear, dt=dt, steps=n, seed=3)])
    x, y, _ = moved(result).T
    remaining = shear * dt * np.arange(n)
    check_variance(x, 2 * DIFFUSIVITY * dt * (1 + remaining**2).sum())
    expected = 2 * DIFFUSIVITY * dt * remaining.sum()
    sigma = np.std(x * y) / np.sqrt(MANY)
    assert np.mean(x * y) == pytest.approx(expected, abs=SIGMAS * sigma)
    assert expected > 30 * sigma


def test_equipartition_in_a_trap_with_the_bias_of_eulers_steps():
    """The final variance is kT/k / (1 - rate dt/2), which has the expected error of first order in dt."""
    rate, sizes = 100.0, (0.05, 0.2, 1.0)
    place = np.zeros((MANY, 3))
    scenes = [colloids(place, trap=rate, dt=a / rate, steps=round(8 / a), seed=7) for a in sizes]
    for a, result in zip(sizes, run(scenes), strict=True):
        check_variance(moved(result), DIFFUSIVITY / rate / (1 - a / 2) * (1 - (1 - a) ** (16 / a)), a)


def test_noise_keeps_its_law_with_state_dependent_steps():
    """In each step the displacement minus the drift is normal with variance 2 D dt.

    This holds for short and long steps, and successive steps are independent.
    """
    apart = 4e-7 * np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3)
    scenes = [colloids(apart, True, trap=200.0, dt=1e-3, steps=400, drift=0.3, seed=k) for k in range(5)]
    simulation = compiled(scenes[0], 5, 600)
    simulation.load(scenes)
    noise, lengths = [], []
    for _ in range(400):
        before = simulation.s.read("position")[:, :8]
        simulation.run(steps=1)
        dt = simulation.s.read("dt")[:, None, None]
        drift = simulation.s.read("velocity")[:, :8] * dt
        shift = simulation.s.read("position")[:, :8] - before - drift
        noise.append(shift / np.sqrt(2 * DIFFUSIVITY * dt))
        lengths.append(dt[:, 0, 0])
    noise, lengths = np.array(noise), np.array(lengths)
    short = lengths < np.median(lengths)
    assert lengths[~short].mean() > 1.3 * lengths[short].mean()
    for some in (noise[short], noise[~short]):
        check_variance(some, 1.0)
    assert stats.kstest(noise.ravel(), "norm").pvalue > 1e-6
    lengths_seen = lengths[1:, :, None, None] + 0 * noise[1:]
    for now in (noise[1:], noise[1:] ** 2 - 1):
        for past in (noise[:-1], noise[:-1] ** 2, lengths_seen):
            product = now * (past - past.mean())
            assert abs(product.mean()) < SIGMAS * product.std() / np.sqrt(product.size)


def test_individual_steps_give_the_right_distribution():
    """In a trap, with steps cut to a tenth or less in steep regions; the bias is below 1 %."""
    rate = 100.0
    width = np.sqrt(DIFFUSIVITY / rate)
    place = np.zeros((MANY, 3))
    scene = colloids(place, trap=rate, dt=0.1 / rate, steps=50, seed=9, drift=0.02 * width / RADIUS)
    (result,) = run([scene])
    assert 5 < result.work["particle_steps"] / MANY / result.work["steps"] < 20
    standard = moved(result) / width
    assert np.mean(standard**2) == pytest.approx(1.0, abs=0.01 + SIGMAS * np.sqrt(2 / standard.size))
    assert stats.kstest(standard.ravel() / standard.std(), "norm").pvalue > 1e-6


@pytest.mark.long
@pytest.mark.parametrize("together", [pytest.param(False, marks=pytest.mark.slow), True])
def test_same_bits_on_both_schedules_alone_in_a_batch_and_in_portions(together):
    def make(seed):
        place = np.random.default_rng(seed).uniform(-1e-6, 1e-6, (40, 3))
        return colloids(place, together, trap=200.0, dt=1e-3, steps=30, drift=0.3, seed=seed)

    scenes = [make(seed) for seed in range(5)]
    usual = run(scenes)
    for other in simulate(scenes, worlds=5, schedule="world")[2], simulate([scenes[2]])[0]:
        check_same(usual[2], other)
    simulation = compiled(scenes[0], 5, schedule="world")
    simulation.load(scenes)
    for portion in (1, 2, 7):
        simulation.run(steps=portion)
    simulation.run()
    check_same(usual[2], simulation.results()[2])
    assert usual[2].work["particle_steps"] > 1500
    assert not np.array_equal(usual[1].state["position"], usual[2].state["position"])


class Pinned(Force):
    """Exerts no force; lets particles have the field ``fixed``."""

    fields = ("fixed",)


@pytest.mark.slow
@pytest.mark.parametrize(
    "domain",
    [Open(), pytest.param(Box(low=(-1.1e-6,) * 3, high=(1.1e-6,) * 3), marks=pytest.mark.slow)],
    ids=["open", "box"],
)
def test_vectorised_particles_equal_single_ones(domain, monkeypatch):
    """Vectorised and single steps agree to the bit.

    The scenes contain intervals with one step for all particles, intervals with several, fixed particles, and
    too steep a force. There is a flow, and one of the runs is done in portions.
    """
    place = np.random.default_rng(2).uniform(-1e-6, 1e-6, (70, 3))
    more = {"dt": 1e-3, "steps": 30, "drift": 0.3, "domain": domain, "shear": 5.0, "extra": (Pinned(),)}
    pinned = {"fixed": (np.arange(70) == 40).astype(int)}
    free = [colloids(place, trap=trap, seed=1, **more) for trap in (2.0, 30.0, 300.0, 1e10)]
    scenes = [*free, colloids(place, trap=2.0, quantities=pinned, **more)]
    runs = []
    for kind in (VectorisedBrownianSteps, IndependentBrownianSteps):
        monkeypatch.setattr(
            brownian, "vectorises", lambda context, kind=kind: kind is VectorisedBrownianSteps
        )
        simulation = Simulation(scenes[0], 5)
        assert kind.__name__ in simulation.program.names()
        simulation.load(scenes)
        simulation.run(steps=7 if kind is VectorisedBrownianSteps else None)
        simulation.run()
        runs.append(simulation.results())
    for many, single in zip(*runs, strict=True):
        assert many.status == single.status
        # The counts of a failed world depend on the progress of its last launch.
        assert many.work == single.work or not many.status.ok
        for name, values in many.state.items():
            np.testing.assert_array_equal(values, single.state[name], err_msg=name)
    assert [result.status.ok for result in runs[0]] == [True, True, True, False, True]
    steps = [result.work["particle_steps"] / (70 * 30) for result in runs[0]]
    assert steps[0] == 1.0 < steps[1] < 2.0 < steps[2]
    assert steps[4] == 69 / 70


@both
def test_a_checkpoint_continues_to_the_same_bits(together, tmp_path):
    place = np.random.default_rng(1).uniform(-1e-6, 1e-6, (40, 3))
    scene = colloids(place, together, trap=200.0, dt=1e-3, steps=30, drift=0.3)
    simulation = compiled(scene, 5, 600 if together else MANY)
    ends = []
    for stop in (False, True):
        simulation.load([scene])
        simulation.run(steps=11)
        if stop:
            save(simulation, tmp_path / "c.h5")
            simulation.run(steps=3)
            simulation.load([scene])
            restore(simulation, tmp_path / "c.h5")
        simulation.run()
        ends += simulation.results()
    check_same(*ends)


@pytest.mark.long
@pytest.mark.parametrize("together", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_fixed_particles_stay_and_the_others_move(together):
    """In a flow along x an operator stops each particle right after the step that brings it past the
    place."""
    shear, dt, place = 10.0, 1e-3, 1.05e-6
    height = 1e-5 * np.arange(8)
    begin = np.stack([np.full(8, -1e-6), height, 3e-5 * np.arange(8)], axis=1)
    (result,) = simulate([colloids(begin, together, shear=shear, dt=dt, steps=30, temperature=0.0,
                                   extra=(Stop(place=place),))])  # fmt: skip
    assert result.status.ok
    path = -1e-6 + shear * dt * np.outer(height, np.arange(31))
    end = [row[np.argmax(row > place)] if (row > place).any() else row[-1] for row in path]
    np.testing.assert_allclose(result.state["position"][:, 0], end, rtol=0, atol=1e-18)
    fixed = result.state["fixed"] == 1
    assert fixed.tolist() == [False] + [True] * 7
    assert result.work["stops"] == 7
    when = dt * np.argmax(path > place, axis=1)
    np.testing.assert_allclose(result.state["stopped_at"], when, rtol=1e-12)
    assert np.abs(result.state["velocity"][fixed]).max() == 0


@both
def test_a_force_that_is_too_steep_is_refused_with_time_and_particle(together):
    """The spring of the second particle at once needs a step below the shortest; other worlds continue."""
    place = np.array([[1e-9, 0, 0], [-1e-3, 0, 0]])
    limits = {"dt": 1e-3, "steps": 5, "drift": 1.0, "shortest": 1e-6}
    cases = ((1, 1e3), (1e-3, 1e3), ([[0], [1]], 1e158))
    steep, fine, mad = run([colloids(place * k, together, trap=trap, **limits) for k, trap in cases])
    assert fine.status.ok, fine.status.reason
    reason = steep.status.reason
    assert "found at t = 0 s: a force so strong that it requires a step shorter than the shortest" in reason
    assert "by effects.trap, at particle 1" in reason
    assert "found at t = 0 s: a quantity is not finite, by effects.trap, at particle 1" in mad.status.reason
    np.testing.assert_array_equal(steep.state["position"], steep.start["position"])


def test_overlapping_pair_is_pushed_apart_in_short_steps():
    """The longest step is 300 times the stability limit of the repulsion.

    The pair separates by the overlap, and by no more than one step of the drift limit beyond it.
    """
    overlap, drift, stable = 0.2 * RADIUS, 0.02, 1 / 1.2e9
    pair = np.array([[0.0, 0, 0], [2 * RADIUS - overlap, 0, 0]])
    scene = colloids(pair, True, stiffness=1e-3, dt=300 * stable, steps=20, drift=drift, temperature=0.0,
                    shortest=1e-13)  # fmt: skip
    (result,) = run([scene])
    assert result.status.ok, result.status.reason
    gap = np.linalg.norm(np.diff(result.state["position"], axis=0)) - 2 * RADIUS
    assert -drift * RADIUS < gap < 2 * drift * RADIUS
    assert result.work["steps"] >= overlap / (2 * drift * RADIUS) + 15


@pytest.mark.parametrize(
    "effects",
    [
        (StokesDrag(viscosity=1e-3),),
        (Impact(hardness=1e5),),
        (ContactDissipation(damping=1.0), Hertz(young=1e6, poisson=0.3)),
    ],
    ids=["drag", "impact", "dissipation"],
)
def test_effects_that_need_velocities_are_refused(effects):
    rule = "must be one that does not depend on velocity in a scene stepped by brownian"
    with pytest.raises(InputError, match=rf"effects.{effects[0].kind()} {rule}"):
        colloids(np.zeros((1, 3)), extra=effects)


def test_bad_limits_are_refused():
    with pytest.raises(InputError, match=r"shortest must be at least longest/1e\+09"):
        colloids(np.zeros((1, 3)), dt=1.0, shortest=1e-12)
    with pytest.raises(InputError, match=r"brownian.temperature must be at least 0"):
        colloids(np.zeros((1, 3)), temperature=-1.0)
