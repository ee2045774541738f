"""How often the reported best design of a noisy search truly satisfies its constraint.

The least x is searched for, with a load of x plus normal noise whose mean must be at least 0.5: the best
design is x = 0.5, y = 0.5, and a design is feasible if x is at least 0.5.

    PYTHONPATH=. python tests/optimize/reported_constraints.py [SEARCHES]
"""

import os
import sys

import numpy as np

from tests.optimize.fake_runs import FakeCache
from tisim.optimize import Gene, Objective, Problem, ResultConstraint
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings

GENES = (Gene("x", "m", 0.0, 1.0), Gene("y", "m", 0.0, 1.0))
BOUND, DEVIATION = 0.5, 0.3
"""The bound of the load, and the standard deviation of its noise, N."""


def noisy(design, seed):
    rng = np.random.default_rng(seed)
    value = design["x"] + 0.1 * (design["y"] - 0.5) ** 2 + 0.02 * rng.normal()
    return {"value": value, "load": design["x"] + DEVIATION * rng.normal()}


PROBLEM = Problem.of_function(
    noisy, GENES, (Objective("value", lambda result: result.value["value"]),),
    constraints=(ResultConstraint("load", lambda result: result.value["load"], "N", at_least=BOUND),),
)  # fmt: skip


def reported(method, seed, runs, **ensemble):
    """The reported designs of a search."""
    settings = Settings(method=method, seed=seed, max_evaluations=runs, generations=1000, ensemble=ensemble)
    return search(PROBLEM, FunctionEvaluator(), FakeCache(), settings).designs


def shares(designs):
    """Shares of designs: truly feasible; marked as feasible, unproven and violating; wrongly marked as
    feasible; and the mean distance of x from the bound over the truly feasible ones, m."""
    x = np.array([design.genes["x"] for design in designs])
    marked = [np.array([design.feasible is answer for design in designs]) for answer in (True, None, False)]
    true = x >= BOUND
    far = np.mean(x[true] - BOUND) if true.any() else np.nan
    return np.mean(true), *(np.mean(one) for one in marked), np.mean(marked[0] & ~true), far


if __name__ == "__main__":
    searches = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for method, common in (("random", True), ("random", False), ("cma-es", True), ("genetic", False)):
        for runs in (200, 400):
            designs = [reported(method, seed, runs, common_starts=common)[0] for seed in range(searches)]
            true, yes, unproven, no, wrong, far = shares(designs)
            print(
                f"{method}, {'common' if common else 'own'} starts, {runs} runs: truly feasible {true:.3f}; "
                f"marked yes {yes:.3f}, unproven {unproven:.3f}, no {no:.3f}; wrongly yes {wrong:.3f}; "
                f"x is {far:.3f} above the bound",
                flush=True,
            )
