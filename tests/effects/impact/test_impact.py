"""Impact of two grains against an independent reference, and conservation."""

import numpy as np
import pytest

from tests.effects.impact.impact_reference import COMBINATIONS, DT, PAIRS, as_scene, draw, reference
from tests.scenes import energy, momentum, simulate
from tisim.effects import DeformationWork, Friction, Heating, Reaction

QUICK = ("all",)


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in COMBINATIONS],
)
def impacts(request):
    """The same random pairs under each combination of laws, as the worlds of one batch."""
    kinds = COMBINATIONS[request.param]
    rng = np.random.Generator(np.random.Philox(11))
    pairs = [draw(rng) for _ in range(PAIRS)]
    results = simulate([as_scene(pair, kinds) for pair in pairs], worlds=PAIRS, capacity=2)
    assert all(result.work["impacts"] == 1 for result in results)
    assert all(result.work["unconverged"] == 0 for result in results)
    return kinds, pairs, results


@pytest.mark.long
def test_impact_equals_its_reference(impacts):
    kinds, pairs, results = impacts
    bond_outcomes = set()
    for pair, result in zip(pairs, results, strict=True):
        expected = reference(pair, kinds)
        speed = np.abs(pair["velocity"][0] - pair["velocity"][1]).max()
        np.testing.assert_allclose(
            result.state["velocity"], expected["velocity"], rtol=1e-12, atol=1e-10 * speed
        )
        assert result.work["bonds"] == (expected["e"] == 0)
        if Heating in kinds:
            np.testing.assert_allclose(result.state["temperature"], expected["temperature"], rtol=1e-10)
        if Reaction in kinds:
            np.testing.assert_allclose(result.state["reaction_heat"], expected["heat"], rtol=1e-10)
        if DeformationWork in kinds:
            np.testing.assert_allclose(
                result.state["deformation_work"], expected["work"], rtol=1e-9, atol=1e-300
            )
        bond_outcomes.add(expected["e"] == 0)
    assert bond_outcomes == {True, False}, "the sample must hold bonds and rebounds"


def test_impact_conserves_momentum_and_energy(impacts):
    kinds, pairs, results = impacts
    for pair, result in zip(pairs, results, strict=True):
        before = pair["mass"] @ pair["velocity"]
        scale = (pair["mass"] * np.linalg.norm(pair["velocity"], axis=1)).sum()
        np.testing.assert_allclose(momentum(result.state), before, rtol=0, atol=4e-16 * scale)
        if Heating in kinds:
            start = dict(result.start)
            assert energy(result.state) == pytest.approx(energy(start), rel=2e-14)


def test_friction_slows_slip_and_never_reverses_it(impacts):
    kinds, pairs, results = impacts
    stuck = slid = 0
    for pair, result in zip(pairs, results, strict=True):
        apart = pair["position"] + DT * pair["velocity"]
        n = (apart[1] - apart[0]) / np.linalg.norm(apart[1] - apart[0])
        before, after = (v[0] - v[1] for v in (pair["velocity"], result.state["velocity"]))
        before, after = before - before @ n * n, after - after @ n * n
        size = np.linalg.norm(before)
        rounding = 1e-14 * np.abs(pair["velocity"]).max()
        assert after @ before >= -rounding * size
        assert np.linalg.norm(after) <= size + rounding
        if Friction not in kinds and not result.work["bonds"]:
            np.testing.assert_allclose(after, before, rtol=0, atol=10 * rounding)
        stuck += np.linalg.norm(after) < 10 * rounding
        slid += np.linalg.norm(after) > 0.01 * size
    assert stuck
    assert slid


def test_restitution_leaves_the_approach_times_e(impacts):
    """Separation speed over approach speed is between 0 and 1, and exactly 0 for pairs that bond."""
    _, pairs, results = impacts
    for pair, result in zip(pairs, results, strict=True):
        apart = pair["position"] + DT * pair["velocity"]
        n = (apart[1] - apart[0]) / np.linalg.norm(apart[1] - apart[0])
        departure = (result.state["velocity"][1] - result.state["velocity"][0]) @ n
        approach = (pair["velocity"][0] - pair["velocity"][1]) @ n
        e = departure / approach
        rounding = 1e-13 * np.abs(pair["velocity"]).max() / approach
        assert -rounding <= e < 1
        assert (e <= rounding) == bool(result.work["bonds"])


def test_impact_looks_the_same_from_a_moving_frame(impacts):
    """Galilean invariance: adding 1000 m/s to all velocities changes only the velocities."""
    kinds, pairs, results = impacts
    boost = np.array([1000.0, -1000.0, 1000.0])
    moving = simulate(
        [as_scene({**pair, "velocity": pair["velocity"] + boost}, kinds) for pair in pairs],
        worlds=PAIRS,
        capacity=2,
    )
    for rest, other in zip(results, moving, strict=True):
        np.testing.assert_allclose(other.state["velocity"] - boost, rest.state["velocity"], rtol=0, atol=2e-9)
        for name in ("temperature", "reaction_heat", "deformation_work"):
            if name in rest.state:
                np.testing.assert_allclose(other.state[name], rest.state[name], rtol=1e-9, atol=1e-300)
        for name in ("bonds", "impacts"):
            assert other.work[name] == rest.work[name]
