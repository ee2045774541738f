"""The reported designs of a search with constraints of the result, by held-out starts.

A constraint limits the mean over the random starts. The starts of the search choose the designs, so they say
little about the constraints of the chosen ones; if the starts are common, their noise shifts the constraint
of all designs alike. Each design that is run from held-out starts shows this shift, and the width of an
interval. The next design is the best one that should then satisfy the constraints with confidence.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.conclusion.held_out import FEWEST_FRESH, HeldOut
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.feasibility import feasible
from tisim.optimize.surrogate.ranking import PosteriorLimits, by_posterior_mean

Array = NDArray[np.float64]


def constrained(
    held_out: HeldOut, known: Sequence[Individual], first: Sequence[Individual], count: int, starts: int
) -> list[Individual]:
    """Return designs after their held-out starts: those that satisfy the constraints with confidence, those
    that may violate one, and those that violate one, by the size of the violation.

    known : all designs that have run and not failed. first : designs by rank; the first of them is run first.
    count : number of designs, if the budget allows them; twice as many are tried if none of them satisfies
        the constraints with confidence.
    starts : held-out starts of each design; the last one may have fewer, if none of the others satisfies
        the constraints with confidence.

    The designs in front are selected by these starts, so the intervals are corrected like intervals of a
    front (conclusion.front).
    """
    choice = _Choice(held_out, known)
    following = list(first[:1])
    while following:
        affordable = int(min(starts, held_out.left))
        if choice.tried and affordable < (starts if choice.proven else FEWEST_FRESH):
            break
        held_out.confirm(following, affordable)
        if not following[0].confirmed:
            break
        choice.add(following[0], affordable)
        done = len(choice.tried) >= (count if choice.proven else 2 * count)
        following = [] if done else choice.following()
    if not choice.tried:
        return list(first[:count])
    selected = choice.proven or [one for one in choice.tried if not held_out.excess(one)]
    if 0 < len(selected) < len(choice.tried):
        confidence = 1.0 - (1.0 - CONFIDENCE) * len(selected) / len(choice.tried)
        for individual, of_it in zip(choice.tried, choice.starts, strict=True):
            held_out.confirm([individual], of_it, confidence)
    return sorted(choice.tried, key=lambda one: (not choice.is_proven(one), held_out.excess(one)))[:count]


class _Choice:
    """Designs that have been run from held-out starts, and the choice of the next one.

    tried : these designs, in order. starts : the number of held-out starts of each.
    """

    def __init__(self, held_out: HeldOut, known: Sequence[Individual]) -> None:
        self.constraints = held_out.problem.result_constraints
        genome = held_out.problem.genome
        self.limits = PosteriorLimits.of(genome, known, self.constraints)
        self.ranked = by_posterior_mean(genome, known)
        self.row = {id(individual): i for i, individual in enumerate(known)}
        self.tried: list[Individual] = []
        self.starts: list[int] = []

    def add(self, individual: Individual, starts: int) -> None:
        """Add a design after its held-out starts."""
        self.tried.append(individual)
        self.starts.append(starts)

    def is_proven(self, individual: Individual) -> bool:
        """Return whether a design satisfies the constraints with confidence."""
        return feasible(self.constraints, individual.confirmed_limits) is True

    @property
    def proven(self) -> list[Individual]:
        return [individual for individual in self.tried if self.is_proven(individual)]

    def following(self) -> list[Individual]:
        """Return the next design to be tried, in a list; empty if there is none.

        It is the best one, by posterior mean, of those that should satisfy the constraints with confidence;
        without one, the one that is closest to this.
        """
        shift, reach = self._shown()
        violations = self.limits.violations(self.constraints, shift, reach)
        tried = set(map(id, self.tried))
        left = [one for one in self.ranked if id(one) not in tried]
        return sorted(left, key=lambda one: violations[self.row[id(one)]])[:1]

    def _shown(self) -> tuple[Array, Array]:
        """Return for each constraint the mean deviation of the held-out starts from the posterior mean, and
        half of the interval of one more design; (constraints,) both."""
        good = [one for one in self.tried if all(limit.ok for limit in one.confirmed_limits)]
        if not good:
            return np.zeros(len(self.constraints)), np.zeros(len(self.constraints))
        means = np.array([[limit.mean for limit in one.confirmed_limits] for one in good])
        halves = np.array([[limit.half_width for limit in one.confirmed_limits] for one in good])
        expected = self.limits.means[[self.row[id(one)] for one in good]]
        # The interval of one selected design of several is wider.
        rest = (1.0 - CONFIDENCE) / 2.0
        wider = norm.isf(rest / (len(self.tried) + 1)) / norm.isf(rest)
        return (means - expected).mean(axis=0), wider * np.nan_to_num(halves).mean(axis=0)
