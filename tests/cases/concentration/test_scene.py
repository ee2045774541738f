"""Concentrated samples: initial positions and the identification of chains."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim import Particles, RunError, Simulation, run
from tisim.analysis import Mean, head_to_tail, labels, mean_size, near
from tisim.cases.case import Claim
from tisim.cases.common.magnetic_fibre import SATURATION_MOMENTS
from tisim.cases.concentration import CASE
from tisim.cases.concentration.scene import (
    DENSITY,
    DISTANCE,
    SIZES,
    coupling,
    longest,
    scene,
    scene_for,
    side,
)
from tisim.cases.concentration.statistics import (
    CAPTURE,
    CHAINS,
    DENSE,
    DENSEST,
    first,
    firsts,
    grown,
    held_fraction,
    results,
)


@pytest.mark.parametrize("angle", [0.0, 90.0])
@pytest.mark.parametrize("concentration", [0.005, 2.0])
def test_samples_have_the_concentration_and_lie_above_the_rim(angle, concentration):
    sample = scene(angle=angle, concentration=concentration, number=500)
    state = sample.particles.arrays(sample.domain, 0)
    body = sample.effects[1].cylinders[0]
    along = state["position"] @ np.asarray(body.direction)
    d = side(500, 75e-9, concentration)
    assert state["mass"].sum() / d**3 == pytest.approx(1e3 * concentration)
    low, high = state["position"].min(axis=0), state["position"].max(axis=0)
    assert (high - low <= d).all()
    assert (high - low > 0.9 * d).all()
    assert along.min() >= body.length / 2 + DISTANCE
    assert along.min() < body.length / 2 + DISTANCE + 0.1 * d
    across = (low + high) / 2 - (low + high) / 2 @ np.asarray(body.direction) * np.asarray(body.direction)
    assert np.linalg.norm(across) == pytest.approx(body.radius, abs=0.1 * d)


def test_coupling_is_the_energy_that_binds_two_at_contact():
    """mu_0 m^2 / (2 pi d^3), in k T, and B16's numbers: 1 for 25 nm, 825 for the largest there."""
    assert coupling(25) == pytest.approx(1.0, abs=0.005)
    assert coupling(125) == pytest.approx(825, rel=0.001)


def test_noise_moves_a_particle_by_a_part_of_its_radius_in_the_longest_step():
    for radius, coarse in ((25e-9, 1.0), (125e-9, 3.0)):
        diffusivity = 1.380649e-23 * 298 / (6 * np.pi * 1e-3 * radius)
        assert np.sqrt(2 * diffusivity * longest(radius, coarse)) == pytest.approx(0.03 * coarse * radius)


def test_near_pairs_agree_with_a_double_loop():
    position = np.random.default_rng(1).uniform(size=(60, 3))
    expected = [
        (i, j)
        for i in range(60)
        for j in range(i + 1, 60)
        if np.linalg.norm(position[i] - position[j]) <= 0.2
    ]
    assert len(expected) > 10
    np.testing.assert_array_equal(near(position, 0.2), expected)


def test_pairs_bound_head_to_tail_by_energy():
    """Every pair is compared with B16 Eq. (6.21)."""
    draw = np.random.default_rng(2)
    position, moment = draw.uniform(size=(80, 3)) * 4, draw.normal(size=(80, 3))
    moment[:, 0] += 2
    unit = moment / np.linalg.norm(moment, axis=1, keepdims=True)
    expected = []
    for i in range(80):
        for j in range(i + 1, 80):
            r = position[i] - position[j]
            d = np.linalg.norm(r)
            u = -(3 * (r @ unit[i]) * (r @ unit[j]) / d**5 - unit[i] @ unit[j] / d**3)
            if u <= 0.5 * -2.0 / 0.9**3:
                expected.append((i, j))
    assert len(expected) > 10
    np.testing.assert_array_equal(head_to_tail(position, moment, 0.9), expected)


def test_chains_and_singles():
    x = np.array([0.0, 1.0, 2.0, 5.0, 0.0, 9.0])
    position = np.stack([x, [0, 0, 0, 0, 1.0, 0], np.zeros(6)], axis=1)
    pairs = head_to_tail(position, np.tile([1.0, 0, 0], (6, 1)), 1.0)
    np.testing.assert_array_equal(pairs, [(0, 1), (1, 2)])
    cluster = labels(6, pairs)
    assert len(set(cluster[:3])) == 1
    assert len(set(cluster)) == 4
    assert mean_size(6, pairs) == 1.5
    assert mean_size(6, pairs[:0]) == 1.0


