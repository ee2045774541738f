"""Searches whose optimum lies at the edge of designs that fail: the distance of the best from the least cost.

    python tests/benchmarks/refused_designs.py [--searches 20] [--runs 50,100] [--methods NAME,...]

A failed design costs a run, as a simulation that diverges does. A third of the range or more fails.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping

import numpy as np

from tests.optimize.fake_runs import FakeCache
from tisim.optimize import Gene, Problem
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings

Design = Mapping[str, float]
GENES = tuple(Gene(f"x{k}", "", 0.0, 1.0) for k in range(3))


def corner(design: Design) -> float:
    """The cost falls towards the corner of two half spaces in which all designs fail; least, 0, in it."""
    x = np.array([*design.values()])
    first, second = x[0] + x[1] - 0.9, x[1] - x[0] - 0.1
    return float(first + second + 2.0 * abs(x[2] - 0.5)) if min(first, second) >= 0.0 else math.nan


def steep(design: Design) -> float:
    """The cost falls with a vertical slope to the edge of a half space of failing designs; least, 0."""
    x = np.array([*design.values()])
    height = x[0] - 0.35 - 0.3 * x[1]
    rest = (x[1] - 0.6) ** 2 + (x[2] - 0.4) ** 2
    return float(3.0 * math.sqrt(height) + rest) if height >= 0.0 else math.nan


def ring(design: Design) -> float:
    """All designs fail outside of a part of a ring; least, 0, at the end of this part."""
    x = np.array([*design.values()])
    radius = math.hypot(x[0] - 0.5, x[1] - 0.5)
    valid = 0.2 <= radius <= 0.35 and x[0] >= 0.3
    return float(x[0] - 0.3 + (x[2] - 0.5) ** 2) if valid else math.nan


FUNCTIONS = {"corner": corner, "steep": steep, "ring": ring}


def regret(name: str, method: str, seed: int, runs: int) -> float:
    """The cost of the best design of a search."""
    problem = Problem.of_function(FUNCTIONS[name], GENES, name="refused", code=name)
    settings = Settings(method=method, seed=seed, generations=10**4, max_evaluations=runs)
    outcome = search(problem, FunctionEvaluator(), FakeCache(), settings)
    return outcome.designs[0].values["value"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--searches", type=int, default=20)
    options.add_argument("--runs", default="50,100")
    options.add_argument("--methods", default="genetic,gaussian-process")
    options.add_argument("--functions", default=",".join(FUNCTIONS))
    given = options.parse_args()
    for name in given.functions.split(","):
        for method in given.methods.split(","):
            for runs in map(int, given.runs.split(",")):
                found = [regret(name, method, seed, runs) for seed in range(given.searches)]
                print(
                    f"{name}, {method}, {runs} runs: median {np.median(found):.2g}, "
                    f"mean {np.mean(found):.2g}, worst {max(found):.2g}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
