"""Comparison of search methods on one problem with the same number of runs, and several searches for each."""

from __future__ import annotations

import csv
import io
import math
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
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.evaluation.runs import Evaluator
from tisim.optimize.outcome import Outcome, Progress
from tisim.optimize.problem.feasibility import ANSWERS, excess, feasible, penalised
from tisim.optimize.problem.problem import Problem
from tisim.optimize.report import front_comparison
from tisim.optimize.report.front_comparison import FrontResult, front_result
from tisim.optimize.search import search
from tisim.optimize.search_folder import check_problem, resume_or_clear
from tisim.optimize.settings import Settings, fit, identity, proposed
from tisim.optimize.storage.cache import Cache
from tisim.optimize.tables import FEASIBLE, FRESH_STARTS, HIGH, LOW

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
NOTE_ON_CONSTRAINTS = (
    "feasible: number of these designs whose intervals of all constraints, from the fresh starts, lie within "
    "the bounds; unproven: an interval contains a bound; violated: a mean violates a bound. Designs that "
    "violate one rank behind all others: in the median they count as worst (- if it is one of them), and "
    "lowest, highest, claimed and 95 % +- leave them out"
)


@dataclass(frozen=True)
class MethodResult:
    """The result of one search.

    claimed, fresh : estimates of the cost of its best design, from the search and from held-out starts.
    limits : estimates of each constraint of the result, from the same held-out starts.
    """

    method: str
    repeat: int
    evaluations: int
    claimed: FitnessEstimate
    fresh: FitnessEstimate
    limits: tuple[FitnessEstimate, ...] = ()


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
        unknown methods and invalid numbers.
    """
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
) -> Iterator[MethodResult | FrontResult]:
    """Yield the result of each search of a plan; of fronts for several objectives.

    Everything is cached, so a stopped comparison can be resumed. KeyboardInterrupt if a search was stopped.
    """
    once = EnsembleSettings(min_starts=plan.fresh, max_starts=plan.fresh, block=plan.fresh)
    fresh_ensemble = Ensemble(plan.problem, evaluator, cache, once, FRESH)
    for method, repeat, settings in plan.searches:
        outcome = search(plan.problem, evaluator, cache, settings, on_progress=on_progress)
        if outcome.interrupted:
            raise KeyboardInterrupt
        if outcome.best is None:
            raise RunError(f"{method}, repeat {repeat}: no design has run to its end")
        result = front_result if plan.problem.several else method_result
        yield result(method, repeat, outcome, fresh_ensemble)


def method_result(method: str, repeat: int, outcome: Outcome, fresh_ensemble: Ensemble) -> MethodResult:
    """Return the result of a search for one objective whose hall is not empty."""
    assert outcome.best is not None
    design = outcome.problem.genome.decode(outcome.best)
    (estimates,) = fresh_ensemble.estimate([design])
    assert estimates is not None  # this ensemble has no budget
    (claimed,) = outcome.best.estimates
    limits = fresh_ensemble.limits(design, held_out=True)
    return MethodResult(method, repeat, outcome.evaluations + outcome.hits, claimed, estimates[0], limits)


def summary(problem: Problem, result: MethodResult | FrontResult) -> str:
    """Return the number of runs of a search, and whether its designs satisfy the constraints."""
    line = f"{result.evaluations} runs"
    if isinstance(result, FrontResult):
        line += f", {len(result.fresh)} designs of the front"
        return f"{line}, {result.violated} of them infeasible" if problem.result_constraints else line
    return f"{line}, feasible: {verdict(problem, result)}" if problem.result_constraints else line


def verdict(problem: Problem, result: MethodResult) -> str:
    """Return whether the best design of a search satisfies the constraints of the result by its fresh starts,
    as in ``best.csv``: yes, unproven or no."""
    return ANSWERS[feasible(problem.result_constraints, result.limits)]


def table(problem: Problem, results: Sequence[MethodResult | FrontResult]) -> Table:
    """Return a table with a line for each method, the best median first: of the best designs for one
    objective, or of the hypervolumes of the fronts (``front_comparison``)."""
    fronts = [one for one in results if isinstance(one, FrontResult)]
    if fronts:
        return front_comparison.table(problem, fronts)
    return _table_of_best(problem, [one for one in results if isinstance(one, MethodResult)])


def _table_of_best(problem: Problem, results: Sequence[MethodResult]) -> Table:
    """Return the table for one objective: the best designs from held-out starts, and the estimates of the
    searches themselves. With constraints of the result, designs that violate one are behind all others."""
    (objective,) = problem.objectives
    constraints = problem.result_constraints
    meaning = problem.meanings.get(objective.name, "")
    verdicts = ("feasible", "unproven", "violated") if constraints else ()
    grid = plain_table(
        "method", "searches", "runs each", *verdicts, "median", "lowest", "highest", "claimed", "95 % +-"
    )
    grid.title, grid.title_justify = objective.label + (f": {meaning}" if meaning else ""), "left"
    grid.caption = f"{NOTE}. {NOTE_ON_CONSTRAINTS}" if constraints else NOTE
    grid.caption_justify = "left"
    excesses = [excess(constraints, f.limits) for f in results]
    ordered = penalised([f.fresh.mean for f in results], excesses)
    by_method: dict[str, list[int]] = {}
    for k, f in enumerate(results):
        by_method.setdefault(f.method, []).append(k)
    for method, rows in sorted(by_method.items(), key=lambda item: np.median(ordered[item[1]])):
        mine = [results[k] for k in rows]
        allowed = [results[k] for k in rows if not excesses[k]]
        values = [objective.sign * f.fresh.mean for f in allowed]
        costs = [f.fresh.mean for f in allowed] + [math.inf] * (len(mine) - len(allowed))
        numbers = (
            objective.sign * np.median(costs), min(values, default=math.nan), max(values, default=math.nan),
            _median([objective.sign * f.claimed.mean for f in allowed]),
            _median([f.fresh.half_width for f in allowed]),
        )  # fmt: skip
        runs = sorted({f.evaluations for f in mine})
        each = str(runs[0]) if len(runs) == 1 else f"{runs[0]}..{runs[-1]}"
        answers = [verdict(problem, f) for f in mine]
        counts = [str(answers.count(answer)) for answer in ANSWERS.values()] if constraints else []
        cells = (f"{number:.4g}" if math.isfinite(number) or not constraints else "-" for number in numbers)
        grid.add_row(method, str(len(mine)), each, *counts, *cells)
    return grid


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else math.nan


def as_csv(problem: Problem, results: Sequence[MethodResult | FrontResult]) -> bytes:
    """Return a CSV file with a line for each search, or for each design of each front, and all digits."""
    fronts = [one for one in results if isinstance(one, FrontResult)]
    if fronts:
        return front_comparison.as_csv(problem, fronts)
    return _csv_of_best(problem, [one for one in results if isinstance(one, MethodResult)])


def _csv_of_best(problem: Problem, results: Sequence[MethodResult]) -> bytes:
    (objective,) = problem.objectives
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    constraints = problem.result_constraints
    of_limits = [
        f"{heading}{FRESH_STARTS}"
        for one in constraints
        for heading in (one.label, f"{one.name} {LOW}", f"{one.name} {HIGH}")
    ]
    writer.writerow(
        (
            "method",
            "repeat",
            "runs",
            *((FEASIBLE,) if constraints else ()),
            f"{objective.label}{FRESH_STARTS}",
            "95 % +-",
            "claimed",
            "std. error claimed",
            *of_limits,
        )
    )
    for f in results:
        means = objective.sign * f.fresh.mean, f.fresh.half_width, objective.sign * f.claimed.mean
        known = (verdict(problem, f),) if constraints else ()
        limits = (number for limit in f.limits for number in (limit.mean, limit.low, limit.high))
        writer.writerow(
            (f.method, f.repeat, f.evaluations, *known, *means, f.claimed.standard_error, *limits)
        )
    return text.getvalue().encode()
