"""Statistics of a generation, for its line of the logbook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.problem import Problem


def statistics(
    problem: Problem, population: Sequence[Individual], hall: Sequence[Individual]
) -> dict[str, Any]:
    """Return the fitness columns of Outcome.logbook; values of the objectives, not costs."""
    best = [
        min((one.fitness.values[k] for one in hall if not one.violation), default=math.inf)
        for k in range(len(problem.objectives))
    ]
    values = problem.costs(best)
    if problem.several:
        names = [best_of(objective.label) for objective in problem.objectives]
        return {"front": len(hall), **dict(zip(names, values, strict=True))}
    # The fitness of a design that violates a constraint is penalised.
    good = [problem.costs(one.fitness.values)[0] for one in population if not (one.failed or one.violation)]
    return {
        "best": values[0],
        "mean": float(np.mean(good)) if good else math.nan,
        "std": float(np.std(good)) if good else math.nan,
    }


def best_of(label: str) -> str:
    """Return the heading of the best value of one of several objectives."""
    return f"best {label}"
