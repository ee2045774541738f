"""Which of the designs that were run are the best, where a mean of few starts is good by luck, too.

The best of many noisy means is flattered. A Gaussian process through all of them draws each towards its
neighbours, the more so the fewer starts it has: that is ranked.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import Belief, all_exact
from tisim.optimize.surrogate.selection import beaten_by

_UNSEEN = 1e-4
"""A nugget below this part of the variance of all costs is taken for no noise, where noise is not known."""


def posterior_means(genome: Genome, strings: Sequence[Individual]) -> NDArray[np.float64]:
    """Return the posterior mean of each cost of designs, (strings, objectives), in units that may be others
    than those of the costs, in the same order; the costs where there is no noise, or the process sees none.
    None of the strings has failed."""
    costs = np.array([string.fitness.values for string in strings])
    if len(strings) < 3 or all_exact(strings):
        return costs
    belief = Belief(genome.features)
    belief.learn(strings, iterations=60)
    seen = any(model.nugget > _UNSEEN or np.any(model.noise) for model in belief.models)
    return belief.predict(belief.points)[0] if seen else costs


def best(genome: Genome, strings: Sequence[Individual], count: int) -> list[Individual]:
    """Return the best designs by posterior mean, best first; of several objectives the front, along the
    first, of which ``count`` are kept where it is larger: the ends, and those farthest from others."""
    ran = [string for string in strings if not string.failed]
    good = [string for string in ran if not string.violation] or ran
    if not good:
        return []
    means = posterior_means(genome, good)
    if means.shape[1] == 1:
        return [good[i] for i in np.argsort(means[:, 0], kind="stable")[:count]]
    front = np.flatnonzero(beaten_by(means) == 0)
    front = front[np.lexsort(means[front].T[::-1])]
    return [good[i] for i in front[spread(means[front], count)]]


def spread(costs: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Return the indices of designs that are spread over a front, ascending: the best of each objective, then
    again and again the one that is farthest from those taken, the ranges of the front being 1."""
    if len(costs) <= count:
        return np.arange(len(costs))
    span = np.ptp(costs, axis=0)
    scaled = (costs - costs.min(axis=0)) / np.where(span > 0, span, 1.0)
    taken = list(dict.fromkeys(np.argmin(scaled, axis=0).tolist()))[:count]
    while len(taken) < count:
        distance = np.linalg.norm(scaled[:, None] - scaled[taken][None], axis=2).min(axis=1)
        taken.append(int(np.argmax(distance)))
    return np.sort(taken)
