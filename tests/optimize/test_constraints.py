"""Constraints on results: the best design satisfies them, for the mean over its starts."""

import numpy as np
import pytest

from tisim import optimize
from tisim.optimize import Gene, Objective, Problem, ResultConstraint

GENES = (Gene("x", "m", 0.0, 1.0), Gene("y", "m", 0.0, 1.0))


def bowl(design, seed):
    """Least at (0.3, 0.3); its load is x + y plus noise."""
    rng = np.random.default_rng(seed)
    value = (design["x"] - 0.3) ** 2 + (design["y"] - 0.3) ** 2
    return {"value": value + 0.001 * rng.normal(), "load": design["x"] + design["y"] + 0.01 * rng.normal()}


def problem(**bounds):
    load = ResultConstraint("load", lambda result: result.value["load"], "N", **bounds)
    return Problem.of_function(
        bowl, GENES, (Objective("value", lambda result: result.value["value"]),), constraints=(load,)
    )


@pytest.mark.parametrize("method", ["gaussian-process", "cma-es"])
def test_the_best_design_satisfies_a_constraint_on_the_result(method):
    outcome = optimize.run(problem(at_least=1.0), method=method, max_evaluations=200, generations=100)
    best = outcome.designs[0]
    assert best.genes["x"] + best.genes["y"] == pytest.approx(1.0, abs=0.05)
    assert best.genes["x"] == pytest.approx(best.genes["y"], abs=0.2)
    assert all(individual.violation == 0 and individual.limited[0] >= 1.0 for individual in outcome.hall)


def test_without_a_feasible_design_the_least_violation_is_best():
    outcome = optimize.run(problem(at_least=3.0), max_evaluations=80, generations=100)
    assert outcome.hall[0].violation == min(one.violation for one in outcome.hall) > 0
    assert sum(outcome.designs[0].genes.values()) > 1.8


def test_a_range_of_few_designs_is_searched_to_its_end():
    def value(design, seed):
        return abs(design["n"] - 3) + 0.01 * np.random.default_rng(seed).normal()

    few = Problem.of_function(value, (Gene("n", "", 1, 6, integer=True),))
    for method in ("genetic", "gaussian-process"):
        outcome = optimize.run(few, method=method, generations=12)
        assert outcome.designs[0].genes == {"n": 3}
        assert len(outcome.estimates) == 6
