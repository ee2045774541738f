"""Individuals as DEAP handles them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache

from deap import base, creator

from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.problem.constraint import InequalityConstraint
from tisim.optimize.problem.feasibility import total_violation


@cache
def minimised(objectives: int) -> type:
    """Return the fitness class for this number of costs, which DEAP's creator makes, so that individuals can
    be pickled."""
    name = f"TisimFitness{objectives}"
    creator.create(name, base.Fitness, weights=(-1.0,) * objectives)
    kind: type = getattr(creator, name)
    return kind


class Individual(list[float]):
    """An individual: a point of the unit cube, its DEAP fitness (invalid until known) and its estimates.

    estimates, confirmed : estimates of the cost of each objective, from the search and from held-out starts;
        () if there are none.
    limits, confirmed_limits : the same of each constraint of the result, in its unit.
    violation : total constraint violation by the means of the search, 0 for a feasible design.
    """

    def __init__(self, genes: Iterable[float], objectives: int = 1) -> None:
        super().__init__(float(x) for x in genes)
        self.fitness = minimised(objectives)()
        self.estimates: tuple[FitnessEstimate, ...] = ()
        self.confirmed: tuple[FitnessEstimate, ...] = ()
        self.limits: tuple[FitnessEstimate, ...] = ()
        self.confirmed_limits: tuple[FitnessEstimate, ...] = ()
        self.violation = 0.0

    def know(self, estimates: tuple[FitnessEstimate, ...]) -> None:
        """Set these estimates as its fitness."""
        self.estimates = estimates
        self.fitness.values = tuple(estimate.mean for estimate in estimates)

    def limit(self, constraints: Sequence[InequalityConstraint], limits: Iterable[FitnessEstimate]) -> None:
        """Set these estimates of the constraints of the result, in order."""
        self.limits = tuple(limits)
        parts = [one.violation(mean) for one, mean in zip(constraints, self.limited, strict=True)]
        self.violation = float(total_violation(parts))

    @property
    def limited(self) -> tuple[float, ...]:
        """The mean of each constraint of the result over the starts of the search."""
        return tuple(estimate.mean for estimate in self.limits)

    @property
    def reported_limits(self) -> tuple[FitnessEstimate, ...]:
        """The estimates of the constraints of the result: from held-out starts, if it has any."""
        return self.confirmed_limits or self.limits

    @property
    def failed(self) -> bool:
        return not self.estimates or not self.estimates[0].ok
