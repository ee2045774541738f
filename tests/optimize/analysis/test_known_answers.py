"""The true friction, rolling friction, restitution, flux, speed and hardness are in their intervals.

PYTHONPATH=. python tests/optimize/analysis/known_answers.py
"""

import numpy as np
import pytest

from tests.optimize.analysis.known_answers import EXPERIMENTS, KnownAnswers, coverage

SETS = 200


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch):
    """Skip fsync, as no file of these searches is kept."""
    monkeypatch.setattr("os.fsync", lambda file: None)


@pytest.mark.long
def test_flux_and_speed_are_recovered():
    """With seed 0 no error of the data exceeds 1.96 deviations."""
    for inside, part in KnownAnswers("flux").inside(0):
        assert inside
        assert 0.05 < part < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_truth_is_in_the_interval(name):
    inside, part = coverage(name, SETS)
    print(f"{name}: truth inside {inside}, intervals {part} of the ranges")
    deviation = np.sqrt(0.95 * 0.05 / SETS)
    assert np.all(np.abs(inside - 0.95) < 2.5 * deviation)
    assert np.all(part < 0.3)
