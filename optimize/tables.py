"""Hall of fame, logbook and designs that meet the requirement, as plain columns for report and cache file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from deap import tools

from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.generation_log import chapter_column
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.calls import constraint_value
from tisim.optimize.problem.feasibility import ANSWERS, excess, feasible
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem

FRESH_STARTS = ", fresh starts"
ERROR, LOW, HIGH = "std. error", "95 % low", "95 % high"
"""Headings, or ends of headings."""
Estimates = Mapping[tuple[float, ...], tuple[FitnessEstimate, ...]]
"""Estimates of designs, by their points of the unit cube."""
FEASIBLE = "feasible"
"""Heading of the column that says whether a design satisfies the constraints of the result."""
NOT_KNOWN = FitnessEstimate(math.nan, math.nan, math.nan, math.nan, 0, False)
"""The estimate of a value that is not known."""


def best_columns(problem: Problem, hall: Sequence[Individual]) -> dict[str, list[Any]]:
    """Return the columns of Z04's tables 1 to 3 in one: heading -> values, best design first.

    They are rank, whether the design is feasible (with constraints of the result), every gene in its unit,
    each constraint, each objective as estimated by the search with its standard error, the derived columns of
    the problem, starts, and whether the mean converged (if a tolerance was set). With held-out starts, each
    objective and each constraint of the result follows with the ends of its 95 % confidence interval. With
    several objectives, the front is sorted by the first.
    """
    estimates = [individual.estimates for individual in hall]
    number = "front" if problem.several else "rank"
    columns: dict[str, list[Any]] = {number: list(range(1, len(estimates) + 1))}
    designs = [problem.genome.decode(individual) for individual in hall]
    constraints = problem.result_constraints
    if constraints:
        columns[FEASIBLE] = [ANSWERS[feasible(constraints, one.reported_limits)] for one in hall]
    for gene in problem.genome.genes:
        columns[gene.label] = [design[gene.name] for design in designs]
    for constraint in problem.design_constraints:
        columns[constraint.label] = [constraint_value(constraint, one, problem) for one in designs]
    for k, constraint in enumerate(constraints):
        limits = [individual.limits[k] for individual in hall]
        columns[constraint.label] = [limit.mean for limit in limits]
        if any(limit.std for limit in limits):
            columns[error_of(constraint.name)] = [limit.standard_error for limit in limits]
    columns |= _objectives(problem, estimates, "")
    columns["starts"] = [of_all[0].starts for of_all in estimates]
    if any(of_all[0].converged for of_all in estimates):
        columns["converged"] = ["yes" if of_all[0].converged else "no" for of_all in estimates]
    confirmed = [individual.confirmed for individual in hall if individual.confirmed]
    if confirmed and len(confirmed) == len(hall):
        columns |= _objectives(problem, confirmed, FRESH_STARTS)
        for k, constraint in enumerate(constraints):
            limits = [individual.confirmed_limits[k] for individual in hall]
            columns[f"{constraint.label}{FRESH_STARTS}"] = [limit.mean for limit in limits]
            columns[f"{constraint.name} {LOW}{FRESH_STARTS}"] = [limit.low for limit in limits]
            columns[f"{constraint.name} {HIGH}{FRESH_STARTS}"] = [limit.high for limit in limits]
        columns[f"starts{FRESH_STARTS}"] = [of_all[0].starts for of_all in confirmed]
    return columns


def _objectives(
    problem: Problem, estimates: Sequence[tuple[FitnessEstimate, ...]], after: str
) -> Mapping[str, list[Any]]:
    columns: dict[str, list[Any]] = {}
    for k, objective in enumerate(problem.objectives):
        mine = [of_all[k] for of_all in estimates]
        means = [objective.sign * one.mean for one in mine]
        columns[f"{objective.label}{after}"] = means
        name = f"{objective.name} " if problem.several else ""
        if after:
            ends = [interval_of_value(one, objective) for one in mine]
            columns[f"{name}{LOW}{after}"] = [low for low, _ in ends]
            columns[f"{name}{HIGH}{after}"] = [high for _, high in ends]
        elif any(one.std for one in mine):
            columns[f"{name}{ERROR}"] = [one.standard_error for one in mine]
        for heading, function in problem.derived.items():
            columns[f"{heading}{after}"] = [float(function(mean)) for mean in means]
    return columns


def interval_of_value(estimate: FitnessEstimate, objective: Objective) -> tuple[float, float]:
    """Return the ends of the interval of an objective's value from the interval of its cost."""
    low, high = sorted((objective.sign * estimate.low, objective.sign * estimate.high))
    return low, high


