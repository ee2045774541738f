"""Which of two designs is better where there are constraints: feasibility first.

Of two feasible designs the better one counts, a feasible one is better than one that is not, and of two that
are not feasible the one that violates less is better: K. Deb, Comput. Methods Appl. Mech. Eng. 186 (2000)
311-338, section 3; for several objectives, where the better one dominates: K. Deb et al., IEEE Trans. Evol.
Comput. 6 (2002) 182-197, section VI. So no weight of a penalty is to be chosen.

Costs are of shape (designs,) or (designs, objectives) and to be minimised. Violations are totals of designs,
shape (designs,), 0 for feasible ones; infinite for a design that failed, whose values nobody knows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def total_violation(violations: ArrayLike) -> NDArray[np.float64]:
    """Return the sum over the constraints, the last axis, of scaled excesses
    (``InequalityConstraint.violation``)."""
    return np.sum(np.asarray(violations, dtype=float), axis=-1)


def beats(costs: ArrayLike, violation: float, other_costs: ArrayLike, other_violation: float) -> bool:
    """Return whether a design is better than another one: feasible before infeasible, then by violation; two
    feasible ones by their costs, of several objectives one that dominates."""
    if violation > 0 or other_violation > 0:
        return bool(violation < other_violation)
    mine, others = np.atleast_1d(costs), np.atleast_1d(other_costs)
    return bool(np.all(mine <= others) and np.any(mine < others))


def ranks(costs: ArrayLike, violations: ArrayLike) -> NDArray[np.intp]:
    """Return at which place each design is, from 0: of one objective by its cost, equal costs sharing a
    place; of several by its front. Behind all feasible designs the others, by their violation."""
    values, excess = _checked(costs, violations)
    place = np.zeros(len(excess), dtype=np.intp)
    feasible = excess == 0
    place[feasible] = _fronts(values[feasible])
    behind = place[feasible].max(initial=-1) + 1
    place[~feasible] = behind + np.unique(excess[~feasible], return_inverse=True)[1]
    return place


def penalised(costs: ArrayLike, violations: ArrayLike) -> NDArray[np.float64]:
    """Return costs that put these designs into the order of feasibility first, for a method that knows costs
    only: those of infeasible designs are the worst of the feasible ones plus the violation, in each
    objective; the worst is taken for 0 where no design is feasible (Deb 2000, section 3).

    They compare the designs of one call; those of another may have another worst one.
    """
    values, excess = _checked(costs, violations)
    infeasible = excess > 0
    known = values[~infeasible & np.all(np.isfinite(values), axis=1)]
    worst = known.max(axis=0) if len(known) else np.zeros(values.shape[1])
    values[infeasible] = worst + excess[infeasible, None]
    return values.reshape(np.shape(costs))


def _checked(costs: ArrayLike, violations: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return costs, shape (designs, objectives), in an array of their own, and violations."""
    values, excess = np.array(costs, dtype=float), np.asarray(violations, dtype=float)
    return values if values.ndim == 2 else values[:, None], excess


def _fronts(costs: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return in which front each design is, 0 for those that nothing dominates."""
    if costs.shape[1] == 1:
        return np.unique(costs[:, 0], return_inverse=True)[1]
    no_worse = np.all(costs[:, None] <= costs[None], axis=2)
    dominates = no_worse & np.any(costs[:, None] < costs[None], axis=2)
    fronts, left = np.zeros(len(costs), dtype=np.intp), np.arange(len(costs))
    while len(left):
        dominated = dominates[np.ix_(left, left)].any(axis=0)
        fronts[left[dominated]] += 1
        left = left[dominated]
    return fronts
