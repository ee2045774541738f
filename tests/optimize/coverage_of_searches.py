"""Coverage of the intervals that searches report, for functions with known means.

Each kind of noise is a function of two genes: a bowl with noise of that kind, whose mean is known everywhere.
Searches with seeds 0, 1, ... report designs with 95 % intervals from held-out seeds. The experiment counts
the intervals that contain the true mean of their design.

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
    """value : result of a run, from the noiseless cost of its design (0 at best, about 1 at worst) and a
    random generator. mean : expected value of such runs, from that cost.
    """

    value: Callable[[float, np.random.Generator], float]
    mean: Callable[[float], float]


def added(draw, mean):
    """Noise added to the bowl, the same at all designs: a function that draws it, and its mean."""
    return Noise(lambda cost, rng: cost + draw(rng), lambda cost: cost + mean)


def share(least):
    """Probability of the outcome 1 as a function of the cost; it is ``least`` at the best design."""
    return lambda cost: min(least + 0.5 * cost, 1.0)


def bernoulli(least):
    return Noise(lambda cost, rng: float(rng.random() < share(least)(cost)), share(least))


def captured(least):
    """The captured fraction of 20 particles."""
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
    """Costs of two objectives, whose best designs are 0.6 apart."""
    return bowl(x, y), bowl(x - 0.6, y)


def problem(kind, several=False):
    """A problem of one or two objectives with noise of this kind."""
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
    """Whether the interval contains the truth, for each reported design and objective: (designs, objectives).

    The value is NaN if no interval is given because all runs of the search are equal.
    """
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
    """(coverage for the best design, for all designs, standard error of the latter, median width).

    Designs of one search are not independent, so the error is computed from the means of searches. The best
    design of a front is the compromise.
    """
    first, everything, widths = [], [], []
    for seed in range(searches):
        outcome = searched(kind, seed, several, **settings)
        holds = held(kind, outcome, several)
        best = next(k for k, individual in enumerate(outcome.hall) if individual is outcome.best)
        if not np.any(np.isnan(holds)):
            first.append(holds[best].mean())
            everything.append(holds.mean())
        widths += [np.ptp(ends) for design in outcome.designs for ends in design.intervals.values()]
    error = np.std(everything, ddof=1) / math.sqrt(len(everything))
    return np.mean(first), np.mean(everything), error, np.nanmedian(widths)


def stopped_at_target(kind, searches, above, **settings):
    """(fraction of searches that stop at a target, fraction of those whose design does not meet it).

    above : difference between the target and the mean of the best design.
    """
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
    """The number of listed designs that are dominated by another, by their listed values."""
    values = np.array([list(design.values.values()) for design in outcome.designs])
    no_better = np.all(values[:, None] >= values[None], axis=2)
    return int(np.sum(no_better & np.any(values[:, None] > values[None], axis=2)))


def truly_dominated(kind, outcome):
    """The fraction of listed designs that are dominated by another, by their true means."""
    true = np.array([truths(kind, design.genes, True) for design in outcome.designs])
    return np.mean(np.any(np.all(true[:, None] > true[None], axis=2), axis=1))


def share_dominated(kind, searches, runs):
    """Mean share of truly dominated designs in the fronts of searches, and its standard error."""
    settings = {"ensemble": OWN, "generations": 1000, "options": {"population": 100}, "max_evaluations": runs}
    found = [truly_dominated(kind, searched(kind, seed, True, **settings)) for seed in range(searches)]
    return np.mean(found), np.std(found, ddof=1) / math.sqrt(searches)


def table(searches, kinds):
    """Print a line for each kind of noise and each way to search."""
    for kind in kinds:
        for way, settings in WAYS.items():
            report(kind, way, coverage(kind, searches, **settings))
        for way, settings in WAYS_TO_FRONTS.items():
            report(kind, way, coverage(kind, searches, several=True, **settings))
        for runs in (200, 400):
            part, error = share_dominated(kind, searches, runs)
            way = f"a front, {runs} runs"
            print(f"{kind:40s} {way:26s} truly dominated {part:.3f} +- {1.96 * error:.3f}", flush=True)
        for above in (-1e-9, 0.1, 0.2):
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
