"""Held-out starts of the reported designs, within the budget of a search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tisim.numerics.skewed import Moments
from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.feasibility import excess
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings
from tisim.optimize.surrogate.noise import moments

FEWEST_FRESH = 4
"""Held-out starts of each design of a front, if the budget does not allow more."""
Report = Callable[[float], None]
Noise = Sequence[Moments] | None


@dataclass(frozen=True)
class HeldOut:
    """Runs designs from held-out starts, which were not used to choose them.

    noise : moments of the noise of each cost, as known from the search; None if they cannot be estimated.
    report : called with the finished fraction of each call.
    """

    problem: Problem
    ensemble: Ensemble
    noise: Noise
    report: Report

    @property
    def left(self) -> float:
        """The number of runs that the budget still allows."""
        return self.ensemble.budget - self.ensemble.requested

    def confirm(self, chosen: Sequence[Individual], starts: int, confidence: float = CONFIDENCE) -> None:
        """Set the confirmed estimates of designs, if ``starts`` are enough for the statistics and the budget
        allows them, or they are cached."""
        again = bool(chosen) and bool(chosen[0].confirmed)
        too_few = starts < max(one.statistic.fewest_starts for one in self.problem.objectives)
        if not starts or too_few or (starts * len(chosen) > self.left and not again):
            return
        designs = [self.problem.genome.decode(individual) for individual in chosen]
        fresh = self.ensemble.fresh(
            designs, starts, progress=self.report, noise=self.noise, confidence=confidence
        )
        for individual, (estimates, limits) in zip(chosen, fresh, strict=True):
            individual.confirmed, individual.confirmed_limits = estimates, limits

    def excess(self, individual: Individual) -> float:
        """Return the total violation of a design, by its held-out starts if it has any."""
        return excess(self.problem.result_constraints, individual.reported_limits)


def noise_of(problem: Problem, settings: Settings, ensemble: Ensemble, known: Sequence[Individual]) -> Noise:
    """Return the moments of the noise of each cost, if they can be estimated.

    They cannot with common starts, because then the noise is the same for all designs.
    """
    if ensemble.repeatable or settings.ensemble.common_starts:
        return None
    return moments(problem.genome, known)