def test_particles_connected_to_a_captured_one_are_held():
    position = np.array([[0, 0, 0], [2.1, 0, 0], [4.2, 0, 0], [9, 0, 0], [11, 0, 0]], float)
    state = {"position": position, "radius": np.ones(5), "fixed": np.array([1, 0, 0, 0, 0])}
    assert held_fraction(state) == 3 / 5
    assert held_fraction({**state, "fixed": np.zeros(5, int)}) == 0


def test_first_capture_is_not_the_end_of_the_run():
    at = {"captured_at": np.array([-1.0, 0.3, 0.2])}
    result = SimpleNamespace(state=at, time=0.4, scene=SimpleNamespace(name="x"))
    assert first(result) == 0.2
    at["captured_at"][1:] = -1.0
    with pytest.raises(RunError, match=r"x: nothing is captured within 0\.4 s"):
        first(result)


@pytest.mark.slow
def test_every_size_runs():
    """A few steps of each size are run, as the longest sizes take days."""
    for size in SIZES:
        sample = scene_for(size, 0).replace({"duration": 2e-6})
        assert run(sample).status.ok, size


def spread(coarse):
    """Standard deviation of the distance of a bound pair in equilibrium, in diameters."""
    two = scene(nanometres=75, number=2, coarse=coarse)
    place = np.asarray(two.particles.placement.low) + np.array([[0.0, 0, 0], [1.5e-7, 0, 0]])
    pair = Particles(
        position=place, velocity=0 * place, radius=75e-9, density=DENSITY,
        quantities={"saturation_moment": SATURATION_MOMENTS[75]},
    )  # fmt: skip
    scenes = [two.model_copy(update={"particles": pair, "seed": seed}) for seed in range(16)]
    simulation = Simulation(scenes[0], worlds=16)
    simulation.load(scenes)
    distance = []
    for _ in range(100):
        simulation.run(steps=20)
        a, b = simulation.s.read("position")[:, :2].transpose(1, 0, 2)
        distance.append(np.linalg.norm(b - a, axis=1) / 1.5e-7)
    return np.std(distance[20:])


@pytest.mark.slow
def test_the_spread_of_bound_pairs():
    assert spread(1.0) == pytest.approx(0.03, rel=0.2)
    assert spread(1 / 3) == pytest.approx(0.008, rel=0.2)
    assert spread(3.0) == pytest.approx(0.09, rel=0.2)


@pytest.mark.slow
def test_first_capture_does_not_depend_on_the_steps():
    """With half the step size the time of each start changes by less than its confidence interval."""
    settings = [{"concentration": 0.5, "angle": 0.0, **CAPTURE, "coarse": coarse} for coarse in (3.0, 1.5)]
    usual, finer = (firsts(group) for group in results(settings, 4))
    change = Mean.of(finer - usual)
    assert abs(change.value) < change.half < 0.05


@pytest.mark.slow
def test_denser_samples_are_captured_sooner_along_the_field_too():
    """Concentrations are within the range of B16. Many starts are needed, as the effect is small."""
    settings = [{"angle": 0.0, "concentration": c, **CAPTURE, "duration": 0.3} for c in (DENSE, DENSEST)]
    usual, denser = map(firsts, results(settings, 32))
    assert Claim("", Mean.of(usual - denser), least=0.0).ok


@pytest.mark.slow
def test_chains_hardly_depend_on_the_steps():
    """With steps that move particles a third or three times as far, the growth of chains by three particles
    changes by less than half a particle at 95 % confidence: by 0.19 ± 0.14 and by -0.02 ± 0.15."""
    settings = [{"concentration": 0.5, **CHAINS, "coarse": coarse} for coarse in (1.0, 1 / 3, 3.0)]
    usual, *others = (np.array([grown(result) for result in group]) for group in results(settings, 64))
    assert Mean.of(usual).value > 2
    for other in others:
        change = Mean.of(other - usual)
        assert abs(change.value) + change.half < 0.5


@pytest.mark.slow
def test_the_claims_hold():
    for claim in CASE.check():
        assert claim.ok, (claim.name, *claim.cells)
