"""The reported front of several objectives, by held-out starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.conclusion.held_out import FEWEST_FRESH, HeldOut
from tisim.optimize.hall_of_fame import not_dominated
from tisim.optimize.methods.individual import Individual
from tisim.optimize.surrogate.ranking import best


def front_of(held_out: HeldOut, known: Sequence[Individual], confirm: int) -> list[Individual]:
    """Return the front, in which no design is dominated according to the means of held-out starts. If none
    of its designs satisfies the constraints of the result, it is the one with the least violation.

    confirm : held-out starts of each design.

    The remaining designs are selected by the same means, and so are biased again. If r of m intervals remain,
    they get the confidence 1 - 0.05 r / m, so that 95 % of them contain the true value.

    Source: Y. Benjamini and D. Yekutieli, J. Am. Stat. Assoc. 100 (2005) 71-81.
    """
    problem = held_out.problem
    constraints = problem.result_constraints
    front = best(problem.genome, known, len(known), constraints)
    if not confirm or not front:
        return front
    left = held_out.left
    if not math.isinf(left):
        fewest = max(FEWEST_FRESH, *(one.statistic.fewest_starts for one in problem.objectives))
        confirm = max(min(confirm, int(left) // len(front)), min(confirm, fewest))
        front = best(problem.genome, known, max(1, int(left) // confirm), constraints)
    held_out.confirm(front, confirm)
    if not front[0].confirmed:
        return front
    good = [one for one in front if not held_out.excess(one)]
    left_over = not_dominated(good or [min(front, key=lambda one: held_out.excess(one))])
    confidence = 1.0 - (1.0 - CONFIDENCE) * len(left_over) / len(front)
    held_out.confirm(front, confirm, confidence)
    return left_over
