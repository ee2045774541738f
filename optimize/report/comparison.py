"""Comparison of search methods on one problem with the same number of runs, and several searches for each."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from tisim import RunError
from tisim.console import plain_table
from tisim.errors import must
from tisim.files import output_folder
from tisim.optimize.evaluation.ensemble import Ensemble, EnsembleSettings
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.evaluation.runs import Evaluator
from tisim.optimize.outcome import Outcome, Progress
from tisim.optimize.problem.problem import Problem
from tisim.optimize.search import search
from tisim.optimize.search_folder import check_problem, resume_or_clear
from tisim.optimize.settings import Settings, fit, identity, proposed
from tisim.optimize.storage.cache import Cache

COMPARISON_FILE, CSV = "compare.h5", "compare.csv"
COMPARISON_FILES = (
    COMPARISON_FILE,
    f"{COMPARISON_FILE}.journal",
    f"{COMPARISON_FILE}.lock",
    CSV,
    output_folder.LOCK,
)
FRESH = 10**6
"""The seed of the starts from which the best designs are run again; no search uses it."""
NOTE = (
    "median, lowest, highest: best designs of the searches, from held-out (fresh) starts; claimed: median of "
    "the searches' own estimates; 95 % +-: median of half the interval from the fresh starts"
)


@dataclass(frozen=True)
class MethodResult:
    """The result of one search: the estimate of its best design from the search, and from held-out starts
    (costs)."""

    method: str
    repeat: int
    evaluations: int
    claimed: FitnessEstimate
    fresh: FitnessEstimate


@contextmanager
def claim(folder: Path, fresh: bool | None, overwrite: bool) -> Iterator[bool]:
    """Hold the folder of a comparison, and yield whether an existing one is resumed; otherwise it is
    deleted."""
    resume = resume_or_clear(folder, fresh, overwrite, "comparison", COMPARISON_FILE, (CSV,))
    output_folder.claim(folder, COMPARISON_FILES, overwrite)
    with output_folder.lock(folder, exclusive=False):
        yield resume


def check(folder: Path, cache: Cache, problem: Problem, evaluator: Mapping[str, Any]) -> None:
    """Raise InputError if the file in the folder is from a comparison on another problem.

    Methods, their settings, ranges of genes and numbers of runs may differ. evaluator : the settings of the
        evaluator.
    """
    check_problem(folder, "comparison", cache, identity(problem, Settings(), evaluator))


def settings_of(
    problem: Problem, base: Mapping[str, Any], method: str, evaluations: int, repeat: int
) -> Settings:
    """Return the settings of one search: the case's with another method, stopped only by the number of
    runs."""
    search_table = proposed(problem, base, method)
    for rule in ("target", "patience", "wall_clock_s"):
        search_table.pop(rule, None)
    ensemble = {**search_table.get("ensemble", {}), "select": 0, "confirm": 0}
    # Every generation requests at least one run, unless the method has no new design; then the search ends,
    # too.
    stop = {"generations": evaluations, "max_evaluations": evaluations}
    settings = Settings(**{**search_table, "ensemble": ensemble, "seed": repeat, **stop})
    fit(problem, settings)
    return settings


@dataclass(frozen=True)
class Plan:
    """The searches of a comparison: method, repeat and settings of each, in the order in which they run.

    fresh : number of held-out starts from which each best design is run again, the same for all and not used
        by any search. The estimates of the searches themselves are biased by selection, more so for a method
        that spends fewer starts on a design.
    """

    problem: Problem
    searches: tuple[tuple[str, int, Settings], ...]
    fresh: int


def plan(
    problem: Problem,
    base: Mapping[str, Any],
    methods: Sequence[str],
    evaluations: int,
    repeats: int,
    fresh: int,
) -> Plan:
    """Return the plan of a comparison; repeat k of every method has the same random starts.

    base : settings of a search, as of a case. evaluations : number of runs of each search. InputError for
        several objectives, unknown methods and invalid numbers.
    """
    must(not problem.several, "problem of a comparison", "one with one objective", problem.name)
    must(len(set(methods)) == len(methods) > 0, "methods", "one or more, all different", list(methods))
    must(evaluations >= 1, "evaluations", "at least 1", evaluations)
    must(1 <= repeats <= FRESH, "repeats", f"within 1..{FRESH}", repeats)
    must(fresh >= 2, "fresh starts", "at least 2", fresh)
    planned = tuple(
        (method, k, settings_of(problem, base, method, evaluations, k))
        for k in range(repeats)
        for method in methods
    )
    return Plan(problem, planned, fresh)


def compare(
    plan: Plan, evaluator: Evaluator, cache: Cache, on_progress: Callable[[Progress], None] | None = None
) -> Iterator[MethodResult]:
    """Yield the result of each search of a plan.

    Everything is cached, so a stopped comparison can be resumed. KeyboardInterrupt if a search was stopped.
    """
    once = EnsembleSettings(min_starts=plan.fresh, max_starts=plan.fresh, block=plan.fresh)
    fresh_ensemble = Ensemble(plan.problem, evaluator, cache, once, FRESH)
    for method, repeat, settings in plan.searches:
        outcome = search(plan.problem, evaluator, cache, settings, on_progress=on_progress)
        if outcome.interrupted:
            raise KeyboardInterrupt
        yield _result(method, repeat, outcome, fresh_ensemble)


def _result(method: str, repeat: int, outcome: Outcome, fresh_ensemble: Ensemble) -> MethodResult:
    if outcome.best is None:
        raise RunError(f"{method}, repeat {repeat}: no design has run to its end")
    (estimates,) = fresh_ensemble.estimate([outcome.problem.genome.decode(outcome.best)])
    assert estimates is not None  # this ensemble has no budget
    (claimed,) = outcome.best.estimates
    return MethodResult(method, repeat, outcome.evaluations + outcome.hits, claimed, estimates[0])


def table(problem: Problem, results: Sequence[MethodResult]) -> Table:
    """Return a table with a line for each method, the best median first.

    It shows the best designs from held-out starts, and the estimates of the searches themselves.
    """
    (objective,) = problem.objectives
    meaning = problem.meanings.get(objective.name, "")
    grid = plain_table("method", "searches", "runs each", "median", "lowest", "highest", "claimed", "95 % +-")
    grid.title, grid.title_justify = objective.label + (f": {meaning}" if meaning else ""), "left"
    grid.caption, grid.caption_justify = NOTE, "left"
    by_method = {f.method: [g for g in results if g.method == f.method] for f in results}
    for method, mine in sorted(
        by_method.items(), key=lambda item: np.median([f.fresh.mean for f in item[1]])
    ):
        values = [objective.sign * f.fresh.mean for f in mine]
        numbers = (
            np.median(values), min(values), max(values),
            np.median([objective.sign * f.claimed.mean for f in mine]),
            np.median([f.fresh.half_width for f in mine]),
        )  # fmt: skip
        runs = sorted({f.evaluations for f in mine})
        each = str(runs[0]) if len(runs) == 1 else f"{runs[0]}..{runs[-1]}"
        grid.add_row(method, str(len(mine)), each, *(f"{number:.4g}" for number in numbers))
    return grid


def as_csv(problem: Problem, results: Sequence[MethodResult]) -> bytes:
    """Return a CSV file with a line for each search and all digits."""
    (objective,) = problem.objectives
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(
        (
            "method",
            "repeat",
            "runs",
            f"{objective.label}, fresh starts",
            "95 % +-",
            "claimed",
            "std. error claimed",
        )
    )
    for f in results:
        means = objective.sign * f.fresh.mean, f.fresh.half_width, objective.sign * f.claimed.mean
        writer.writerow((f.method, f.repeat, f.evaluations, *means, f.claimed.standard_error))
    return text.getvalue().encode()
