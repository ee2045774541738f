"""How often the intervals that a search reports hold the truth, by plain functions of which it is known.

Each kind of noise is a function of two genes: a bowl and noise of that kind, whose mean is known everywhere.
Searches with seeds 0, 1, ... report designs with 95 % intervals from fresh starts, and each is asked whether
it has the true mean of its design.

    PYTHONPATH=. python tests/optimize/coverage_of_searches.py [SEARCHES [KIND ...]]
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tisim import optimize
from tisim.optimize import Gene, Problem

GENES = (Gene("x", "", 0.0, 1.0), Gene("y", "", 0.0, 1.0))


@dataclass(frozen=True)
class Noise:
    """value : of a run, by the cost of its design without noise (0 at best, about 1 at worst) and a
    generator. mean : of such runs, by that cost."""

    value: Callable[[float, np.random.Generator], float]
    mean: Callable[[float], float]


def added(draw, mean):
    """Noise that is added to the bowl, the same at all designs: draws, and their mean."""
    return Noise(lambda cost, rng: cost + draw(rng), lambda cost: cost + mean)


def share(least):
    """The probability that an outcome is 1, by the cost: the given one at the best design."""
    return lambda cost: min(least + 0.5 * cost, 1.0)


def bernoulli(least):
    return Noise(lambda cost, rng: float(rng.random() < share(least)(cost)), share(least))


def captured(least):
    """The part of 20 that are captured."""
    return Noise(lambda cost, rng: rng.binomial(20, share(least)(cost)) / 20, share(least))


KINDS = {
    "normal": added(lambda rng: 0.2 * rng.normal(), 0.0),
    "exponential": added(lambda rng: 0.2 * rng.exponential(), 0.2),
    "lognormal": added(lambda rng: 0.1 * math.exp(rng.normal()), 0.1 * math.exp(0.5)),
    "lognormal, a factor": Noise(
        lambda cost, rng: (0.2 + cost) * math.exp(rng.normal()), lambda cost: (0.2 + cost) * math.exp(0.5)
    ),
    "one of 20 runs is off by 20 deviations": added(
        lambda rng: 0.1 * rng.normal() + 2.0 * (rng.random() < 0.05), 0.1
    ),
    "one of 20 runs is off, else equal": added(lambda rng: float(rng.random() < 0.05), 0.05),
    "one of 20 runs is lucky, else equal": added(lambda rng: -float(rng.random() < 0.05), -0.05),
    "0 or 1, 0.05": bernoulli(0.05),
    "0 or 1, 0.3": bernoulli(0.3),
    "0 or 1, 0.95": bernoulli(0.95),
    "captured of 20, 0.02": captured(0.02),
    "captured of 20, 0.3": captured(0.3),
    "all runs equal": Noise(lambda cost, rng: cost, lambda cost: cost),
}
OWN, BUDGET = {"common_starts": False}, {"max_evaluations": 200, "options": {"population": 100}}
WAYS = {
    "200 runs": {"ensemble": OWN, **BUDGET},
    "200 runs, common starts": BUDGET,
    "six designs": {"ensemble": OWN},
    "four fresh starts": {"ensemble": {**OWN, "confirm": 4}},
}
WAYS_TO_FRONTS = {
    "a front, 16 fresh starts": {"ensemble": OWN},
    "a front, 200 runs": {"ensemble": OWN, **BUDGET},
}


def bowl(x, y):
    return (x - 0.3) ** 2 + (y - 0.6) ** 2


def costs(x, y):
    """Of two objectives: their best designs are 0.6 apart."""
    return bowl(x, y), bowl(x - 0.6, y)


def problem(kind, several=False):
    """A problem of one objective or two with noise of that kind."""
    noise = KINDS[kind]

    def function(design, seed):
        rng = np.random.default_rng(seed)
        if several:
            return tuple(noise.value(cost, rng) for cost in costs(**design))
        return noise.value(bowl(**design), rng)

    objectives = ("one", "other") if several else ("cost",)
    return Problem.of_function(function, GENES, objectives, "noisy", code=f"{kind} {several}")


def truths(kind, design, several=False):
    """The true mean of each objective of a design."""
    mean = KINDS[kind].mean
    return tuple(map(mean, costs(**design))) if several else (mean(bowl(**design)),)


def searched(kind, seed, several=False, **settings):
    """The outcome of a search."""
    usual = {"method": "random", "generations": 0, "options": {"population": 60}}
    return optimize.run(problem(kind, several), seed=seed, **{**usual, **settings})


def held(kind, outcome, several=False):
    """For each reported design and objective whether its interval has the truth, (designs, objectives); NaN
    where none is given, as all runs of the search are equal."""
    found = []
    for design in outcome.designs:
        true = truths(kind, design.genes, several)
        ends = [design.intervals[name] for name in design.values]
        found.append(
            [math.nan if math.isnan(low) else low - 1e-12 <= t <= high + 1e-12
             for (low, high), t in zip(ends, true, strict=True)]
        )  # fmt: skip
    return np.array(found, dtype=float)


def coverage(kind, searches, several=False, **settings):
    """(part of the reported best that hold, part of all, its standard error, median width): designs of one
    search are not independent, so that the error is that of the means of searches. The best of a front is
    the compromise."""
    first, everything, widths = [], [], []
    for seed in range(searches):
        outcome = searched(kind, seed, several, **settings)
        holds = held(kind, outcome, several)
        best = next(k for k, string in enumerate(outcome.hall) if string is outcome.best)
        if not np.any(np.isnan(holds)):
            first.append(holds[best].mean())
            everything.append(holds.mean())
        widths += [np.ptp(ends) for design in outcome.designs for ends in design.intervals.values()]
    error = np.std(everything, ddof=1) / math.sqrt(len(everything))
    return np.mean(first), np.mean(everything), error, np.nanmedian(widths)


def stopped_at_target(kind, searches, above, **settings):
    """(part of searches that stop at a target, part of these whose design does not meet it); the target is so
    much above what the best design has."""
    goal = KINDS[kind].mean(0.0) + above
    usual = {"generations": 12, "options": {"population": 20}, "target": goal, "ensemble": OWN}
    stopped, wrong = 0, 0
    for seed in range(searches):
        outcome = searched(kind, seed, **{**usual, **settings})
        if outcome.stopped == "target":
            stopped += 1
            wrong += truths(kind, outcome.designs[0].genes)[0] > goal
    return stopped / searches, wrong / max(stopped, 1)


def dominated(outcome):
    """The number of listed designs that another one dominates by the values that are listed."""
    values = np.array([list(design.values.values()) for design in outcome.designs])
    no_better = np.all(values[:, None] >= values[None], axis=2)
    return int(np.sum(no_better & np.any(values[:, None] > values[None], axis=2)))


def truly_dominated(kind, outcome):
    """The part of the listed designs that another one dominates by the true means."""
    true = np.array([truths(kind, design.genes, True) for design in outcome.designs])
    return np.mean(np.any(np.all(true[:, None] > true[None], axis=2), axis=1))


def table(searches, kinds):
    """Print a line for each kind of noise and way to search."""
    for kind in kinds:
        for way, settings in WAYS.items():
            report(kind, way, coverage(kind, searches, **settings))
        for way, settings in WAYS_TO_FRONTS.items():
            report(kind, way, coverage(kind, searches, several=True, **settings))

        for above in (-1e-9, 0.1):
            stopped, wrong = stopped_at_target(kind, searches, above)
            print(
                f"{kind:40s} target {above:+.1f}: {stopped:.3f} stop, {wrong:.3f} of these in error",
                flush=True,
            )


def report(kind, way, found):
    first, everything, error, width = found
    print(
        f"{kind:40s} {way:26s} best {first:.3f}, all {everything:.3f} +- {1.96 * error:.3f}, "
        f"width {width:.3g}",
        flush=True,
    )


if __name__ == "__main__":
    number, *wanted = sys.argv[1:] or ["200"]
    table(int(number), wanted or list(KINDS))
