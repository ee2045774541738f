"""Captured particles are released when nothing holds them, compared with NumPy; Brownian and inertial."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.constants import k as BOLTZMANN

from tests.numerics.test_philox import reference
from tests.scenes import by_id, compiled, fixed, scene, simulate
from tests.throwaway import SoftShellOfAll
from tisim import InputError, MeasureSeries, Particles, Scene
from tisim.analysis import particle_balance
from tisim.backend.taichi import ti
from tisim.effects import FixedMoment, Force, Gravity, Magnetophoresis, parameter
from tisim.numerics.random_streams import ADHESION
from tisim.operators import Capture, Release
from tisim.sources import MagneticField, MagneticSpheres, UniformFlow
from tisim.steppers import Brownian, DriftLimit

VISCOSITY, DT, STEPS, BALL = 1e-3, 1e-3, 150, 5e-6
PUSH, SPEED = 2e-12, 2e-5
"""N, force down on each particle; m/s, speed of the flow along x."""
OFF = 60.4 * DT
"""s, time at which the force ends, within a step."""
RELEASES = {
    "without force": Release(),
    "most adhere": Release(adhering=0.7),
    "adhesion": Release(adhesion_force=1e-14),
    "adhesion below drag": Release(adhesion_force=1e-14, viscosity=VISCOSITY),
    "threshold": Release(least_force=10.0, temperature=300.0),
}


class Push(Force):
    """A constant force until a time."""

    size: tuple[float, float, float] = parameter("N", "force")
    end: float = parameter("s", "end")

    @ti.func
    def force(self, s, w, i, t):
        return ti.select(t < self.end(w), 1.0, 0.0) * self.size(w)


def pushed(release, together=False, seed=0, steps=STEPS, temperature=0.0):
    """Particles of several sizes that a force drives down onto a ball and a flow carries along x.

    together : whether there is a pair force, which is far too weak to matter, so that all take common steps.
    """
    draw = np.random.default_rng(5)
    position = draw.uniform((-2, -1, 1.05), (1.3, 1, 4), (60, 3)) * BALL
    shell = (SoftShellOfAll(stiffness=1e-60, width=1e-15),) if together else ()
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=draw.uniform(1e-7, 3e-7, 60),
            density=1000.0,
        ),
        effects=(
            *shell,
            Push(size=(0.0, 0.0, -PUSH), end=OFF),
            UniformFlow(velocity=(SPEED, 0.0, 0.0)),
            MagneticSpheres(spheres=[{"radius": BALL}]),
            Capture(release=release),
        ),
        stepper=Brownian(
            temperature=temperature,
            viscosity=VISCOSITY,
            control=DriftLimit(longest=DT, shortest=1e-9, drift=1e6),
        ),
        duration=DT * steps,
        seed=seed,
    )


def adheres(release, seed, particle, count):
    a, b, _, _ = reference((count, 0, particle, ADHESION), (seed, 0))
    return ((a >> 5) * 2**26 + (b >> 6) + 0.5) / 2**53 < release.adhering


def by_numpy(setup):
    """Place, capture and release of each particle at the end, by the rules of ``Release``."""
    release = next(e for e in setup.effects if isinstance(e, Capture)).release
    r, radius = np.array(setup.particles.position), np.asarray(setup.particles.radius)
    friction = 6 * np.pi * VISCOSITY * radius
    drag = 6 * np.pi * release.viscosity * radius[:, None] * np.array([SPEED, 0.0, 0.0])
    captured, stays = np.full(60, -1.0), np.zeros(60, bool)
    released, count = np.full(60, -1.0), np.zeros(60, int)

    def holds(i, t):
        force = drag[i] + (np.array([0.0, 0.0, -PUSH]) if t < OFF else 0.0)
        least = release.least_force * BOLTZMANN * release.temperature / radius[i]
        return release.adhesion_force - force @ r[i] / np.linalg.norm(r[i]) > least

    for step in range(STEPS):
        t, end = step * DT, (step + 1) * DT
        for i in range(60):
            if captured[i] < 0:
                r[i] += DT * np.array([SPEED, 0.0, -PUSH / friction[i] if t < OFF else 0.0])
                away = np.linalg.norm(r[i])
                if away <= BALL + radius[i]:
                    r[i] *= (BALL + radius[i]) / away
                    if holds(i, end):
                        captured[i], stays[i] = end, adheres(release, setup.seed, i, count[i])
                        count[i] += 1
            elif not stays[i] and not holds(i, end):
                captured[i], released[i] = -1.0, end
    return r, captured, released, stays, count


def check_balance(result):
    balance = particle_balance(result.work, result.state)
    assert balance.missing == 0
    assert balance.captured == balance.captures - balance.releases
    return balance


@pytest.mark.long
@pytest.mark.parametrize("together", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_against_numpy(together):
    """Five conditions of release, in one batch; with steps of their own, and with common steps."""
    scenes = [pushed(release, together, seed=k) for k, release in enumerate(RELEASES.values())]
    results = dict(zip(RELEASES, simulate(scenes, worlds=5), strict=True))
    for setup, result in zip(scenes, results.values(), strict=True):
        assert result.status.ok, result.status.reason
        state, (place, captured, released, stays, count) = by_id(result), by_numpy(setup)
        np.testing.assert_allclose(state["position"], place, rtol=1e-12, atol=1e-18)
        np.testing.assert_allclose(state["captured_at"], captured, rtol=1e-12)
        np.testing.assert_allclose(state["released_at"], released, rtol=1e-12)
        np.testing.assert_array_equal(state["captured_by"], np.where(captured < 0, -1, 0))
        np.testing.assert_array_equal(state["fixed"], captured >= 0)
        np.testing.assert_array_equal(state["adheres"][count > 0], stays[count > 0])
        np.testing.assert_array_equal(state["capture_count"], count)
        assert result.work["captures"] == count.sum()
        check_balance(result)
    caught = results["without force"].work["captures"]
    assert caught > 30
    # All are released at the end of the step in which the force ends; some touch again and stay free.
    assert results["without force"].work["releases"] == caught
    times = results["without force"].state["released_at"]
    np.testing.assert_allclose(times[times >= 0], 61 * DT, rtol=1e-12)
    assert 0 < results["most adhere"].work["releases"] < 0.5 * caught
    assert results["adhesion"].work["releases"] == 0
    # Drag frees those behind the ball, on which it pulls by more than the adhesion.
    assert (
        0 < results["adhesion below drag"].work["releases"] < results["adhesion below drag"].work["captures"]
    )
    assert 0 < results["threshold"].work["captures"] < caught


@pytest.mark.long
def test_the_field_of_a_magnet_holds_and_lets_go():
    """The magnetic moment is that at the end of the step; a remaining field of the magnet still holds."""
    draw = np.random.default_rng(2)
    position = draw.normal(size=(50, 3))
    position *= BALL * draw.uniform(1.2, 1.8, (50, 1)) / np.linalg.norm(position, axis=1, keepdims=True)

    def setup(end):
        return Scene(
            particles=Particles(
                position=position,
                velocity=np.zeros((50, 3)),
                radius=1e-7,
                density=1000.0,
                quantities={"saturation_moment": 2e-16},
            ),
            effects=(
                MagneticField(constant=(0.1, 0.0, 0.0), end=0.5),
                MagneticSpheres(spheres=[{"radius": BALL, "magnetisation": (1e6, 0.0, 0.0)}], end=end),
                FixedMoment(),
                Magnetophoresis(),
                Capture(release=Release(adhering=0.4)),
            ),
            stepper=Brownian(
                temperature=298.0,
                viscosity=VISCOSITY,
                control=DriftLimit(longest=1e-3, shortest=1e-9, drift=1.0),
            ),
            duration=0.8,
            seed=3,
        )

    off, on = simulate([setup(0.5), setup(0.9)], worlds=2)
    for result in (off, on):
        assert result.status.ok, result.status.reason
        check_balance(result)
    assert on.work["captures"] > 40
    assert on.work["releases"] == 0
    assert off.work["captures"] > 40
    stay = int(off.state["adheres"][off.state["captured_by"] >= 0].sum())
    assert stay == off.work["captures"] - off.work["releases"]
    assert 0.2 < stay / off.work["captures"] < 0.6
    # Those released have diffused away from the surface.
    free = off.state["captured_by"] < 0
    away = np.linalg.norm(off.state["position"][free], axis=1) - BALL - 1e-7
    assert away.min() >= -1e-20
    assert np.median(away) > 1e-7


def filtered(seed=0, together=False):
    """As ``pushed``, at room temperature, with a part that adheres."""
    return pushed(Release(adhering=0.4), together, seed, temperature=298.0)


def same(one, other):
    assert one.work == other.work
    for name, values in one.state.items():
        np.testing.assert_array_equal(values, other.state[name], err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("together", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_same_bits_alone_in_a_batch_in_portions_and_by_both_schedules(together):
    scenes = [filtered(seed, together) for seed in range(4)]
    # As many worlds as for the comparison with NumPy, whose structure this is.
    usual = simulate(scenes, worlds=5)
    assert all(0 < result.work["releases"] < result.work["captures"] for result in usual)
    same(simulate([scenes[2]])[0], usual[2])
    if together:
        same(simulate(scenes, worlds=5, schedule="world")[2], usual[2])
    simulation = compiled(scenes[0], worlds=5)
    simulation.load(scenes)
    for portion in (7, 1, 53, 2):
        simulation.run(steps=portion)
        assert all(particle_balance(one.work, one.state).missing == 0 for one in simulation.results())
    simulation.run()
    same(simulation.results()[2], usual[2])


@pytest.mark.long
def test_numbers_balance_at_every_look():
    setup = filtered()
    simulation = compiled(setup)
    simulation.load([setup])
    series = MeasureSeries(4.2 * DT)
    simulation.run(observers=[series])
    captured = series[0]["captures"] - series[0]["releases"]
    (result,) = simulation.results()
    assert captured.max() > captured[-1] > 0
    assert all(now >= before for before, now in pairwise(series[0]["captures"]))
    check_balance(result)


@pytest.mark.long
def test_inertial_particles_are_released_too():
    """A grain on top of a ball is held by gravity; one that rises against its lower side is not, slides
    along it, and passes."""
    effects = (
        Gravity(acceleration=(0.0, 0.0, -9.81)),
        MagneticSpheres(spheres=[{"radius": 1.0}]),
        Capture(release=Release()),
    )
    setup = scene(
        [[0.0, 0.0, 1.06], [0.3, 0.0, -1.02]],
        [[0.0, 0.0, -0.1], [0.0, 0.0, 1.0]],
        effects,
        radius=0.05,
        mass=1.0,
        stepper=fixed(1e-3),
        duration=0.2,
    )
    (result,) = simulate([setup], capacity=4)
    state = by_id(result)
    np.testing.assert_array_equal(state["captured_by"], [0, -1])
    assert np.linalg.norm(state["position"][0]) == pytest.approx(1.05, abs=1e-12)
    assert np.linalg.norm(state["position"][1]) >= 1.05 - 1e-9
    assert check_balance(result).captures == 1


def test_without_release_particles_stay_for_ever():
    """B16 6.3; the fields of a release do not exist."""
    (result,) = simulate([pushed(None)])
    assert result.work["captures"] > 30
    assert "releases" not in result.work
    assert not {"released_at", "adheres", "capture_count"} & result.state.keys()
    assert particle_balance(result.work, result.state).captured == result.work["captures"]


def test_release_is_kept_in_files_and_validated():
    setup = pushed(Release(adhering=0.4, adhesion_force=1e-13))
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert again.effects[-1].release == Release(adhering=0.4, adhesion_force=1e-13)
    with pytest.raises(InputError, match=r"release\.adhering must be at most 1\.0; received 1\.2"):
        Release(adhering=1.2)
