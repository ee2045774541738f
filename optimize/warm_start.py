"""A warm start: a search learns from the runs of other searches in its file.

The designs that it learns from are stored when the search begins, and read back when it is resumed: by then
the file has more runs, including its own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tisim.errors import InputError, is_number
from tisim.optimize.beginning import Beginning
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.experiments import plain, restored
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.calls import check_design
from tisim.optimize.problem.genes import Choice, Gene
from tisim.optimize.problem.genome import AnyGene
from tisim.optimize.problem.given_genes import DependentGene
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.search_records import WARM_START, searches
from tisim.optimize.settings import Settings, identity
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import canonical
from tisim.optimize.storage.runs_table import RunsTable
from tisim.optimize.surrogate.noise import all_exact, costs_and_noise
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative


def warmed(
    cache: Cache, problem: Problem, settings: Settings, evaluator: Mapping[str, Any], beginning: Beginning
) -> Beginning:
    """Return a beginning with the designs of its warm start, if it has one.

    A resumed search gets the designs that it stored when it began; a new one the runs that are in the file
    now.
    """
    if beginning.warm is None:
        return beginning
    requested = json.loads(canonical(identity(problem, settings, evaluator, beginning)))
    for name, attributes in searches(cache).items():
        stored = json.loads(attributes["identity"])
        if WARM_START in stored and {**stored, WARM_START: ""} == {**requested, WARM_START: ""}:
            return replace(beginning, warm=restored(problem, cache.table(f"{name}/{WARM_START}").columns))
    individuals = [individual for part in cache.runs() for individual in _of_runs(problem, part)]
    return replace(beginning, warm=tuple(individuals))


def _of_runs(problem: Problem, part: RunsTable) -> list[Individual]:
    """Return the designs in a table of runs that lie within the genome, at most the number that a surrogate
    learns from; none if all have failed."""
    values_needed = {*problem.quantities, *(one.name for one in problem.result_constraints)}
    genes = {gene.name for gene in problem.genome.searched}
    if part.problem != problem.name or not (genes <= set(part.genes) and values_needed <= set(part.values)):
        return []
    first, design = part.designs()
    by_design = np.split(np.argsort(design, kind="stable"), np.cumsum(np.bincount(design))[:-1])
    fewest = 1 if problem.deterministic else max(one.statistic.fewest_starts for one in problem.objectives)
    found: list[tuple[Individual, Mapping[str, Any]]] = []
    for row, rows in zip(first, by_design, strict=True):
        if len(rows) < fewest:
            continue
        values = part.record(int(row)).design
        if all(_allows(gene, values.get(gene.name)) for gene in problem.genome.genes):
            found.append((_individual(problem, part, rows), values))
    individuals = [individual for individual, _ in found]
    if not individuals or all(individual.failed for individual in individuals):
        return []
    # The points are computed last, since this is the slowest step.
    costs, _ = costs_and_noise(individuals)
    chosen = [found[k] for k in representative(costs, MOST_LEARNED, all_exact(individuals))]
    learned = []
    for individual, values in chosen:
        individual[:] = map(float, problem.genome.encode({name: values[name] for name in genes}))
        with suppress(InputError):
            check_design(problem, problem.genome.decode(individual))
            learned.append(individual)
    return learned


def _allows(gene: AnyGene, value: Any) -> bool:
    """Return whether a gene allows this value; None stands for a run without the gene."""
    if isinstance(gene, Gene):
        within = is_number(value) and gene.low <= value <= gene.high
        return within and (not gene.integer or float(value).is_integer())
    if isinstance(gene, Choice):
        return value in gene.choices
    return isinstance(gene, DependentGene) or value in (gene.value, None)


def _individual(problem: Problem, part: RunsTable, rows: NDArray[np.intp]) -> Individual:
    """Return the individual of a design from the rows of its runs, without its point."""
    individual = Individual((), len(problem.objectives))
    failed = rows[part.facts["ok"][rows] == 0]
    if len(failed):
        reason = part.record(int(failed[0])).reason
        individual.know((FitnessEstimate.failed(len(rows), reason),) * len(problem.objectives))
        return individual
    individual.know(tuple(_estimate(one, part, rows) for one in problem.objectives))
    individual.limit(
        problem.result_constraints,
        [plain([part.values[one.name][rows].mean()]) for one in problem.result_constraints],
    )
    return individual


def _estimate(objective: Objective, part: RunsTable, rows: NDArray[np.intp]) -> FitnessEstimate:
    """Return the estimate of a cost from some rows of runs, without an interval."""
    values = np.column_stack([part.values[name][rows] for name in objective.quantities])
    std = float(np.std(objective.pseudo_costs(values), ddof=1)) if len(rows) > 1 else np.nan
    return FitnessEstimate(objective.cost(values), std, np.nan, np.nan, len(rows), False)
