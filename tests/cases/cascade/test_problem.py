"""The inverse problem of cascade: stages of a design, its capture time, and what it refuses."""

import numpy as np
import pytest

from tisim import InputError
from tisim.cases.cascade import problem as cascades
from tisim.cases.cascade.problem import ANGLES, GIVEN_UP, TIMES, capture_time, planned
from tisim.cases.cascade.scene import PlannedCascade
from tisim.cases.cascade.statistics import captured_at, time_to
from tisim.sources import MagneticCylinders

DESIGN = {name: 10.0 * k for k, name in enumerate(ANGLES)} | {name: 5.0 + k for k, name in enumerate(TIMES)}


def angle_to_the_field(scene):
    """In degrees; the field is along x."""
    (body,) = next(one for one in scene.effects if isinstance(one, MagneticCylinders)).cylinders
    return np.degrees(np.arccos(abs(body.axis[0])))


def test_a_design_is_an_angle_and_a_time_for_each_stage():
    cascade, draw = planned(DESIGN), np.random.default_rng(0)
    lengths = [5.0, 6.0, 7.0, 8.0, 9.0, 10.0]
    for passed in range(9):
        stage = cascade.scene(4, draw, passed)
        assert stage.duration == pytest.approx(lengths[passed % 6], rel=1e-12)
        assert angle_to_the_field(stage) == pytest.approx(10.0 * (passed % 6), abs=1e-6)
        assert cascade.begin(passed) == pytest.approx(sum((lengths * 2)[:passed]), rel=1e-12)
        assert stage.particles.number == 4


def across(time):
    return {name: 90.0 for name in ANGLES} | {name: time for name in TIMES}


@pytest.mark.slow
def test_the_capture_time_is_the_one_of_the_cascade():
    """A cascade with equal stages of fibres across the field is B16's optimal cascade."""
    found = capture_time(across(40.0), seed=3)
    (times,) = captured_at([PlannedCascade(25, gap=cascades.OFF, angles=(90.0,), stages=(40.0,))], 1, seed=3)
    assert found == time_to(0.9, times)[0]
    assert 200 < found < 450
    assert found != capture_time(across(40.0), seed=4)


def test_a_design_that_captures_too_little_is_refused(monkeypatch):
    """Stages that never capture most particles, without a run."""
    asked = []
    monkeypatch.setattr(
        cascades, "captured_at", lambda some, **more: asked.append((some, more)) or [np.full((1, 25), np.inf)]
    )
    with pytest.raises(InputError, match=r"time to capture 90% must be at most 4400 s; received more"):
        capture_time(DESIGN, seed=5)
    assert asked == [([planned(DESIGN)], {"repeats": 1, "seed": 5, "longest": GIVEN_UP})]


@pytest.mark.slow
def test_fibres_along_the_field_capture_too_little(monkeypatch):
    monkeypatch.setattr(cascades, "GIVEN_UP", 100.0)
    with pytest.raises(InputError, match=r"time to capture 90% must be at most 100 s; received more"):
        capture_time(across(50.0) | {name: 0.0 for name in ANGLES}, seed=0)
    assert GIVEN_UP == 4400.0


@pytest.mark.slow
def test_longer_stages_of_fibres_across_the_field_are_faster_than_the_published_ones():
    """Six starts each, at least five standard errors apart: 490 s with B16's stages of 10 s, 320 s with
    40 s."""
    stages = [
        PlannedCascade(25, gap=cascades.OFF, angles=(90.0,), stages=(length,)) for length in (10.0, 40.0)
    ]
    published, longer = (time_to(0.9, times) for times in captured_at(stages, 6))
    error = np.hypot(published.std(ddof=1), longer.std(ddof=1)) / np.sqrt(6)
    assert published.mean() - longer.mean() > 5 * error
