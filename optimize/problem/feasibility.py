"""The order of designs under constraints: feasible designs come first.

Of two feasible designs the one with the better cost is better; a feasible design is better than an infeasible
one; of two infeasible designs the one with the smaller violation is better. With several objectives, "better
cost" means that one dominates the other. No penalty weight has to be chosen.

Costs have the shape (designs,) or (designs, objectives) and are minimised. Violations are the totals of
designs, shape (designs,): 0 for feasible ones, infinite for a failed design, whose values are not known.

Source: K. Deb, Comput. Methods Appl. Mech. Eng. 186 (2000) 311-338, section 3; for several objectives K. Deb
et al., IEEE Trans. Evol. Comput. 6 (2002) 182-197, section VI.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from tisim.optimize.evaluation.estimate import FitnessEstimate
    from tisim.optimize.problem.constraint import InequalityConstraint

ANSWERS = {True: "yes", None: "unproven", False: "no"}
"""The results of ``feasible``, as in tables."""


def feasible(
    constraints: Sequence[InequalityConstraint], estimates: Sequence[FitnessEstimate]
) -> bool | None:
    """Return whether a design satisfies all constraints, from the estimates of their values.

    False if a mean violates its bounds; True if all intervals lie within the bounds; None otherwise: an
    interval contains a bound, or is not known.
    """
    pairs = list(zip(constraints, estimates, strict=True))
    if any(one.violation(estimate.mean) > 0 for one, estimate in pairs):
        return False
    ends = [one.violation(end) for one, estimate in pairs for end in (estimate.low, estimate.high)]
    return None if any(end > 0 for end in ends) else True


def excess(constraints: Sequence[InequalityConstraint], estimates: Sequence[FitnessEstimate]) -> float:
    """Return the total violation of a design from the means of its constraints."""
    parts = [one.violation(estimate.mean) for one, estimate in zip(constraints, estimates, strict=True)]
    return float(total_violation(parts))


def violated(constraints: Sequence[InequalityConstraint], estimates: Sequence[FitnessEstimate]) -> str:
    """Return the constraints that the means of a design violate, in words; "" if there is none."""
    return "; ".join(
        f"{one.name} is {estimate.mean:.4g} {one.unit}".rstrip() + f" and must be {one.rule}"
        for one, estimate in zip(constraints, estimates, strict=True)
        if one.violation(estimate.mean) > 0
    )


def total_violation(violations: ArrayLike) -> NDArray[np.float64]:
    """Return the sum of scaled excesses (``InequalityConstraint.violation``) over the constraints, the last
    axis."""
    return np.sum(np.asarray(violations, dtype=float), axis=-1)


def beats(costs: ArrayLike, violation: float, other_costs: ArrayLike, other_violation: float) -> bool:
    """Return whether a design is better than another: feasible before infeasible, then by violation; two
    feasible ones by cost, or by dominance for several objectives."""
    if violation > 0 or other_violation > 0:
        return bool(violation < other_violation)
    mine, others = np.atleast_1d(costs), np.atleast_1d(other_costs)
    return bool(np.all(mine <= others) and np.any(mine < others))


def ranks(costs: ArrayLike, violations: ArrayLike) -> NDArray[np.intp]:
    """Return the rank of each design, from 0.

    Feasible designs are ranked by cost, equal costs sharing a rank; with several objectives by front.
    Infeasible designs follow, by their violation.
    """
    values, excess = _checked(costs, violations)
    place = np.zeros(len(excess), dtype=np.intp)
    feasible = excess == 0
    place[feasible] = _fronts(values[feasible])
    behind = place[feasible].max(initial=-1) + 1
    place[~feasible] = behind + np.unique(excess[~feasible], return_inverse=True)[1]
    return place


def penalised(costs: ArrayLike, violations: ArrayLike) -> NDArray[np.float64]:
    """Return costs that sort designs feasible-first, for a method that only knows costs.

    The cost of an infeasible design is the worst feasible cost plus the violation, in each objective. Without
    a feasible design the worst cost is taken as 0. Only costs from the same call can be compared, since the
    worst feasible cost may differ in another call.

    Source: Deb 2000, section 3.
    """
    values, excess = _checked(costs, violations)
    infeasible = excess > 0
    known = values[~infeasible & np.all(np.isfinite(values), axis=1)]
    worst = known.max(axis=0) if len(known) else np.zeros(values.shape[1])
    values[infeasible] = worst + excess[infeasible, None]
    return values.reshape(np.shape(costs))


def _checked(costs: ArrayLike, violations: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a copy of the costs, shape (designs, objectives), and the violations."""
    values, excess = np.array(costs, dtype=float), np.asarray(violations, dtype=float)
    return values if values.ndim == 2 else values[:, None], excess


def _fronts(costs: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the front of each design, 0 for non-dominated ones."""
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