def units(problem: Problem) -> dict[str, str]:
    """Return the unit of each column of these tables that has one."""
    found = {gene.label: gene.unit for gene in problem.genome.genes}
    for objective in problem.objectives:
        name = f"{objective.name} " if problem.several else ""
        progress = (f"best {objective.label}",) if problem.several else ("best", "mean", "std")
        fresh = (objective.label, f"{name}{LOW}", f"{name}{HIGH}")
        headings = (objective.label, f"{name}{ERROR}", *progress, *(f"{one}{FRESH_STARTS}" for one in fresh))
        found |= dict.fromkeys(headings, objective.unit)
    for constraint in problem.constraints:
        name = constraint.name
        fresh = (constraint.label, f"{name} {LOW}", f"{name} {HIGH}")
        headings = (constraint.label, error_of(name), *(f"{one}{FRESH_STARTS}" for one in fresh))
        found |= dict.fromkeys(headings, constraint.unit)
    return {heading: unit for heading, unit in found.items() if unit}


def attributes(problem: Problem) -> dict[str, dict[str, Any]]:
    """Return the attributes of each column of these tables that has some: its unit, and the bounds of a
    constraint."""
    found: dict[str, dict[str, Any]] = {heading: {"unit": unit} for heading, unit in units(problem).items()}
    for constraint in problem.constraints:
        ends = {"at_least": constraint.at_least, "at_most": constraint.at_most}
        bounds = {side: float(bound) for side, bound in ends.items() if bound is not None}
        for heading in (constraint.label, f"{constraint.label}{FRESH_STARTS}"):
            found[heading] = found.get(heading, {}) | bounds
    return found


def design_columns(problem: Problem, estimates: Estimates, limits: Estimates) -> dict[str, list[Any]]:
    """Return the columns of designs by the names of genes and objectives.

    They are every gene, the mean of each objective and of each constraint of the result, their standard
    errors (NaN if the design failed), whether it is feasible ("" if it failed), starts, converged, and the
    reason of a failure.

    estimates : of the objectives. limits : of the constraints of the result.
    """
    designs = [problem.genome.decode(point) for point in estimates]
    columns: dict[str, list[Any]] = {
        gene.name: [design[gene.name] for design in designs] for gene in problem.genome.genes
    }
    for k, objective in enumerate(problem.objectives):
        mine = [of_all[k] for of_all in estimates.values()]
        columns[objective.name] = [objective.sign * e.mean if e.ok else math.nan for e in mine]
        columns[error_of(objective.name)] = [e.standard_error for e in mine]
    constraints = problem.result_constraints
    good = [limits[one] if of_all[0].ok else () for one, of_all in estimates.items()]
    for k, constraint in enumerate(constraints):
        columns[constraint.name] = [of_all[k].mean if of_all else math.nan for of_all in good]
        errors = [of_all[k].standard_error if of_all else math.nan for of_all in good]
        columns[error_of(constraint.name)] = errors
    if constraints:
        columns[FEASIBLE] = [ANSWERS[feasible(constraints, of_all)] if of_all else "" for of_all in good]
    first = [of_all[0] for of_all in estimates.values()]
    columns["starts"] = [e.starts for e in first]
    columns["converged"] = [e.converged for e in first]
    columns["failed"] = [e.reason for e in first]
    return columns


@dataclass(frozen=True)
class SearchedDesigns:
    """All designs of a search as tables with a row for each, in the order of their first estimation.

    facts : gen (the generation of the first estimation), rank (in the hall of fame from 1, 0 outside), best
        (1 for the best design, or the compromise of a front), starts, starts from held-out seeds, converged
        (1 or 0), feasible ("yes", "unproven", "no"), failed (the reason, or "").
    genes : the genes, by name, in their units.
    values : by name, the mean of each objective and of each constraint of the result with its standard error,
        and, if there are any, the mean from held-out starts with the ends of its 95 % interval. NaN if not
        known.
    """

    facts: dict[str, list[Any]]
    genes: dict[str, list[Any]]
    values: dict[str, list[float]]


