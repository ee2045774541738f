"""Ranking of the designs that were run, when the means of few starts are noisy.

The best of many noisy means is biased by luck. A Gaussian process through all means draws each towards its
neighbours, more strongly if it has fewer starts; the ranking uses these posterior means.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.noise import all_exact
from tisim.optimize.surrogate.selection import beaten_by

_UNSEEN = 1e-4
"""If the noise is not known and the nugget is below this fraction of the variance of all costs, there is no
noise."""


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


def best(genome: Genome, individuals: Sequence[Individual], count: int) -> list[Individual]:
    """Return the best designs by posterior mean, best first.

    For several objectives it is the front, sorted by the first objective. If it has more than ``count``
    designs, the ends and the designs farthest from others are kept.
    """
    ran = [individual for individual in individuals if not individual.failed]
    good = [individual for individual in ran if not individual.violation] or ran
    if not good:
        return []
    means = posterior_means(genome, good)
    if means.shape[1] == 1:
        return [good[i] for i in np.argsort(means[:, 0], kind="stable")[:count]]
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
