"""Ranking of the designs that were run, when the means of few starts are noisy.

The best of many noisy means is biased by luck. A Gaussian process through all means draws each towards its
neighbours, more strongly if it has fewer starts; the ranking uses these posterior means. The same applies to
the constraints of the result: a design that violates one may have satisfied it by luck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.constraint import InequalityConstraint
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import GaussianProcess
from tisim.optimize.surrogate.noise import all_exact, costs_and_noise
from tisim.optimize.surrogate.selection import MOST_LEARNED, beaten_by, representative

Number = float | NDArray[np.float64]
_UNSEEN = 1e-4
"""If the noise is not known and the nugget is below this fraction of the variance of all costs, there is no
noise."""
_MARGIN = 1.0
"""Distance, in posterior standard deviations, that the value of a constraint must keep from its bounds: a
design then satisfies the constraint with a probability of 0.84."""


def posterior_means(genome: Genome, individuals: Sequence[Individual]) -> NDArray[np.float64]:
    """Return the posterior mean of each cost of designs, (individuals, objectives).

    Its units may differ from the units of the costs, but the order of values is the same. The costs
    themselves are returned if there is no noise, or the process finds none. None of the individuals may have
    failed.
    """
    costs = np.array([individual.fitness.values for individual in individuals])
    if len(individuals) < 3 or all_exact(individuals):
        return costs
    belief = Belief(genome.features)
    belief.learn(individuals, iterations=60)
    seen = any(model.nugget > _UNSEEN or np.any(model.noise) for model in belief.models)
    return belief.predict(belief.points)[0] if seen else costs


def by_posterior_mean(genome: Genome, individuals: Sequence[Individual]) -> list[Individual]:
    """Return the designs of one objective that satisfy the constraints of the result by their own means, best
    posterior mean first. None of the individuals may have failed."""
    # The costs of designs that violate a constraint are penalised.
    good = [individual for individual in individuals if not individual.violation]
    if not good:
        return []
    return [good[i] for i in np.argsort(posterior_means(genome, good)[:, 0], kind="stable")]


@dataclass(frozen=True, eq=False)
class PosteriorLimits:
    """The posterior of the constraints of the result of some designs, from the starts of the search.

    means, deviations : of each constraint, in its unit, shape (individuals, constraints). They are the own
        means of the designs, and 0, if there is no noise or there are too few designs.
    """

    means: NDArray[np.float64]
    deviations: NDArray[np.float64]

    @classmethod
    def of(
        cls, genome: Genome, individuals: Sequence[Individual], constraints: Sequence[InequalityConstraint]
    ) -> PosteriorLimits:
        """Return the posterior. None of the individuals may have failed."""
        means = np.array([individual.limited for individual in individuals], dtype=float)
        deviations = np.zeros_like(means)
        exact = all(limit.exact for individual in individuals for limit in individual.limits)
        if len(individuals) < 3 or exact:
            return cls(means, deviations)
        stand_ins = [Individual(individual, len(constraints)) for individual in individuals]
        for stand_in, individual in zip(stand_ins, individuals, strict=True):
            stand_in.know(individual.limits)
        values, noise = costs_and_noise(stand_ins)
        features = genome.features(np.array([list(individual) for individual in individuals]))
        chosen = representative(values, MOST_LEARNED, exact=False)
        for k in range(len(constraints)):
            model = GaussianProcess(features[chosen], values[chosen, k], noise[chosen, k], iterations=60)
            if model.nugget > _UNSEEN or np.any(noise[:, k]):
                means[:, k], deviations[:, k] = model.predict(features)
        return cls(means, deviations)

    def violations(
        self, constraints: Sequence[InequalityConstraint], shift: Number = 0.0, margin: Number = 0.0
    ) -> NDArray[np.float64]:
        """Return the total violation of each design, (individuals,), if every constraint may deviate by
        ``margin`` from its posterior mean plus ``shift``; both may be arrays (constraints,)."""
        low, high = (self.means + shift + sign * margin for sign in (-1.0, 1.0))
        total = np.zeros(len(self.means))
        for k, constraint in enumerate(constraints):
            total += [
                max(constraint.violation(one), constraint.violation(other))
                for one, other in zip(low[:, k], high[:, k], strict=True)
            ]
        return total


def by_feasibility(
    genome: Genome, individuals: Sequence[Individual], constraints: Sequence[InequalityConstraint]
) -> tuple[list[Individual], list[Individual], list[Individual]]:
    """Return the designs that satisfy the constraints by their own means and with a margin by the posterior;
    those that only just satisfy them by the posterior mean; and all others.

    The first are in the given order, the others are sorted by their violation.
    """
    own = np.array([individual.violation for individual in individuals])
    margined = plain = own
    if constraints:
        limits = PosteriorLimits.of(genome, individuals, constraints)
        margined = limits.violations(constraints, margin=_MARGIN * limits.deviations)
        plain = limits.violations(constraints)
    sure = (own == 0) & (margined == 0)
    by_violation = np.lexsort([own, margined])
    return (
        [individual for individual, one in zip(individuals, sure, strict=True) if one],
        [individuals[i] for i in by_violation if plain[i] == 0 and not sure[i]],
        [individuals[i] for i in by_violation if plain[i] > 0],
    )


def best(
    genome: Genome,
    individuals: Sequence[Individual],
    count: int,
    constraints: Sequence[InequalityConstraint] = (),
) -> list[Individual]:
    """Return the best designs by posterior mean, best first.

    For several objectives it is the front, sorted by the first objective. If it has more than ``count``
    designs, the ends and the designs farthest from others are kept.

    constraints : of the result. Designs that satisfy them by the posterior mean are returned, those closest
        to a bound last; without such a design, the ones with the least violation, or the one for several
        objectives.
    """
    ran = [individual for individual in individuals if not individual.failed]
    if not ran:
        return []
    good, near, others = by_feasibility(genome, ran, constraints)
    several = len(ran[0].fitness.values) > 1
    if not good:
        return (near or others)[: 1 if several else count]
    # The costs of designs that violate a constraint are penalised.
    unpenalised = [individual for individual in ran if not individual.violation]
    kept = set(map(id, good))
    rows = [i for i, individual in enumerate(unpenalised) if id(individual) in kept]
    means = posterior_means(genome, unpenalised)[rows]
    if not several:
        in_order = [good[i] for i in np.argsort(means[:, 0], kind="stable")]
        return [*in_order, *near][:count]
    front = np.flatnonzero(beaten_by(means) == 0)
    front = front[np.lexsort(means[front].T[::-1])]
    return [good[i] for i in front[spread(means[front], count)]]


def spread(costs: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Return the indices of designs that are spread over a front, ascending.

    The best of each objective is taken first, then repeatedly the design farthest from those taken. The
    ranges of the front are scaled to 1.
    """
    if len(costs) <= count:
        return np.arange(len(costs))
    span = np.ptp(costs, axis=0)
    scaled = (costs - costs.min(axis=0)) / np.where(span > 0, span, 1.0)
    taken = list(dict.fromkeys(np.argmin(scaled, axis=0).tolist()))[:count]
    while len(taken) < count:
        distance = np.linalg.norm(scaled[:, None] - scaled[taken][None], axis=2).min(axis=1)
        taken.append(int(np.argmax(distance)))
    return np.sort(taken)
