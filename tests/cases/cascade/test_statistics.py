"""Statistics of cascades, against stages with known outcomes and against single stages."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim import RandomAroundCylinder, run
from tisim.cases.capture.statistics import fraction
from tisim.cases.cascade import CASE, statistics
from tisim.cases.cascade.scene import Cascade
from tisim.cases.cascade.statistics import captured_at, time_to


@pytest.fixture
def stages(monkeypatch):
    """Scenes of all stages in order; each stage captures its first three particles, at 1/10, 2/10 and 3/10
    of its time."""
    stages_seen = []

    def captured(scenes):
        stages_seen.append(scenes)
        for scene in scenes:
            at = np.full(scene.particles.number, -1.0)
            at[:3] = scene.duration * np.array([0.3, 0.1, 0.2])[: len(at)]
            yield SimpleNamespace(status=SimpleNamespace(ok=True), state={"captured_at": at})

    monkeypatch.setattr(statistics, "run", lambda scenes: list(captured(scenes)))
    return stages_seen


def test_times_count_from_the_start_of_the_cascade_and_end_with_the_share(stages):
    (times,) = captured_at([Cascade(stage=2.0, number=10)], 2)
    expected = [0.2, 0.4, 0.6, 2.2, 2.4, 2.6, 4.2, 4.4, 4.6, np.inf]
    np.testing.assert_allclose(times, [expected, expected])
    assert [[scene.particles.number for scene in stage] for stage in stages] == [[10, 10], [7, 7], [4, 4]]


def test_finished_cascades_do_not_wait_for_others(stages):
    few, many = captured_at([Cascade(stage=1.0, number=3), Cascade(stage=4.0, number=12)], 1)
    np.testing.assert_allclose(few, [[0.1, 0.2, 0.3]])
    np.testing.assert_allclose(time_to(0.9, many), [12.8])
    assert [len(stage) for stage in stages] == [2, 1, 1, 1]


def test_a_cascade_that_captures_too_little_is_stopped(stages, monkeypatch):
    monkeypatch.setattr(statistics, "MAX_STAGES", 2)
    (times,) = captured_at([Cascade(number=10)], 1)
    assert np.isfinite(times).sum() == 6
    assert time_to(0.9, times) == np.inf
    assert len(stages) == 2


def test_time_to_a_share_is_the_capture_time_of_its_last_particle():
    times = np.array([np.arange(1.0, 11.0), [1.0, 2.0, *[np.inf] * 8]])
    np.testing.assert_array_equal(time_to(0.9, times), [9.0, np.inf])
    np.testing.assert_array_equal(time_to(0.15, times), [2.0, 2.0])


def test_every_stage_has_a_start_of_its_own_and_random_ones_an_orientation(stages):
    captured_at([Cascade(number=9), Cascade(number=9, orientation="optimal")], 2)
    scenes = [scene for stage in stages for scene in stage]
    assert len({scene.seed for scene in scenes}) == len(scenes) == 12
    axes = [scene.effects[1].cylinders[0].axis for scene in scenes]
    optimal = [axis for axis in axes if abs(axis[0]) < 1e-15]
    assert len(optimal) == 6
    assert len(set(axes)) == 7


def test_random_orientations_have_the_named_distribution():
    draw = np.random.default_rng(3)
    cosines = [np.cos(np.radians(Cascade().angle(draw))) for _ in range(4000)]
    angles = [Cascade(orientation="angles").angle(draw) for _ in range(4000)]
    # Mean and variance are uniform within five standard errors.
    for values in (np.array(cosines), np.array(angles) / 90):
        assert abs(values.mean() - 1 / 2) < 5 * np.sqrt(1 / 12 / 4000)
        assert abs(values.var() - 1 / 12) < 5 * np.sqrt(1 / 180 / 4000)


def test_particles_lie_in_the_layer():
    scene = Cascade(orientation="optimal", gap=0.5, thickness=1.0, aspect=2.0).scene(
        200, np.random.default_rng(0)
    )
    assert isinstance(scene.particles.placement, RandomAroundCylinder)
    r = scene.particles.arrays(scene.domain, scene.seed)["position"] / 300e-6
    rho, z = np.hypot(r[:, 0], r[:, 1]), np.abs(r[:, 2])
    assert ((rho > 1.5) | (z > 2.5)).all()
    assert rho.max() < 2.5
    assert z.max() < 3.5


@pytest.mark.slow
def test_a_cascade_follows_from_its_stages():
    """Stages of an optimal cascade are alike: 1 - (1 - p)^k is captured after k, p from single stages."""
    one = Cascade(orientation="optimal", number=400)
    draw = np.random.default_rng(5)
    alone = [fraction(result.state) for result in run([one.scene(400, draw) for _ in range(12)])]
    (times,) = captured_at([one], 12, share=0.7)
    p, k = np.mean(alone), 3
    caught = (times <= k * one.stage).mean(axis=1)
    error = np.hypot(caught.std(ddof=1), k * (1 - p) ** (k - 1) * np.std(alone, ddof=1)) / np.sqrt(12)
    assert abs(caught.mean() - (1 - (1 - p) ** k)) < 4 * error < 0.05


@pytest.mark.slow
def test_the_claims_hold():
    for claim in CASE.check():
        assert claim.ok, (claim.name, *claim.cells)
