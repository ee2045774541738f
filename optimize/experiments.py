"""Designs with values that the search did not run: measured by the user, told, or found by other searches.

They are individuals, as in a search. If a value has a standard error, its estimate has one start, with the
standard error as its standard deviation (see FitnessEstimate.standard_error).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tisim.errors import InputError, abbreviated, must
from tisim.optimize.designs_csv import Given, cell_of, check_headings, design_of, naming, rows
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.problem import Problem
from tisim.optimize.tables import ERROR, error_of

DEVIATION = "std. deviation"
"""The end of the heading of the standard deviation between starts."""
FAILED = "failed"
Values = tuple[float, ...]


def experiments(given: Given, problem: Problem, what: str = "experiments") -> tuple[Individual, ...]:
    """Return the designs of a CSV file, or of its rows, with their measured values.

    The columns are the genes, each objective and each constraint of the result, in their units, and
    optionally the standard error of each value ("NAME std. error", or "std. error" of a single objective). An
    objective that is empty or not finite marks a failed design. Rows of the same design are repeats of it.
    InputError for an invalid row, naming it.
    """
    found: dict[tuple[float, ...], list[tuple[Values, Values, Values]]] = {}
    for place, row in rows(given, what):
        with naming(place):
            check_headings(problem, row)
            point = tuple(map(float, problem.genome.encode(design_of(problem, row))))
            found.setdefault(point, []).append(row_values(problem, row))
    individuals = []
    for point, of_design in found.items():
        with naming(what):
            values, errors, limits = zip(*of_design, strict=True)
            individuals.append(known(problem, point, values, errors, limits))
    return tuple(individuals)


def known(
    problem: Problem, point: Sequence[float], values: Sequence[Values], errors: Sequence[Values],
    limits: Sequence[Values] = (),
) -> Individual:  # fmt: skip
    """Return the individual of a design from all its values.

    point : of the unit cube.
    values, errors : for each trial the value of each objective, in its unit, and its standard error; NaN if
        there is none.
    limits : for each trial the value of each constraint of the result.

    A design fails if any of its values is not a finite number.
    """
    individual = Individual(point, len(problem.objectives))
    if not np.all(np.isfinite(values)):
        individual.know(
            (FitnessEstimate.failed(len(values), "told to have failed"),) * len(problem.objectives)
        )
        return individual
    columns = zip(*(problem.costs(row) for row in values), strict=True)
    individual.know(
        tuple(combined(column, of) for column, of in zip(columns, zip(*errors, strict=True), strict=True))
    )
    exact = problem.deterministic and len(limits) == 1
    columns = zip(*limits, strict=True)
    individual.limit(
        problem.result_constraints,
        [FitnessEstimate.certain(float(column[0])) if exact else plain(column) for column in columns],
    )
    return individual


def combined(values: Sequence[float], errors: Sequence[float]) -> FitnessEstimate:
    """Return the estimate of a cost from repeated values.

    errors : the standard error of each value, or NaN for all if not known; then the error is computed from
        the spread of the values. Known errors weight the values by their inverse squares; a value with error
        0 outweighs all others.
    """
    x, s = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    if np.all(np.isnan(s)):
        return plain(x)
    rule = "given for all values of a design or for none"
    must(not np.any(np.isnan(s)), "standard error", rule, list(errors))
    if np.any(s == 0):
        return FitnessEstimate.certain(float(np.mean(x[s == 0])))
    weights = s**-2.0
    mean, error = float(np.sum(weights * x) / np.sum(weights)), float(np.sum(weights) ** -0.5)
    return FitnessEstimate(mean, error, math.nan, math.nan, 1, False)


def plain(values: Sequence[float] | Any) -> FitnessEstimate:
    """Return mean, standard deviation and number of values, without an interval."""
    std = float(np.std(values, ddof=1)) if len(values) > 1 else math.nan
    return FitnessEstimate(float(np.mean(values)), std, math.nan, math.nan, len(values), False)


def table_of(problem: Problem, individuals: Sequence[Individual]) -> dict[str, list[Any]]:
    """Return a table of individuals as columns, from which ``restored`` recovers them to the last bit."""
    designs = [problem.genome.decode(individual) for individual in individuals]
    found: dict[str, list[Any]] = {
        gene.name: [design[gene.name] for design in designs] for gene in problem.genome.searched
    }
    for k, objective in enumerate(problem.objectives):
        mine = [individual.estimates[k] for individual in individuals]
        found[objective.name] = [objective.sign * one.mean if one.ok else math.nan for one in mine]
        found[f"{objective.name} {DEVIATION}"] = [one.std for one in mine]
    for k, constraint in enumerate(problem.result_constraints):
        found[constraint.name] = [one.limited[k] if one.limited else math.nan for one in individuals]
    found["starts"] = [individual.estimates[0].starts for individual in individuals]
    found[FAILED] = [individual.estimates[0].reason for individual in individuals]
    return found


def restored(problem: Problem, table: Mapping[str, Sequence[Any]]) -> tuple[Individual, ...]:
    """Return the individuals of a table from ``table_of``."""
    lines = zip(*table.values(), strict=True)
    return tuple(_restored(problem, dict(zip(table, cells, strict=True))) for cells in lines)


def _restored(problem: Problem, row: Mapping[str, Any]) -> Individual:
    cells = {gene: row[gene.name] for gene in problem.genome.searched}
    # A gene that mixes texts and numbers is stored as a column of texts.
    design = {gene.name: gene.parse(cell) if isinstance(cell, str) else cell for gene, cell in cells.items()}
    individual = Individual(problem.genome.encode(design), len(problem.objectives))
    if row[FAILED]:
        individual.know((FitnessEstimate.failed(row["starts"], row[FAILED]),) * len(problem.objectives))
        return individual
    means = problem.costs([row[one.name] for one in problem.objectives])
    deviations = (row[f"{one.name} {DEVIATION}"] for one in problem.objectives)
    individual.know(
        tuple(
            FitnessEstimate(mean, std, math.nan, math.nan, row["starts"], False)
            for mean, std in zip(means, deviations, strict=True)
        )
    )
    individual.limit(
        problem.result_constraints, [plain([row[one.name]]) for one in problem.result_constraints]
    )
    return individual


def row_values(problem: Problem, row: Mapping[str, str]) -> tuple[Values, Values, Values]:
    """Return the values of a row, their standard errors and the constraints of the result."""
    values, errors = [], []
    for objective in problem.objectives:
        values.append(_number(objective.name, cell_of(objective, row)))
        headings = (error_of(objective.name), *(() if problem.several else (ERROR,)))
        cells = [row[heading] for heading in headings if heading in row]
        errors.append(_number(error_of(objective.name), cells[0]) if cells else math.nan)
        able = math.isnan(errors[-1]) or 0 <= errors[-1] < math.inf
        must(able, error_of(objective.name), "0 or more, or empty", errors[-1])
    limits = [_number(one.name, _limit(one.name, row)) for one in problem.result_constraints]
    return tuple(values), tuple(errors), tuple(limits)


def _limit(name: str, row: Mapping[str, str]) -> str | None:
    """Return the cell of a constraint, whose heading may have a bound after its name."""
    return next((cell for head, cell in row.items() if head.partition(",")[0] == name), None)


def _number(name: str, cell: str | None) -> float:
    """Return a measured number; NaN for an empty cell. InputError if it is not a number."""
    must(cell is not None, "columns", f"of all objectives and constraints, {name} among them", "none")
    if not cell:
        return math.nan
    try:
        return float(cell)
    except ValueError:
        rule = f"{name} must be a number, or empty if there is none"
        raise InputError(f"{rule}; received {abbreviated(cell)}") from None