def searched_designs(
    problem: Problem,
    generations: Mapping[tuple[float, ...], int],
    estimates: Estimates,
    limits: Estimates,
    held_out: Mapping[tuple[float, ...], tuple[Sequence[FitnessEstimate], Sequence[FitnessEstimate]]],
    hall: Sequence[Individual],
    best: Individual | None,
) -> SearchedDesigns:
    """Return all designs of a search.

    generations : generation of the first estimation of each design, in order. estimates : of the objectives,
        failed designs included. limits : of the constraints of the result.
    held_out : both from held-out starts. best : of the hall.
    """
    members = {tuple(individual): (rank, individual) for rank, individual in enumerate(hall, start=1)}
    found = [members.get(point, (0, None)) for point in generations]
    designs = [problem.genome.decode(point) for point in generations]
    of_all, constraints = [estimates[point] for point in generations], problem.result_constraints
    nothing = (NOT_KNOWN,) * len(constraints)
    limited = [
        (limits.get(point) or nothing) if known[0].ok else nothing
        for point, known in zip(generations, of_all, strict=True)
    ]
    again = [held_out.get(point, ((), ()))[0] for point in generations]
    again_limited = [held_out.get(point, ((), ()))[1] for point in generations]
    values: dict[str, list[float]] = {}

    def add(k: int, name: str, sign: float, mine: Sequence[Any], fresh: Sequence[Any]) -> None:
        values[name] = [sign * one[k].mean if one[k].ok else math.nan for one in mine]
        values[error_of(name)] = [one[k].standard_error for one in mine]
        if any(fresh):
            known = [one[k] if one else NOT_KNOWN for one in fresh]
            ends = [sorted((sign * one.low, sign * one.high)) for one in known]
            values[f"{name}{FRESH_STARTS}"] = [sign * one.mean for one in known]
            values[f"{name} {LOW}{FRESH_STARTS}"] = [low for low, _ in ends]
            values[f"{name} {HIGH}{FRESH_STARTS}"] = [high for _, high in ends]

    for k, objective in enumerate(problem.objectives):
        add(k, objective.name, objective.sign, of_all, again)
    for k, constraint in enumerate(constraints):
        add(k, constraint.name, 1.0, limited, again_limited)
    reported = zip(of_all, limited, again_limited, strict=True)
    facts: dict[str, list[Any]] = {
        "gen": list(generations.values()),
        "rank": [rank for rank, _ in found],
        "best": [int(one is not None and one is best) for _, one in found],
        "starts": [one[0].starts for one in of_all],
        f"starts{FRESH_STARTS}": [one[0].starts if one else 0 for one in again],
        "converged": [int(one[0].converged) for one in of_all],
        FEASIBLE: [
            ANSWERS[feasible(constraints, fresh or first)] if known[0].ok else ""
            for known, first, fresh in reported
        ],
        "failed": [one[0].reason for one in of_all],
    }
    genes = {gene.name: [design[gene.name] for design in designs] for gene in problem.genome.genes}
    return SearchedDesigns(facts, genes, values)


def error_of(name: str) -> str:
    """Return the heading of the standard error of a mean over starts."""
    return f"{name} {ERROR}"


def met_points(problem: Problem, estimates: Estimates, limits: Estimates) -> list[tuple[float, ...]]:
    """Return the points of the designs with a fitness of ``met_at`` or better whose means satisfy the
    constraints of the result, best first; none without ``met_at``.

    estimates : of the objectives. limits : of the constraints of the result.
    """
    if problem.met_at is None:
        return []
    (objective,) = problem.objectives
    costs = {point: of_all[0].mean for point, of_all in estimates.items()}
    limit, constraints = objective.sign * problem.met_at, problem.result_constraints
    met = (one for one in costs if costs[one] <= limit and not excess(constraints, limits.get(one, ())))
    return sorted(met, key=lambda one: (costs[one], one))


def met_columns(problem: Problem, estimates: Estimates, limits: Estimates) -> dict[str, list[Any]]:
    """Return every gene, the fitness and each constraint of the result of the designs of ``met_points``:
    heading -> values."""
    points, (objective,) = met_points(problem, estimates, limits), problem.objectives
    designs = [problem.genome.decode(point) for point in points]
    columns = {gene.label: [design[gene.name] for design in designs] for gene in problem.genome.genes}
    columns[objective.label] = [objective.sign * estimates[one][0].mean for one in points]
    for k, constraint in enumerate(problem.result_constraints):
        columns[constraint.label] = [limits[one][k].mean for one in points]
    return columns


def logbook_columns(problem: Problem, logbook: tools.Logbook) -> dict[str, list[Any]]:
    """Return the logbook with its chapters, and the derived values of each generation's best: heading ->
    values by generation."""
    columns = {name: list(logbook.select(name)) for name in (logbook[0] if logbook else {})}
    for chapter, rows in logbook.chapters.items():
        columns |= {
            chapter_column(chapter, name): list(rows.select(name)) for name in rows[0] if name != "gen"
        }
    for heading, function in problem.derived.items() if columns else ():
        columns[heading] = [float(function(best)) for best in columns["best"]]
    return columns
