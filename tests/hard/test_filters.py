"""Extreme cases of capture, release and flow through a filter: narrow gaps, switched fields, everything
caught at once, nothing that enters."""

import numpy as np
import pytest
from scipy.constants import k as BOLTZMANN

from tests.scenes import by_id, simulate
from tests.steppers.brownian.colloids import RADIUS, TEMPERATURE, VISCOSITY
from tisim import Particles, Scene
from tisim.analysis import particle_balance
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.geometry import Plane
from tisim.operators import Capture, Inlet, Outlet, Release
from tisim.sources import MagneticField, MagneticSpheres, UniformFlow
from tisim.steppers import Brownian, DriftLimit

pytestmark = pytest.mark.long

BALL, DT = 3e-6, 1e-3
"""m, radius of the magnets; s, longest step."""


def scene(position, balls, *effects, field=0.0, off=1e30, steps=200, flow=0.0, longest=DT, seed=0, **given):
    """Particles near magnets along x, magnetised as long as the field is on."""
    magnetisation = (1e6 if field else 0.0, 0.0, 0.0)
    position = np.asarray(position, float)
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=RADIUS,
            density=1000.0,
            quantities={"saturation_moment": 2e-16, "domain_moment": 1e-19, **given},
        ),
        effects=(
            MagneticField(constant=(field, 0.0, 0.0), end=off),
            MagneticSpheres(
                spheres=[{"centre": c, "radius": BALL, "magnetisation": magnetisation} for c in balls],
                end=off,
            ),
            UniformFlow(velocity=(0.0, 0.0, flow)),
            LangevinMoment(temperature=TEMPERATURE),
            Magnetophoresis(),
            *effects,
        ),
        stepper=Brownian(
            temperature=TEMPERATURE,
            viscosity=VISCOSITY,
            control=DriftLimit(longest=longest, shortest=1e-12, drift=1.0),
        ),
        duration=steps * DT,
        seed=seed,
    )


def run(*scenes):
    results = simulate(scenes, worlds=2, capacity=128)
    for result in results:
        assert result.status.ok, result.status.reason
        assert particle_balance(result.work, result.state).missing == 0
        assert all(np.isfinite(values).all() for values in result.state.values())
    return results


@pytest.mark.slow
@pytest.mark.parametrize("part", [1.5, 0.5, 0.0, -0.1])
def test_a_gap_narrower_than_the_particle(part):
    """Particles start between two balls with a gap of ``part`` radii, below 0 for balls that overlap. In a
    field they are captured in the first step, by the nearer ball, at its surface. Without it nothing holds
    them: they are put onto one surface after the other, and leave sideways or stay, but are never farther
    away than diffusion takes them."""
    apart = BALL + part * RADIUS / 2
    balls = [(-apart, 0.0, 0.0), (apart, 0.0, 0.0)]
    start = np.zeros((60, 3))
    start[:, 1] = np.linspace(-0.3, 0.3, 60) * BALL
    caught, free = run(
        scene(start, balls, Capture(release=Release()), field=0.5),
        scene(start, balls, Capture(release=Release())),
    )
    state = by_id(caught)
    assert (state["captured_at"] <= DT * (1 + 1e-12)).all()
    for k in range(2):
        away = np.linalg.norm(state["position"][state["captured_by"] == k] - balls[k], axis=1)
        np.testing.assert_allclose(away, BALL + RADIUS, rtol=1e-12)
    assert free.work["captures"] == 0
    width = np.sqrt(6 * BOLTZMANN * TEMPERATURE / (6 * np.pi * VISCOSITY * RADIUS) * free.time)
    assert np.linalg.norm(free.state["position"] - start, axis=1).max() < 2 * RADIUS + 4 * width


def test_a_field_that_is_switched_within_a_step():
    """All is released at the end of the longest step in which the field ends; also if the field is on for
    less than that, and particles are captured in their own shorter steps."""
    draw = np.random.default_rng(1)
    start = draw.normal(size=(60, 3))
    start *= (BALL + 2 * RADIUS) / np.linalg.norm(start, axis=1, keepdims=True)
    ball = [(0.0, 0.0, 0.0)]
    off = 100.37 * DT
    coarse, fine = run(
        scene(start, ball, Capture(release=Release()), field=0.5, off=off),
        scene(start, ball, Capture(release=Release()), field=0.5, off=off, longest=DT / 8),
    )
    for result, step in ((coarse, DT), (fine, DT / 8)):
        assert result.work["captures"] > 40
        assert result.work["releases"] == result.work["captures"]
        released = result.state["released_at"]
        end = np.ceil(off / step) * step
        np.testing.assert_allclose(released[released >= 0], end, rtol=1e-12)
    blink, _ = run(*[scene(start, ball, Capture(release=Release()), field=0.5, off=0.4 * DT)] * 2)
    assert blink.work["captures"] == blink.work["releases"] > 20
    released = blink.state["released_at"]
    np.testing.assert_allclose(released[released >= 0], DT, rtol=1e-12)


def test_everything_is_captured_in_the_first_step():
    """And all is released in one step, although each has drawn whether it adheres."""
    draw = np.random.default_rng(1)
    start = draw.normal(size=(100, 3))
    start *= (BALL + 0.9 * RADIUS) / np.linalg.norm(start, axis=1, keepdims=True)
    start = start[np.abs(start[:, 0]) > 0.85 * BALL]
    release = Capture(release=Release(adhering=0.5))
    kept, _ = run(*[scene(start, [(0.0, 0.0, 0.0)], release, field=0.5, off=50.5 * DT, longest=DT / 50)] * 2)
    state = by_id(kept)
    assert kept.work["captures"] == len(start) > 5
    assert (state["capture_count"] == 1).all()
    assert kept.work["releases"] == (state["adheres"] == 0).sum()
    assert 0 < kept.work["releases"] < len(start)


def test_no_particle_ever_enters():
    """The inlet is closed by a ball; or its flow is slower than any number that can be drawn."""
    outlet = Outlet(planes=[Plane(point=(0, 0, 1e-4), normal=(0, 0, -1))])
    inlet = Inlet(
        low=(-1e-6, -1e-6, 0.0), high=(1e-6, 1e-6, 1e-7), direction=(0, 0, 1), end=0.01, fastest=1e-3
    )
    closed, slow = run(
        scene(np.zeros((50, 3)), [(0.0, 0.0, 0.0)], inlet, Capture(), outlet, flow=1e-3),
        scene(np.zeros((50, 3)), [(1.0, 0.0, 0.0)], inlet, Capture(), outlet, flow=1e-60),
    )
    for result in (closed, slow):
        balance = particle_balance(result.work, result.state)
        assert (balance.entered, balance.waiting, balance.free, balance.captures) == (0, 50, 0, 0)
        assert result.state["entry_trials"].min() > 10_000
