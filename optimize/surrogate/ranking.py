"""Ranking of the designs that were run, when the means of few starts are noisy.

The best of many noisy means is biased by luck. A Gaussian process through all means draws each towards its
neighbours, more strongly if it has fewer starts; the ranking uses these posterior means. The same applies to
the constraints of the result: a design that violates one may have satisfied it by luck.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.constraint import InequalityConstraint
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import GaussianProcess
from tisim.optimize.surrogate.noise import all_exact, costs_and_noise
from tisim.optimize.surrogate.selection import MOST_LEARNED, beaten_by, representative

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


def posterior_violations(
    genome: Genome, individuals: Sequence[Individual], constraints: Sequence[InequalityConstraint]
) -> NDArray[np.float64]:
    """Return two total violations of each design, (individuals, 2), by the posterior of its constraints.

    The first is computed from the posterior means, with ``_MARGIN`` added on the side of the violation; the
    second from the posterior means alone. Both are the violation by the design's own means if there is no
    noise, or too few designs. None of the individuals may have failed.
    """
    own = np.array([individual.violation for individual in individuals])
    exact = all(limit.exact for individual in individuals for limit in individual.limits)
    if not constraints or len(individuals) < 3 or exact:
        return np.column_stack([own, own])
    stand_ins = [Individual(individual, len(constraints)) for individual in individuals]
    for stand_in, individual in zip(stand_ins, individuals, strict=True):
        stand_in.know(individual.limits)
    means, noise = costs_and_noise(stand_ins)
    features = genome.features(np.array([list(individual) for individual in individuals]))
    chosen = representative(means, MOST_LEARNED, exact=False)
    total = np.zeros((len(individuals), 2))
    for k, constraint in enumerate(constraints):
        values, margins = means[:, k], np.zeros(len(individuals))
        model = GaussianProcess(features[chosen], values[chosen], noise[chosen, k], iterations=60)
        if model.nugget > _UNSEEN or np.any(noise[:, k]):
            values, deviations = model.predict(features)
            margins = _MARGIN * deviations
        for i, (value, margin) in enumerate(zip(values, margins, strict=True)):
            ends = (constraint.violation(value - margin), constraint.violation(value + margin))
            total[i] += max(ends), constraint.violation(value)
    return total


def by_feasibility(
    genome: Genome, individuals: Sequence[Individual], constraints: Sequence[InequalityConstraint]
) -> tuple[list[Individual], list[Individual], list[Individual]]:
    """Return the designs that satisfy the constraints by their own means and with a margin by the posterior;
    those that only just satisfy them by the posterior mean; and all others.

    The first are in the given order, the others are sorted by their violation.
    """
    margined, plain = posterior_violations(genome, individuals, constraints).T
    own = np.array([individual.violation for individual in individuals])
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
    *,
    allowed: bool = False,
) -> list[Individual]:
    """Return the best designs by posterior mean, best first.

    For several objectives it is the front, sorted by the first objective. If it has more than ``count``
    designs, the ends and the designs farthest from others are kept.

    constraints : of the result. Designs that satisfy them by the posterior mean are returned, those closest
        to a bound last; without such a design, the ones with the least violation, or the one for several
        objectives.
    allowed : leave out designs that do not satisfy the constraints, even if there are no others.
    """
    ran = [individual for individual in individuals if not individual.failed]
    if not ran:
        return []
    good, near, others = by_feasibility(genome, ran, constraints)
    others = [] if allowed else others
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
