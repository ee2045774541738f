"""Searches with and without races, at equal numbers of runs: the true cost of the best design.

    python tests/benchmarks/races.py [--searches 20] [--runs 400] [--methods genetic,cma-es] [--races 0,12,24]

The noisy bowl and the noisy Hartmann function have noise of deviation 0.3 in each start, which differs
between designs. Random designs of the bowl differ by about as much; the deepest well of Hartmann's function
is 3.3 deep. The third function has ten genes and the noise of agglomeration: costs of 0.15 to 0.5, with a
deviation of 0.11 between the starts of a design. A round of a race adds two starts to each of six designs at
first, so races of fewer than 12 starts have no effect.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping

import numpy as np

from tests.benchmarks.search_problems import bowl, genes, hartmann, variables
from tests.optimize.fake_runs import FakeCache
from tisim.optimize import Genome, Problem
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings

Design = Mapping[str, float]


def like_agglomeration(design: Design) -> float:
    """Least, 0, at 0.3 in five genes; the other five have no effect."""
    x = variables(design)[:5]
    return float(0.35 * (1.0 - np.exp(-2.0 * np.sum((x - 0.3) ** 2))))


TRUTHS: dict[str, tuple[Callable[[Design], float], Genome, float, float]] = {
    "noisy bowl": (bowl, genes(5), 0.3, 0.0),
    "noisy Hartmann": (hartmann, genes(6), 0.3, -3.32237),
    "like agglomeration": (like_agglomeration, genes(10), 0.11, 0.0),
}
"""True cost, genes, standard deviation of the noise, and least cost."""


def regret(name: str, method: str, race: int, seed: int, runs: int) -> float:
    """The true cost of the best design of a search above the least cost."""
    truth, genome, deviation, least = TRUTHS[name]

    def run(design: Design, seed: int) -> float:
        at = (variables(design) * 2**32).astype(np.int64).tolist()
        return truth(design) + deviation * float(np.random.default_rng([seed, *at]).normal())

    problem = Problem.of_function(run, genome, name="noisy", code=name)
    settings = Settings(
        method=method, seed=seed, generations=10**4, max_evaluations=runs, ensemble={"race": race}
    )
    best = search(problem, FunctionEvaluator(), FakeCache(), settings).designs[0]
    return truth(best.genes) - least


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--searches", type=int, default=20)
    options.add_argument("--runs", type=int, default=400)
    options.add_argument("--methods", default="genetic,cma-es")
    options.add_argument("--races", default="0,12,24")
    options.add_argument("--functions", default=",".join(TRUTHS))
    given = options.parse_args()
    for name in given.functions.split(","):
        for method in given.methods.split(","):
            for race in map(int, given.races.split(",")):
                found = [regret(name, method, race, seed, given.runs) for seed in range(given.searches)]
                half = 2.09 * np.std(found, ddof=1) / np.sqrt(len(found))
                print(
                    f"{name}, {method}, {given.runs} runs, race {race}: median {np.median(found):.3f}, "
                    f"mean {np.mean(found):.3f} +- {half:.3f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
