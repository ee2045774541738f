"""Feasibility first: the order of designs with constraints, for one and several objectives."""

import numpy as np
import pytest
from deap import base, tools

from tisim.optimize.problem.feasibility import beats, penalised, ranks, total_violation

RNG = np.random.default_rng(11)


def test_the_three_rules_of_deb():
    assert beats(2.0, 0.0, 3.0, 0.0)  # both feasible: the better one
    assert not beats(3.0, 0.0, 2.0, 0.0)
    assert not beats(2.0, 0.0, 2.0, 0.0)
    assert beats(9.0, 0.0, 2.0, 0.1)  # feasible before infeasible
    assert not beats(2.0, 0.1, 9.0, 0.0)
    assert beats(9.0, 0.1, 2.0, 0.2)  # both infeasible: the smaller violation
    assert not beats(2.0, 0.1, 1.0, 0.1)


def test_with_several_objectives_feasible_designs_must_dominate():
    assert beats([1.0, 2.0], 0.0, [1.0, 3.0], 0.0)
    assert not beats([1.0, 3.0], 0.0, [2.0, 2.0], 0.0)
    assert beats([1.0, 3.0], 0.0, [0.0, 0.0], 1e-9)
    assert beats([9.0, 9.0], 0.1, [0.0, 0.0], 0.2)


def test_violations_add_up():
    np.testing.assert_allclose(total_violation([[0.0, 0.0], [0.5, 0.25]]), [0.0, 0.75])


def test_ranks_of_one_objective():
    costs = [3.0, 1.0, 2.0, 1.0, 0.0, 0.5]
    violations = [0.0, 0.0, 0.0, 0.0, 0.3, 0.1]
    assert ranks(costs, violations).tolist() == [2, 0, 1, 0, 4, 3]


def test_ranks_if_none_or_all_are_feasible():
    assert ranks([1.0, 2.0], [0.2, 0.1]).tolist() == [1, 0]
    assert ranks([1.0, 2.0], [0.0, 0.0]).tolist() == [0, 1]
    assert ranks(np.empty((0, 2)), []).tolist() == []


@pytest.mark.parametrize("objectives", [1, 2, 3])
def test_ranks_agree_with_the_comparison_of_two(objectives):
    for _ in range(20):
        costs = RNG.integers(0, 5, (30, objectives)).astype(float)
        violations = np.maximum(0, RNG.integers(-3, 4, 30)) / 2
        place = ranks(costs, violations)
        for i in range(30):
            better = [j for j in range(30) if beats(costs[j], violations[j], costs[i], violations[i])]
            # Each design is behind all better ones, and directly behind one of them, as in nondominated
            # sorting.
            assert place[i] == max((place[j] + 1 for j in better), default=0)


def test_fronts_of_feasible_designs_equal_deap():
    costs = RNG.random((60, 3))

    class Point(list):
        def __init__(self, values, index):
            super().__init__(values)
            self.index = index
            self.fitness = type("F", (base.Fitness,), {"weights": (-1.0,) * 3})(tuple(values))

    fronts = tools.sortNondominated([Point(row, k) for k, row in enumerate(costs)], 60)
    expected = np.empty(60, int)
    for number, front in enumerate(fronts):
        expected[[point.index for point in front]] = number
    np.testing.assert_array_equal(ranks(costs, np.zeros(60)), expected)


@pytest.mark.parametrize("objectives", [1, 2])
def test_penalised_costs_are_in_the_same_order(objectives):
    costs = RNG.random((50, objectives))
    violations = np.maximum(0, RNG.normal(size=50))
    by_cost = penalised(costs, violations)
    assert by_cost.shape == costs.shape
    np.testing.assert_array_equal(by_cost[violations == 0], costs[violations == 0])
    for i in range(50):
        for j in range(50):
            alone = beats(by_cost[i], 0.0, by_cost[j], 0.0)
            assert alone == beats(costs[i], violations[i], costs[j], violations[j])


def test_penalised_costs_without_a_feasible_design_and_with_a_failed_one():
    np.testing.assert_allclose(penalised([5.0, 7.0], [0.2, 0.1]), [0.2, 0.1])
    costs = penalised([1.0, np.inf, 0.0], [0.0, np.inf, 0.5])
    np.testing.assert_array_equal(costs, [1.0, np.inf, 1.5])
