"""Designs that fail do not bend the process of the costs, and are avoided with the right probability."""

import numpy as np
import pytest

from tests.benchmarks.refused_designs import regret
from tests.optimize.fake_runs import individual_of
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.surrogate.acquisition import Worth
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.validity import Validity


def valid(points):
    return points[:, 0] + points[:, 1] > 0.8


def ran(points, objectives=1):
    individuals = []
    for point, good in zip(points, valid(points), strict=True):
        individual = individual_of(point, *(10.0 + np.sum((point - k) ** 2) for k in range(objectives)))
        if not good:
            individual = Individual(point, objectives)
            individual.know((FitnessEstimate.failed(1, "diverged"),) * objectives)
        individuals.append(individual)
    return individuals


POINTS = np.random.default_rng(1).random((60, 2))


def test_the_probability_of_failure_changes_at_the_edge():
    points = np.random.default_rng(2).random((400, 2))
    probability = np.exp(Validity(np.asarray, POINTS, ~valid(POINTS)).log_probability(points))
    distance = points.sum(axis=1) - 0.8
    assert probability[distance > 0.25].min() > 0.8
    assert probability[distance < -0.25].mean() < 0.1
    near = np.abs(distance) < 0.02
    assert np.mean(probability[near]) == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("objectives", [1, 2])
def test_failed_designs_do_not_change_predicted_costs(objectives):
    individuals = ran(POINTS, objectives)
    everything, good = Belief(), Belief()
    everything.learn(individuals)
    good.learn([individual for individual in individuals if not individual.failed])
    points = np.random.default_rng(3).random((50, 2))
    assert np.array_equal(everything.predict(points), good.predict(points))
    assert good.log_valid(points) is None
    rng = np.random.default_rng(0)
    with_failures, without = Worth(everything, rng).of(points), Worth(good, rng).of(points)
    log_valid = everything.log_valid(points)
    if objectives == 1:
        assert with_failures == pytest.approx(without + log_valid)
    else:
        positive = without > 0
        assert with_failures[positive] == pytest.approx(without[positive] * np.exp(log_valid[positive]))
        assert np.all(with_failures[~positive] <= without[~positive])
    first = Worth(everything, rng).batch(points, 1)[0]
    assert np.array_equal(first, points[np.argmax(with_failures)])


def test_a_search_reaches_the_edge_of_failing_designs():
    """With the worst known cost in place of failed designs the median is 0.38."""
    assert np.median([regret("corner", "genetic", seed, 50) for seed in range(6)]) < 0.28
