"""Whether a search of agglomeration should begin with fewer grains.

    python tests/benchmarks/cheaper_scene.py [--searches 5] [--cheap 200] [--runs 100 200 400]

Searches of 250 grains with different numbers of runs start from nothing, or from the best six designs of a
search of 60 grains, whose seconds are also counted. The returned designs are run again from 64 held-out
random starts (seeds). A line has the mean of Pi of 250 grains over the searches, its 95 % interval, and the
mean seconds of a search.
"""

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim import optimize
from tisim.analysis import Mean
from tisim.cases.agglomeration.problem import problem
from tisim.optimize.evaluation.runs import start_seed

FRESH = 10**6
"""The seed of the held-out starts."""


def searched(size: str, runs: int, seed: int, begin: list[dict[str, float]]) -> list[dict[str, float]]:
    """Return the best designs of a search, best first."""
    with tempfile.TemporaryDirectory() as folder:
        found = optimize.run(
            problem(size), out=Path(folder) / "s", seed=seed, max_evaluations=runs, generations=runs,
            starting_designs=begin or None,
        )  # fmt: skip
    return [dict(found.problem.genome.decode(individual)) for individual in found.hall]


def true_pi(design: dict[str, float]) -> float:
    whole = problem("default")
    results = tisim.run([whole.scene(design, start_seed(FRESH, k)) for k in range(64)])
    return float(
        np.mean([whole.costs([one.of(result) for one in whole.objectives])[0] for result in results])
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--searches", type=int, default=5)
    parser.add_argument("--cheap", type=int, default=200, help="runs of a search of 60 grains")
    parser.add_argument("--runs", type=int, nargs="+", default=[100, 200, 400], help="of 250 grains")
    options = parser.parse_args()
    tisim.init()
    searched("small", 20, 0, [])  # compiles
    searched("default", 20, 0, [])
    found, seconds = defaultdict(list), defaultdict(list)
    for seed in range(options.searches):
        begun = time.perf_counter()
        cheap = searched("small", options.cheap, seed, [])
        spent = time.perf_counter() - begun
        for runs in options.runs:
            for first, before in (([], 0.0), (cheap, spent)):
                begun = time.perf_counter()
                best = searched("default", runs, seed, first)[0]
                seconds[runs, bool(first)].append(before + time.perf_counter() - begun)
                found[runs, bool(first)].append(true_pi(best))
    print("runs of 250 grains | begun with 60 | Pi | 95 % +- | seconds")
    for (runs, cheaper), values in sorted(found.items()):
        mean = Mean.of(np.array(values))
        print(f"{runs} | {'yes' if cheaper else 'no'} | {mean.value:.3f} | {mean.half:.3f} "
              f"| {np.mean(seconds[runs, cheaper]):.1f}")  # fmt: skip


if __name__ == "__main__":
    main()
