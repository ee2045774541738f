"""Search methods of tisim and of other libraries, each with the same number of runs.

    python tests/benchmarks/search.py --tasks rosenbrock,zdt1 --budget 400 --seeds 10
    python tests/benchmarks/search.py --tasks agglomeration --methods genetic,pycma,sklearn-gp --budget 1600

The peers are installed by ``python -m pip install ".[bench]"``. Each finished search is a line of JSON in
``--out``; the same command continues with the missing searches, and ``--table`` prints the finished ones.

A peer runs each design from ``Task.starts`` random starts (seeds), the same for all designs. A method of
tisim has its default settings; the runs in which it chooses and reports its best design count towards the
budget. The returned design is judged by its exact cost, or by its mean cost over held-out starts. For one
cost, the table prints its distance from the minimum (less is better). For several costs, it prints the
hypervolume of the returned designs over the largest possible one, or over an upper bound of it (more is
better). Then come the mean over the seeds with the half width of its 95 % interval, and the seconds of a
search, without its runs.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from search_peers import ONE, SEVERAL, Spent
from search_problems import TASKS, Task

import tisim
from tisim import optimize
from tisim.analysis import Mean
from tisim.optimize import Problem
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.evaluation.runs import Evaluator, start_seed
from tisim.optimize.methods.base import every
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.surrogate.selection import beaten_by

FRESH = 10**6
"""The seed of the held-out starts by which all designs are judged."""
MOST_ASKED = 50
"""The number of designs that a peer may ask for, for each run of the budget. Designs that cannot be simulated
do not use up the budget."""
RUNNING = {"s": 0.0}
"""Seconds taken by runs since it was set to 0."""


def clocked(kind: type) -> None:
    """Let an evaluator add its seconds to RUNNING."""
    evaluate = kind.evaluate

    def timed(self: Any, scenes: Sequence[Any], progress: Any = None) -> Iterator[Any]:
        results = iter(evaluate(self, scenes, progress))
        while True:
            begun = time.perf_counter()
            result = next(results, None)
            RUNNING["s"] += time.perf_counter() - begun
            if result is None:
                return
            yield result

    kind.evaluate = timed


def costs_of(problem: Problem, evaluator: Evaluator, points: np.ndarray, seeds: Sequence[int]) -> np.ndarray:
    """Return the costs of points from starts, (points, starts, costs); inf if a design cannot be
    simulated."""
    costs = np.full((len(points), len(seeds), len(problem.objectives)), np.inf)
    places, scenes = [], []
    for i, point in enumerate(points):
        try:
            scenes += [problem.scene(problem.genome.decode(point), seed) for seed in seeds]
        except tisim.InputError:
            continue
        places += [(i, k) for k in range(len(seeds))]
    for index, result in evaluator.evaluate(scenes):
        if result.status.ok:
            costs[places[index]] = problem.costs([one.of(result) for one in problem.objectives])
    return costs


class Purse:
    """The function that peers call (search_peers.Evaluate): mean costs of points, until the budget
    is spent."""

    def __init__(self, problem: Problem, evaluator: Evaluator, starts: int, seed: int, budget: int) -> None:
        self.problem, self.evaluator = problem, evaluator
        self.seeds = [start_seed(seed, k) for k in range(starts)]
        self.left, self.may_ask = budget // starts, MOST_ASKED * budget
        self.points = np.empty((0, len(problem.genome)))
        self.values = np.empty((0, len(problem.objectives)))
        self.variances: list[float] = []

    @property
    def variance(self) -> float:
        return float(np.mean(self.variances)) / len(self.seeds) if self.variances else 0.0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        points = np.clip(np.atleast_2d(points), 0.0, 1.0)
        paid = points[: self.left]
        costs = costs_of(self.problem, self.evaluator, paid, self.seeds)
        means = costs.mean(axis=1)
        good = np.isfinite(means).all(axis=1)
        known = np.vstack([self.values, means[good]])
        means[~good] = known.max(axis=0) if len(known) else 1e3
        self.points, self.values = np.vstack([self.points, paid]), np.vstack([self.values, means])
        if len(self.seeds) > 1:
            self.variances += list(costs[good][:, :, 0].var(axis=1, ddof=1))
        self.left -= int(good.sum())
        self.may_ask -= len(points)
        if len(paid) < len(points) or self.left == 0 or self.may_ask < 0:
            raise Spent
        return means


def peer(name: str, task: Task, evaluator: Evaluator, seed: int, budget: int) -> tuple[np.ndarray, int]:
    """Search with a peer; return the points that it returns, one or a front, and the number it has tried."""
    problem = task.problem()
    purse = Purse(problem, evaluator, task.starts, seed, budget)
    costs = len(problem.objectives)
    chosen = None
    with contextlib.suppress(Spent):
        chosen = (SEVERAL if costs > 1 else ONE)[name](purse, len(problem.genome), costs, seed)
    best = beaten_by(purse.values) == 0 if costs > 1 else [int(np.argmin(purse.values[:, 0]))]
    return purse.points[best] if chosen is None else chosen[None], len(purse.points)


def ours(name: str, task: Task, evaluator: Evaluator, seed: int, budget: int) -> tuple[np.ndarray, int]:
    """Search with a method of tisim at its defaults; as ``peer``."""
    problem = task.problem()
    settings = {"seed": seed, "method": name, "max_evaluations": budget, "generations": budget}
    if problem.function:
        found = optimize.run(problem, **settings)
    else:  # as optimize.run does, with an evaluator that has already compiled the scene
        with tempfile.TemporaryDirectory() as folder, Cache(Path(folder) / "search.h5") as cache:
            found = search(problem, evaluator, cache, Settings(**settings))
    if found.interrupted:
        raise KeyboardInterrupt  # and no line is written, so that the search is repeated
    assert found.evaluations + found.hits <= budget
    several = found.problem.several
    points = np.array([list(individual) for individual in (found.hall if several else found.hall[:1])])
    return points, len(found.estimates)


def worth(task: Task, evaluator: Evaluator, points: np.ndarray) -> float:
    """Return the quality of a search: the cost above the minimum, or the hypervolume over its scale."""
    problem = task.problem()
    if task.truth is not None:
        return task.truth(problem.genome.decode(points[0])) - task.least
    seeds = [start_seed(FRESH, k) for k in range(task.fresh)]
    means = costs_of(problem, evaluator, points, seeds).mean(axis=1)
    if not problem.several:
        return float(means[0, 0]) - task.least
    from pymoo.indicators.hv import HV

    return float(HV(ref_point=np.array(task.reference))(means)) / task.scale


def searched(name: str, evaluator: Evaluator, seed: int, budget: int, method: str) -> dict[str, Any]:
    """Make one search, and judge it."""
    task = TASKS[name]
    RUNNING["s"], begun = 0.0, time.perf_counter()
    if method in every():
        points, designs = ours(method, task, evaluator, seed, budget)
    else:
        points, designs = peer(method, task, evaluator, seed, budget)
    seconds = time.perf_counter() - begun - RUNNING["s"]
    value = worth(task, evaluator, points)
    return {"task": name, "budget": budget, "method": method, "seed": seed, "value": value,
            "designs": designs, "returned": len(points), "seconds": seconds}  # fmt: skip


def show(rows: Sequence[dict[str, Any]]) -> None:
    """Print the results of each task and budget, the best method first."""
    groups: dict[tuple[str, int], dict[str, list[dict[str, Any]]]] = {}
    for row in rows:
        groups.setdefault((row["task"], row["budget"]), {}).setdefault(row["method"], []).append(row)
    print("| problem | runs | method | searches | median | mean | 95 % ± | designs | seconds |")
    print("|---" * 9 + "|")
    for (task, budget), methods in groups.items():
        sign = -1 if TASKS[task].reference else 1
        order = sorted(methods, key=lambda name: sign * np.mean([row["value"] for row in methods[name]]))
        for method in order:
            values = np.array([row["value"] for row in methods[method]])
            tried, seconds = (
                np.mean([row[key] for row in methods[method]]) for key in ("designs", "seconds")
            )
            mean = Mean.of(values) if len(values) > 1 else None
            average = f"{mean.value:.3g} | {mean.half:.2g}" if mean else f"{values[0]:.3g} | "
            print(f"| {task} | {budget} | {method} | {len(values)} | {np.median(values):.3g} | {average} "
                  f"| {tried:.0f} | {seconds:.1f} |")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--tasks", default=",".join(TASKS), help=f"of {', '.join(TASKS)}")
    parser.add_argument("--methods", default="", help="of tisim and peers; left out: genetic and all peers")
    parser.add_argument("--budget", type=int, default=400, help="runs of a search")
    parser.add_argument("--seeds", type=int, default=10, help="searches of each method")
    parser.add_argument("--out", type=Path, default=Path("out/search.jsonl"))
    parser.add_argument("--table", action="store_true", help="search nothing, print what there is")
    options = parser.parse_args()
    rows = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    if options.table:
        return show(rows)
    tisim.init("cpu", "f64", threads=1)
    for kind in (FunctionEvaluator, BatchEvaluator):
        clocked(kind)
    done = {(row["task"], row["budget"], row["method"], row["seed"]) for row in rows}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("a") as file:
        for task in options.tasks.split(","):
            peers = SEVERAL if TASKS[task].reference else ONE
            evaluator = FunctionEvaluator() if TASKS[task].problem().function else BatchEvaluator()
            for seed in range(options.seeds):
                for method in options.methods.split(",") if options.methods else ("genetic", *peers):
                    if (task, options.budget, method, seed) not in done:
                        rows.append(searched(task, evaluator, seed, options.budget, method))
                        file.write(json.dumps(rows[-1]) + "\n")
                        file.flush()
            evaluator.close()
    show(rows)


if __name__ == "__main__":
    main()
